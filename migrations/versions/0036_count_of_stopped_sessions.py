"""The index that counts the sessions with a stop

Revision ID: 0036
Revises: 0035
"""

import sqlalchemy as sa
from alembic import op

revision = "0036"
down_revision = "0035"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.drop_index("ix_session_stops_started_at", "session_stops")
    op.create_index("ix_session_stops_started_at", "session_stops", ["started_at", "code", "station", "session_id"])
    # A program of 0010 needs no index.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    op.drop_index("ix_session_stops_started_at", "session_stops")
    op.create_index("ix_session_stops_started_at", "session_stops", ["started_at", "code", "station"])
