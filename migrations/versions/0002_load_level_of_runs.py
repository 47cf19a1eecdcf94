"""The load level that a run was played with

Revision ID: 0002
Revises: 0001
"""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    # The load level of older runs is unknown.
    op.add_column("runs", sa.Column("load_level", sa.Integer(), nullable=True))


def downgrade() -> None:
    # SQLite can drop a column itself. A batch would drop the table, to which others refer.
    op.drop_column("runs", "load_level")
