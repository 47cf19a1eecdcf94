"""Client for scripts. It reads a clinic's records with an access token.

    with Kata("https://station-1.clinic.example", token) as kata:
        for patient in kata.patients():
            print(patient.clinic_number, patient.name)

The structures contain only those fields of the same version's API that scripts need. ``tests/api/test_client.py`` compares them with the
OpenAPI document.
"""

from collections.abc import Iterator
from datetime import date, datetime
from io import BytesIO
from pathlib import Path
from typing import Any, Final, Generic, Literal, Self, TypeVar
from uuid import UUID

import msgspec
import numpy as np
import requests
from arro3.io import read_parquet
from numpy.typing import NDArray

from kata import __version__

Side = Literal["left", "right"]
Chart = Literal[
    "rom", "pain", "spadi", "questionnaires", "tracking", "correction", "adherence", "end_feel", "end_range"
]
_Read = TypeVar("_Read")
_LIMIT_S: Final = 60.0
"""Longest wait for an answer in seconds. An export of a record with hours of samples takes tens of seconds."""
_PAGE: Final = 200
_CHUNK: Final = 1 << 20


class KataError(Exception):
    """The service has refused a request. The message is the service's sentence and its next step."""

    def __init__(self, status: int, code: str, message: str) -> None:
        """``status``: HTTP status. ``code``: code of the problem, such as ``restricted``."""
        super().__init__(message)
        self.status, self.code = status, code


class Patient(msgspec.Struct, frozen=True):
    """A patient. If the record is restricted, users outside its team get only number and name."""

    id: UUID
    clinic_number: str
    name: str
    kana: str | None
    birth_date: date | None
    sex: str
    affected_side: Side | None
    episode_id: UUID | None
    """Id of the open episode, else of the last one."""
    archived_at: datetime | None
    restricted: bool


class Episode(msgspec.Struct, frozen=True):
    """An episode of care."""

    id: UUID
    patient_id: UUID
    side: Side
    diagnosis: str
    diagnosis_code: str
    onset_on: date | None
    opened_at: datetime
    closed_at: datetime | None


class ProgressColumn(msgspec.Struct, frozen=True):
    """A column of a progress table."""

    name: str
    """Name of the column with its unit."""
    kind: Literal["text", "moment", "number"]


class ProgressTable(msgspec.Struct, frozen=True):
    """The values of a progress chart."""

    columns: list[ProgressColumn]
    rows: list[list[str | float | None]]


class Progress(msgspec.Struct, frozen=True):
    """A progress chart as a table."""

    table: ProgressTable
    simulated: bool
    """True if a simulated apparatus made some of the values."""


class RomEntry(msgspec.Struct, frozen=True):
    """A measured range of motion."""

    side: Side
    motion: str
    kind: str
    """active or passive"""
    position: str
    angle_deg: float


class SpadiScore(msgspec.Struct, frozen=True):
    """The score of a SPADI questionnaire, 0 (best) to 100."""

    pain: float | None
    disability: float | None
    total: float | None


class Assessment(msgspec.Struct, frozen=True):
    """An assessment. Pain is 0 (none) to 10."""

    id: UUID
    episode_id: UUID
    assessed_at: datetime
    assessed_by: str
    rom: list[RomEntry]
    pain_rest: int | None
    pain_active: int | None
    pain_passive: int | None
    pain_average: int | None
    spadi_score: SpadiScore | None
    note: str
    withdrawn_at: datetime | None
    """Time at which the assessment was marked as entered by mistake."""


class SessionPatient(msgspec.Struct, frozen=True):
    """The patient of a session."""

    id: UUID
    name: str
    clinic_number: str


class SessionSummary(msgspec.Struct, frozen=True):
    """A session in a list."""

    id: UUID
    patient: SessionPatient
    started_at: datetime
    ended_at: datetime | None
    therapist: str
    station: str
    runs: int
    stops: int
    simulated: bool


class MotorTracking(msgspec.Struct, frozen=True):
    """The error of one motor during a run."""

    motor: int
    rmse_deg: float
    peak_deg: float


class Comparison(msgspec.Struct, frozen=True):
    """Played and taught angles of a run, compared."""

    samples: int
    motors: list[MotorTracking]


class Run(msgspec.Struct, frozen=True):
    """A playback of a recording."""

    id: UUID
    session_id: UUID
    recording_id: UUID
    recording_name: str
    started_at: datetime
    ended_at: datetime | None
    outcome: str
    method: str | None
    rate_hz: int | None
    speed_percent: float
    repetitions: int
    repetitions_done: int | None
    reversals: int | None
    comparison: Comparison | None


class Session(msgspec.Struct, frozen=True):
    """A session with its runs."""

    id: UUID
    patient: SessionPatient
    episode_id: UUID | None
    side: Side | None
    therapist: str
    station: str
    started_at: datetime
    ended_at: datetime | None
    pain_before: int | None
    pain_during: int | None
    pain_after: int | None
    note: str
    signed_at: datetime | None
    runs: list[Run]
    simulated: bool


class Recording(msgspec.Struct, frozen=True):
    """A taught motion."""

    id: UUID
    patient_id: UUID
    name: str
    side: Side
    station: str
    taught_by: str
    taught_at: datetime
    duration_s: float
    rate_hz: int
    samples: int
    simulated: bool
    archived_at: datetime | None


class _Page(msgspec.Struct, Generic[_Read], frozen=True):
    items: list[_Read]
    next: str | None


class _Problem(msgspec.Struct, frozen=True):
    detail: str
    code: str
    next_step: str


