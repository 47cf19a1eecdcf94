"""One row of outcomes for each episode, with the changes of all measures

Revision ID: 0039
Revises: 0038
"""

import math
import struct
from collections import defaultdict
from datetime import UTC, datetime, timedelta
from decimal import ROUND_HALF_UP, Decimal

import sqlalchemy as sa
from alembic import op

revision = "0039"
down_revision = "0038"
branch_labels = None
depends_on = None

_IMPORTANT = {"spadi": 13.0, "pain": 2.0}
_MEASURES = ("spadi", "pain", "flexion", "abduction", "external_rotation")
_MOTIONS = {
    ("flexion", ""): "flexion",
    ("abduction", ""): "abduction",
    ("external_rotation", "at_side"): "external_rotation",
}
_MANY = 5000
_WEEK = timedelta(weeks=1)
_NONE = (math.nan,) * 6
_VALUES = """
SELECT a.episode_id, a.assessed_at, a.spadi_score, a.pain_average, m.motion, m.position, m.angle_deg
FROM assessments a JOIN episodes e ON e.id = a.episode_id
LEFT JOIN rom_measurements m ON m.assessment_id = a.id AND m.side = e.side AND m.kind = 'passive'
WHERE a.withdrawn_at IS NULL ORDER BY a.episode_id
"""


def upgrade() -> None:
    moment = sa.DateTime(timezone=True)
    op.drop_index("ix_episode_outcomes_last_at", "episode_outcomes")
    op.drop_table("episode_outcomes")
    outcomes = op.create_table(
        "episode_outcomes",
        sa.Column("episode_id", sa.Uuid(), nullable=False),
        sa.Column("begin_at", moment, nullable=False),
        sa.Column("end_at", moment, nullable=False),
        sa.Column("changes", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["episode_id"], ["episodes.id"], name="fk_episode_outcomes_episode_id_episodes"),
        sa.PrimaryKeyConstraint("episode_id", name="pk_episode_outcomes"),
    )
    rows = []
    for episode_id, values in _values():
        ends = [max(values[measure])[0] for measure in _MEASURES if values[measure]]
        if ends:
            packed = [number for measure in _MEASURES for number in _change(measure, sorted(values[measure]))]
            changes = struct.pack(f"<{len(packed)}d", *packed)
            rows.append({"episode_id": episode_id, "begin_at": min(ends), "end_at": max(ends), "changes": changes})
    for start in range(0, len(rows), _MANY):
        op.bulk_insert(outcomes, rows[start : start + _MANY])
    op.create_index("ix_episode_outcomes_end_at", "episode_outcomes", ["end_at", "begin_at"])
    # A program of 0010 ignores the table. One of 0018 to 0038 stores all records, logs that it cannot store outcomes, and shows none.
    # What it stores is counted when the episode changes again.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def _values():
    """Yield each episode with the times and values of its measures."""
    columns = {"episode_id": sa.Uuid(), "assessed_at": sa.DateTime(timezone=True)}
    episode_id, values = None, defaultdict(set)
    for row in op.get_bind().execute(sa.text(_VALUES).columns(**columns)):
        if row.episode_id != episode_id:
            yield episode_id, values
            episode_id, values = row.episode_id, defaultdict(set)
        at = row.assessed_at if row.assessed_at.tzinfo else row.assessed_at.replace(tzinfo=UTC)
        for measure, value in (
            ("spadi", row.spadi_score),
            ("pain", row.pain_average),
            (_MOTIONS.get((row.motion, row.position)), row.angle_deg),
        ):
            if measure and value is not None:
                values[measure].add((at, float(value)))
    yield episode_id, values


def _change(measure, of):
    """Return times, values, improvement and weeks until an important one."""
    if not of:
        return _NONE
    (first_at, first), (last_at, last) = of[0], of[-1]
    limit = _IMPORTANT.get(measure, math.inf)
    weeks = ((at - first_at) / _WEEK for at, value in of if _improvement(first, value) >= limit)
    return first_at.timestamp(), last_at.timestamp(), first, last, _improvement(first, last), next(weeks, math.nan)


def _improvement(first, last):
    before, after = (Decimal(value).quantize(Decimal("0.1"), ROUND_HALF_UP) for value in (first, last))
    return float(before - after)


def downgrade() -> None:
    moment = sa.DateTime(timezone=True)
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    stored = sa.table("episode_outcomes", sa.column("episode_id", sa.Uuid()), sa.column("changes", sa.LargeBinary()))
    packed = op.get_bind().execute(sa.select(stored)).all()
    op.drop_index("ix_episode_outcomes_end_at", "episode_outcomes")
    op.drop_table("episode_outcomes")
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
    rows = [
        {
            "episode_id": episode_id, "measure": measure, "first_at": datetime.fromtimestamp(first_at, UTC), "first": first,
            "last_at": datetime.fromtimestamp(last_at, UTC), "last": last,
            "important_at": None if math.isnan(weeks) else datetime.fromtimestamp(first_at, UTC) + weeks * _WEEK,
        }
        for episode_id, changes in packed
        for measure, (first_at, last_at, first, last, _, weeks) in zip(_MEASURES, struct.iter_unpack("<6d", changes), strict=True)
        if not math.isnan(first_at)
    ]  # fmt: skip
    for start in range(0, len(rows), _MANY):
        op.bulk_insert(outcomes, rows[start : start + _MANY])
    op.create_index(
        "ix_episode_outcomes_last_at",
        "episode_outcomes",
        ["last_at", "episode_id", "measure", "first_at", "first", "last", "important_at"],
    )
