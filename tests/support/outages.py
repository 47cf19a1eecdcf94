"""Stations that share one database and continue treatment during outages, and a comparison of their record with the database."""

import logging
import random
import re
import time
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path
from threading import Event, Thread
from typing import Any, Final
from urllib.error import URLError
from uuid import UUID, uuid4

import httpx2
import numpy as np
from sqlalchemy import delete, inspect, select, update
from sqlalchemy.orm import Session

from kata.audit.verify import verify
from kata.bench.page_load import page_load
from kata.bench.records import BenchRecords
from kata.bench.running_service import BenchError, RunningService, prepare_records
from kata.clinic.events.observer import ESTOP_TESTED
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.sessions import runs
from kata.clinic.sessions.tables import RunRow, RunSampleBlockRow
from kata.database.arrays import UnreadableError
from kata.database.engine import Database
from kata.device import journal
from kata.station.schemas import LoopLive

log = logging.getLogger(__name__)

_RATE_HZ: Final = 100
_PLAY_S: Final = 20.0
_LIMIT_S: Final = 120.0
_PREPARED: Final = 3
"""Journals before the first playback."""
_ACTIVE: Final = {"X-Kata-Active": "1"}
_ESTOP: Final = "estop_pressed"


class _Hand:
    """The simulator's client, which counts the presses of the emergency stop."""

    def __init__(self, hand: Any) -> None:
        self._hand, self.presses = hand, 0

    def estop(self, pressed: bool) -> None:
        self.presses += pressed
        self._hand.estop(pressed)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._hand, name)


