"""Prescribed end-range time of a programme's items

Revision ID: 0027
Revises: 0026
"""

import sqlalchemy as sa
from alembic import op

revision = "0027"
down_revision = "0026"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("programme_items", sa.Column("end_range", sa.JSON(), nullable=True))
    # A program of 0010 ignores the column, which may be null.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    with op.batch_alter_table("programme_items") as table:
        table.drop_column("end_range")
