"""SQLite stores the sums of the stations in the order of their key

Revision ID: 0038
Revises: 0037
"""

import sqlalchemy as sa
from alembic import op

revision = "0038"
down_revision = "0037"
branch_labels = None
depends_on = None


def upgrade() -> None:
    if op.get_bind().dialect.name == "sqlite":
        # With row ids, every row of a period is found in the key's index and then once more in the table.
        with op.batch_alter_table("station_hours", recreate="always", table_kwargs={"sqlite_with_rowid": False}):
            pass
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    if op.get_bind().dialect.name == "sqlite":
        with op.batch_alter_table("station_hours", recreate="always"):
            pass
