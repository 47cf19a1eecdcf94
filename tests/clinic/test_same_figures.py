"""A figure of the home page is the figure of the page behind it, at any time of the day, in several time zones."""

from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta, tzinfo
from random import Random
from typing import Any
from uuid import UUID
from zoneinfo import ZoneInfo

import pytest
from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.actor import Actor
from kata.cli import seed, seed_people
from kata.clinic.local_time import midnight
from kata.clinic.restricted import service as restricted
from kata.clinic.sessions import lists
from kata.clinic.sessions.lists import SessionFilter, SessionSummary
from kata.clinic.sessions.tables import SessionRow
from kata.clinic.statistics import usage, worklist
from kata.clinic.statistics.recent_days import recent_days
from kata.clinic.statistics.usage import Span
from kata.database.engine import Database
from tests.support.databases import upgraded_file

SEEDED_AT = datetime(2026, 11, 20, 12, 0, tzinfo=UTC)
THERAPIST = Actor(UUID(int=1), UUID(int=2), seed_people.INVENTED_TEXTS["en"].therapists[4], "therapist", frozenset())
ZONES = ("UTC", "Asia/Tokyo", "America/Chicago", "Europe/Berlin")
TIMES_OF_DAY = 6
WEEK, FOUR_WEEKS = 7, 28


class Clinic:
    """The seeded clinic at one time: the figures of the home page, and the lists behind them."""

    def __init__(self, session: Session, now: datetime, zone: tzinfo) -> None:
        self._session = session
        self._zone = zone
        self._day = now.astimezone(zone).date()
        self.today, self.tomorrow = (midnight(self._day + timedelta(days=n), zone) for n in (0, 1))
        recent = recent_days(now, zone)
        self.work = worklist.worklist(session, THERAPIST, recent)
        self.adherence = worklist.adherence(worklist.followed(session, recent), recent)
        self.patients = worklist.lowest_adherence(session, THERAPIST, recent).rows
        self.use = usage.usage(session, self.last(WEEK), "week").rows
        self.use_by_day = usage.usage(session, self.last(WEEK), "day").rows
        self.stops = usage.stops(session, self.last(FOUR_WEEKS))

    def last(self, days: int) -> Span:
        """Return the last days in the form in which the page asks for them: whole days, the last of which is today."""
        return Span(midnight(self._day - timedelta(days=days - 1), self._zone), self.tomorrow, self._zone)

    def sessions(self, days: int | None = None, **wanted: Any) -> list[SessionSummary]:
        """Return all pages of the list of sessions, of all times or of the last days."""
        span = self.last(days) if days else None
        time: dict[str, Any] = {"since": span.since, "until": span.until} if span else {}
        chosen = SessionFilter(hidden=restricted.hidden(THERAPIST), **time, **wanted)
        found, after = lists.find(self._session, chosen, 50, None)
        while after is not None:
            page, after = lists.find(self._session, chosen, 50, after)
            found += page
        return found

    def held(self, days: int, **wanted: Any) -> list[SessionSummary]:
        """Return the listed sessions in which something was played."""
        return [one for one in self.sessions(days, **wanted) if one.runs > 0]