class TreatingStation:
    """Plays repeatedly, presses its emergency stop at times, and writes notes, also while the database is unavailable."""

    def __init__(self, stack: ExitStack, folder: Path, name: str, database_url: str, over: Event) -> None:
        self.name, self.data, self._over = name, folder / name, over
        self.records: BenchRecords = prepare_records(self.data, play_s=_PLAY_S, plot_s=1.0, database_url=database_url)
        self.clinic = stack.enter_context(
            RunningService(self.data, self.records, cycle_hz=_RATE_HZ, rate_hz=_RATE_HZ, name=name)
        )
        self.hand = _Hand(self.clinic.hand)
        self.clinic.hand = self.hand  # type: ignore[assignment]
        # Without an open page, the apparatus would be paused.
        stack.enter_context(page_load(self.clinic, None, pages=1))
        self.notes: dict[str, int] = {}
        """Number of the last acknowledged change of the notes, by clinic number."""
        self.runs: set[UUID] = set()
        """Observed runs."""
        self._threads = [Thread(target=self._treat), Thread(target=self._write)]

    def begin(self) -> None:
        self._before = self._loop()
        for thread in self._threads:
            thread.start()

    def wait_for_a_run(self) -> None:
        """Wait until the first run is played and stored, so that its one-time memory does not count as growth."""
        limit = time.monotonic() + _LIMIT_S
        while len(_journals(self.data)) <= _PREPARED:
            assert time.monotonic() < limit, self.clinic.live()
            time.sleep(0.1)

    def end(self) -> None:
        """Wait until nothing runs and the spool is delivered."""
        for thread in self._threads:
            thread.join()
        limit = time.monotonic() + _LIMIT_S
        while (
            (live := self.clinic.live()).mode != "idle"
            or live.database.waiting
            or live.database.unavailable_since
            # A run that has just ended is still being delivered.
            or list((self.data / "journal").glob("*.journal"))
        ):
            assert time.monotonic() < limit, live
            self._stop_running(live.mode)
            time.sleep(0.1)

    @property
    def missed(self) -> str:
        """Return the control loop's cycles since the beginning as text."""
        before, now = self._before, self._loop()
        return f"{now.overruns - before.overruns} of {now.cycles - before.cycles} cycles"

    def _loop(self) -> LoopLive:
        loop = self.clinic.live().loop
        assert loop
        return loop

    def _stop_running(self, mode: str) -> None:
        if mode == "stopped":
            self.clinic.command("acknowledge")
        elif mode != "idle":
            self.clinic.command("stop")

    def _treat(self) -> None:
        chance = random.Random(self.name)
        while not self._over.is_set():
            try:
                self._once(chance)
            except (BenchError, URLError, TimeoutError) as error:
                log.info("%s: %s", self.name, error)
                self._over.wait(0.5)

    def _once(self, chance: random.Random) -> None:
        live = self.clinic.live()
        if live.run:
            self.runs.add(live.run.run_id)
        if live.mode == "stopped":
            self.clinic.insist("acknowledge")
        elif live.mode == "idle":
            self.clinic.play(self.records)
        elif live.mode == "ready":
            self.clinic.insist("approach")
        elif live.mode == "paused":
            self.clinic.insist("play")
        elif live.mode == "playing" and chance.random() < 0.1:
            self.clinic.hand.estop(True)
            try:
                self.clinic.until(lambda now: now.estop == "pressed", 10.0)
            finally:
                self.clinic.hand.estop(False)
            self.clinic.until(lambda now: now.estop == "released", 10.0)
        else:
            self._over.wait(0.5)

    def _write(self) -> None:
        cookie = dict([self.records.cookie.split("=", 1)])
        with httpx2.Client(base_url=self.clinic.url, cookies=cookie, headers=_ACTIVE, timeout=30) as client:
            while not self._over.is_set():
                number = uuid4().hex
                body = {"clinic_number": number, "name": "N", "affected_side": "left", "notes": "1"}
                made = self._acknowledged(client, "POST", "/api/patients", body, 201)
                if made is None:
                    continue
                self.notes[number] = 1
                for change in range(2, 5):
                    path = f"/api/patients/{made['id']}"
                    if self._acknowledged(client, "PATCH", path, {"notes": str(change)}, 200) is None:
                        break
                    self.notes[number] = change
                self._over.wait(0.2)

    def _acknowledged(
        self, client: httpx2.Client, method: str, path: str, body: dict[str, str], status: int
    ) -> dict[str, Any] | None:
        """Return the answer; None when the database was unavailable and the effect is unknown."""
        answer = client.request(method, path, json=body)
        if answer.status_code == 503:
            self._over.wait(0.5)
            return None
        assert answer.status_code == status, answer.text
        found: dict[str, Any] = answer.json()
        return found


def judge(stations: list[TreatingStation], database_url: str) -> str:
    """Check that nothing is missing or stored twice; return the numbers as text.

    It also checks that a removed or added record is detected.
    """
    with closing(Database(database_url)) as database:
        with database.read() as session:
            numbers = _judged(stations, session)
            log.info("%s", numbers)
        harms = _harms(stations[0])
        for what, harm in harms.items():
            with database.read() as session:
                harm(session)
                session.flush()
                assert not _is_whole(stations, session), f"the check does not detect that {what}"
                session.rollback()
        return f"{numbers}; seen was that {', '.join(harms)}"


def _is_whole(stations: list[TreatingStation], session: Session) -> bool:
    try:
        _judged(stations, session)
    except (AssertionError, UnreadableError):
        return False
    return True


