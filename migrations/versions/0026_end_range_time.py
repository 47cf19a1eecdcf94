"""End-range time of each motion of a run

Revision ID: 0026
Revises: 0025
"""

import sqlalchemy as sa
from alembic import op

revision = "0026"
down_revision = "0025"
branch_labels = None
depends_on = None

_COLUMNS = ("end_range_s", "end_range_band_deg", "end_range_torque_nm")


def upgrade() -> None:
    for name in _COLUMNS:
        op.add_column("motion_tracking", sa.Column(name, sa.Double(), nullable=True))
    # A program of 0010 ignores the columns, which may be null.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    with op.batch_alter_table("motion_tracking") as table:
        for name in reversed(_COLUMNS):
            table.drop_column(name)
