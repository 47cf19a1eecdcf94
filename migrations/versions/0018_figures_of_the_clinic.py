"""Sums of each station's hours, and first and last values of each episode, for the clinic's figures

Revision ID: 0018
Revises: 0017
"""

from collections import defaultdict

import sqlalchemy as sa
from alembic import op

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None

_INDEXES = (
    ("ix_sessions_open", "sessions", ["started_at"], "ended_at IS NULL"),
    ("ix_sessions_unsigned", "sessions", ["therapist", "started_at"], "signed_at IS NULL"),
    ("ix_session_stops_started_at", "session_stops", ["started_at", "code", "station"], None),
    ("ix_device_events_alarms", "device_events", ["at", "code", "station"], "kind = 'alarm'"),
)
_IMPORTANT = {"spadi": 13.0, "pain": 2.0}
_MOTIONS = {
    ("flexion", ""): "flexion",
    ("abduction", ""): "abduction",
    ("external_rotation", "at_side"): "external_rotation",
}
_MANY = 5000
_HOUR = {
    "sqlite": "strftime('%Y-%m-%d %H:00:00.000000', s.started_at)",
    "postgresql": "date_trunc('hour', s.started_at, 'UTC')",
}
_HOURS = """
INSERT INTO station_hours
    (hour, station, sessions, playbacks, stopped, played_s, repetitions, compared, rmse_sum_deg, rmse_square_sum_deg2, peak_deg)
SELECT {hour}, s.station, COUNT(DISTINCT s.id), COUNT(r.id), COUNT(CASE WHEN r.outcome = 'stopped' THEN 1 END),
    COALESCE(SUM(r.played_s), 0), COALESCE(SUM(r.repetitions_done), 0), COUNT(r.worst_rmse_deg),
    COALESCE(SUM(r.worst_rmse_deg), 0), COALESCE(SUM(r.worst_rmse_deg * r.worst_rmse_deg), 0), MAX(r.worst_peak_deg)
FROM sessions s LEFT JOIN runs r ON r.session_id = s.id AND r.outcome NOT IN ('loaded', 'unloaded', 'running')
WHERE s.station <> '' AND s.run_count > 0
GROUP BY 1, 2
"""
_VALUES = """
SELECT a.episode_id, a.assessed_at, a.spadi_score, a.pain_average, m.motion, m.position, m.angle_deg
FROM assessments a JOIN episodes e ON e.id = a.episode_id
LEFT JOIN rom_measurements m ON m.assessment_id = a.id AND m.side = e.side AND m.kind = 'passive'
WHERE a.withdrawn_at IS NULL ORDER BY a.episode_id, a.assessed_at
"""


def upgrade() -> None:
    moment = sa.DateTime(timezone=True)
    op.create_table(
        "station_hours",
        sa.Column("hour", moment, primary_key=True),
        sa.Column("station", sa.String(100), primary_key=True),
        *(sa.Column(name, sa.Integer(), nullable=False) for name in ("sessions", "playbacks", "stopped")),
        sa.Column("played_s", sa.Double(), nullable=False),
        *(sa.Column(name, sa.Integer(), nullable=False) for name in ("repetitions", "compared")),
        *(sa.Column(name, sa.Double(), nullable=False) for name in ("rmse_sum_deg", "rmse_square_sum_deg2")),
        sa.Column("peak_deg", sa.Double(), nullable=True),
        sa.PrimaryKeyConstraint("hour", "station", name="pk_station_hours"),
    )
    outcomes = op.create_table(
        "episode_outcomes",
        sa.Column("episode_id", sa.Uuid(), nullable=False),
        sa.Column("measure", sa.String(32), nullable=False),
        sa.Column("first_at", moment, nullable=False),
        sa.Column("first", sa.Double(), nullable=False),
        sa.Column("last_at", moment, nullable=False),
        sa.Column("last", sa.Double(), nullable=False),
        sa.Column("important_at", moment, nullable=True),
        sa.ForeignKeyConstraint(["episode_id"], ["episodes.id"], name="fk_episode_outcomes_episode_id_episodes"),
        sa.PrimaryKeyConstraint("episode_id", "measure", name="pk_episode_outcomes"),
    )
    op.create_index("ix_episode_outcomes_last_at", "episode_outcomes", ["last_at", "episode_id"])
    for name, table, columns, where in _INDEXES:
        some = {f"{kind}_where": sa.text(where) for kind in _HOUR} if where else {}
        op.create_index(name, table, columns, **some)
    op.execute(_HOURS.format(hour=_HOUR[op.get_bind().dialect.name]))
    _fill(outcomes)
    # A program of 0012 ignores the tables. What it stores is counted when the hour or the episode changes again.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def _fill(outcomes: sa.Table) -> None:
    columns = {"episode_id": sa.Uuid(), "assessed_at": sa.DateTime(timezone=True)}
    rows, episode_id, values = [], None, defaultdict(list)
    for row in op.get_bind().execute(sa.text(_VALUES).columns(**columns)):
        if row.episode_id != episode_id:
            rows += _outcomes(episode_id, values)
            episode_id, values = row.episode_id, defaultdict(list)
        for measure, value in (
            ("spadi", row.spadi_score),
            ("pain", row.pain_average),
            (_MOTIONS.get((row.motion, row.position)), row.angle_deg),
        ):
            if measure and value is not None and (row.assessed_at, value) not in values[measure][-1:]:
                values[measure].append((row.assessed_at, value))
    rows += _outcomes(episode_id, values)
    for start in range(0, len(rows), _MANY):
        op.bulk_insert(outcomes, rows[start : start + _MANY])


def _outcomes(episode_id, values):
    for measure, of in values.items():
        (first_at, first), (last_at, last) = of[0], of[-1]
        limit = _IMPORTANT.get(measure)
        important = (at for at, value in of if limit is not None and first - value >= limit)
        yield {
            "episode_id": episode_id, "measure": measure, "first_at": first_at, "first": first, "last_at": last_at, "last": last,
            "important_at": next(important, None),
        }  # fmt: skip


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    for name, table, _, _ in _INDEXES:
        op.drop_index(name, table)
    op.drop_table("episode_outcomes")
    op.drop_table("station_hours")
