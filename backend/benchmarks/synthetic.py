"""Generates ten years of an invented clinic until today: patients, episodes, programmes, assessments, sessions, runs, alarms, their audit
trail, the sums of the clinic's figures, and one run of an hour.

Only the patients that a benchmark reads have tracking figures of each motor. For all patients they would be ten million rows, and such a
row is only read together with its run.
"""

import json
import random
from collections import defaultdict
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from typing import Any, Final, Literal
from uuid import UUID

import numpy as np
from sqlalchemy.orm import Session

from benchmarks.bulk_insert import Insert, Rows, bulk_insert
from benchmarks.synthetic_figures import StationHours, outcome_row, stored_time
from kata.audit.tables import AuditRow
from kata.clinic.assessments.tables import AssessmentRow, RomRow
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patients.search import text_of
from kata.clinic.patients.sorting import sort_key
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeRow, ProgrammeVersionRow
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow, TeachingRow
from kata.clinic.sessions import runs
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.tables import MotorTrackingRow, RunRow, SessionRow, SessionStopRow
from kata.clinic.stations.tables import StationRow, StationVersionRow
from kata.clinic.statistics.derived_tables import DerivedTablesHook
from kata.clinic.statistics.tables import EpisodeOutcomeRow, StationHourRow
from kata.database.engine import Database
from kata.device.config import StationConfig, as_toml
from kata.device.journal import JournalEnd, JournalHeader, synthetic_journal
from kata.motion.axes import AXES

THERAPISTS: Final = ("Sato", "Suzuki", "Takahashi", "Tanaka", "Watanabe", "Ito")
STATIONS: Final = ("Station 1", "Station 2", "Station 3")
STOPS: Final = ("estop_pressed", "pedal_released", "following_error", "service_silent")
ACTIONS: Final = ("get_patient", "get_session", "update_session", "play", "stop", "list_patients")
ACCOUNTS: Final = tuple(UUID(int=(10 << 64) + n) for n in range(len(THERAPISTS)))
_FAMILIES: Final = (
    ("Yamada", "ヤマダ"),
    ("Kobayashi", "コバヤシ"),
    ("Kato", "カトウ"),
    ("Mori", "モリ"),
    ("Abe", "アベ"),
)
_GIVEN: Final = (("Hanako", "ハナコ"), ("Ken", "ケン"), ("Mai", "マイ"), ("Yuki", "ユキ"), ("Taro", "タロウ"))
_DAYS: Final = 3650
_COURSE: Final = timedelta(days=200)
"""Duration of an episode until it is closed."""
_UNSIGNED: Final = 0.2
_UNSIGNED_DAYS: Final = 7
"""Share of recent notes that are not signed, and the number of days that count as recent."""
_MOVES: Final = 10
"""Number of versions of each station's configuration, one for each year."""
_RUNS: Final = 2
_STOPPED: Final = 0.03
_REFUSED: Final = 0.005
"""Share of refused actions. All other actions succeed."""
_ASSESSMENTS: Final = 6
_ROM: Final = (("flexion", "", 120.0), ("abduction", "", 100.0), ("external_rotation", "at_side", 40.0))
_STAGES: Final = ("freezing", "frozen", "thawing")
_PROGRAMMES: Final = ("Gentle motion", "Range of motion", "Full range", "Strength")
_SESSIONS_A_BATCH: Final = 20_000
_PATIENTS_A_BATCH: Final = 1000
_REQUESTED_PATIENTS: Final = 50
_RESTRICTED: Final = 50
"""One of this many patients is restricted to a care team. The benchmark's accounts are in no care team."""
_RATE_HZ: Final = 100
_COUNT_DEG: Final = 360 / 4096
_TORQUE_COUNT_NM: Final = 0.00538
_TORQUE_NOISE_COUNTS: Final = (10.9, 9.4, 12.4, 11.7, 1.6)
"""Noise of the simulated apparatus in torque counts, for each motor."""
_ANGLE_NOISE_DEG: Final = 0.01
_JITTER_S: Final = 3e-5
_TABLES: Final[tuple[Any, ...]] = (
    PatientRow, EpisodeRow, StageRow, TeachingRow, RecordingRow, ProgrammeRow, ProgrammeVersionRow, AssessmentRow, RomRow,
    SessionRow, RunRow, SessionStopRow, MotorTrackingRow, DeviceEventRow, AuditRow, StationRow, StationVersionRow, StationHourRow,
    EpisodeOutcomeRow,
)  # fmt: skip
_Rows = dict[Any, Rows]


