"""The demonstration clinic: a dozen invented patients with months of history, which fill every page.

Nothing in it is measured: invented drives play the built-in motions. Every patient is marked as invented. The clinic is created only in a
database without patients.
"""

import random
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from typing import Any, Final
from uuid import UUID

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from kata.actor import by_program
from kata.backups import folder
from kata.clinic.assessments import spadi
from kata.clinic.assessments.tables import AssessmentRow, RomRow
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeRow, ProgrammeVersionRow
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow, TeachingRow
from kata.clinic.sessions import runs
from kata.clinic.sessions.tables import AddendumRow, RunRow, SessionRow
from kata.database.base import utc_now
from kata.database.engine import Database, DatabaseError
from kata.database.upgrade import upgrade
from kata.device.config import StationConfig
from kata.device.journal import FolderInUseError, JournalEnd, JournalHeader, synthetic_journal
from kata.motion.axes import Side
from kata.motion.builtin import built_in_motions
from kata.motion.edit import Motion, PlaybackSettings, with_settings
from kata.motion.linkage import motor_angles_deg
from kata.motion.taught import Taught
from kata.settings import Settings

MARK: Final = "Invented for the demonstration: nobody's record."
NUMBER: Final = "DEMO-"
_PEOPLE: Final = (
    ("Yamada Hanako", "ヤマダ ハナコ", "female"), ("Tanaka Ren", "タナカ レン", "male"), ("Suzuki Aoi", "スズキ アオイ", "female"),
    ("Kobayashi Ken", "コバヤシ ケン", "male"), ("Mori Yuki", "モリ ユキ", "female"), ("Abe Taro", "アベ タロウ", "male"),
    ("Ishii Nao", "イシイ ナオ", "female"), ("Kato Haru", "カトウ ハル", "male"), ("Ogawa Emi", "オガワ エミ", "female"),
    ("Hayashi Jun", "ハヤシ ジュン", "male"), ("Maeda Rin", "マエダ リン", "female"), ("Okada Sho", "オカダ ショウ", "male"),
)  # fmt: skip
_THERAPISTS: Final = ("Sato Mai", "Ito Daiki", "Watanabe Yui")
_STATION: Final = "Station 1"
_MOTIONS: Final = (3, 4, 0)
"""Indices of built-in motions: abduction, flexion, and the scapula."""
_RATE_HZ: Final = 100
_LAG_S: Final = 0.05
_COUNT_DEG: Final = 360 / 4096
_NOISE_DEG: Final = (0.15, 0.15, 0.25, 0.3, 0.6)
"""By motor. Motor 5 has the largest error, as in the paper."""
_ROM: Final = (
    ("flexion", "", 95.0, 165.0), ("abduction", "", 70.0, 160.0), ("external_rotation", "at_side", 12.0, 60.0),
    ("internal_rotation", "at_side", 35.0, 70.0),
)  # fmt: skip
"""Motion, position of the arm, first angle and the other shoulder's angle in degrees."""


class SeedError(Exception):
    """The clinic has patients already."""


FAILURES: Final = (SeedError, DatabaseError, FolderInUseError, folder.UnfinishedRestoreError, OSError)
"""Errors whose message the command prints."""


def seeded(settings: Settings, number: int, patients: int) -> int:
    """Fill the clinic of these settings and return the number of patients. No service may run on it.

    :raises SeedError: and the others of :data:`FAILURES`. Nothing is written then.
    """
    with folder.claimed_by_service(settings):
        database = Database(settings.effective_database_url)
        try:
            upgrade(database)
            return fill(database, number, utc_now(), patients)
        finally:
            database.close()


def fill(database: Database, number: int, now: datetime, patients: int = len(_PEOPLE)) -> int:
    """Fill a database and return the number of patients. The same ``number`` on the same day gives the same clinic.

    :raises SeedError: when the database has a patient, so that real and invented records are never mixed.
    """
    with by_program("seed", _STATION), database.write() as session:
        if session.scalar(select(func.count()).select_from(PatientRow)):
            raise SeedError("This clinic has patients already. Invented patients are only added to an empty clinic.")
        motions = built_in_motions()
        for place, (name, kana, sex) in enumerate(_PEOPLE[:patients]):
            chance = random.Random(f"{number} {place}")  # noqa: S311 - no secret depends on it
            _Invented(session, chance, place, now, motions).write(name, kana, sex)
    return min(patients, len(_PEOPLE))


@dataclass(frozen=True)
class _Taught:
    row: RecordingRow
    motion: Motion


