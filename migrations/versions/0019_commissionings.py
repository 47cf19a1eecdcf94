"""Records of commissionings and periodic checks, and who changed a station's configuration

Revision ID: 0019
Revises: 0018
"""

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None


def upgrade() -> None:
    moment = sa.DateTime(timezone=True)
    op.create_table(
        "commissionings",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("station", sa.String(100), nullable=False),
        sa.Column("kind", sa.String(8), nullable=False),
        sa.Column("done_by", sa.String(100), nullable=False),
        sa.Column("software", sa.String(32), nullable=False),
        sa.Column("began_at", moment, nullable=False),
        sa.Column("ended_at", moment, nullable=False),
        sa.Column("passed", sa.Boolean(), nullable=False),
        sa.Column("fault", sa.Text(), nullable=False),
        sa.Column("fault_key", sa.JSON(), nullable=True),
        sa.Column("digest", sa.String(64), nullable=False),
        sa.Column("configuration_digest", sa.String(64), nullable=False),
        sa.Column("figures", sa.JSON(), nullable=False),
        sa.Column("record", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["station"], ["stations.name"], name="fk_commissionings_station_stations"),
        sa.PrimaryKeyConstraint("id", name="pk_commissionings"),
        sa.UniqueConstraint("station", "kind", "began_at", name="uq_commissionings_station"),
    )
    op.create_index("ix_commissionings_ended_at", "commissionings", ["ended_at"])
    op.add_column("station_versions", sa.Column("changed_by", sa.String(100), nullable=False, server_default=""))
    # A program of 0012 ignores the table and the column.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    with op.batch_alter_table("station_versions") as table:
        table.drop_column("changed_by")
    op.drop_index("ix_commissionings_ended_at", "commissionings")
    op.drop_table("commissionings")