@dataclass(frozen=True)
class History:
    """Ids and names of the records that a benchmark requests."""

    patients: tuple[UUID, ...]
    episodes: tuple[UUID, ...]
    sessions: tuple[UUID, ...]
    recordings: tuple[UUID, ...]
    names: tuple[str, ...]
    """Texts for a search."""
    hour: UUID
    """Id of the run of an hour, or of another requested length."""


def fill(database: Database, patients: int, visits: int, hour_s: float, today: date) -> History:
    """Fill the database with the ten years before ``today``. Except for the dates the content is always the same."""
    random_source = random.Random(7)
    first = datetime(today.year, today.month, today.day, 9, tzinfo=UTC) - timedelta(days=_DAYS)
    people = [_Person(n, random_source, first) for n in range(patients)]
    clinic = _Clinic(first, random_source, StationHours())
    requested = people[:: max(1, patients // _REQUESTED_PATIENTS)]
    requested_numbers = {person.number for person in requested}
    with bulk_insert(database, [row.__table__ for row in _TABLES]) as insert:
        _insert_rows(insert, _stations(first))
        for start in range(0, patients, _PATIENTS_A_BATCH):
            rows = _no_rows()
            for person in people[start : start + _PATIENTS_A_BATCH]:
                restricted = person.number % _RESTRICTED == _RESTRICTED // 2 and person.number not in requested_numbers
                person.add_to(rows, restricted, clinic)
            _insert_rows(insert, rows)
        each = -(-visits // patients)
        for start in range(0, visits, _SESSIONS_A_BATCH):
            rows = _no_rows()
            for n in range(start, min(start + _SESSIONS_A_BATCH, visits)):
                # A patient has one session a day from the beginning of the episode.
                person = people[n // each]
                clinic.add_session(rows, n, person, n % each, person.number in requested_numbers)
                rows[AuditRow].append(clinic.audit_row(n, visits, random_source.choice(people)))
            _insert_rows(insert, rows)
        _insert_rows(insert, {StationHourRow: clinic.hours.rows()})
    DerivedTablesHook(database)
    with database.write() as session:
        hour = _add_hour(session, people[0], hour_s)
    if not database.file:
        # A PostgreSQL server does this automatically after some time. A clinic's SQLite file is never analyzed.
        with database.writer.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
            connection.exec_driver_sql("VACUUM (ANALYZE)")
    return History(
        patients=tuple(person.id for person in requested),
        episodes=tuple(person.episode_id for person in requested),
        sessions=tuple(
            UUID(int=(2 << 64) + person.number * each) for person in requested if person.number * each < visits
        ),
        recordings=tuple(person.recording_id for person in requested),
        names=tuple(person.search for person in requested),
        hour=hour,
    )


class _Person:
    """A patient with one episode, one programme, several assessments and one recording."""

    def __init__(self, number: int, random_source: random.Random, first: datetime) -> None:
        family, given = random_source.choice(_FAMILIES), random_source.choice(_GIVEN)
        self.number = number
        self.id, self.episode_id, self.recording_id = (UUID(int=(kind << 64) + number) for kind in (4, 5, 6))
        self.name, self.kana = f"{family[0]} {given[0]} {number}", f"{family[1]} {given[1]}"
        self.search = f"{family[0]} {number}"
        self.began = first + timedelta(days=random_source.randrange(_DAYS))

    def add_to(self, rows: _Rows, restricted: bool, clinic: "_Clinic") -> None:
        """Add the patient's rows, without sessions."""
        random_source = clinic.random_source
        at, key, episode = stored_time(self.began), self.id.hex, self.episode_id.hex
        born = self.began.date() - timedelta(days=random_source.randrange(7000, 30_000))
        number = f"K-{self.number:06}"
        rows[PatientRow].append(
            {
                "id": key, "clinic_number": number, "name": self.name, "kana": self.kana, "sex": "female",
                "birth_date": born.isoformat(), "notes": "", "created_at": at, "updated_at": at, "restricted": restricted,
                "search_text": text_of(self.name, self.kana, number, born), "sort_key": sort_key(self.name, self.kana),
            }
        )  # fmt: skip
        rows[EpisodeRow].append(
            {
                "id": episode, "patient_id": key, "side": "left", "diagnosis": "", "contraindications": "", "limits": "[]",
                "limits_by": "", "opened_at": at, "closing_note": "", "updated_at": at,
                "closed_at": stored_time(self.began + _COURSE) if self.began + _COURSE < clinic.today else None,
            }
        )  # fmt: skip
        self._add_programme(rows, at)
        teaching = UUID(int=(7 << 64) + self.number).hex
        common = {"patient_id": key, "name": "Lift", "side": "left", "taught_by": "", "fixtures": "[]"}
        rows[TeachingRow].append({"id": teaching, "started_at": at} | common)
        rows[RecordingRow].append(
            {
                "id": self.recording_id.hex, "teaching_id": teaching, "take": 1, "done": "[]", "station": STATIONS[0],
                "taught_at": at, "duration_s": 20.0, "rate_hz": _RATE_HZ, "samples": 2001, "note": "", "updated_at": at,
            } | common
        )  # fmt: skip
        self._add_assessments(rows, clinic)

    def _add_programme(self, rows: _Rows, at: str) -> None:
        programme, episode = UUID(int=(9 << 64) + self.number).hex, self.episode_id.hex
        rows[StageRow].append(
            {
                "id": UUID(int=(11 << 64) + self.number).hex, "episode_id": episode, "stage": _STAGES[self.number % len(_STAGES)],
                "since": self.began.date().isoformat(), "noted_at": at,
            }
        )  # fmt: skip
        rows[ProgrammeRow].append(
            {
                "id": programme, "episode_id": episode, "name": _PROGRAMMES[self.number % len(_PROGRAMMES)], "created_at": at,
                "updated_at": at,
            }
        )  # fmt: skip
        rows[ProgrammeVersionRow].append(
            {
                "id": UUID(int=(12 << 64) + self.number).hex, "programme_id": programme, "number": 1, "made_at": at,
                "made_by": "", "note": "", "sessions_per_week": 5,
            }
        )  # fmt: skip

    def _add_assessments(self, rows: _Rows, clinic: "_Clinic") -> None:
        values: dict[str, list[tuple[datetime, float]]] = defaultdict(list)
        for n in range(_ASSESSMENTS):
            at = self.began + timedelta(days=7 * n)
            if n and at > clinic.today:
                break
            when, spadi = stored_time(at), max(0, 8 - n) * 10.0
            assessment = UUID(int=(8 << 64) + self.number * _ASSESSMENTS + n).hex
            rows[AssessmentRow].append(
                {
                    "id": assessment, "episode_id": self.episode_id.hex, "assessed_at": when,
                    "assessed_by": clinic.random_source.choice(THERAPISTS), "note": "", "pain_rest": 3, "pain_active": max(0, 7 - n),
                    "pain_passive": 2, "pain_average": 4, "spadi": json.dumps([max(0, 8 - n)] * 13), "spadi_score": spadi,
                    "updated_at": when,
                }
            )  # fmt: skip
            values["spadi"].append((at, spadi))
            values["pain"].append((at, 4.0))
            for motion, position, angle_deg in _ROM:
                measured = {"assessment_id": assessment, "side": "left", "kind": "passive", "position": position}
                rows[RomRow].append(measured | {"motion": motion, "angle_deg": angle_deg + 5 * n})
                values[motion].append((at, angle_deg + 5 * n))
        rows[EpisodeOutcomeRow].append(outcome_row(self.episode_id, values))


@dataclass
class _Clinic:
    """Data that all sessions share."""

    first: datetime
    """Beginning of the history."""
    random_source: random.Random
    hours: StationHours

    @property
    def today(self) -> datetime:
        """End of the history."""
        return self.first + timedelta(days=_DAYS)

    def add_session(self, rows: _Rows, n: int, person: _Person, nth: int, compared: bool) -> None:
        """Add a session with its runs, its stop and its alarm. It is the ``nth`` session of the person and the ``n``-th of the clinic."""
        random_source = self.random_source
        day = nth % min(_COURSE.days, (self.today - person.began).days + 1)
        began = person.began + timedelta(days=day, minutes=15 * random_source.randrange(36), seconds=nth % 900)
        at, ended = stored_time(began), stored_time(began + timedelta(minutes=20))
        key = f"{(2 << 64) + n:032x}"
        stop = random_source.choice(STOPS) if random_source.random() < _STOPPED else None
        recent = self.today - began < timedelta(days=_UNSIGNED_DAYS)
        unsigned = recent and random_source.random() < _UNSIGNED
        station = random_source.choice(STATIONS)
        visit = {
            "id": key, "patient_id": person.id.hex, "episode_id": person.episode_id.hex, "started_at": at,
            "therapist": random_source.choice(THERAPISTS), "station": station, "ended_at": ended, "checks": "[]",
            "pain_before": 4, "pain_during": 4, "pain_after": 3, "end_reason": "completed", "note": "Went well.",
            "signed_at": None if unsigned else ended, "signed_by": "" if unsigned else "Sato", "updated_at": ended, "run_count": _RUNS,
            "stop_count": int(bool(stop)),
        }  # fmt: skip
        rows[SessionRow].append(visit)
        if stop:
            whose = {name: visit[name] for name in ("therapist", "station")}
            rows[SessionStopRow].append({"session_id": key, "code": stop, "started_at": at} | whose)
            rows[DeviceEventRow].append(
                {
                    "id": f"{(13 << 64) + n:032x}", "station": visit["station"], "at": at, "kind": "alarm", "code": stop,
                    "message": "It was stopped.", "category": 1, "patient_id": person.id.hex, "session_id": key, "ended_at": ended,
                }
            )  # fmt: skip
        played = [self._run(n, run, visit, person, stop if run == _RUNS - 1 else None) for run in range(_RUNS)]
        if compared:
            figures = {"peak_deg": 3.0, "peak_at_s": 1.0, "rmse_deg": 1.0, "start_deg": 0.0}
            rows[MotorTrackingRow] += [
                {"run_id": run["id"], "motor": motor} | figures for run in played for motor in AXES
            ]
        rows[RunRow] += [run | {"samples": 6000 if compared else None} for run in played]
        self.hours.add(began, station, played)

    def _run(self, n: int, run: int, visit: dict[str, Any], person: _Person, stopped: str | None) -> dict[str, Any]:
        return {
            "id": f"{(3 << 64) + n * _RUNS + run:032x}", "session_id": visit["id"], "recording_id": person.recording_id.hex,
            "started_at": visit["started_at"], "ended_at": visit["ended_at"], "outcome": "stopped" if stopped else "completed",
            "stop_code": stopped, "stop_message": "It was stopped." if stopped else None, "rate_hz": _RATE_HZ,
            "load_level": 8, "speed_percent": 100.0, "repetitions": 3, "pause_s": 1.0, "range_percent": 90.0,
            "method": "learned", "worst_rmse_deg": 1.0 + self.random_source.random(),
            "worst_peak_deg": 3.0 + self.random_source.random(), "reversals": 0, "repetitions_done": 3, "played_s": 60.0,
        }  # fmt: skip

    def audit_row(self, n: int, of: int, person: _Person) -> dict[str, Any]:
        """Return one row of the audit trail, in order of time. Its hash is not valid, because the chain is not checked."""
        random_source = self.random_source
        who = random_source.randrange(len(THERAPISTS))
        return {
            "number": n + 1, "at": stored_time(self.first + timedelta(days=_DAYS) * (n / of)), "account_id": ACCOUNTS[who].hex,
            "who": THERAPISTS[who], "role": "therapist", "address": "192.0.2.1", "action": random_source.choice(ACTIONS),
            "outcome": "refused" if random_source.random() < _REFUSED else "done", "patient_id": person.id.hex, "subject": "",
            "station": random_source.choice(STATIONS), "detail": "{}", "anchor": "", "anchored": 0, "hash": bytes(32),
        }  # fmt: skip


def _stations(first: datetime) -> _Rows:
    """Return the rows of the stations, which are real apparatus, with a new configuration every year."""
    rows = _no_rows()
    for name in STATIONS:
        config = as_toml(StationConfig(name=name))
        at = stored_time(first)
        rows[StationRow].append({"name": name, "config": config, "registered_at": at, "started_at": at})
        for number in range(1, _MOVES + 1):
            since = stored_time(first + timedelta(days=365 * (number - 1)))
            version = {"station": name, "number": number, "config": config, "software": "1.0.0", "since": since}
            rows[StationVersionRow].append(version)
    return rows


def _no_rows() -> _Rows:
    return {row: [] for row in _TABLES}


def _insert_rows(insert: Insert, rows: _Rows) -> None:
    for row, some in rows.items():
        insert(row.__table__, some)


def _header(kind: Literal["teaching", "run"], identity: UUID, began: datetime) -> JournalHeader:
    return JournalHeader(
        kind=kind,
        id=str(identity),
        recording_id=None,
        station=STATIONS[0],
        rate_hz=_RATE_HZ,
        started_at=began,
        started_ns=0,
    )


def _add_hour(session: Session, person: _Person, lasts_s: float) -> UUID:
    """Add a run with drive counts, a lag behind the setpoint, the simulated drives' noise and a jittering clock."""
    noise = np.random.default_rng(7)
    count = round(lasts_s * _RATE_HZ) + 1
    times_s = np.arange(count) / _RATE_HZ + noise.normal(0, _JITTER_S, count)
    times_s -= times_s[0]

    def at(moments_s: Any) -> Any:
        swings = np.sin(2 * np.pi * moments_s[:, None] / np.array([7.9, 8.3, 11.3, 9.7, 13.1]))
        return np.array([0.0, 0.0, 55.0, 30.0, 0.0]) + np.array([12.0, 9.0, 40.0, 30.0, 25.0]) * swings

    def counts(values: Any, count: float) -> Any:
        return np.rint(values / count) * count

    measured = counts(at(times_s - 0.05) + noise.normal(0, _ANGLE_NOISE_DEG, (count, 5)), _COUNT_DEG)
    shaking = noise.normal(0, 1, (count, 5)) * _TORQUE_NOISE_COUNTS * _TORQUE_COUNT_NM
    torque = counts(shaking + at(times_s) / 50, _TORQUE_COUNT_NM)
    began = person.began
    teaching = TeachingRow(id=UUID(int=9), patient_id=person.id, name="An hour", side="left", started_at=began)
    session.add(teaching)
    session.flush()
    zeros = np.zeros((count, 5))
    taught = counts(at(times_s), _COUNT_DEG)
    end = JournalEnd(reason="finished")
    saved = recordings.store_teaching(
        session,
        synthetic_journal(
            _header("teaching", teaching.id, began),
            times_s,
            taught,
            zeros,
            zeros,
            end,
        ),
    )
    assert saved
    visit = sessions.begin(session, person.id)
    run = runs.begin(session, runs.RunRequest(visit.id, saved[0].id))
    end = JournalEnd(reason="completed")
    played = synthetic_journal(
        _header("run", run.id, began),
        times_s,
        measured,
        at(times_s),
        torque,
        end,
    )
    runs.complete(session, played, StationConfig())
    return run.id