def _judged(stations: list[TreatingStation], session: Session) -> str:
    counted: Counter[str] = Counter()
    for station in stations:
        events = select(DeviceEventRow).where(DeviceEventRow.station == station.name)
        rows = session.scalars(events).all()
        assert sum(row.code == _ESTOP for row in rows) == station.hand.presses, (
            f"{station.name}: presses of the emergency stop"
        )
        sent = Counter(_sent_events(station.data / "device.log"))
        found = Counter((row.code, row.message) for row in rows if row.kind == "event" and row.code != ESTOP_TESTED)
        assert found == sent, f"{station.name}: events: {sent - found} lost, {found - sent} doubled"
        assert list((station.data / "journal").glob("unreadable/*")) == []
        assert list((station.data / "journal").glob("*.journal")) == []
        measured = {
            UUID(recorded.id): recorded
            for recorded in map(journal.read, _journals(station.data))
            if recorded.kind == "run"
        }
        written = {row.id: row for row in session.scalars(_runs(station.records))}
        written.pop(station.records.run_id)
        measured.pop(station.records.run_id)
        assert set(measured) == set(written), f"{station.name}: runs without a journal, or journals without a run"
        assert station.runs <= set(written), f"{station.name}: runs that were seen"
        assert [row.id for row in written.values() if not row.ended_at] == [], f"{station.name}: runs that never end"
        for key, recorded in measured.items():
            # A run that was loaded and never moved has no samples.
            if len(recorded.t_ns):
                times_s = runs.samples(session, key)["time_s"]
                np.testing.assert_allclose(
                    times_s, (recorded.t_ns - recorded.t_ns[0]) / 1e9, atol=1e-6, err_msg=str(key)
                )
            counted["samples"] += len(recorded.t_ns)
        query = select(PatientRow.clinic_number, PatientRow.notes).where(
            PatientRow.clinic_number.in_(list(station.notes))
        )
        notes = {number: int(last) for number, last in session.execute(query).all()}
        assert set(notes) == set(station.notes), f"{station.name}: patients"
        # A request that failed for lack of the database may have had its effect.
        assert all(0 <= notes[number] - change <= 1 for number, change in station.notes.items()), (
            f"{station.name}: notes"
        )
        counted.update(
            presses=station.hand.presses, events=found.total(), runs=len(written), notes=sum(station.notes.values())
        )
    verdict = verify(session, [station.data / "audit.anchor" for station in stations])
    assert verdict.findings == []
    return f"{dict(counted)}, {verdict.rows} rows of the audit trail"


def _harms(station: TreatingStation) -> dict[str, Callable[[Session], object]]:
    """Possible damage to a station's records."""
    pressed = DeviceEventRow.station == station.name, DeviceEventRow.code == _ESTOP
    shown = DeviceEventRow.station == station.name, DeviceEventRow.kind == "event", DeviceEventRow.code != ESTOP_TESTED

    def doubled(session: Session) -> None:
        row = session.scalars(select(DeviceEventRow).where(*shown)).first()
        assert row
        copied = {
            column.key: getattr(row, column.key)
            for column in inspect(DeviceEventRow).column_attrs
            if column.key != "id"
        }
        session.add(DeviceEventRow(id=uuid4(), **copied))

    def a_run(session: Session) -> UUID:
        played = session.scalars(
            _runs(station.records).where(RunRow.samples > 0, RunRow.id != station.records.run_id)
        ).first()
        assert isinstance(played, RunRow)
        return played.id

    number = next(iter(station.notes))
    return {
        "a press is missing": lambda session: session.execute(delete(DeviceEventRow).where(*pressed)),
        "an event is missing": lambda session: session.execute(delete(DeviceEventRow).where(*shown)),
        "an event is there twice": doubled,
        "samples are missing": lambda session: session.execute(
            delete(RunSampleBlockRow).where(RunSampleBlockRow.run_id == a_run(session))
        ),
        "a run has not ended": lambda session: session.execute(
            update(RunRow).where(RunRow.id == a_run(session)).values(ended_at=None)
        ),
        "a note is missing": lambda session: session.execute(
            update(PatientRow).where(PatientRow.clinic_number == number).values(notes="0")
        ),
    }


def _sent_events(log_file: Path) -> list[tuple[str, str]]:
    """Return the events that the device process has sent, except alarms."""
    found = re.findall(r"device INFO (\w+): (.*)", log_file.read_text())
    return [(code, message) for code, message in found if code != "fault"]


def _journals(data: Path) -> list[Path]:
    return sorted((data / "journal/imported").iterdir())


def _runs(records: BenchRecords) -> Any:
    return select(RunRow).where(RunRow.session_id == records.session_id)