class Kata:
    """A service of Kata, read with an access token of one of its users (*My account, Access tokens for scripts*)."""

    def __init__(self, url: str, token: str, certificate: Path | None = None) -> None:
        """Make a client. This sends nothing.

        :param url: the address of the page, such as ``https://station-1.clinic.example``.
        :param certificate: file (PEM) of the service's own certificate, if no authority that this computer knows has signed it.
        """
        self._url = url.rstrip("/")
        self._session = requests.Session()
        self._session.headers.update({"Authorization": f"Bearer {token}", "User-Agent": f"kata.client/{__version__}"})
        # Otherwise a .netrc file would replace the token.
        self._session.trust_env = False
        if certificate:
            self._session.verify = str(certificate)

    def __enter__(self) -> Self:
        """Return the client."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the client's connections."""
        self._session.close()

    def patients(self, search: str = "", *, archived: bool = False) -> Iterator[Patient]:
        """Yield the patients.

        :param search: parts of names and numbers; empty: all patients.
        :param archived: yield the archived patients instead.
        """
        return self._pages(Patient, "/api/patients", search=search or None, archived=archived or None)

    def patient(self, patient_id: UUID) -> Patient:
        """Return a patient."""
        return self._read(Patient, f"/api/patients/{patient_id}")

    def episodes(self, patient_id: UUID) -> Iterator[Episode]:
        """Yield a patient's episodes of care."""
        return self._pages(Episode, f"/api/patients/{patient_id}/episodes", limit=None)

    def progress(self, episode_id: UUID, chart: Chart) -> Progress:
        """Return a progress chart of an episode as a table."""
        return self._read(Progress, f"/api/episodes/{episode_id}/progress/{chart}")

    def assessments(self, patient_id: UUID) -> Iterator[Assessment]:
        """Yield a patient's assessments, newest first."""
        return self._pages(Assessment, f"/api/patients/{patient_id}/assessments")

    def sessions(self, since: datetime | None = None, until: datetime | None = None) -> Iterator[SessionSummary]:
        """Yield the sessions of the clinic, newest first. ``since`` and ``until`` need a time zone."""
        return self._pages(
            SessionSummary,
            "/api/sessions",
            since=since.isoformat() if since else None,
            until=until.isoformat() if until else None,
        )

    def patient_sessions(self, patient_id: UUID) -> Iterator[SessionSummary]:
        """Yield a patient's sessions, newest first."""
        return self._pages(SessionSummary, f"/api/patients/{patient_id}/sessions")

    def session(self, session_id: UUID) -> Session:
        """Return a session with its runs."""
        return self._read(Session, f"/api/sessions/{session_id}")

    def recordings(self, patient_id: UUID) -> Iterator[Recording]:
        """Yield the motions that were taught with a patient."""
        return self._pages(Recording, f"/api/patients/{patient_id}/recordings")

    def run(self, run_id: UUID) -> Run:
        """Return a run."""
        return self._read(Run, f"/api/runs/{run_id}")

    def run_samples(self, run_id: UUID) -> dict[str, NDArray[np.float64]]:
        """Return the samples of a run by column, such as ``time_s`` and ``motor_1_measured_deg``. A missing value is NaN."""
        return _columns(self._get(f"/api/runs/{run_id}/samples.parquet").content)

    def recording_samples(self, recording_id: UUID) -> dict[str, NDArray[np.float64]]:
        """Return the samples of a recording by column, such as ``time_s`` and ``motor_1_deg``. A missing value is NaN."""
        return _columns(self._get(f"/api/recordings/{recording_id}/samples.parquet").content)

    def save_export(self, patient_id: UUID, file: Path) -> None:
        """Save a patient's complete record as a ZIP file. If the export is interrupted, an existing file stays unchanged."""
        partial = file.with_name(f"{file.name}.part")
        with self._get(f"/api/patients/{patient_id}/export.zip", stream=True) as answer, partial.open("wb") as opened:
            for chunk in answer.iter_content(_CHUNK):
                opened.write(chunk)
        partial.replace(file)

    def _read(self, kind: type[_Read], path: str) -> _Read:
        return msgspec.json.decode(self._get(path).content, type=kind)

    def _pages(self, kind: type[_Read], path: str, limit: int | None = _PAGE, **query: Any) -> Iterator[_Read]:
        """Yield the items of all pages. ``limit``: items per page; None for a list without pages."""
        page = _Page[kind]([], "")  # type: ignore[valid-type]
        while page.next is not None:
            answer = self._get(path, query | {"limit": limit, "after": page.next or None})
            page = msgspec.json.decode(answer.content, type=_Page[kind])  # type: ignore[valid-type]
            yield from page.items

    def _get(self, path: str, query: dict[str, Any] | None = None, *, stream: bool = False) -> requests.Response:
        """Return the answer to a request.

        :raises KataError: when the service refuses it.
        """
        answer = self._session.get(
            f"{self._url}{path}", params=query, timeout=_LIMIT_S, stream=stream, allow_redirects=False
        )
        if answer.status_code == 200:
            return answer
        try:
            problem = msgspec.json.decode(answer.content, type=_Problem)
        except msgspec.MsgspecError as error:
            raise KataError(answer.status_code, "", f"{self._url} answered {answer.status_code}.") from error
        raise KataError(answer.status_code, problem.code, f"{problem.detail} {problem.next_step}".strip())


def _columns(parquet: bytes) -> dict[str, NDArray[np.float64]]:
    table = read_parquet(BytesIO(parquet)).read_all()
    # None becomes NaN.
    return {name: np.array(table[name].to_pylist(), dtype=np.float64) for name in table.schema.names}
