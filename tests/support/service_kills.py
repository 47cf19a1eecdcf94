"""One `kill -9` of the service during writes, and a check that every acknowledged change remains."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Thread
from typing import Any, Final

import httpx2
from sqlalchemy import select, text

from kata.audit.verify import verify
from kata.auth.login_session import COOKIE
from kata.clinic.patients.tables import PatientRow
from kata.database.engine import Database
from kata.settings import Settings
from tests.support.login import signed_in_at
from tests.support.ports import free_port

_WRITERS: Final = 4
_START_LIMIT_S: Final = 120.0
_ACTIVE: Final = {"X-Kata-Active": "1"}


@dataclass(frozen=True)
class Left:
    """The state on disk after a kill."""

    acknowledged: int
    """Changes that the service had acknowledged."""
    rows: int
    """Rows of the audit trail, all verified."""


class KilledClinic:
    """A clinic whose service is killed repeatedly; records the acknowledged changes."""

    def __init__(self, folder: Path) -> None:
        self._settings = Settings(data=folder, database_url="")
        self._cookie = signed_in_at(folder)
        self._notes: dict[str, int] = {}
        """Number of the last acknowledged change of the notes, by clinic number."""

    def kill(self, after_s: float) -> Left:
        """Start the service, let the clients write, kill it ``after_s`` after the first answer, and check."""
        port = free_port()
        command = [sys.executable, "-m", "kata", "serve", "--simulate", "--data", str(self._settings.data)]
        command += ["--port", str(port)]
        service = subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True)
        try:
            url = f"http://127.0.0.1:{port}"
            _wait_for(url, service)
            before = sum(self._notes.values())
            began, over = Event(), Event()
            # A port may be used again: distinguish clients by the number of acknowledged changes.
            writers = [Thread(target=self._write, args=(url, f"{before}-{n}", began, over)) for n in range(_WRITERS)]
            for writer in writers:
                writer.start()
            assert began.wait(_START_LIMIT_S)
            over.wait(after_s)
            os.kill(service.pid, signal.SIGKILL)
            over.set()
            for writer in writers:
                writer.join()
        finally:
            # With its child processes, in any case.
            os.killpg(service.pid, signal.SIGKILL)
            service.wait(20)
        return self._look(sum(self._notes.values()) - before)

    def _write(self, url: str, who: str, began: Event, over: Event) -> None:
        """Create a patient, then change the notes repeatedly, numbering each change, until the service does not answer."""
        with httpx2.Client(base_url=url, cookies={COOKIE: self._cookie}, headers=_ACTIVE, timeout=20) as client:
            for number in range(1_000_000):
                clinic_number = f"K-{who}-{number}"
                body: Any = {"clinic_number": clinic_number, "name": "N", "affected_side": "left", "notes": "1"}
                try:
                    made = client.post("/api/patients", json=body)
                    assert made.status_code == 201, made.text
                    self._notes[clinic_number] = 1
                    began.set()
                    for change in range(2, 5):
                        done = client.patch(f"/api/patients/{made.json()['id']}", json={"notes": str(change)})
                        assert done.status_code == 200, done.text
                        self._notes[clinic_number] = change
                except httpx2.TransportError:
                    assert over.wait(10), "the service ended without the kill"
                    return

    def _look(self, acknowledged: int) -> Left:
        """Check the database after the kill, before another service opens it.

        A request during the kill must have had its full effect or none.
        """
        with closing(Database(self._settings.effective_database_url)) as database, database.read() as session:
            assert session.scalars(text("PRAGMA integrity_check")).all() == ["ok"]
            assert session.execute(text("PRAGMA foreign_key_check")).all() == []
            notes = {row.clinic_number: int(row.notes) for row in session.scalars(select(PatientRow))}
            lost = {
                number: change for number, change in self._notes.items() if not 0 <= notes.get(number, 0) - change <= 1
            }
            assert lost == {}, "an acknowledged change is lost"
            verdict = verify(session, [self._settings.effective_audit_anchor])
            assert verdict.findings == []
            changes = sum(notes.values())
            # The trail contains each change, and no other change.
            assert verdict.rows >= changes
        self._notes.update(notes)
        return Left(acknowledged, verdict.rows)


def _wait_for(url: str, service: "subprocess.Popen[bytes]") -> None:
    _until(lambda: _answers(url), service)


def _answers(url: str) -> bool:
    try:
        return httpx2.get(f"{url}/health/live", timeout=2).status_code == 200
    except httpx2.TransportError:
        return False


def _until(condition: Callable[[], bool], service: "subprocess.Popen[bytes]") -> None:
    limit = time.monotonic() + _START_LIMIT_S
    while not condition():
        assert service.poll() is None, "the service did not start"
        assert time.monotonic() < limit
        time.sleep(0.05)
