"""The chosen code and the certainty of a diagnosis

Revision ID: 0012
Revises: 0011
"""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    # An older diagnosis has neither code nor certainty: it stays text.
    for column, length in (("diagnosis_code", 8), ("verification", 16)):
        op.add_column("episodes", sa.Column(column, sa.String(length), nullable=False, server_default=""))
    # A program of 0011 ignores the new columns.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    for column in ("verification", "diagnosis_code"):
        op.drop_column("episodes", column)
