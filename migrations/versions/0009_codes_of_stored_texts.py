"""Code and parameters beside texts that are stored in English

Revision ID: 0009
Revises: 0008
"""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

_COLUMNS = (("device_events", "message_key"), ("runs", "stop_key"), ("recordings", "done_keys"))


def upgrade() -> None:
    # Older texts have no codes. The page shows them in English.
    for table, column in _COLUMNS:
        op.add_column(table, sa.Column(column, sa.JSON(), nullable=True))
    # A program of 0008 ignores the new columns.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0008"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    for table, column in _COLUMNS:
        op.drop_column(table, column)