class _Invented:
    """One patient with random duration, stiffness and progress of the treatment."""

    def __init__(
        self, session: Session, chance: random.Random, place: int, now: datetime, motions: tuple[Taught, ...]
    ) -> None:
        self._session = session
        self._chance = chance
        self._motions = motions
        self._place = place
        self._noise = np.random.default_rng(chance.randrange(2**32))
        self._weeks = 6 + 2 * (place % 5)
        last_day = now.date() - timedelta(days=1 + (place % 3) * 2)
        self._visits = [
            datetime.combine(last_day - timedelta(days=7 * n), time(1 + place % 7, 30), UTC)
            for n in reversed(range(self._weeks))
        ]
        self._first = self._visits[0]
        self._therapist = _THERAPISTS[place % len(_THERAPISTS)]
        self._side: Side = "left" if place % 2 else "right"

    def write(self, name: str, kana: str, sex: str) -> None:
        patient = PatientRow(
            id=self._id(), clinic_number=f"{NUMBER}{self._place + 1:03}", name=name, kana=kana, sex=sex, notes=MARK,
            birth_date=date(1950 + self._chance.randrange(30), 1 + self._chance.randrange(12), 15), dominant_side="right",
            created_at=self._first, updated_at=self._first,
        )  # fmt: skip
        self._add(patient)
        episode = self._episode(patient.id)
        taught = [self._teach(patient.id, motion) for motion in _MOTIONS[:: 1 + self._place % 2][:2]]
        version = self._programme(episode.id, taught)
        for nth, at in enumerate(self._visits):
            self._visit(patient.id, episode.id, version, taught, nth, at)
        for nth in (*range(0, self._weeks - 1, 2), self._weeks - 1):
            self._assess(episode.id, nth)

    def _better(self, week: float) -> float:
        """Return the improvement by a week, as a fraction of the difference from the other shoulder."""
        return min(0.85, 0.07 * week)

    def _episode(self, patient_id: UUID) -> EpisodeRow:
        onset = self._first.date() - timedelta(days=60 + self._chance.randrange(120))
        row = EpisodeRow(
            id=self._id(), patient_id=patient_id, side=self._side, diagnosis="Frozen shoulder", onset_on=onset,
            limits=[{"motion": 4, "lowest_deg": None, "highest_deg": 120.0}], max_load_level=20,
            limits_by="Dr. Nakamura", opened_at=self._first - timedelta(days=1), updated_at=self._first,
        )  # fmt: skip
        self._add(row)
        for stage, since in (("freezing", onset), ("frozen", self._first.date() - timedelta(days=10))):
            self._add(StageRow(id=self._id(), episode_id=row.id, stage=stage, since=since, noted_at=self._first))
        if self._weeks > 8:
            thawing = self._visits[len(self._visits) // 2]
            self._add(
                StageRow(id=self._id(), episode_id=row.id, stage="thawing", since=thawing.date(), noted_at=thawing)
            )
        return row

    def _teach(self, patient_id: UUID, number: int) -> _Taught:
        built_in = self._motions[number]
        at = self._first + timedelta(minutes=5 + 5 * number)
        row = TeachingRow(
            id=self._id(), patient_id=patient_id, name=built_in.name[2:], side=self._side, taught_by=self._therapist,
            fixtures=["arm_fixer_1"], started_at=at,
        )  # fmt: skip
        self._add(row)
        # A stiff shoulder allows a smaller range.
        rest = built_in.poses_deg[0]
        poses = rest + (0.45 + 0.1 * self._chance.random()) * (built_in.poses_deg - rest)
        angles = motor_angles_deg(poses, self._side)
        nothing = np.zeros_like(angles)
        end = JournalEnd(reason="finished")
        journal = synthetic_journal(
            JournalHeader(
                kind="teaching",
                id=str(row.id),
                recording_id=None,
                station=_STATION,
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
            id=self._id(), episode_id=episode_id, name="Range of motion", created_at=self._first, updated_at=self._first
        )
        self._add(programme)
        version = ProgrammeVersionRow(
            id=self._id(), programme_id=programme.id, number=1, made_at=self._first, made_by=self._therapist,
            note="", timer_minutes=30.0, sessions_per_week=1,
        )  # fmt: skip
        self._add(version)
        for position, one in enumerate(taught, start=1):
            self._add(
                ProgrammeItemRow(
                    version_id=version.id, position=position, recording_id=one.row.id, speed_percent=100.0, repetitions=1,
                    pause_s=0.0, range_percent=90.0, load_level=18, method="smooth",
                    duration_s=with_settings(one.motion, PlaybackSettings(100.0, 1, 0.0, 90.0)).duration_s,
                )
            )  # fmt: skip
        return version

    def _visit(
        self,
        patient_id: UUID,
        episode_id: UUID,
        version: ProgrammeVersionRow,
        taught: list[_Taught],
        nth: int,
        at: datetime,
    ) -> None:
        better = self._better(nth)
        before = max(1, round(7 - 6 * better + self._chance.uniform(-1, 1)))
        ended, signed = at + timedelta(minutes=35), at + timedelta(minutes=40)
        stopped = self._chance.random() < 0.06
        row = SessionRow(
            id=self._id(), patient_id=patient_id, episode_id=episode_id, programme_version_id=version.id,
            therapist=self._therapist, station=_STATION, started_at=at, ended_at=ended, checks=list(self._checks(at)),
            pain_before=before, pain_during=min(10, before + 1), pain_after=max(0, before - 1),
            end_reason="completed", note=_note(better, stopped), signed_at=signed, signed_by=self._therapist,
            run_count=len(taught), updated_at=signed,
        )  # fmt: skip
        self._add(row)
        for position, one in enumerate(taught, start=1):
            self._run(row.id, position, one, at + timedelta(minutes=6 * position), stopped and position == len(taught))
        if stopped:
            self._add(
                AddendumRow(
                    id=self._id(), session_id=row.id, written_at=ended + timedelta(hours=2), written_by=self._therapist,
                    text="Asked by telephone: no pain since.",
                )
            )  # fmt: skip

    def _checks(self, at: datetime) -> Iterator[dict[str, Any]]:
        for check, subject, by in (
            ("side", self._side, self._therapist), ("fixtures", "arm_fixer_1", self._therapist),
            ("belt", "", self._therapist), ("pedal", "", ""), ("estop", "", ""),
        ):  # fmt: skip
            yield {"check": check, "subject": subject, "at": (at + timedelta(minutes=2)).isoformat(), "by": by}

    def _run(self, session_id: UUID, position: int, taught: _Taught, at: datetime, stopped: bool) -> None:
        asked = PlaybackSettings(100.0, 1, 0.0, 90.0)
        row = RunRow(
            id=self._id(), session_id=session_id, recording_id=taught.row.id, programme_position=position, started_at=at,
            outcome="running", load_level=18, speed_percent=asked.speed_percent, repetitions=asked.repetitions,
            pause_s=asked.pause_s, range_percent=asked.range_percent, method="smooth",
        )  # fmt: skip
        self._add(row)
        wanted = with_settings(taught.motion, asked)
        count = int(wanted.duration_s * _RATE_HZ * (0.6 if stopped else 1.0))
        times_s = np.arange(count) / _RATE_HZ
        setpoints = wanted.at(times_s)
        # The motors lag behind the setpoint, and the arm pulls slowly, which shows in the error.
        pull = self._noise.normal(0, 1, 5) * np.sin(2 * np.pi * times_s[:, None] / self._noise.uniform(3, 9, 5))
        shaking = self._noise.normal(0, 0.05, setpoints.shape)
        measured = _counts(wanted.at(np.maximum(times_s - _LAG_S, 0.0)) + np.array(_NOISE_DEG) * pull + shaking)
        torque = 0.6 + 0.4 * pull + 4 * shaking
        end = JournalEnd(reason="completed")
        if stopped:
            end = JournalEnd(reason="stopped", cause_code="operator_stop", cause_message="Stopped by the operator.")
        journal = synthetic_journal(
            JournalHeader(
                kind="run",
                id=str(row.id),
                recording_id=None,
                station=_STATION,
                rate_hz=_RATE_HZ,
                started_at=at,
                started_ns=0,
            ),
            times_s,
            measured,
            setpoints,
            torque,
            end,
        )
        runs.complete(self._session, journal, StationConfig(name=_STATION))

    def _assess(self, episode_id: UUID, week: int) -> None:
        at = self._first + timedelta(days=7 * week, minutes=-20)
        better = self._better(week)
        pain = round(7 - 6 * better)
        answers: list[int | None] = [max(0, round(8 - 7 * better + self._chance.uniform(-1, 1))) for _ in range(13)]
        row = AssessmentRow(
            id=self._id(), episode_id=episode_id, assessed_at=at, assessed_by=self._therapist, note="",
            pain_rest=max(0, pain - 4), pain_active=pain, pain_passive=max(0, pain - 1), pain_average=max(0, pain - 2),
            spadi=answers, spadi_score=spadi.score(answers).total, updated_at=at,
        )  # fmt: skip
        self._add(row)
        other: Side = "left" if self._side == "right" else "right"
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


def _note(better: float, stopped: bool) -> str:
    went = "Still stiff; the shoulder blade helps early." if better < 0.3 else "Moves more freely than last week."
    return f"{went} The last motion was stopped at the patient's wish." if stopped else went


def _counts(angles_deg: Any) -> Any:
    """Round angles to a drive's encoder counts."""
    return np.rint(np.asarray(angles_deg) / _COUNT_DEG) * _COUNT_DEG
