"""Invented courses of treatment: when a patient comes, to which therapist, at which station, and how the shoulder improves."""

from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from random import Random
from typing import Final

from kata.cli.seed_people import DETAILED
from kata.motion.axes import Side

STATIONS: Final = 3
"""Number of stations."""
_DRIFTING: Final = 2
"""Index of the station whose error grows."""
_DRIFT_SINCE: Final = timedelta(weeks=4)
_DRIFT_DEG: Final = 0.35
"""Degrees by which the error of the third station has grown for four weeks, so that the pages show a drift."""
_YEARS: Final = timedelta(days=730)
_WEEK: Final = timedelta(weeks=1)
_STAGE_ORDER: Final = ("freezing", "frozen", "thawing")


@dataclass(frozen=True)
class Course:
    """The treatment of one invented patient."""

    visits: tuple[datetime, ...]
    """Times of the sessions, oldest first."""
    sessions_per_week: int
    therapist: int
    """Index of the therapist."""
    station: int
    """Index of the station."""
    side: Side
    stages: tuple[tuple[str, date], ...]
    """Stages with their first day, oldest first."""
    gain: float
    """Improvement at the end of :attr:`expected_weeks`, as a fraction of the difference from the other shoulder; below 0: worse."""
    expected_weeks: float
    closed: bool
    left: bool
    """True if the patient stopped coming."""
    unsigned: bool
    """True if the note of the last session is not signed."""

    @property
    def first(self) -> datetime:
        """Return the time of the first session."""
        return self.visits[0]

    def better(self, at: datetime) -> float:
        """Return the improvement at a given time. It is fast at first, then slower."""
        share = min(1.0, max(0.0, (at - self.first) / _WEEK / self.expected_weeks))
        return self.gain * float(1 - (1 - share) ** 1.6)

    @property
    def first_stage(self) -> str:
        """Return the stage at the first session."""
        return [stage for stage, since in self.stages if since <= self.first.date()][-1]


def course(chance: Random, place: int, now: datetime) -> Course:
    """Return the course of the patient with the index ``place``. The first twelve come weekly until now; the others are spread over two
    years.
    """
    return _recent(chance, place, now) if place < DETAILED else _of_two_years(chance, place, now)


def drift_deg(station: int, at: datetime, now: datetime) -> float:
    """Return the degrees by which a station's tracking error has grown at a given time."""
    return _DRIFT_DEG if station == _DRIFTING and at > now - _DRIFT_SINCE else 0.0


def _recent(chance: Random, place: int, now: datetime) -> Course:
    weeks = 6 + 2 * (place % 5)
    last_day = now.date() - timedelta(days=1 + (place % 3) * 2)
    visits = tuple(datetime.combine(last_day - n * _WEEK, time(1 + place % 7, 30), UTC) for n in reversed(range(weeks)))
    first = visits[0].date()
    stages = [("freezing", first - timedelta(days=60 + chance.randrange(120))), ("frozen", first - timedelta(days=10))]
    if weeks > 8:
        stages.append(("thawing", visits[weeks // 2].date()))
    return Course(
        visits=visits, sessions_per_week=1, therapist=place % 3, station=0, side="left" if place % 2 else "right",
        stages=tuple(stages), gain=0.85, expected_weeks=12.0, closed=False, left=False, unsigned=False,
    )  # fmt: skip


def _of_two_years(chance: Random, place: int, now: datetime) -> Course:
    weeks, per_week = chance.randrange(8, 25), chance.choice((1, 1, 2))
    # Every fourth of these patients is treated now; the others began earlier, evenly spread.
    present = place % 4 == 0
    age = timedelta(weeks=chance.uniform(3, weeks - 1)) if present else chance.uniform(0.3, 0.97) * _YEARS
    first = datetime.combine((now - age).date(), time(chance.randrange(0, 8), chance.choice((0, 30))), UTC)
    slots = [first + n * _WEEK / per_week + timedelta(hours=chance.choice((0, 0, 1))) for n in range(weeks * per_week)]
    # Patients with little motivation miss one of four expected sessions, the others one of sixteen.
    missed = chance.choice((0.06, 0.06, 0.25))
    visits = [at for at in slots if at == slots[0] or chance.random() > missed]
    dropped_out = not present and chance.random() < 0.18
    if dropped_out:
        visits = visits[: max(2, len(visits) // 3)]
    # The last session of a present patient was up to two weeks ago, so that some sessions are due.
    last = now - timedelta(days=chance.randrange(1, 12))
    visits = [at for at in visits if at < last] or visits[:1]
    stage = chance.choices((0, 1, 2), (3, 5, 3))[0]
    return Course(
        visits=tuple(visits),
        sessions_per_week=per_week,
        therapist=place % 5,
        station=place % STATIONS,
        side=chance.choice(("left", "right")),
        stages=_stages(chance, stage, first.date(), visits[-1].date()),
        # Frozen shoulders improve least in their first stage.
        gain=min(0.95, chance.gauss((0.35, 0.5, 0.65)[stage], 0.28)),
        expected_weeks=float(weeks),
        closed=not present,
        left=dropped_out,
        unsigned=present and place % 5 == 4,
    )


def _stages(chance: Random, stage: int, first: date, last: date) -> tuple[tuple[str, date], ...]:
    since = first - timedelta(days=chance.randrange(10, 60))
    stages = [(_STAGE_ORDER[stage], since)]
    for earlier in reversed(_STAGE_ORDER[:stage]):
        since -= timedelta(days=chance.randrange(60, 150))
        stages.insert(0, (earlier, since))
    if stage < 2 and last - first > timedelta(days=60):
        stages.append((_STAGE_ORDER[stage + 1], first + (last - first) / 2))
    return tuple(stages)
