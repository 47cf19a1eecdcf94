"""Statements of FHIR exports, so that a later export can withdraw them

Revision ID: 0028
Revises: 0027
"""

import sqlalchemy as sa
from alembic import op

revision = "0028"
down_revision = "0027"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "exported_statements",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("patient_id", sa.Uuid(), nullable=False),
        sa.Column("withdrawal", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(["patient_id"], ["patients.id"], name="fk_exported_statements_patient_id_patients"),
        sa.PrimaryKeyConstraint("id", name="pk_exported_statements"),
    )
    op.create_index("ix_exported_statements_patient_id", "exported_statements", ["patient_id"])
    # A program of 0010 ignores the table.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    op.drop_table("exported_statements")
