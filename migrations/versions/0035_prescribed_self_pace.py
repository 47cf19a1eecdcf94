"""Self-paced items of programmes, and the mean pace of self-paced runs

Revision ID: 0035
Revises: 0034
"""

import sqlalchemy as sa
from alembic import op

revision = "0035"
down_revision = "0034"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("programme_items", sa.Column("self_paced", sa.Boolean(), nullable=False, server_default=sa.false()))
    op.add_column("runs", sa.Column("mean_pace_percent", sa.Double(), nullable=True))
    # A program of 0010 leaves these columns at their defaults: own pace, no mean pace.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    op.drop_column("runs", "mean_pace_percent")
    op.drop_column("programme_items", "self_paced")
