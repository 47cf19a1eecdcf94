"""The demonstration clinic with 60 invented patients over two years, five therapists and three stations. It has data for every page.

Nothing in it is measured: invented drives play the built-in motions. Every patient is marked as invented. The clinic is created only in a
database without patients. The playbacks of the first twelve patients and the last session of each other patient have samples. Older
playbacks have only figures, so that the command takes less than half a minute.
"""

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from pathlib import Path
from typing import Any, Final
from uuid import UUID

import msgspec
import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from kata import __version__
from kata.actor import by_program
from kata.auth import demonstration
from kata.backups import folder
from kata.cli import seed_course, seed_people
from kata.cli.seed_course import Course
from kata.cli.seed_people import DETAILED, INVENTED_TEXTS, Language, Person
from kata.clinic.assessments import spadi
from kata.clinic.assessments.tables import AssessmentRow, RomRow
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeRow, ProgrammeVersionRow
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow, TeachingRow
from kata.clinic.sessions import runs
from kata.clinic.sessions.tables import AddendumRow, RunRow, SessionRow, SessionStopRow
from kata.clinic.stations import service as stations
from kata.clinic.statistics.derived_tables import DerivedTablesHook
from kata.database.base import utc_now
from kata.database.engine import Database, DatabaseError
from kata.database.upgrade import upgrade
from kata.device import config
from kata.device import texts as device_texts
from kata.device.config import StationConfig
from kata.device.journal import FolderInUseError, JournalEnd, JournalHeader, synthetic_journal
from kata.messages import Text, sent_key
from kata.motion.axes import OPPOSITE, Side
from kata.motion.builtin import built_in_motions
from kata.motion.edit import Motion, PlaybackSettings, with_settings
from kata.motion.linkage import motor_angles_deg
from kata.motion.taught import Taught
from kata.settings import Settings

MARK: Final = INVENTED_TEXTS["en"].mark
NUMBER: Final = "DEMO-"
STATION_FILE: Final = "station.toml"
_LONGEST_AGO: Final = timedelta(days=800)
"""A time span longer than any patient's history."""
_MOTIONS: Final = (3, 4, 0)
"""Indices of the built-in motions in use: abduction, flexion, and the scapula."""
_RATE_HZ: Final = 100
_LAG_S: Final = 0.05
_COUNT_DEG: Final = 360 / 4096
_NOISE_DEG: Final = (0.15, 0.15, 0.25, 0.3, 0.6)
"""Noise by motor. Motor 5 has the largest error, as in the paper."""
_RMSE_DEG: Final = (0.7, 0.12)
"""Mean and spread of the worst motor's RMSE. They match the playbacks with samples."""
_PEAK_FACTOR: Final = 1.9
_ROM: Final = (
    ("flexion", "", 95.0, 165.0), ("abduction", "", 70.0, 160.0), ("external_rotation", "at_side", 12.0, 60.0),
    ("internal_rotation", "at_side", 35.0, 70.0),
)  # fmt: skip
"""Motion, position of the arm, first angle, and angle of the other shoulder, in degrees."""
_STOPPED: Final = 0.06
_CAUSES: Final = (
    ("operator_stop", device_texts.OPERATOR_STOP(), 6), ("load_repeated", device_texts.RESISTANCE_REPEATED(motor=3), 3),
    ("estop_pressed", device_texts.ESTOP_PRESSED(), 2), ("following_error", device_texts.FOLLOWING_ERROR(motor=5), 1),
)  # fmt: skip
"""Causes of stops with their weights."""
_ONCE: Final = PlaybackSettings(100.0, 1, 0.0, 90.0)
_TEN_TIMES: Final = PlaybackSettings(100.0, 10, 2.0, 90.0)
"""Settings for the first twelve patients, whose samples are stored, and for the others."""


class SeedError(Exception):
    """The clinic already has patients."""


FAILURES: Final = (SeedError, DatabaseError, FolderInUseError, folder.UnfinishedRestoreError, OSError)
"""Errors whose message the command prints."""


