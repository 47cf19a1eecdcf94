"""Recordings that were made of others

Revision ID: 0004
Revises: 0003
"""

from uuid import UUID

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

_PARENT = "fk_recordings_parent_id_recordings"


def upgrade() -> None:
    with op.batch_alter_table("recordings") as table:
        # A derived recording has no teaching.
        table.alter_column("teaching_id", existing_type=sa.Uuid(), nullable=True)
        table.alter_column("take", existing_type=sa.Integer(), nullable=True)
        table.add_column(sa.Column("parent_id", sa.Uuid(), nullable=True))
        table.add_column(sa.Column("done", sa.JSON(), nullable=False, server_default="[]"))
        table.create_foreign_key(_PARENT, "recordings", ["parent_id"], ["id"])
    _check()


def downgrade() -> None:
    _as_if_taught()
    with op.batch_alter_table("recordings") as table:
        table.drop_constraint(_PARENT, type_="foreignkey")
        table.drop_column("done")
        table.drop_column("parent_id")
        table.alter_column("take", existing_type=sa.Integer(), nullable=False)
        table.alter_column("teaching_id", existing_type=sa.Uuid(), nullable=False)
    _check()


def _as_if_taught() -> None:
    """Turn derived recordings into further takes of their teaching. They cannot be deleted, because they may have been played."""
    recordings = sa.table(
        "recordings",
        sa.column("id", sa.Uuid()),
        sa.column("parent_id", sa.Uuid()),
        sa.column("teaching_id", sa.Uuid()),
        sa.column("take", sa.Integer()),
        sa.column("taught_at", sa.DateTime()),
    )
    connection = op.get_bind()
    rows = connection.execute(sa.select(recordings).order_by(recordings.c.taught_at, recordings.c.id)).all()
    parents = {row.id: row.parent_id for row in rows}
    teachings = {row.id: row.teaching_id for row in rows if row.teaching_id}
    last: dict[UUID, int] = {}
    for row in rows:
        if row.teaching_id:
            last[row.teaching_id] = max(last.get(row.teaching_id, 0), row.take)
    for row in rows:
        if row.teaching_id:
            continue
        taught = row.id
        while parents[taught]:
            taught = parents[taught]
        teaching = teachings[taught]
        last[teaching] += 1
        given = {"teaching_id": teaching, "take": last[teaching]}
        connection.execute(sa.update(recordings).where(recordings.c.id == row.id).values(**given))


def _check() -> None:
    """Check foreign keys, which SQLite does not enforce while the table changes."""
    connection = op.get_bind()
    if connection.dialect.name == "sqlite":
        lost = connection.exec_driver_sql("PRAGMA foreign_key_check").all()
        if lost:
            raise RuntimeError(f"records would refer to missing rows: {lost}")
