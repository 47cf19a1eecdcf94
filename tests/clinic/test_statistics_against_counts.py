"""Worklist and figures of random clinics agree with plain loops over all records."""

import random
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, closing
from datetime import UTC, date, datetime, timedelta
from typing import Any
from uuid import UUID
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.actor import Actor
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeRow, ProgrammeVersionRow
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.restricted import service as restricted
from kata.clinic.sessions import runs
from kata.clinic.sessions.tables import MotorTrackingRow, RunRow, SessionRow, SessionStopRow
from kata.clinic.statistics import derived_tables, episode_changes, outcomes, usage, worklist
from kata.clinic.statistics.measures import MEASURES, improvement
from kata.clinic.statistics.recent_days import recent_days
from kata.clinic.statistics.schemas import LEAST_SHOWN
from kata.clinic.statistics.tables import EpisodeOutcomeRow
from kata.clinic.statistics.usage import Span
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from tests.support.databases import emptied_afterwards, upgraded_file

NOW = datetime(2026, 11, 20, 6, 0, tzinfo=UTC)
TOKYO = ZoneInfo("Asia/Tokyo")
TODAY = datetime(2026, 11, 19, 15, 0, tzinfo=UTC)
"""Begin of the day in Tokyo."""
SINCE = TODAY - timedelta(days=27)
DAYS = recent_days(NOW, TOKYO)
THERAPISTS = ("Sato", "Ito")
STATIONS = ("Kata 1", "Kata 2")
CODES = ("estop_pressed", "bus_lost", "load_repeated")
ACTOR = Actor(UUID(int=1), UUID(int=2), "Sato", "therapist", frozenset())
ZONES = (
    "Asia/Tokyo", "America/Chicago", "Asia/Kolkata", "Asia/Kathmandu", "Australia/Adelaide", "Australia/Lord_Howe", "Pacific/Chatham",
    "America/St_Johns", "Pacific/Marquesas",
)  # fmt: skip
"""Zones with and without whole hours, most with a change of the offset in the time of the records."""
REPETITION_S = 10.0
MEASURED = ("spadi", "pain", "flexion")
Values = dict[str, list[tuple[datetime, float]]]
"""Times and values of each measure, in order."""