def seeded(settings: Settings, number: int, patients: int, language: Language = "en") -> int:
    """Fill the clinic of these settings and return the number of patients. No service may run on it.

    :raises SeedError: and the other errors of :data:`FAILURES`. Nothing is then written.
    """
    with folder.claimed_by_service(settings):
        database = Database(settings.effective_database_url)
        try:
            upgrade(database)
            count = fill(database, number, utc_now(), patients, language)
        finally:
            database.close()
    write_station(settings.data, language)
    return count


def write_station(data: Path, language: Language) -> Path:
    """Write the file of the first station into the clinic's folder and return it. Its load is identified, so that every function of the
    apparatus can be tried.
    """
    file, name = data / STATION_FILE, INVENTED_TEXTS[language].stations[0]
    config.write(msgspec.structs.replace(config.simulated_with_load("simulator"), name=name), file)
    return file


def fill(
    database: Database, number: int, now: datetime, patients: int = seed_people.MOST, language: Language = "en"
) -> int:
    """Fill a database and return the number of patients. The same ``number`` on the same day creates the same clinic.

    :raises SeedError: when the database has a patient, so that real and invented records are never mixed.
    """
    # It computes the clinic's figures at the commit.
    DerivedTablesHook(database)
    station_names = INVENTED_TEXTS[language].stations
    with by_program("seed", station_names[0]), database.write() as session:
        if session.scalar(select(func.count()).select_from(PatientRow)):
            raise SeedError("This clinic has patients already. Invented patients are only added to an empty clinic.")
        # All seeded data are invented, so the stations count as simulated.
        for name in station_names:
            stations.register(session, StationConfig(name=name), __version__, now - _LONGEST_AGO, simulated=True)
        if language == "ja":
            demonstration.name_in_japanese(session, now)
        motions = built_in_motions()
        for place in range(patients):
            chance = random.Random(f"{number} {place}")  # noqa: S311 - no secret depends on it
            _Invented(session, chance, place, now, motions).write(language)
    return patients


@dataclass(frozen=True)
class _Taught:
    row: RecordingRow
    motion: Motion


