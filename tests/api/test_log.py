"""The log contains no secret and no patient's data, also after errors."""

import json
import logging
from typing import Any

import pytest
from fastapi.testclient import TestClient
from pydantic import ValidationError
from sqlalchemy import text

from kata.api import logs
from kata.api.logs import JsonLines, Lines
from kata.audit.audit_log import AUDIT_ROW_LOGGER
from kata.audit.tables import AuditRow
from kata.auth.login_session import COOKIE
from kata.clinic.patients import service
from kata.clinic.patients.schemas import PatientCreate

pytestmark = pytest.mark.no_apparatus

SECRET = "correct horse battery staple 7391"
NAME = "Yamada Hanako of the log"


def logged(caplog: pytest.LogCaptureFixture) -> str:
    """Return all log lines with their tracebacks, as in a file."""
    formatter = logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s")
    return "\n".join(formatter.format(record) for record in caplog.records)


def test_unexpected_error_is_logged_without_the_users_input(
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


def test_every_audit_row_is_a_line_of_the_collected_log(client: TestClient, caplog: pytest.LogCaptureFixture) -> None:
    """A collected log cannot be changed afterwards. Neither log nor trail contains values of fields."""
    app: Any = client.app
    body = {"clinic_number": "K-told", "name": NAME, "affected_side": "right"}
    with caplog.at_level(logging.INFO, logger=AUDIT_ROW_LOGGER):
        made = client.post("/api/patients", json=body).json()
        assert client.get(f"/api/patients/{made['id']}").status_code == 200
        assert app.state.services.audit_log.until_written()
    lines = [json.loads(JsonLines().format(record)) for record in caplog.records if record.name == AUDIT_ROW_LOGGER]
    answer = {line["message"]: line["audit"] for line in lines}
    row = answer["create_patient done"]
    assert (row["patient_id"], row["role"], row["who"]) == (made["id"], "administrator", "Test administrator")
    with app.state.services.database.read() as session:
        stands = session.get_one(AuditRow, row["number"])
        assert (stands.action, stands.hash.hex()) == ("create_patient", row["hash"])
    assert answer["get_patient done"]["number"] > row["number"]
    assert NAME not in json.dumps(lines, ensure_ascii=False)


def test_plain_log_omits_audit_rows() -> None:
    before = logging.getLogger(AUDIT_ROW_LOGGER).level
    handlers = list(logging.getLogger().handlers)
    try:
        logs.begin("json")
        assert logging.getLogger(AUDIT_ROW_LOGGER).isEnabledFor(logging.INFO)
        logs.begin("plain")
        assert not logging.getLogger(AUDIT_ROW_LOGGER).isEnabledFor(logging.INFO)
    finally:
        logging.getLogger(AUDIT_ROW_LOGGER).setLevel(before)
        logging.getLogger().handlers[:] = handlers


def test_log_line_stays_one_line_whatever_it_contains() -> None:
    record = logging.LogRecord("kata", logging.INFO, "", 0, "a name\nand %s", ("2026 CRITICAL forged\r\n",), None)
    formatted = JsonLines().format(record)
    assert "\n" not in formatted
    assert "\r" not in formatted
    assert "\n" not in Lines().format(record)
    assert "\r" not in Lines().format(record)


def test_validation_error_does_not_contain_the_invalid_value() -> None:
    with pytest.raises(ValidationError) as error:
        PatientCreate.model_validate({"clinic_number": NAME * 9, "name": NAME, "affected_side": NAME})
    assert NAME not in str(error.value)


def test_a_wrong_log_call_does_not_fail_its_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logging, "raiseExceptions", False)
    recent = logs.RecentLines(2)
    recent.handle(logging.LogRecord("kata", logging.INFO, __file__, 1, "%d sessions", ("no number",), None))
    recent.handle(logging.LogRecord("kata", logging.INFO, __file__, 1, "%d sessions", (3,), None))
    assert recent.text().endswith("INFO kata: 3 sessions\n")
    assert len(recent.text().splitlines()) == 1