class RandomClinic:
    """Records of a random clinic. Times differ from each other, so that every order is certain."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self._numbers = iter(range(1, 1_000_000))
        self.outcomes: dict[UUID, Values] = {}
        """The assessments of each episode."""

    def fill(self, session: Session, patients: int) -> None:
        for _ in range(patients):
            self._patient(session)

    def _patient(self, session: Session) -> None:
        chance = self.random.random
        patient = PatientRow(
            id=self._id(), clinic_number=str(next(self._numbers)), name="N", sex="female", notes="", created_at=NOW,
            updated_at=NOW, restricted=chance() < 0.2, archived_at=NOW if chance() < 0.1 else None,
        )  # fmt: skip
        session.add(patient)
        session.flush()
        recording = RecordingRow(
            id=self._id(), patient_id=patient.id, name="Lift", side="left", station=STATIONS[0], taught_at=NOW, taught_by="",
            duration_s=REPETITION_S, rate_hz=100, samples=1000, note="",
        )  # fmt: skip
        session.add(recording)
        session.flush()
        self._recording = recording
        for side in ("left", "right")[: self.random.choice((1, 1, 2))]:
            self._episode(session, patient.id, side)

    def _episode(self, session: Session, patient_id: UUID, side: str) -> None:
        episode = EpisodeRow(
            id=self._id(), patient_id=patient_id, side=side, limits_by="", opened_at=self._time(90), updated_at=NOW,
            closed_at=NOW if self.random.random() < 0.2 else None,
        )  # fmt: skip
        session.add(episode)
        session.flush()
        for _ in range(self.random.randrange(3)):
            self._programme(session, episode.id)
        for stage in self.random.sample(("freezing", "frozen", "thawing"), self.random.randrange(4)):
            at = self._time(90)
            session.add(StageRow(id=self._id(), episode_id=episode.id, stage=stage, since=at.date(), noted_at=at))
        values = {measure: self._values() for measure in self.random.sample(MEASURED, self.random.randrange(4))}
        if values:
            self.outcomes[episode.id] = values
            ends = [of[-1][0] for of in values.values()]
            session.add(
                EpisodeOutcomeRow(
                    episode_id=episode.id, begin_at=min(ends), end_at=max(ends), changes=episode_changes.pack(values)
                )
            )
        for _ in range(self.random.randrange(12)):
            self._session(session, patient_id, episode.id)

    def _programme(self, session: Session, episode_id: UUID) -> None:
        programme = ProgrammeRow(
            id=self._id(), episode_id=episode_id, name=self.random.choice("AB"), created_at=self._time(90), updated_at=NOW,
            archived_at=NOW if self.random.random() < 0.3 else None,
        )  # fmt: skip
        session.add(programme)
        session.flush()
        for number in range(1, self.random.randrange(2, 4)):
            session.add(
                ProgrammeVersionRow(
                    id=self._id(), programme_id=programme.id, number=number, made_at=self._time(60), made_by="", note="",
                    sessions_per_week=self.random.choice((None, 0, 1, 3)),
                )
            )  # fmt: skip

    def _values(self) -> list[tuple[datetime, float]]:
        """Return times and values of one to three assessments of a measure, the first first."""
        times = sorted(self._time(200) for _ in range(self.random.choice((1, 2, 2, 3, 3))))
        return [(at, round(self.random.uniform(0, 90), 2)) for at in times]

    def _session(self, session: Session, patient_id: UUID, episode_id: UUID) -> None:
        at = self._time(self.random.choice((1, 60)))
        id_, station = self._id(), self.random.choice(STATIONS)
        session.add(
            SessionRow(
                id=id_, patient_id=patient_id, episode_id=self.random.choice((episode_id, episode_id, None)),
                therapist=self.random.choice(THERAPISTS), station=station, started_at=at, updated_at=at, note="", checks=[],
                ended_at=self.random.choice((None, at, at, at)), signed_at=self.random.choice((None, at)),
                run_count=self.random.randrange(3),
            )
        )  # fmt: skip
        session.flush()
        for _ in range(session.get_one(SessionRow, id_).run_count):
            self._run(session, id_, at)
        for code in self.random.sample(CODES, self.random.randrange(3)):
            session.add(SessionStopRow(session_id=id_, code=code, started_at=at, station=station))
        for kind in ("alarm", "event"):
            session.add(
                DeviceEventRow(
                    id=self._id(), station=station, at=at, kind=kind, code=self.random.choice(CODES), message="", session_id=id_
                )
            )  # fmt: skip

    def _run(self, session: Session, session_id: UUID, at: datetime) -> None:
        """Add a run that was played to its end, ended early, played with reduced range, never played, or is being played."""
        outcome = self.random.choice(
            ("completed", "completed", "stopped", "returned", "interrupted", "unloaded", "loaded")
        )
        run = RunRow(
            id=self._id(),
            session_id=session_id,
            recording=self._recording,
            started_at=at,
            outcome=outcome,
            repetitions=3,
        )
        if outcome not in ("unloaded", "loaded"):
            played = 3.0 if outcome == "completed" else self.random.uniform(0, 3)
            reduced = self.random.choice((0.0, 0.0, 0.05, 0.4, 1.0))
            run.repetitions_done, run.played_s, run.rate_hz = int(played), played * REPETITION_S, 100
            run.compared_percent = 100 * (1 - reduced)
            run.least_range_percent = 60.0 if reduced else None
            if reduced < 1:
                # An error is larger in a short part of the motion, or smaller.
                spread = 1.0 if played >= 1 else self.random.choice((0.1, 20.0))
                run.samples = round(played * 1000 * (1 - reduced))
                run.tracking = [self._errors(motor, spread) for motor in (1, 3)]
        runs.store_worst_errors(run)
        session.add(run)

    def _errors(self, motor: int, spread: float) -> MotorTrackingRow:
        rmse = spread * self.random.uniform(0.5, 1.5)
        return MotorTrackingRow(motor=motor, peak_deg=-2 * rmse, peak_at_s=0.5, rmse_deg=rmse, start_deg=0.0)

    def _id(self) -> UUID:
        return UUID(int=self.random.getrandbits(128), version=4)

    def _time(self, days: int) -> datetime:
        """Return a time before now."""
        return NOW - timedelta(seconds=self.random.randrange(days * 86_400), microseconds=next(self._numbers))


@pytest.fixture(scope="module", params=["sqlite", "postgresql"])
def session(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    """Return a session of a database with a random clinic, another one on each kind of database."""
    with ExitStack() as stack:
        if request.param == "sqlite":
            url = upgraded_file(tmp_path_factory.mktemp("counts") / "kata.db")
        else:
            url = stack.enter_context(emptied_afterwards(request.getfixturevalue("postgresql_url")))
        database = stack.enter_context(closing(Database(url)))
        upgrade(database)
        derived_tables.DerivedTablesHook(database)
        clinic = RandomClinic(seed=len(request.param))
        with database.write() as writing:
            clinic.fill(writing, 150)
        with database.read() as reading:
            reading.info["outcomes"] = clinic.outcomes
            yield reading


def rows(session: Session, table: Any) -> list[Any]:
    return list(session.scalars(select(table)))


def followed_programmes(session: Session, *, hidden: bool) -> dict[UUID, tuple[datetime, datetime | None, int]]:
    """Return date, last session and held sessions of the newest followed programme of each episode."""
    patients = {row.id: row for row in rows(session, PatientRow)}
    programmes = {row.id: row for row in rows(session, ProgrammeRow)}
    episodes = {row.id: row for row in rows(session, EpisodeRow)}
    newest: dict[UUID, Any] = {}
    recent = set()
    for version in sorted(rows(session, ProgrammeVersionRow), key=lambda row: row.number):
        newest[version.programme_id] = version
        if version.made_at >= SINCE:
            recent.add(programmes[version.programme_id].episode_id)
    held = defaultdict(list)
    for row in rows(session, SessionRow):
        if row.run_count and row.started_at >= SINCE:
            held[row.episode_id].append(row.started_at)
    found: dict[UUID, tuple[datetime, datetime | None, int]] = {}
    for version in sorted(newest.values(), key=lambda row: row.made_at):
        programme = programmes[version.programme_id]
        episode = episodes[programme.episode_id]
        patient = patients[episode.patient_id]
        if patient.archived_at or programme.archived_at or episode.closed_at or not version.sessions_per_week:
            continue
        if (hidden and patient.restricted) or (episode.id not in recent and not held[episode.id]):
            continue
        since_made = [at for at in held[episode.id] if at >= version.made_at]
        found[episode.id] = (version.made_at, max(held[episode.id], default=None), len(since_made))
    return found


@pytest.mark.parametrize("hidden", [False, True])
def test_followed_programmes(session: Session, hidden: bool) -> None:
    query = restricted.hidden(ACTOR) if hidden else None
    found = worklist.followed(session, DAYS, query)
    assert found
    assert {one.episode_id: (one.made_at, one.last_session_at, one.held) for one in found} == followed_programmes(
        session, hidden=hidden
    )


def test_work_of_the_day(session: Session) -> None:
    work = worklist.worklist(session, ACTOR, DAYS)
    visible = [row for row in rows(session, SessionRow) if not row.patient.restricted]
    by_time = sorted(visible, key=lambda row: row.started_at)
    of_day = [row.id for row in reversed(by_time) if row.started_at >= TODAY or not row.ended_at]
    assert len(of_day) > 50
    assert [row.id for row in work.sessions] == of_day[:50]
    unsigned = [row.id for row in by_time if row.ended_at and not row.signed_at and row.therapist == ACTOR.name]
    assert [row.id for row in work.unsigned] == unsigned[:50]
    assert work.unsigned_count == sum(1 for row in by_time if row.ended_at and not row.signed_at)
    last = {row.started_at: row.therapist for row in by_time if row.episode_id and row.run_count}
    assert any(due.last_session_at for due in work.due)
    # A patient with two programmes, one for each shoulder, comes once.
    assert len({due.patient.id for due in work.due}) == len(work.due)
    assert work.due_count == len(due_patients(session))
    assert [due.therapist for due in work.due] == [last.get(due.last_session_at or NOW, "") for due in work.due]


def due_patients(session: Session) -> set[UUID]:
    """Return the patients who are due until the end of the day."""
    versions = rows(session, ProgrammeVersionRow)
    per_week = {(row.made_at, row.programme_id): row.sessions_per_week for row in versions}
    programmes = {row.id: row.episode_id for row in rows(session, ProgrammeRow)}
    of_episode = {(made_at, programmes[id_]): weekly for (made_at, id_), weekly in per_week.items()}
    patients = {row.id: row.patient_id for row in rows(session, EpisodeRow)}
    found = set()
    for episode_id, (made_at, last_at, _) in followed_programmes(session, hidden=True).items():
        due_at = last_at + timedelta(weeks=1) / of_episode[made_at, episode_id] if last_at else made_at
        if due_at < TODAY + timedelta(days=1):
            found.add(patients[episode_id])
    return found


def test_last_sessions_of_a_therapist(session: Session) -> None:
    found = worklist._last_sessions(session, ACTOR, SINCE, restricted.hidden(ACTOR))
    last = {}
    for row in sorted(rows(session, SessionRow), key=lambda row: row.started_at):
        if row.therapist == ACTOR.name and row.episode_id and not row.patient.restricted and row.started_at >= SINCE:
            last[row.episode_id] = row.started_at
    newest = sorted(last.items(), key=lambda item: item[1], reverse=True)
    assert len(newest) > 12
    assert [(row.episode_id, row.last_at) for row in found] == newest[:12]


@pytest.mark.parametrize("station", [None, "Kata 2"])
@pytest.mark.parametrize("days", [14, 300])
def test_stops(session: Session, days: int, station: str | None) -> None:
    span = Span(NOW - timedelta(days=days), NOW, TOKYO, station)
    counts: dict[tuple[str, str], list[int]] = defaultdict(lambda: [0, 0])
    stops = [
        row for row in rows(session, SessionStopRow) if row.started_at >= span.since and station in (None, row.station)
    ]
    alarms = [row for row in rows(session, DeviceEventRow) if row.at >= span.since and row.kind == "alarm"]
    for place, found in enumerate((stops, [row for row in alarms if station in (None, row.station)])):
        for row in found:
            counts[row.code, row.station][place] += 1
    stopped = {row.session_id for row in stops}
    assert len(stopped) < len(stops), "sessions have several causes"
    answer = usage.stops(session, span)
    assert {(row.code, row.station): [row.sessions, row.alarms] for row in answer.rows} == counts
    assert answer.stopped_sessions == len(stopped)


def span_of(zone: str, station: str | None) -> Span:
    """Return seven weeks of a zone that begin on a Monday."""
    local = ZoneInfo(zone)
    since, until = (datetime(2026, month, day, tzinfo=local).astimezone(UTC) for month, day in ((9, 28), (11, 16)))
    return Span(since, until, local, station)


def sessions_of(session: Session, span: Span) -> list[tuple[date, str, list[Any]]]:
    """Return the day and station of each session of a span, with the runs that were played."""
    played = defaultdict(list)
    for run in rows(session, RunRow):
        if run.outcome not in ("loaded", "unloaded"):
            played[run.session_id].append(run)
    return [
        (row.started_at.astimezone(span.zone).date(), row.station, played[row.id])
        for row in rows(session, SessionRow)
        if row.run_count and span.since <= row.started_at < span.until and span.station in (None, row.station)
    ]


@pytest.mark.parametrize("station", [None, "Kata 2"])
@pytest.mark.parametrize("zone", ZONES)
def test_use_of_the_stations(session: Session, zone: str, station: str | None) -> None:
    """Sums of whole hours of UTC once moved sessions to another day."""
    span = span_of(zone, station)
    used: dict[tuple[date, str], list[float]] = defaultdict(lambda: [0, 0, 0, 0, 0])
    for day, name, played in sessions_of(session, span):
        sums = used[day, name]
        sums[0] += 1
        for run in played:
            for place, more in enumerate((1, run.outcome == "stopped", run.played_s / 3600, run.repetitions_done), 1):
                sums[place] += more
    found = {
        (row.begins_on, row.station): [row.sessions, row.playbacks, row.stopped, row.hours, row.repetitions]
        for row in usage.usage(session, span, "day").rows
    }
    assert found.keys() == used.keys()
    for key, sums in found.items():
        assert sums == pytest.approx(used[key])


@pytest.mark.parametrize("station", [None, "Kata 2"])
@pytest.mark.parametrize("zone", ZONES)
def test_tracking_error_of_the_stations(session: Session, zone: str, station: str | None) -> None:
    """A playback that was stopped after a second once counted like a whole one."""
    span = span_of(zone, station)
    errors: dict[tuple[date, str], list[tuple[float, float]]] = defaultdict(list)
    left_out = 0
    for day, name, played in sessions_of(session, span):
        for run in played:
            if run.played_s < REPETITION_S or run.compared_percent < 90:
                left_out += 1
            else:
                motors = [(motor.rmse_deg, abs(motor.peak_deg)) for motor in run.tracking]
                errors[day - timedelta(days=day.weekday()), name].append(max(motors))
    quality = usage.tracking(session, span)
    assert left_out > 10
    assert quality.left_out == left_out
    assert {(row.begins_on, row.station): row.playbacks for row in quality.rows} == {
        week: len(of) for week, of in errors.items()
    }
    for row in quality.rows:
        of = errors[row.begins_on, row.station]
        assert row.rmse_deg == pytest.approx(np.mean([rmse for rmse, _ in of]))
        assert row.peak_deg == max(peak for _, peak in of)


@pytest.mark.parametrize("days", [60, 300])
def test_outcomes(session: Session, days: int) -> None:
    span = Span(NOW - timedelta(days=days), NOW, TOKYO)
    found = outcomes.outcomes(session, span)
    assert sum(bool(group.changes) for group in found.groups) > 1
    groups = counted(session, span)
    assert {(group.by, group.name) for group in found.groups} == set(groups)
    for group in found.groups:
        values = groups[group.by, group.name]
        patients = {patient for of_measure in values.values() for patient, *_ in of_measure}
        if group.patients is None:
            continue
        assert group.patients == len(patients)
        for change in group.changes:
            of = values[change.measure]
            assert change.patients == len({patient for patient, *_ in of})
            assert change.shoulders == len(of)
            assert [change.first, change.last] == pytest.approx([np.mean([row[n] for row in of]) for n in (1, 2)])
            assert change.change
            assert change.change.value == pytest.approx(np.mean([last - first for _, first, last, _ in of]))
            weeks = [row[3] for row in of if row[3] is not None]
            improved = {patient for patient, *_, week in of if week is not None}
            quartiles = np.percentile(weeks, (25, 50, 75)) if len(improved) >= LEAST_SHOWN else None
            assert change.weeks_to_important == (None if quartiles is None else pytest.approx(quartiles))
        shown = {measure for measure, of in values.items() if len({patient for patient, *_ in of}) >= LEAST_SHOWN}
        assert {change.measure for change in group.changes} == shown


def counted(session: Session, span: Span) -> dict[tuple[str, str], dict[str, list[Any]]]:
    """Return the patient, the first and the last value, and the weeks until an improvement, by group and measure."""
    episodes = {row.id: row.patient_id for row in rows(session, EpisodeRow)}
    assessed: dict[UUID, Values] = session.info["outcomes"]
    within = [
        (episode_id, measure, of)
        for episode_id, values in assessed.items()
        for measure, of in values.items()
        if span.since <= of[-1][0] < span.until
    ]
    begun: dict[UUID, datetime] = {}
    for episode_id, _, of in within:
        begun[episode_id] = min(begun.get(episode_id, NOW), of[0][0])
    stages, programmes = {}, {}
    for stage in sorted(rows(session, StageRow), key=lambda row: (row.since, row.noted_at)):
        if stage.episode_id in begun and stage.since <= begun[stage.episode_id].astimezone(TOKYO).date():
            stages[stage.episode_id] = stage.stage
    for programme in sorted(rows(session, ProgrammeRow), key=lambda row: (row.archived_at is None, row.created_at)):
        programmes[programme.episode_id] = programme.name
    groups: dict[tuple[str, str], dict[str, list[Any]]] = defaultdict(lambda: defaultdict(list))
    for episode_id, measure, of in within:
        (first_at, first), (last_at, last) = of[0], of[-1]
        if last_at == first_at:
            continue
        limit = MEASURES[measure].important  # type: ignore[index]
        important = [at for at, value in of if limit and improvement(first, value) >= limit]
        weeks = (important[0] - first_at) / timedelta(weeks=1) if important else None
        change = (episodes[episode_id], first, last, weeks)
        stage, programme = stages.get(episode_id, ""), programmes.get(episode_id, "")
        for group in (("all", ""), ("stage", stage), ("programme", programme)):
            groups[group][measure].append(change)
    return groups
