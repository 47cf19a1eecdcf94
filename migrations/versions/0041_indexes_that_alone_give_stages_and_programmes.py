"""Indexes that alone give the stages and programmes of episodes

Revision ID: 0041
Revises: 0040
"""

import sqlalchemy as sa
from alembic import op

revision = "0041"
down_revision = "0040"
branch_labels = None
depends_on = None

_COLUMNS = {"stages": ["since", "noted_at", "stage"], "programmes": ["archived_at", "created_at", "name"]}


def upgrade() -> None:
    for table, columns in _COLUMNS.items():
        op.drop_index(f"ix_{table}_episode_id", table)
        op.create_index(f"ix_{table}_episode_id", table, ["episode_id", *columns])
    # A program of 0010 needs no index.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    for table in _COLUMNS:
        op.drop_index(f"ix_{table}_episode_id", table)
        op.create_index(f"ix_{table}_episode_id", table, ["episode_id"])
