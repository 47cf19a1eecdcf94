"""``kata.client``: its addresses and types are those of the OpenAPI document, and the scripts of the documentation run on a service."""

import inspect
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final
from uuid import uuid4
from zipfile import ZipFile

import msgspec
import numpy as np
import pytest
import requests

from kata.auth.login_session import COOKIE
from kata.auth.permissions import ROUTE_RULES, TOKEN_PERMISSIONS
from kata.client import Kata, KataError, Run
from tests.support.browser_clinic import Clinic, invented_clinic
from tests.support.paths import ROOT
from tests.support.service import api_document

ID: Final = uuid4()
NOW: Final = datetime(2026, 11, 26, tzinfo=UTC)
CALLS: Final[dict[str, tuple[Any, ...]]] = {
    "patients": ("sato",),
    "patient": (ID,),
    "episodes": (ID,),
    "progress": (ID, "spadi"),
    "assessments": (ID,),
    "sessions": (NOW, NOW),
    "patient_sessions": (ID,),
    "session": (ID,),
    "recordings": (ID,),
    "run": (ID,),
    "run_samples": (ID,),
    "recording_samples": (ID,),
    "save_export": (ID, Path("none.zip")),
}
"""Every method of the client, with arguments."""
FILES: Final = {"run_samples", "recording_samples", "save_export"}
"""Methods whose answers are files."""
SCRIPTS: Final = ROOT / "docs/how-to/scripts"


def operation(url: str, names: set[str]) -> dict[str, Any]:
    """Return the operation of an address. Every parameter of the query must be documented."""
    path = url.removeprefix("https://kata.example")
    documented = [
        methods["get"]
        for template, methods in api_document()["paths"].items()
        if "get" in methods and re.fullmatch(re.sub(r"\{\w+\}", "[^/]+", template), path)
    ]
    # "filter-options" is no session's id.
    found = documented[0] if len(documented) == 1 else api_document()["paths"][path]["get"]
    assert ROUTE_RULES[found["operationId"]].needs in TOKEN_PERMISSIONS
    assert names <= {parameter["name"] for parameter in found.get("parameters", ()) if parameter["in"] == "query"}
    result: dict[str, Any] = found
    return result


def example(schema: dict[str, Any], *, empty: bool) -> Any:
    """Return a value that a schema allows. ``empty``: null wherever it is allowed."""
    if "$ref" in schema:
        return example(api_document()["components"]["schemas"][schema["$ref"].rpartition("/")[2]], empty=empty)
    if "anyOf" in schema:
        kinds = sorted(schema["anyOf"], key=lambda kind: (kind.get("type") == "null") != empty)
        return example(kinds[0], empty=empty)
    if "enum" in schema:
        return schema["enum"][-1]
    if schema["type"] == "object":
        return {name: example(field, empty=empty) for name, field in schema.get("properties", {}).items()}
    if schema["type"] == "array":
        return [example(schema["items"], empty=empty)] * schema.get("minItems", 1)
    texts = {"uuid": str(uuid4()), "date": "2026-11-26", "date-time": "2026-11-26T09:30:00Z"}
    return {
        "null": None, "boolean": True, "integer": 3, "number": 2.5, "string": texts.get(schema.get("format", ""), "text"),
    }[schema["type"]]  # fmt: skip


class Answers:
    """Answers each request with an example of what the OpenAPI document describes, as a session of ``requests``."""

    def __init__(self, *, empty: bool) -> None:
        self._empty = empty
        self.asked: list[str] = []

    def get(self, url: str, params: dict[str, Any] | None, **_: Any) -> requests.Response:
        found = operation(url, {name for name, value in (params or {}).items() if value is not None})
        self.asked.append(found["operationId"])
        answer = example(found["responses"]["200"]["content"]["application/json"]["schema"], empty=self._empty)
        if "next" in answer:
            answer["next"] = None
        response = requests.Response()
        response.status_code, response._content = 200, msgspec.json.encode(answer)
        return response


@pytest.mark.parametrize("empty", [False, True], ids=["filled", "empty"])
@pytest.mark.parametrize("method", sorted(set(CALLS) - FILES))
def test_client_reads_every_answer_that_the_api_describes(method: str, empty: bool) -> None:
    kata = Kata("https://kata.example", "kata_none")
    answers = Answers(empty=empty)
    kata._session = answers  # type: ignore[assignment]
    result = getattr(kata, method)(*CALLS[method])
    assert list(result) if isinstance(result, Iterator) else result
    assert len(answers.asked) == 1


def test_every_method_of_the_client_is_called_here() -> None:
    methods = {name for name, _ in inspect.getmembers(Kata, inspect.isfunction) if not name.startswith("_")}
    assert methods == set(CALLS)


