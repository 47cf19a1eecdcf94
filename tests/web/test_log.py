"""What is secret or a patient's stands in no log, whatever goes wrong."""

import logging
from typing import Any

import pytest
from fastapi.testclient import TestClient
from pydantic import ValidationError
from sqlalchemy import text

from kata.access.sign_in import COOKIE
from kata.clinic.patients import service
from kata.clinic.patients.schemas import PatientCreate

SECRET = "correct horse battery staple 7391"
NAME = "Yamada Hanako of the log"


def logged(caplog: pytest.LogCaptureFixture) -> str:
    """Every line, with its traceback, as a file of it would have it."""
    formatter = logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s")
    return "\n".join(formatter.format(record) for record in caplog.records)


def test_an_unexpected_error_is_logged_without_what_was_written(
    client: TestClient, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def create(session: Any, wanted: PatientCreate) -> None:
        session.execute(text("INSERT INTO nowhere (name, hash) VALUES (:name, :hash)"), {"name": NAME, "hash": SECRET})

    monkeypatch.setattr(service, "create", create)
    lenient = TestClient(client.app, raise_server_exceptions=False, cookies=client.cookies)
    body = {"clinic_number": "K-log", "name": NAME, "affected_side": "right"}
    with caplog.at_level(logging.INFO):
        answer = lenient.post(f"/api/patients?password={SECRET}", json=body)
    assert answer.status_code == 500
    found = logged(caplog)
    assert "nowhere" in found, "the error itself is in the log"
    for hidden in (NAME, SECRET, client.cookies[COOKIE]):
        assert hidden not in found
        assert hidden not in answer.text
    assert "Traceback" not in answer.text


def test_signing_in_is_logged_without_the_password(client: TestClient, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO):
        client.post("/api/sign-in", json={"username": "nobody", "password": SECRET})
        client.post("/api/sign-in", json={"username": "nobody", "password": [SECRET]})
        client.post("/api/sign-in/link", json={"secret": SECRET})
    assert SECRET not in logged(caplog)


def test_what_does_not_fit_is_named_without_what_it_was() -> None:
    with pytest.raises(ValidationError) as error:
        PatientCreate.model_validate({"clinic_number": NAME * 9, "name": NAME, "affected_side": NAME})
    assert NAME not in str(error.value)
