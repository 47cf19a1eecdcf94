"""Patients, recordings, sessions

Revision ID: 0001
Revises:
"""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "patients",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("clinic_number", sa.String(length=32), nullable=False),
        sa.Column("name", sa.String(length=100), nullable=False),
        sa.Column("kana", sa.String(length=100), nullable=True),
        sa.Column("birth_date", sa.Date(), nullable=True),
        sa.Column("sex", sa.String(length=8), nullable=False),
        sa.Column("affected_side", sa.String(length=8), nullable=False),
        sa.Column("notes", sa.Text(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("updated_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("archived_at", sa.DateTime(timezone=True), nullable=True),
        sa.PrimaryKeyConstraint("id", name="pk_patients"),
        sa.UniqueConstraint("clinic_number", name="uq_patients_clinic_number"),
    )
    op.create_index("ix_patients_name", "patients", ["name"])

    op.create_table(
        "sessions",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("patient_id", sa.Uuid(), nullable=False),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("ended_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("note", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["patient_id"], ["patients.id"], name="fk_sessions_patient_id_patients"),
        sa.PrimaryKeyConstraint("id", name="pk_sessions"),
    )
    op.create_index("ix_sessions_patient_id", "sessions", ["patient_id"])
    op.create_index("ix_sessions_started_at", "sessions", ["started_at"])

    op.create_table(
        "teachings",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("patient_id", sa.Uuid(), nullable=False),
        sa.Column("name", sa.String(length=100), nullable=False),
        sa.Column("side", sa.String(length=8), nullable=False),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["patient_id"], ["patients.id"], name="fk_teachings_patient_id_patients"),
        sa.PrimaryKeyConstraint("id", name="pk_teachings"),
    )
    op.create_index("ix_teachings_patient_id", "teachings", ["patient_id"])

    op.create_table(
        "recordings",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("patient_id", sa.Uuid(), nullable=False),
        sa.Column("teaching_id", sa.Uuid(), nullable=False),
        sa.Column("take", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(length=100), nullable=False),
        sa.Column("side", sa.String(length=8), nullable=False),
        sa.Column("station", sa.String(length=100), nullable=False),
        sa.Column("taught_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("duration_s", sa.Double(), nullable=False),
        sa.Column("rate_hz", sa.Integer(), nullable=False),
        sa.Column("samples", sa.Integer(), nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        sa.Column("archived_at", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(["patient_id"], ["patients.id"], name="fk_recordings_patient_id_patients"),
        sa.ForeignKeyConstraint(["teaching_id"], ["teachings.id"], name="fk_recordings_teaching_id_teachings"),
        sa.PrimaryKeyConstraint("id", name="pk_recordings"),
        sa.UniqueConstraint("teaching_id", "take", name="uq_recordings_teaching_id"),
    )
    op.create_index("ix_recordings_patient_id", "recordings", ["patient_id"])

    op.create_table(
        "recording_samples",
        sa.Column("recording_id", sa.Uuid(), nullable=False),
        sa.Column("data", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(
            ["recording_id"], ["recordings.id"], name="fk_recording_samples_recording_id_recordings"
        ),
        sa.PrimaryKeyConstraint("recording_id", name="pk_recording_samples"),
    )
    op.create_table(
        "runs",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("session_id", sa.Uuid(), nullable=False),
        sa.Column("recording_id", sa.Uuid(), nullable=False),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("ended_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("outcome", sa.String(length=16), nullable=False),
        sa.Column("stop_code", sa.String(length=32), nullable=True),
        sa.Column("stop_message", sa.Text(), nullable=True),
        sa.Column("rate_hz", sa.Integer(), nullable=True),
        sa.Column("samples", sa.Integer(), nullable=True),
        sa.ForeignKeyConstraint(["recording_id"], ["recordings.id"], name="fk_runs_recording_id_recordings"),
        sa.ForeignKeyConstraint(["session_id"], ["sessions.id"], name="fk_runs_session_id_sessions"),
        sa.PrimaryKeyConstraint("id", name="pk_runs"),
    )
    op.create_index("ix_runs_recording_id", "runs", ["recording_id"])
    op.create_index("ix_runs_session_id", "runs", ["session_id"])

    op.create_table(
        "motor_tracking",
        sa.Column("run_id", sa.Uuid(), nullable=False),
        sa.Column("motor", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("peak_deg", sa.Double(), nullable=False),
        sa.Column("peak_at_s", sa.Double(), nullable=False),
        sa.Column("rmse_deg", sa.Double(), nullable=False),
        sa.Column("start_deg", sa.Double(), nullable=False),
        sa.ForeignKeyConstraint(["run_id"], ["runs.id"], name="fk_motor_tracking_run_id_runs"),
        sa.PrimaryKeyConstraint("run_id", "motor", name="pk_motor_tracking"),
    )
    op.create_table(
        "run_samples",
        sa.Column("run_id", sa.Uuid(), nullable=False),
        sa.Column("data", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["run_id"], ["runs.id"], name="fk_run_samples_run_id_runs"),
        sa.PrimaryKeyConstraint("run_id", name="pk_run_samples"),
    )


def downgrade() -> None:
    op.drop_table("run_samples")
    op.drop_table("motor_tracking")
    op.drop_index("ix_runs_session_id", "runs")
    op.drop_index("ix_runs_recording_id", "runs")

    op.drop_table("runs")
    op.drop_table("recording_samples")
    op.drop_index("ix_recordings_patient_id", "recordings")

    op.drop_table("recordings")
    op.drop_index("ix_teachings_patient_id", "teachings")

    op.drop_table("teachings")
    op.drop_index("ix_sessions_started_at", "sessions")
    op.drop_index("ix_sessions_patient_id", "sessions")

    op.drop_table("sessions")
    op.drop_index("ix_patients_name", "patients")

    op.drop_table("patients")
