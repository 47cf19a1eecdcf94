"""Self-paced runs: the doctor's permission, and the patient's work and effort

Revision ID: 0034
Revises: 0033
"""

import sqlalchemy as sa
from alembic import op

revision = "0034"
down_revision = "0033"
branch_labels = None
depends_on = None

_COLUMNS = (
    ("episodes", "self_paced_permitted", sa.Boolean()),
    ("runs", "self_paced", sa.Boolean()),
    ("runs", "work_j", sa.Double()),
    ("runs", "mean_effort_nm", sa.Double()),
)


def upgrade() -> None:
    for table, name, kind in _COLUMNS:
        no = isinstance(kind, sa.Boolean)
        op.add_column(table, sa.Column(name, kind, nullable=not no, server_default=sa.false() if no else None))
    # A program of 0010 leaves these columns at their defaults: no permission, no self-paced run.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    for table, name, _ in _COLUMNS:
        op.drop_column(table, name)
