"""Questionnaires, their licensed texts, and the patient's mode

Revision ID: 0017
Revises: 0015
"""

import sqlalchemy as sa
from alembic import op

revision = "0017"
down_revision = "0015"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("assessments", sa.Column("questionnaires", sa.JSON(), nullable=False, server_default="{}"))
    op.create_table(
        "questionnaire_texts",
        sa.Column("questionnaire", sa.String(length=32), nullable=False),
        sa.Column("language", sa.String(length=8), nullable=False),
        sa.Column("title", sa.Text(), nullable=False),
        sa.Column("copyright", sa.Text(), nullable=False),
        sa.Column("items", sa.JSON(), nullable=False),
        sa.Column("may_be_exported", sa.Boolean(), nullable=False),
        sa.Column("imported_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("questionnaire", "language", name="pk_questionnaire_texts"),
    )
    op.create_table(
        "patient_modes",
        sa.Column("login_session_id", sa.Uuid(), nullable=False),
        sa.Column("episode_id", sa.Uuid(), nullable=False),
        sa.Column("questionnaire", sa.String(length=32), nullable=False),
        sa.Column("language", sa.String(length=8), nullable=False),
        sa.Column("answers", sa.JSON(), nullable=False),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("finished_at", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(
            ["login_session_id"], ["sign_ins.id"], name="fk_patient_modes_login_session_id_sign_ins"
        ),
        sa.ForeignKeyConstraint(["episode_id"], ["episodes.id"], name="fk_patient_modes_episode_id_episodes"),
        sa.PrimaryKeyConstraint("login_session_id", name="pk_patient_modes"),
    )
    # A program of 0010 ignores the new tables and columns.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    op.drop_table("patient_modes")
    op.drop_table("questionnaire_texts")
    op.drop_column("assessments", "questionnaires")
