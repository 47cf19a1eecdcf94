"""Stretches: what was asked, and the time for which the torque was held

Revision ID: 0033
Revises: 0032
"""

import sqlalchemy as sa
from alembic import op

revision = "0033"
down_revision = "0032"
branch_labels = None
depends_on = None

_COLUMNS = (
    ("hold_s", sa.Double()),
    ("repetitions", sa.Integer()),
    ("largest_deg", sa.Double()),
    ("held_s", sa.Double()),
    ("target_nm", sa.Double()),
)


def upgrade() -> None:
    for name, kind in _COLUMNS:
        op.add_column("end_feel_runs", sa.Column(name, kind, nullable=True))
    # A program of 0010 ignores the table.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    for name, _ in _COLUMNS:
        op.drop_column("end_feel_runs", name)
