"""End-feel runs: what was asked, and the result

Revision ID: 0025
Revises: 0024
"""

import sqlalchemy as sa
from alembic import op

revision = "0025"
down_revision = "0024"
branch_labels = None
depends_on = None

_FIGURES = ("range_deg", "onset_deg", "stiffness_nm_deg", "last_third_nm_deg", "hysteresis_nm")


def upgrade() -> None:
    op.create_table(
        "end_feel_runs",
        sa.Column("run_id", sa.Uuid(), nullable=False),
        sa.Column("kind", sa.String(8), nullable=False),
        sa.Column("station", sa.String(100), nullable=False),
        sa.Column("motion", sa.Integer(), nullable=False),
        sa.Column("motor", sa.Integer(), nullable=False),
        sa.Column("outward", sa.Integer(), nullable=False),
        sa.Column("speed_deg_s", sa.Double(), nullable=False),
        sa.Column("further_deg", sa.Double(), nullable=False),
        sa.Column("torque_nm", sa.Double(), nullable=False),
        sa.Column("baseline_run_id", sa.Uuid(), nullable=True),
        sa.Column("unmeasured", sa.String(24), nullable=True),
        *(sa.Column(name, sa.Double(), nullable=True) for name in _FIGURES),
        *(sa.Column(f"interval_{name}", sa.Double(), nullable=True) for name in _FIGURES),
        sa.Column("disagreement_nm", sa.Double(), nullable=True),
        sa.Column("curve", sa.LargeBinary(), nullable=True),
        sa.ForeignKeyConstraint(["run_id"], ["runs.id"], name="fk_end_feel_runs_run_id_runs"),
        sa.PrimaryKeyConstraint("run_id", name="pk_end_feel_runs"),
    )
    # A program of 0010 ignores the table.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    op.drop_table("end_feel_runs")
