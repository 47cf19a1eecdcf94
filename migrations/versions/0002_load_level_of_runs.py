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
    # Nobody knows of the runs of before: they stay without one.
    op.add_column("runs", sa.Column("load_level", sa.Integer(), nullable=True))


def downgrade() -> None:
    # SQLite can do this by itself; a batch would drop the table that others refer to.
    op.drop_column("runs", "load_level")