class _Invented:
    """One patient and the course of treatment."""

    def __init__(
        self, session: Session, chance: random.Random, place: int, now: datetime, motions: tuple[Taught, ...]
    ) -> None:
        self._session = session
        self._chance = chance
        self._motions = motions
        self._place = place
        self._now = now
        self._noise = np.random.default_rng(chance.randrange(2**32))
        self._course: Course = seed_course.course(chance, place, now)
        self._first = self._course.first
        self._side: Side = self._course.side
        self._asked = _ONCE if place < DETAILED else _TEN_TIMES

    def write(self, language: Language) -> None:
        self._words = INVENTED_TEXTS[language]
        self._station = self._words.stations[self._course.station]
        self._therapist = self._words.therapists[self._course.therapist]
        patient = self._patient(seed_people.person(self._place, language))
        episode = self._episode(patient.id)
        taught = [self._teach(patient.id, motion) for motion in _MOTIONS[:: 1 + self._place % 2][:2]]
        version = self._programme(episode.id, taught)
        visits = self._course.visits
        for nth, at in enumerate(visits):
            detailed = self._place < DETAILED or nth == len(visits) - 1
            self._visit(patient.id, episode.id, version, taught, at, detailed)
        for nth in sorted({*range(0, len(visits), 2 * self._course.sessions_per_week), len(visits) - 1}):
            self._assess(episode.id, visits[nth])

    def _patient(self, person: Person) -> PatientRow:
        row = PatientRow(
            id=self._id(), clinic_number=f"{NUMBER}{self._place + 1:03}", name=person.name, kana=person.kana, sex=person.sex,
            notes=self._words.mark, birth_date=date(1950 + self._chance.randrange(30), 1 + self._chance.randrange(12), 15),
            dominant_side="right", created_at=self._first, updated_at=self._first,
        )  # fmt: skip
        self._add(row)
        return row

    def _episode(self, patient_id: UUID) -> EpisodeRow:
        course, last = self._course, self._course.visits[-1]
        row = EpisodeRow(
            id=self._id(), patient_id=patient_id, side=self._side, diagnosis=self._words.diagnosis, diagnosis_code="M75.0",
            verification="confirmed", onset_on=course.stages[0][1],
            limits=[{"motion": 4, "lowest_deg": None, "highest_deg": 120.0}], max_resistance_level=20,
            limits_by=self._words.doctor, opened_at=self._first - timedelta(days=1), updated_at=self._first,
            closed_at=last + timedelta(days=30 if course.left else 1) if course.closed else None,
            closing_note=(self._words.left if course.left else self._words.discharged) if course.closed else "",
        )  # fmt: skip
        self._add(row)
        for stage, since in course.stages:
            noted = max(self._first, datetime.combine(since, self._first.timetz()))
            self._add(StageRow(id=self._id(), episode_id=row.id, stage=stage, since=since, noted_at=noted))
        return row

    def _teach(self, patient_id: UUID, number: int) -> _Taught:
        built_in = self._motions[number]
        at = self._first + timedelta(minutes=5 + 5 * number)
        row = TeachingRow(
            id=self._id(), patient_id=patient_id, name=self._words.motions[number + 1], side=self._side, taught_by=self._therapist,
            fixtures=["arm_fixer_1"], started_at=at,
        )  # fmt: skip
        self._add(row)
        # A stiff shoulder allows a smaller range.
        rest_deg = built_in.poses_deg[0]
        poses = rest_deg + (0.45 + 0.1 * self._chance.random()) * (built_in.poses_deg - rest_deg)
        angles = motor_angles_deg(poses, self._side)
        nothing = np.zeros_like(angles)
        end = JournalEnd(reason="finished")
        journal = synthetic_journal(
            JournalHeader(
                kind="teaching",
                id=str(row.id),
                recording_id=None,
                station=self._station,
                rate_hz=_RATE_HZ,
                started_at=at,
                started_ns=0,
            ),
            built_in.times_s,
            _counts(angles),
            nothing,
            nothing,
            end,
        )
        takes = recordings.store_teaching(self._session, journal)
        if not takes:
            raise AssertionError("the teaching was added above")
        return _Taught(takes[0], Motion(built_in.times_s, _counts(angles)))

    def _programme(self, episode_id: UUID, taught: list[_Taught]) -> ProgrammeVersionRow:
        programme = ProgrammeRow(
            id=self._id(), episode_id=episode_id, name=self._words.programmes[self._course.first_stage],
            created_at=self._first, updated_at=self._first,
        )  # fmt: skip
        self._add(programme)
        durations_s = [with_settings(recording.motion, self._asked).duration_s for recording in taught]
        version = ProgrammeVersionRow(
            id=self._id(), programme_id=programme.id, number=1, made_at=self._first, made_by=self._therapist,
            note="", timer_minutes=float(math.ceil(sum(durations_s) / 60)), sessions_per_week=self._course.sessions_per_week,
        )  # fmt: skip
        self._add(version)
        for position, (recording, duration_s) in enumerate(zip(taught, durations_s, strict=True), start=1):
            self._add(
                ProgrammeItemRow(
                    version_id=version.id, position=position, recording_id=recording.row.id, speed_percent=100.0,
                    repetitions=self._asked.repetitions, pause_s=self._asked.pause_s, range_percent=90.0, resistance_level=18, method="smooth",
                    duration_s=duration_s,
                )
            )  # fmt: skip
        return version

    def _visit(
        self,
        patient_id: UUID,
        episode_id: UUID,
        version: ProgrammeVersionRow,
        taught: list[_Taught],
        at: datetime,
        detailed: bool,
    ) -> None:
        better = self._course.better(at)
        before = min(10, max(1, round(7 - 6 * better + self._chance.uniform(-1, 1))))
        ended_at, signed = at + timedelta(minutes=35), at + timedelta(minutes=40)
        stopped = self._cause() if self._chance.random() < _STOPPED else None
        unsigned = self._course.unsigned and at == self._course.visits[-1]
        row = SessionRow(
            id=self._id(), patient_id=patient_id, episode_id=episode_id, programme_version_id=version.id,
            therapist=self._therapist, station=self._station, started_at=at, ended_at=ended_at, checks=list(self._checks(at)),
            pain_before=before, pain_during=min(10, before + 1), pain_after=max(0, before - 1),
            end_reason="completed", note=self._note(better, stopped is not None), signed_at=None if unsigned else signed,
            signed_by="" if unsigned else self._therapist, run_count=len(taught), updated_at=signed,
        )  # fmt: skip
        self._add(row)
        for position, recording in enumerate(taught, start=1):
            cause = stopped if position == len(taught) else None
            run = self._new_run(row.id, position, recording, at + timedelta(minutes=6 * position))
            (self._play if detailed else self._figures)(row, run, recording, cause)
        if stopped:
            self._alarm(row, at + timedelta(minutes=20), stopped)
            self._add(
                AddendumRow(
                    id=self._id(), session_id=row.id, written_at=ended_at + timedelta(hours=2), written_by=self._therapist,
                    text=self._words.asked,
                )
            )  # fmt: skip

    def _cause(self) -> tuple[str, Text]:
        code, message, _ = self._chance.choices(_CAUSES, [weight for *_, weight in _CAUSES])[0]
        return code, message

    def _note(self, better: float, stopped: bool) -> str:
        went = self._words.stiff if better < 0.3 else self._words.freer
        return f"{went} {self._words.stopped}" if stopped else went

    def _alarm(self, visit: SessionRow, at: datetime, cause: tuple[str, Text]) -> None:
        code, message = cause
        self._add(
            DeviceEventRow(
                id=self._id(), station=visit.station, at=at, kind="alarm", code=code, message=str(message),
                message_key=sent_key(message), category=1, axis=None, patient_id=visit.patient_id, session_id=visit.id,
                ended_at=at + timedelta(minutes=1),
            )
        )  # fmt: skip

    def _checks(self, at: datetime) -> Iterator[dict[str, Any]]:
        for check, subject, by in (
            ("identity", "birth_date+name", self._therapist),
            ("side", self._side, self._therapist), ("fixtures", "arm_fixer_1", self._therapist),
            ("belt", "", self._therapist), ("pedal", "", ""), ("estop", "", ""),
        ):  # fmt: skip
            yield {"check": check, "subject": subject, "at": (at + timedelta(minutes=2)).isoformat(), "by": by}

    def _new_run(self, session_id: UUID, position: int, taught: _Taught, at: datetime) -> RunRow:
        row = RunRow(
            id=self._id(), session_id=session_id, recording_id=taught.row.id, programme_position=position, started_at=at,
            outcome="running", resistance_level=18, speed_percent=self._asked.speed_percent, repetitions=self._asked.repetitions,
            pause_s=self._asked.pause_s, range_percent=self._asked.range_percent, method="smooth",
        )  # fmt: skip
        self._add(row)
        return row

    def _figures(self, visit: SessionRow, row: RunRow, taught: _Taught, cause: tuple[str, Text] | None) -> None:
        """Complete a run with figures only."""
        mean, spread = _RMSE_DEG
        rmse = max(0.2, self._chance.gauss(mean, spread)) + seed_course.drift_deg(
            self._course.station, row.started_at, self._now
        )
        share = 0.6 if cause else 1.0
        row.played_s = with_settings(taught.motion, self._asked).duration_s * share
        row.ended_at = row.started_at + timedelta(seconds=row.played_s)
        row.outcome = "stopped" if cause else "completed"
        row.rate_hz, row.repetitions_done, row.reversals = _RATE_HZ, int(self._asked.repetitions * share), 0
        if cause:
            row.stop_code, row.stop_message, row.stop_key = cause[0], str(cause[1]), sent_key(cause[1])
            visit.stop_count += 1
            copies = {"started_at": visit.started_at, "therapist": visit.therapist, "station": visit.station}
            self._session.add(SessionStopRow(session_id=visit.id, code=cause[0], **copies))
        else:
            row.worst_rmse_deg, row.worst_peak_deg = rmse, _PEAK_FACTOR * rmse
        self._session.flush()

    def _play(self, visit: SessionRow, row: RunRow, taught: _Taught, cause: tuple[str, Text] | None) -> None:
        """Complete a run from the samples of invented drives."""
        requested = with_settings(taught.motion, self._asked)
        count = int(requested.duration_s * _RATE_HZ * (0.6 if cause else 1.0))
        times_s = np.arange(count) / _RATE_HZ
        setpoints = requested.at(times_s)
        # The motors lag behind the setpoint, and the arm pulls slowly; both appear in the error.
        pull = self._noise.normal(0, 1, 5) * np.sin(2 * np.pi * times_s[:, None] / self._noise.uniform(3, 9, 5))
        shaking = self._noise.normal(0, 0.05, setpoints.shape)
        drift = 1.4 * seed_course.drift_deg(self._course.station, row.started_at, self._now)
        spread = np.array(_NOISE_DEG) + np.array([0, 0, 0, 0, drift])
        measured = _counts(requested.at(np.maximum(times_s - _LAG_S, 0.0)) + spread * pull + shaking)
        torque = 0.6 + 0.4 * pull + 4 * shaking
        end = JournalEnd(reason="completed")
        if cause:
            end = JournalEnd(reason="stopped", cause_code=cause[0], cause_message=str(cause[1]), cause_key=cause[1].key)
        journal = synthetic_journal(
            JournalHeader(
                kind="run",
                id=str(row.id),
                recording_id=None,
                station=self._station,
                rate_hz=_RATE_HZ,
                started_at=row.started_at,
                started_ns=0,
            ),
            times_s,
            measured,
            setpoints,
            torque,
            end,
        )
        runs.complete(self._session, journal, StationConfig(name=visit.station))

    def _assess(self, episode_id: UUID, visit: datetime) -> None:
        at = visit - timedelta(minutes=20)
        better = self._course.better(visit)
        pain = min(10, round(7 - 6 * better + (self._chance.uniform(-1, 1) if self._place >= DETAILED else 0)))
        answers: list[int | None] = [
            min(10, max(0, round(8 - 7 * better + self._chance.uniform(-1, 1)))) for _ in range(13)
        ]
        row = AssessmentRow(
            id=self._id(), episode_id=episode_id, assessed_at=at, assessed_by=self._therapist, note="",
            pain_rest=max(0, pain - 4), pain_active=pain, pain_passive=max(0, pain - 1), pain_average=max(0, pain - 2),
            spadi=answers, spadi_score=spadi.score(answers).total, updated_at=at,
        )  # fmt: skip
        self._add(row)
        other = OPPOSITE[self._side]
        for motion, position, first, healthy in _ROM:
            passive = first + (healthy - first) * better + self._chance.uniform(-3, 3)
            for side, kind, angle in (
                (self._side, "active", passive - 8), (self._side, "passive", passive),
                (other, "active", healthy - 4), (other, "passive", healthy),
            ):  # fmt: skip
                self._session.add(
                    RomRow(
                        assessment_id=row.id, side=side, motion=motion, kind=kind, position=position,
                        angle_deg=float(round(angle)),
                    )
                )  # fmt: skip
        self._session.flush()

    def _id(self) -> UUID:
        return UUID(int=self._chance.getrandbits(128), version=4)

    def _add(self, row: Any) -> None:
        self._session.add(row)
        self._session.flush()


def _counts(angles_deg: Any) -> Any:
    """Round angles to a drive's encoder counts."""
    return np.rint(np.asarray(angles_deg) / _COUNT_DEG) * _COUNT_DEG
