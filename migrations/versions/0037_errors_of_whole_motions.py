"""Errors of playbacks that ended in their first repetition leave lists and figures; sums of the stations by parts of an hour

Revision ID: 0037
Revises: 0036
"""

import sqlalchemy as sa
from alembic import op

revision = "0037"
down_revision = "0036"
branch_labels = None
depends_on = None

# A repetition is complete if repetitions_done says so. Rows from before 0005 do not know it of a playback that was ended early.
_LEAVE_OUT = """
UPDATE runs SET worst_rmse_deg = NULL, worst_peak_deg = NULL
WHERE worst_rmse_deg IS NOT NULL AND samples IS NOT NULL AND outcome <> 'completed' AND COALESCE(repetitions_done, 0) = 0
"""
_PUT_BACK = """
UPDATE runs SET
    worst_rmse_deg = (SELECT MAX(rmse_deg) FROM motor_tracking WHERE run_id = runs.id),
    worst_peak_deg = (SELECT MAX(ABS(peak_deg)) FROM motor_tracking WHERE run_id = runs.id)
WHERE samples IS NOT NULL AND outcome <> 'completed' AND COALESCE(repetitions_done, 0) = 0
    AND COALESCE(compared_percent, CASE WHEN least_range_percent IS NULL THEN 100 ELSE 0 END) >= 90
"""
# Midnight of a time zone divides these hours (UTC) at minute 15 or 30.
_AT_15 = "(10, 11, 15, 18)"
_AT_30 = "(2, 3, 9, 13, 14, 17, 18, 19, 20)"
_PART = {
    "sqlite": "printf('%s:%02d:00.000000', strftime('%Y-%m-%d %H', s.started_at), {minute})",
    "postgresql": "date_trunc('hour', s.started_at, 'UTC') + {minute} * INTERVAL '1 minute'",
}
_CLOCK = {
    "sqlite": ("CAST(strftime('%H', s.started_at) AS INTEGER)", "CAST(strftime('%M', s.started_at) AS INTEGER)"),
    "postgresql": (
        "EXTRACT(HOUR FROM s.started_at AT TIME ZONE 'UTC')",
        "EXTRACT(MINUTE FROM s.started_at AT TIME ZONE 'UTC')",
    ),
}
_MINUTE = (
    f"CASE WHEN {{1}} >= 30 AND {{0}} IN {_AT_30} THEN 30 WHEN {{1}} >= 15 AND {{0}} IN {_AT_15} THEN 15 ELSE 0 END"
)
_HOUR = {
    "sqlite": "strftime('%Y-%m-%d %H:00:00.000000', s.started_at)",
    "postgresql": "date_trunc('hour', s.started_at, 'UTC')",
}
_FILL = """
INSERT INTO station_hours
    (hour, station, sessions, playbacks, stopped, played_s, repetitions, compared, rmse_sum_deg, rmse_square_sum_deg2, peak_deg{more})
SELECT {begin}, s.station, COUNT(DISTINCT s.id), COUNT(r.id), COUNT(CASE WHEN r.outcome = 'stopped' THEN 1 END),
    COALESCE(SUM(r.played_s), 0), COALESCE(SUM(r.repetitions_done), 0), COUNT(r.worst_rmse_deg),
    COALESCE(SUM(r.worst_rmse_deg), 0), COALESCE(SUM(r.worst_rmse_deg * r.worst_rmse_deg), 0), MAX(r.worst_peak_deg){left_out}
FROM sessions s LEFT JOIN runs r ON r.session_id = s.id AND r.outcome NOT IN ('loaded', 'unloaded', 'running')
WHERE s.station <> '' AND s.run_count > 0
GROUP BY 1, 2
"""
_LEFT_OUT = """,
    COUNT(CASE WHEN r.worst_rmse_deg IS NULL AND (r.samples IS NOT NULL OR r.compared_percent IS NOT NULL) THEN 1 END)"""


def upgrade() -> None:
    op.execute(_LEAVE_OUT)
    op.add_column("station_hours", sa.Column("left_out", sa.Integer(), nullable=False, server_default="0"))
    op.execute("DELETE FROM station_hours")
    dialect = op.get_bind().dialect.name
    begin = _PART[dialect].format(minute=f"({_MINUTE.format(*_CLOCK[dialect])})")
    op.execute(_FILL.format(begin=begin, more=", left_out", left_out=_LEFT_OUT))
    # A program of 0036 ignores the column. It sums whole hours: what it stores is counted twice until a newer program changes the part.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    op.execute(_PUT_BACK)
    op.drop_column("station_hours", "left_out")
    op.execute("DELETE FROM station_hours")
    begin = _HOUR[op.get_bind().dialect.name]
    op.execute(_FILL.format(begin=begin, more="", left_out=""))