Figure = Callable[[Clinic], Any]
SAME: dict[str, tuple[Figure, Figure]] = {
    "patients due today": (
        lambda clinic: clinic.work.due_count,
        lambda clinic: len({row.patient.id for row in clinic.patients if row.due_at < clinic.tomorrow}),
    ),
    "listed patients due today": (
        lambda clinic: {row.patient.id for row in clinic.work.due},
        lambda clinic: {row.patient.id for row in clinic.patients if row.due_at < clinic.tomorrow},
    ),
    "overdue programmes": (
        lambda clinic: clinic.adherence.overdue,
        lambda clinic: sum(row.due_at < clinic.today for row in clinic.patients),
    ),
    "followed programmes": (lambda clinic: clinic.adherence.programmes, lambda clinic: len(clinic.patients)),
    "sessions prescribed": (
        lambda clinic: clinic.adherence.prescribed,
        lambda clinic: sum(row.prescribed for row in clinic.patients),
    ),
    "sessions held as prescribed": (
        lambda clinic: clinic.adherence.held,
        lambda clinic: sum(min(row.held, row.prescribed) for row in clinic.patients),
    ),
    # In the seeded clinic, a programme is as old as the first session.
    "sessions held by each patient": (
        lambda clinic: {row.patient.id: row.held for row in clinic.patients},
        lambda clinic: {
            row.patient.id: len(clinic.held(FOUR_WEEKS, patient_id=row.patient.id)) for row in clinic.patients
        },
    ),
    "last session of each patient": (
        lambda clinic: {row.patient.id: row.last_session_at for row in clinic.patients},
        lambda clinic: {
            row.patient.id: max((one.started_at for one in clinic.held(FOUR_WEEKS, patient_id=row.patient.id)), default=None)
            for row in clinic.patients
        },
    ),
    "sessions beside the stops": (lambda clinic: clinic.stops.sessions, lambda clinic: len(clinic.held(FOUR_WEEKS))),
    "sessions with a stop": (
        lambda clinic: clinic.stops.stopped_sessions,
        lambda clinic: sum(one.stops > 0 for one in clinic.sessions(FOUR_WEEKS)),
    ),
    "stops by cause and station": (
        lambda clinic: [(row.code, row.station, row.sessions) for row in clinic.stops.rows],
        lambda clinic: [
            (row.code, row.station, len(clinic.sessions(FOUR_WEEKS, stop=row.code, station=row.station)))
            for row in clinic.stops.rows
        ],
    ),
    "sessions of the week": (
        lambda clinic: sum(row.sessions for row in clinic.use),
        lambda clinic: len(clinic.held(WEEK)),
    ),
    "use by week and by day": (
        lambda clinic: [sum(row.repetitions for row in clinic.use), sum(row.playbacks for row in clinic.use)],
        lambda clinic: [sum(row.repetitions for row in clinic.use_by_day), sum(row.playbacks for row in clinic.use_by_day)],
    ),
    "unsigned notes": (lambda clinic: clinic.work.unsigned_count, lambda clinic: len(clinic.sessions(unsigned=True))),
    "unsigned notes of the user": (
        lambda clinic: [one.id for one in clinic.work.unsigned],
        lambda clinic: [one.id for one in reversed(clinic.sessions(unsigned=True, therapist=THERAPIST.name))],
    ),
    "sessions of today and open ones": (
        lambda clinic: [one.id for one in clinic.work.sessions],
        lambda clinic: [one.id for one in clinic.sessions() if one.started_at >= clinic.today or one.ended_at is None],
    ),
}  # fmt: skip
"""By figure: how the home page reads it, and how the page behind it does."""


@pytest.fixture(scope="module")
def seeded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    """Return the seeded clinic with an open session. Only each patient's last session has samples, because they take most of the time."""
    database = Database(upgraded_file(tmp_path_factory.mktemp("figures") / "kata.db"))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(seed, "DETAILED", 0)
        seed.fill(database, 1, SEEDED_AT, patients=28)
    with database.write() as session:
        newest = select(SessionRow).where(SessionRow.run_count > 0).order_by(SessionRow.started_at.desc()).limit(1)
        session.scalars(newest).one().ended_at = None
    with database.read() as session:
        yield session
    database.close()


@pytest.fixture(scope="module")
def clinics(seeded: Session) -> dict[str, Clinic]:
    """Return the clinic at a random time in each part of a day, in each zone, after it was seeded."""
    chance = Random(1)
    part = timedelta(days=1) / TIMES_OF_DAY
    times = [SEEDED_AT + part * (number + chance.random()) for number in range(TIMES_OF_DAY)]
    return {f"{zone} {at}": Clinic(seeded, at, ZoneInfo(zone)) for at in times for zone in ZONES}


@pytest.mark.parametrize("figure", SAME)
def test_home_page_and_the_page_behind_it(clinics: dict[str, Clinic], figure: str) -> None:
    on_home, behind = SAME[figure]
    shown = {time: on_home(clinic) for time, clinic in clinics.items()}
    assert any(shown.values()), "an empty figure proves nothing"
    assert shown == {time: behind(clinic) for time, clinic in clinics.items()}


def test_adherence_and_stops_cover_the_same_days(clinics: dict[str, Clinic]) -> None:
    """Adherence once counted a rolling 28 days, so that more sessions were held than there were."""
    for clinic in clinics.values():
        assert 0 < clinic.adherence.held <= clinic.stops.sessions
