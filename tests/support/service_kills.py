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
    """What stands on the disk after a kill."""

    acknowledged: int
    """Changes that this service had acknowledged."""
    rows: int
    """Of the audit trail, all of them verified."""


class KilledClinic:
    """A clinic whose service is killed again and again; what it has acknowledged is known here."""

    def __init__(self, folder: Path) -> None:
        self._settings = Settings(data=folder, database_url="")
        self._cookie = signed_in_at(folder)
        self._notes: dict[str, int] = {}
        """By clinic number: which change of its notes was the last that the service has acknowledged."""

    def kill(self, after_s: float) -> Left:
        """Start the service, let everybody write, and kill it ``after_s`` after the first answer; then look."""
        port = free_port()
        command = [sys.executable, "-m", "kata", "serve", "--simulate", "--data", str(self._settings.data)]
        command += ["--port", str(port)]
        service = subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True)
        try:
            url = f"http://127.0.0.1:{port}"
            _wait_for(url, service)
            before = sum(self._notes.values())
            began, over = Event(), Event()
            # A port may come again: who writes is told apart by what has been acknowledged so far.
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
            # With what it has started, whatever has happened.
            os.killpg(service.pid, signal.SIGKILL)
            service.wait(20)
        return self._look(sum(self._notes.values()) - before)

    def _write(self, url: str, who: str, began: Event, over: Event) -> None:
        """A patient, then changes of the notes, one after the other, each known by its number; until nobody answers."""
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
                    assert over.wait(10), "the service has died of itself"
                    return

    def _look(self, acknowledged: int) -> Left:
        """As the kill has left it, before another service touches it.

        What was on its way may have been done or not, and nothing in between.
        """
        with closing(Database(self._settings.effective_database_url)) as database, database.read() as session:
            assert session.scalars(text("PRAGMA integrity_check")).all() == ["ok"]
            assert session.execute(text("PRAGMA foreign_key_check")).all() == []
            kept = {row.clinic_number: int(row.notes) for row in session.scalars(select(PatientRow))}
            lost = {
                number: change for number, change in self._notes.items() if not 0 <= kept.get(number, 0) - change <= 1
            }
            assert lost == {}, "acknowledged, and lost"
            verdict = verify(session, [self._settings.effective_audit_anchor])
            assert verdict.findings == []
            changes = sum(kept.values())
            # Each change is in the trail, and the trail speaks of none that is not there.
            assert verdict.rows >= changes
        self._notes.update(kept)
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
