"""Every day that the service shows is a day of the clinic's time zone.

All stored times are at the end of a Wednesday in UTC, when it is Thursday in the clinic. A Wednesday in an answer is a day of UTC.
"""

import json
import re
from calendar import month_abbr
from collections.abc import Callable, Iterator
from contextlib import suppress
from datetime import UTC, date, datetime, timedelta
from io import BytesIO
from itertools import islice, product
from pathlib import Path
from typing import Any, Final, get_args
from uuid import uuid4
from zipfile import ZipFile

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import Date, select

from kata.bench.commissioned import write_commissioned
from kata.clinic import tables
from kata.clinic.commissionings import service as commissionings
from kata.clinic.commissionings.tables import CommissioningRow
from kata.clinic.progress.series import Chart
from kata.clinic.sessions import checks
from kata.database.base import Base, UtcDateTime, utc_now
from kata.database.engine import Database
from kata.device.config import simulated
from tests.support.end_feel_runs import begin, ended
from tests.support.fhir_patient import treated
from tests.support.imported_runs import Clinic, pose
from tests.support.service import api_document, running

pytestmark = pytest.mark.no_apparatus

THURSDAY: Final = 3
NOT_MOVED: Final = {
    "accounts",
    "access_tokens",
    "audit",
    "episode_outcomes",
    "sign_ins",
    "spools",
    "station_hours",
    "stations",
}
"""Tables of the service itself, and figures that the service calculates from moved times."""
STATION: Final = "Station 1"
WITHOUT_RECORD: Final = {
    "get_drive_trend", "get_simulator", "get_station", "get_commissioning_run", "get_patient_questionnaire",
    "get_teaching_checklist", "get_support_bundle", "get_metrics", "get_session_filter_options",
    "get_health_idle", "get_health_ready", "get_run_rhythm", "get_run_figures",
}  # fmt: skip
"""Routes of a running apparatus or of the computer, which show no day of a record."""
MEASURED_FILES: Final = ("/samples.parquet", "/samples.mcap", "/samples.lerobot.zip")
"""Files for programs, which contain only times with their zone."""

_DAYS: Final[dict[str, Callable[[re.Match[str]], date]]] = {
    r"(?<!\d)(\d{4})-(\d\d)-(\d\d)(?!\d)": lambda found: date(*map(int, found.groups())),
    r"(\d{4})年(\d{1,2})月(\d{1,2})日": lambda found: date(*map(int, found.groups())),
    rf"(\d{{1,2}}) ({'|'.join(month_abbr[1:])})[a-z]* (\d{{4}})": lambda found: date(
        int(found[3]), [*month_abbr].index(found[2]), int(found[1])
    ),
}
_MOMENT: Final = re.compile(r"\d{4}-\d\d-\d\dT[\d:.]+(?:Z|[+-]\d\d:\d\d)")


def days_of(text: str) -> Iterator[date]:
    """Yield the days that a text shows. A complete time with its zone is no day."""
    if _MOMENT.fullmatch(text):
        return
    for pattern, as_day in _DAYS.items():
        for found in re.finditer(pattern, text):
            with suppress(ValueError):
                yield as_day(found)


def texts_of(answer: Any) -> Iterator[str]:
    if isinstance(answer, dict):
        for name, value in answer.items():
            yield from texts_of(name)
            yield from texts_of(value)
    elif isinstance(answer, list):
        for value in answer:
            yield from texts_of(value)
    elif isinstance(answer, str):
        yield answer


def shown(name: str, content: bytes) -> Iterator[str]:
    """Yield the texts of a file or an answer by its type."""
    if "zip" in name:
        with ZipFile(BytesIO(content)) as files:
            for file in files.namelist():
                yield from shown(file, files.read(file))
    elif "json" in name:
        yield from texts_of(json.loads(content))
    elif "csv" in name:
        yield from re.split(r"[,\r\n]", content.decode())
    elif "html" in name or "plain" in name:
        yield content.decode()


def of_wednesday(moment: datetime) -> datetime:
    """Return a time on the Wednesday of the week before, in its last eight hours of UTC. The order of times of one day remains."""
    day = moment.date() - timedelta(days=moment.weekday() + 7 - (THURSDAY - 1))
    since_midnight = moment - moment.replace(hour=0, minute=0, second=0, microsecond=0)
    return datetime(day.year, day.month, day.day, 16, tzinfo=UTC) + since_midnight / 3


def of_thursday(day: date) -> date:
    return day - timedelta(days=day.weekday() + 7 - THURSDAY)


def move(database: Database) -> None:
    """Move every stored time to a Wednesday in UTC, and every stored day to a Thursday."""
    for row_type in (mapper.class_ for mapper in Base.registry.mappers):
        table = row_type.__table__
        columns = [column.key for column in table.columns if isinstance(column.type, UtcDateTime | Date)]
        if table.name in NOT_MOVED or not columns:
            continue
        with database.write() as session:
            for row, name in product(session.scalars(select(row_type)), columns):
                stored = getattr(row, name)
                if isinstance(stored, datetime):
                    setattr(row, name, of_wednesday(stored))
                elif stored:
                    setattr(row, name, of_thursday(stored))


