"""Indexes of the home page and the outcomes

Revision ID: 0032
Revises: 0031
"""

import sqlalchemy as sa
from alembic import op

revision = "0032"
down_revision = "0031"
branch_labels = None
depends_on = None


def upgrade() -> None:
    # Serves the former index's queries too.
    op.create_index("ix_sessions_episode_id_started_at", "sessions", ["episode_id", "started_at", "run_count"])
    op.drop_index("ix_sessions_episode_id", "sessions")
    op.create_index("ix_programme_versions_made_at", "programme_versions", ["made_at"])
    op.drop_index("ix_episode_outcomes_last_at", "episode_outcomes")
    op.create_index(
        "ix_episode_outcomes_last_at",
        "episode_outcomes",
        ["last_at", "episode_id", "measure", "first_at", "first", "last", "important_at"],
    )
    # A program of 0010 needs no index.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    op.drop_index("ix_episode_outcomes_last_at", "episode_outcomes")
    op.create_index("ix_episode_outcomes_last_at", "episode_outcomes", ["last_at", "episode_id"])
    op.drop_index("ix_programme_versions_made_at", "programme_versions")
    op.create_index("ix_sessions_episode_id", "sessions", ["episode_id"])
    op.drop_index("ix_sessions_episode_id_started_at", "sessions")
