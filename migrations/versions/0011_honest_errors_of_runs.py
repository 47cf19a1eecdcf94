"""Compared share, clock offset, errors on the wall clock and change by settings of runs

Revision ID: 0011
Revises: 0010
"""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

_COLUMNS = (
    ("runs", "compared_percent"),
    ("runs", "clock_offset_s"),
    *((table, name) for table in ("motor_tracking", "motion_tracking") for name in ("wall_peak_deg", "wall_rmse_deg", "change_deg")),
)  # fmt: skip


def upgrade() -> None:
    # Older runs keep their figures, with the start included. How much of them was compared is not known.
    for table, column in _COLUMNS:
        op.add_column(table, sa.Column(column, sa.Double(), nullable=True))
    # Of a run with reduced range only the rest was compared. Lists and charts do not show such a figure any more.
    op.execute("UPDATE runs SET worst_rmse_deg = NULL, worst_peak_deg = NULL WHERE least_range_percent IS NOT NULL")
    # A program of 0010 ignores the new columns.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    op.execute(
        "UPDATE runs SET "
        "worst_rmse_deg = (SELECT MAX(rmse_deg) FROM motor_tracking WHERE run_id = runs.id), "
        "worst_peak_deg = (SELECT MAX(ABS(peak_deg)) FROM motor_tracking WHERE run_id = runs.id) "
        "WHERE least_range_percent IS NOT NULL"
    )
    for table, column in _COLUMNS:
        op.drop_column(table, column)