def fill(database: Database, folder: Path) -> None:
    """Write a treated patient, end-feel tests of another one, a contraindication that is signed off, and a commissioning."""
    patient_id = treated(database, sessions=3)
    at = datetime(2026, 5, 1, 9, 0, tzinfo=UTC)
    folder.mkdir()
    clinic = Clinic(folder, database)
    recording = clinic.recording(4.0, pose)
    ended(clinic, begin(clinic, recording, "baseline"), (105.0,), shoulder=False)
    for _ in range(2):
        ended(clinic, begin(clinic, recording, "test"), (68.0, 68.0, 68.0), shoulder=True)
    signed_off = {"signed_off_at": at, "signed_off_by": "Dr. Mori", "resolved_at": at, "resolved_by": "Dr. Mori"}
    record = write_commissioned(simulated("virtual"), folder / "station.toml", datetime(2026, 3, 4, 16, 30, tzinfo=UTC))
    with database.write() as session:
        session.add(
            tables.ContraindicationRow(
                id=uuid4(), patient_id=patient_id, code="recent_repair", noted_at=at, noted_by="Sato Mai", resolution="Healed.", **signed_off
            )
        )  # fmt: skip
        for finished in commissionings.finished(record):
            commissionings.add(session, STATION, finished)


def addresses(database: Database) -> Iterator[tuple[str, str]]:
    """Yield the operation id and an address of every route that reads, with ids of records of each kind."""
    kinds: dict[str, Any] = {
        "patient_id": tables.PatientRow.created_at, "episode_id": tables.EpisodeRow.opened_at, "session_id": tables.SessionRow.started_at,
        "run_id": tables.RunRow.started_at, "recording_id": tables.RecordingRow.taught_at, "programme_id": tables.ProgrammeRow.created_at,
        "assessment_id": tables.AssessmentRow.assessed_at, "commissioning_id": CommissioningRow.ended_at,
    }  # fmt: skip
    with database.read() as session:
        ids = {
            name: [str(key) for key in session.scalars(select(at.class_.id).order_by(at)).all()]
            for name, at in kinds.items()
        }
    some = {name: [found[0], found[-1]] for name, found in ids.items()} | {"chart": list(get_args(Chart))}
    for path, methods in api_document()["paths"].items():
        if "get" not in methods or path.endswith(MEASURED_FILES) or methods["get"]["operationId"] in WITHOUT_RECORD:
            continue
        name = methods["get"]["operationId"]
        query = {parameter["name"] for parameter in methods["get"].get("parameters", ()) if parameter["in"] == "query"}
        asked = ["language=en", "language=ja"] if "language" in query and not path.endswith(".pdf") else [""]
        fixed = [f"station={STATION}"] if "station" in query else []
        # The text of a PDF is that of the HTML report, so that one PDF of each kind shows the file's name.
        most = 1 if path.endswith(".pdf") else None
        for values in islice(product(*(dict.fromkeys(some[part]) for part in re.findall(r"\{(\w+)\}", path))), most):
            address = path.format(**dict(zip(re.findall(r"\{(\w+)\}", path), values, strict=True)))
            for language in asked:
                yield name, f"{address}?{'&'.join([*fixed, *([language] if language else [])])}"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    folder = tmp_path_factory.mktemp("kata")
    with running(folder, simulate=False, clinic_time_zone="Asia/Tokyo") as made:
        database: Database = made.app.state.services.database  # type: ignore[attr-defined]
        fill(database, folder / "filled")
        move(database)
        yield made


@pytest.mark.campaign
def test_every_shown_day_is_the_clinics(client: TestClient) -> None:
    database: Database = client.app.state.services.database  # type: ignore[attr-defined]
    recent = utc_now().date() - timedelta(days=1)
    counted, wrong, answered, unanswered = 0, set(), set(), set()
    for name, address in addresses(database):
        answer = client.get(address)
        if answer.status_code != 200:
            unanswered.add(name)
            continue
        answered.add(name)
        said = [answer.headers.get("content-disposition", "")]
        said += shown(answer.headers["content-type"], answer.content)
        for text in said:
            # The day on which a report is printed is today.
            days = [day for day in days_of(text) if day < recent]
            counted += len(days)
            wrong |= {(name, day.isoformat()) for day in days if day.weekday() == THURSDAY - 1}
    assert counted > 100
    assert unanswered <= answered
    assert sorted(wrong) == []


def test_age_is_that_of_the_clinics_day(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    given = {"clinic_number": "K-2", "name": "Ito Mai", "birth_date": "1976-11-26", "affected_side": "left"}
    patient_id = client.post("/api/patients", json=given).json()["id"]
    monkeypatch.setattr(checks, "utc_now", lambda: datetime(2026, 11, 25, 16, 0, tzinfo=UTC))
    assert client.get(f"/api/patients/{patient_id}/banner").json()["age_years"] == 50
