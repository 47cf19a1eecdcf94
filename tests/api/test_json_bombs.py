"""JSON and FHIR that are expensive to read: refused with a clear answer, and a Stop is answered meanwhile."""

import asyncio
import gc
import json
import threading
import time
from collections.abc import Iterator
from typing import Any, Final

import pytest
from fastapi.testclient import TestClient

from kata.api import body_limits
from kata.interop import fhir_import
from tests.support.responses import problem
from tests.support.service import running

_FHIR: Final = "/api/patients/import/fhir?affected_side=right"
_FHIR_JSON: Final = {"content-type": "application/fhir+json"}
_LONGEST_BLOCK_S: Final = 1.0
"""Far above what the loop needs, and far below the seconds for which each of these files blocked it."""
_MANY_LISTS: Final = b'{"resourceType": "Patient", "photo": [' + b"[]," * (3 << 20) + b"[]]}"


_SERVICES_THRESHOLDS: Final = (700, 10, 10)
"""Thresholds of the garbage collection in a service: Python's own."""


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """Return a service without an apparatus whose device process answers, and that collects garbage as often as a clinic's."""
    before = gc.get_threshold()
    gc.set_threshold(*_SERVICES_THRESHOLDS)
    with running(tmp_path_factory.mktemp("kata"), simulate=False, starts_device=True) as made:
        yield made
    gc.set_threshold(*before)


class _Loop:
    """Measures for how long the service's event loop did nothing else."""

    def __init__(self, client: TestClient) -> None:
        self.longest_s = 0.0
        assert client.portal is not None
        self._task = client.portal.start_task_soon(self._tick)

    def stop(self) -> None:
        self._task.cancel()

    async def _tick(self) -> None:
        while True:
            before = time.perf_counter()
            await asyncio.sleep(0.005)
            self.longest_s = max(self.longest_s, time.perf_counter() - before)


@pytest.fixture
def loop(client: TestClient) -> Iterator[_Loop]:
    measured = _Loop(client)
    yield measured
    measured.stop()
    assert measured.longest_s < _LONGEST_BLOCK_S


def _patient(element: bytes) -> bytes:
    return b'{"resourceType": "Patient", ' + element + b"}"


@pytest.mark.parametrize(
    ("content", "code", "said"),
    [
        (b"[" * 900_000, "invalid", "nested"),
        (_patient(b'"birthDate": ' + b"[" * 5000 + b"]" * 5000), "invalid", "nested"),
        (_MANY_LISTS, "invalid", f"{fhir_import.MOST_PARTS} values"),
        (b'{"resourceType": "Bundle", "entry": [' + b"{}," * 2_000_000 + b"{}]}", "invalid", "values"),
        (_patient(b'"birthDate": ' + b"1" * 1_000_000), "invalid", "number"),
        (_patient(b'"birthDate": NaN'), "invalid", "number"),
        (_patient(b'"active": true, "active": false'), "invalid", "same name"),
        (_patient(b'"birthDate": 1e999999999'), "not_understood", "birthDate"),
        (_patient(b'"name": [{"text": "' + b"a" * (8 << 20) + b'"}]'), "not_understood", "identifier"),
        (_patient(b'"gender": "' + b"a" * (8 << 20) + b'"'), "not_understood", "gender"),
        (b"{}" + b" " * (8 << 20), "not_understood", "resourceType"),
        (b"[]", "invalid", "JSON object"),
        (b"", "invalid", "JSON object"),
        (b"\xff\xfe{}", "invalid", "JSON object"),
    ],
    ids=[
        "lists", "deep", "many lists", "entries", "digits", "nan", "twice", "infinite", "name", "gender", "blank", "list", "empty",
        "utf-16",
    ],
)  # fmt: skip
def test_expensive_fhir_is_refused_and_the_loop_goes_on(
    client: TestClient, loop: _Loop, content: bytes, code: str, said: str
) -> None:
    answer = client.post(_FHIR, content=content, headers=_FHIR_JSON)
    assert said in str(problem(answer, 422, code))
    assert len(answer.content) < 10_000


def test_unknown_elements_are_named_only_up_to_a_limit(client: TestClient, loop: _Loop) -> None:
    content = _patient(b", ".join(b'"_%d": 0' % number for number in range(100_000)))
    refusal = problem(client.post(_FHIR, content=content, headers=_FHIR_JSON), 422, "not_understood")
    assert len(refusal["errors"]) == fhir_import.MOST_PLACES


def test_contained_resources_that_refer_to_each_other_are_not_followed(client: TestClient, loop: _Loop) -> None:
    patient: dict[str, Any] = {
        "resourceType": "Patient",
        "identifier": [{"value": "bomb-1", "assigner": {"reference": "#a"}}],
        "name": [{"text": "A"}],
        "contained": [
            {"resourceType": "Patient", "id": "a", "generalPractitioner": {"reference": "#b"}},
            {"resourceType": "Patient", "id": "b", "generalPractitioner": {"reference": "#a"}},
        ],
        "generalPractitioner": [{"reference": "#a"}, {"reference": "http://127.0.0.1:9/"}],
    }
    others = [{"resource": {"resourceType": "Group"}}] * 400
    bundle = {"resourceType": "Bundle", "entry": [{"resource": patient}, *others]}
    answer = client.post(_FHIR, content=json.dumps(bundle), headers=_FHIR_JSON)
    assert answer.status_code == 201, answer.text
    left_out = answer.json()["left_out"]
    assert len(left_out) == fhir_import.MOST_PLACES
    assert answer.json()["left_out_further"] == 402 - fhir_import.MOST_PLACES


def test_stop_is_answered_while_a_large_file_is_read(client: TestClient, loop: _Loop) -> None:
    statuses: list[int] = []
    sending = threading.Thread(
        target=lambda: statuses.append(client.post(_FHIR, content=_MANY_LISTS, headers=_FHIR_JSON).status_code)
    )
    sending.start()
    longest_s = 0.0
    while sending.is_alive():
        before = time.perf_counter()
        assert client.post("/api/station/stop").status_code == 200
        longest_s = max(longest_s, time.perf_counter() - before)
    assert statuses == [422]
    assert longest_s < 2 * _LONGEST_BLOCK_S


def test_a_motion_file_sent_as_json_is_not_parsed(client: TestClient, loop: _Loop) -> None:
    path = "/api/patients/00000000-0000-0000-0000-000000000000/recordings/import/preview?side=right"
    answer = client.post(path, content=_MANY_LISTS, headers={"content-type": "application/json"})
    problem(answer, 413, "content_too_large")


@pytest.mark.parametrize("kind", ["application/json", "application/fhir+json", "text/plain"])
def test_a_form_of_many_values_is_refused(client: TestClient, loop: _Loop, kind: str) -> None:
    body = b"[" + b"[]," * body_limits.MOST_PARTS + b"[]]"
    answer = client.post("/api/patients", content=body, headers={"content-type": kind})
    problem(answer, 413, "content_too_large")


@pytest.mark.parametrize("path", ["/api/patients", "/api/sign-in"])
def test_only_the_first_of_many_invalid_fields_are_described(client: TestClient, loop: _Loop, path: str) -> None:
    body = b"{" + b",".join(b'"%d":0' % number for number in range(6000)) + b"}"
    answer = client.post(path, content=body, headers={"content-type": "application/json"})
    assert len(problem(answer, 422, "invalid")["errors"]) == 50
    assert len(answer.content) < 50_000
