"""What a FHIR export stated last, so that a later export can mark a changed value as amended

Revision ID: 0031
Revises: 0030
"""

import sqlalchemy as sa
from alembic import op

revision = "0031"
down_revision = "0030"
branch_labels = None
depends_on = None


def upgrade() -> None:
    # A statement that an older version exported has no digest, so its next statement is not compared.
    op.add_column("exported_statements", sa.Column("final_digest", sa.String(64), nullable=True))
    op.add_column("exported_statements", sa.Column("amended", sa.Boolean(), nullable=False, server_default=sa.false()))
    # A program of 0010 ignores the table, and a program of 0028 writes neither column.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    op.drop_column("exported_statements", "amended")
    op.drop_column("exported_statements", "final_digest")