def test_files_have_documented_addresses_for_programs() -> None:
    source = inspect.getsource(sys.modules[Kata.__module__])
    paths = re.findall(r'_get\(f"(/api/[^"]+)"', source)
    assert len(paths) == len(FILES)
    for path in paths:
        operation(f"https://kata.example{re.sub(r'{[^}]+}', str(ID), path)}", set())


def test_client_needs_nothing_of_the_service() -> None:
    code = "import sys, kata.client; print(*sorted(m for m in sys.modules if m.startswith('kata') or m in ('fastapi', 'sqlalchemy')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["kata", "kata.client"]


# -- with a service ---------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def clinic(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Clinic]:
    with invented_clinic(tmp_path_factory.mktemp("client")) as made:
        yield made


def post(clinic: Clinic, path: str, body: dict[str, Any]) -> Any:
    """Send a request as the page does."""
    answer = requests.post(f"{clinic.url}{path}", json=body, cookies={COOKIE: clinic.cookie}, timeout=60)
    assert answer.status_code == 201, answer.text
    return answer.json()


@pytest.fixture(scope="module")
def token(clinic: Clinic) -> str:
    return str(post(clinic, "/api/me/access-tokens", {"name": "Scripts", "valid_days": 1})["token"])


@pytest.fixture
def kata(clinic: Clinic, token: str) -> Iterator[Kata]:
    with Kata(clinic.url, token) as client:
        yield client


@pytest.fixture
def run_script(clinic: Clinic, token: str, tmp_path: Path) -> Callable[..., str]:
    """Return a function that runs a script of the documentation and returns what it prints."""
    file = tmp_path / "token.txt"
    file.write_text(f"{token}\n")

    def run(name: str, *arguments: str | Path) -> str:
        command = [sys.executable, SCRIPTS / f"{name}.py", clinic.url, file, *arguments]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout

    return run


def played(kata: Kata) -> Run:
    """Return a run that has samples."""
    found = (run for listed in kata.sessions() for run in kata.session(listed.id).runs if run.comparison)
    return next(found)


@pytest.mark.campaign
def test_script_lists_the_progress_of_every_patient(kata: Kata, run_script: Callable[..., str]) -> None:
    lines = dict(line.split(": ", 1) for line in run_script("list_progress").splitlines())
    assert set(lines) == {patient.clinic_number for patient in kata.patients() if patient.episode_id}
    assert lines
    for number, line in lines.items():
        (patient,) = kata.patients(number)
        sessions = list(kata.patient_sessions(patient.id))
        assert line.endswith(f"sessions: {len(sessions)}{' (simulated)' if sessions else ''}")
        totals = [
            assessment.spadi_score.total
            for assessment in kata.assessments(patient.id)
            if assessment.spadi_score and assessment.episode_id == patient.episode_id
        ]
        assert (f"SPADI {totals[-1]:.0f} to {totals[0]:.0f}" if totals else "no SPADI") in line


@pytest.mark.campaign
def test_script_plots_taught_and_played_angles(kata: Kata, run_script: Callable[..., str], tmp_path: Path) -> None:
    run, page = played(kata), tmp_path / "run.html"
    run_script("plot_run", str(run.id), page)
    text = page.read_text()
    assert "motor 5, measured" in text
    assert "(simulated apparatus)" in text
    samples = kata.run_samples(run.id)
    assert {len(values) for values in samples.values()} == {len(samples["time_s"])}
    assert np.all(np.diff(samples["time_s"]) > 0.0)
    assert not np.isnan(samples["motor_1_measured_deg"]).any()


def test_script_exports_the_patients_of_the_last_day(
    clinic: Clinic, kata: Kata, run_script: Callable[..., str], tmp_path: Path
) -> None:
    folder, patient = tmp_path / "exports", next(kata.patients())
    folder.mkdir()
    session = post(clinic, "/api/sessions", {"patient_id": str(patient.id)})
    run_script("nightly_export", folder)
    since = datetime.now(UTC) - timedelta(hours=25)
    expected = {f"{session.patient.clinic_number}.zip" for session in kata.sessions(since)}
    assert f"{patient.clinic_number}.zip" in expected
    assert {file.name for file in folder.iterdir()} == expected
    with ZipFile(folder / f"{patient.clinic_number}.zip") as archive:
        assert archive.testzip() is None
        assert any(session["id"].encode() in archive.read(name) for name in archive.namelist())


def test_refusal_names_the_service_and_its_next_step(clinic: Clinic, kata: Kata) -> None:
    with pytest.raises(KataError, match="no such") as unknown:
        kata.patient(uuid4())
    assert (unknown.value.status, unknown.value.code) == (404, "not_found")
    with Kata(clinic.url, "kata_invented") as other, pytest.raises(KataError) as refused:
        next(other.patients())
    assert (refused.value.status, refused.value.code) == (401, "token_unknown")
