"""Goniometer readings of a session

Revision ID: 0021
Revises: 0020
"""

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "goniometer_readings",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("session_id", sa.Uuid(), nullable=False),
        sa.Column("motion", sa.Integer(), nullable=False),
        sa.Column("apparatus_deg", sa.Double(), nullable=False),
        sa.Column("patient_deg", sa.Double(), nullable=False),
        sa.Column("read_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("read_by", sa.String(100), nullable=False),
        sa.ForeignKeyConstraint(["session_id"], ["sessions.id"], name="fk_goniometer_readings_session_id_sessions"),
        sa.PrimaryKeyConstraint("id", name="pk_goniometer_readings"),
    )
    op.create_index("ix_goniometer_readings_session_id", "goniometer_readings", ["session_id"])
    # A program of 0012 ignores the table.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    op.drop_index("ix_goniometer_readings_session_id", "goniometer_readings")
    op.drop_table("goniometer_readings")
