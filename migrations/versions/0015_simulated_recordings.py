"""Mark of recordings from a simulated apparatus

Revision ID: 0015
Revises: 0012
"""

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0012"
branch_labels = None
depends_on = None

_TAUGHT = """
    UPDATE recordings SET simulated = true WHERE teaching_id IS NOT NULL AND (
        SELECT version.config FROM station_versions AS version
        WHERE version.station = recordings.station AND version.since <= recordings.taught_at
        ORDER BY version.number DESC LIMIT 1
    ) LIKE :simulated
"""
_DERIVED = """
    UPDATE recordings SET simulated = true WHERE simulated = false
    AND parent_id IN (SELECT parent.id FROM recordings AS parent WHERE parent.simulated = true)
"""


def upgrade() -> None:
    op.add_column("recordings", sa.Column("simulated", sa.Boolean(), nullable=False, server_default=sa.false()))
    # A station from before 0005 has no version: whether it was simulated is not known.
    op.get_bind().execute(sa.text(_TAUGHT), {"simulated": '%\nport = "simulated"\n%'})
    while op.get_bind().execute(sa.text(_DERIVED)).rowcount:
        pass
    # A program of 0010 ignores the new column. What it derives from a simulated recording has no mark.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    op.drop_column("recordings", "simulated")
