"""How a run's recording was to be played, and more figures of its comparison

Revision ID: 0003
Revises: 0002
"""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

# Before this version every recording was played once, as taught.
_SETTINGS = (
    ("speed_percent", sa.Double(), "100"),
    ("repetitions", sa.Integer(), "1"),
    ("pause_s", sa.Double(), "0"),
    ("range_percent", sa.Double(), "100"),
)
_FIGURES = (
    "lag_ms",
    "taught_min_deg",
    "taught_max_deg",
    "played_min_deg",
    "played_max_deg",
    "taught_smoothness",
    "played_smoothness",
)


def upgrade() -> None:
    for name, kind, before in _SETTINGS:
        op.add_column("runs", sa.Column(name, kind, nullable=False, server_default=before))
    op.add_column("runs", sa.Column("method", sa.String(length=16), nullable=True))
    op.add_column("runs", sa.Column("corrected_by", sa.Uuid(), nullable=True))
    op.create_table(
        "run_corrections",
        sa.Column("run_id", sa.Uuid(), nullable=False),
        sa.Column("station", sa.String(length=100), nullable=False),
        sa.Column("data", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["run_id"], ["runs.id"], name="fk_run_corrections_run_id_runs"),
        sa.PrimaryKeyConstraint("run_id", name="pk_run_corrections"),
    )
    # The values of older runs are unknown.
    for name in (*_FIGURES, "torque_peak_nm"):
        op.add_column("motor_tracking", sa.Column(name, sa.Double(), nullable=True))
    op.create_table(
        "motion_tracking",
        sa.Column("run_id", sa.Uuid(), nullable=False),
        sa.Column("motion", sa.Integer(), autoincrement=False, nullable=False),
        *(sa.Column(name, sa.Double(), nullable=False) for name in ("peak_deg", "peak_at_s", "rmse_deg", "start_deg")),
        *(sa.Column(name, sa.Double(), nullable=True) for name in _FIGURES),
        sa.ForeignKeyConstraint(["run_id"], ["runs.id"], name="fk_motion_tracking_run_id_runs"),
        sa.PrimaryKeyConstraint("run_id", "motion", name="pk_motion_tracking"),
    )


def downgrade() -> None:
    op.drop_table("motion_tracking")
    op.drop_table("run_corrections")
    # SQLite can drop a column itself. A batch would drop the table, to which others refer.
    for name in (*_FIGURES, "torque_peak_nm"):
        op.drop_column("motor_tracking", name)
    for name in (*(name for name, _, _ in _SETTINGS), "method", "corrected_by"):
        op.drop_column("runs", name)
