"""Runs a station of ``python -m benchmarks clinic-load`` in this process: an apparatus with a stepped bus, the exchange of the stations' states, the
pages that watch them, and the sessions that the station stores. It has no web server.
"""

import argparse
import asyncio
import os
import random
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec

from kata.api.fleet import Fleet
from kata.api.fleet_router import StationsMessage
from kata.bench.records import add_records
from kata.clinic.patients import service as patients
from kata.database.base import utc_now
from kata.database.engine import SERVICE_ANSWER_S, Database
from kata.device import config
from kata.device.ipc_messages import Snapshot
from kata.evaluation.station import VirtualStation
from kata.evaluation.world import World
from kata.station.device_process import DeviceLaunch
from kata.station.station import Station

_CYCLE_HZ: Final = 20
"""The lowest rate that a station accepts, so that twenty control loops fit on one computer."""
_CYCLES_A_SNAPSHOT: Final = 2
_PAGE_SENDS_EVERY_S: Final = 0.2
_PAGE_LISTS_EVERY_S: Final = 5.0
_PAGE_ROWS: Final = 50
_PRESS_EVERY_S: Final = 6.0
_PRESSED_S: Final = 2.0


class StationFigures(msgspec.Struct):
    """Measurements of one station's process. Times are in seconds of the monotonic clock, which all processes share."""

    name: str
    presses_s: list[float] = []
    seen_s: list[tuple[int, str, float]] = []
    """A page's number, the station whose emergency stop it showed as pressed, and the time."""
    lists_ms: list[float] = []
    """Answer times of the lists that the pages request."""
    stored_s: float = 0.0
    """Length of the stored motions."""
    ended_s: float = 0.0
    """Time of the end of the measurement."""


class _Apparatus(VirtualStation):
    """A control loop on a stepped bus. Its clock advances only in :meth:`step`."""

    def __init__(self) -> None:
        settings = config.simulated("memory")
        inputs = msgspec.structs.replace(settings.inputs, max_age_cycles=2)
        settings = msgspec.structs.replace(settings, cycle_hz=_CYCLE_HZ, rate_hz=_CYCLE_HZ, inputs=inputs)
        self._apparatus_world = World(settings)
        super().__init__(settings, world=self._apparatus_world)

    def step(self) -> Snapshot:
        """Run the cycles of a tenth of a second. Return the newest snapshot."""
        for _ in range(_CYCLES_A_SNAPSHOT):
            self._loop.tick()
        snapshot = self._link.snapshot
        assert snapshot is not None
        return snapshot

    def press_estop(self, pressed: bool) -> None:
        self._apparatus_world.apparatus.press_estop(pressed)

    @property
    def rest_deg(self) -> tuple[float, ...]:
        return self._apparatus_world.apparatus.arm_deg


class _Shown(Station):
    """A station whose snapshots the benchmark passes on."""

    def __init__(self, name: str, folder: Path) -> None:
        launch = DeviceLaunch(folder / "station.toml", folder, real_time=False)
        super().__init__(config.StationConfig(name=name), launch, simulated=True, on_journal=lambda path: None)
        process: Any = _Connected()
        self._process = process

    def take(self, snapshot: Snapshot) -> None:
        self._take(snapshot)


class _Connected:
    running = True


@dataclass
class _Clinic:
    """One station and its pages."""

    database: Database
    station: _Shown
    fleet: Fleet
    apparatus: _Apparatus
    folder: Path
    figures: StationFigures
    watching: bool = False
    """True while measurements are recorded."""

    async def move(self) -> None:
        """Pass on ten snapshots a second. Press the emergency stop at random times."""
        due_s = time.monotonic()
        press_s, release_s = due_s + random.uniform(0, _PRESS_EVERY_S), float("inf")
        while True:
            now_s = time.monotonic()
            if now_s >= press_s:
                self.apparatus.press_estop(True)
                if self.watching:
                    self.figures.presses_s.append(now_s)
                press_s, release_s = float("inf"), now_s + _PRESSED_S
            elif now_s >= release_s:
                self.apparatus.press_estop(False)
                press_s, release_s = now_s + random.uniform(0.5, 1.5) * _PRESS_EVERY_S, float("inf")
            self.station.take(self.apparatus.step())
            due_s = max(due_s + 0.1, time.monotonic())
            await asyncio.sleep(due_s - time.monotonic())

    async def show(self, page: int) -> None:
        """Build the overview's messages as the service does for a WebSocket, and note which emergency stops they show."""
        await asyncio.sleep(random.uniform(0, _PAGE_SENDS_EVERY_S))
        sequence = 0
        before: Mapping[str, str] = {}
        while True:
            sequence += 1
            sent_changes = self.fleet.changes
            statuses = self.fleet.statuses()
            StationsMessage(sequence=sequence, sent_at=utc_now(), stations=statuses).model_dump_json()
            now_s = time.monotonic()
            shown = {status.name: status.state.estop for status in statuses if status.state}
            for name, estop in shown.items():
                if self.watching and estop == "pressed" and before.get(name, estop) != estop:
                    self.figures.seen_s.append((page, name, now_s))
            before = shown
            await asyncio.sleep(_PAGE_SENDS_EVERY_S)
            if self.fleet.changes == sent_changes:
                await self.fleet.wait_for_change(1.0 - _PAGE_SENDS_EVERY_S)

    async def list_patients(self) -> None:
        """Request the list of patients at intervals, as a page does that its user changes."""
        while True:
            await asyncio.sleep(random.uniform(0.5, 1.5) * _PAGE_LISTS_EVERY_S)
            began_s = time.monotonic()
            await asyncio.to_thread(self._list)
            if self.watching:
                self.figures.lists_ms.append((time.monotonic() - began_s) * 1000)

    def _list(self) -> None:
        with self.database.read() as session:
            patients.find(session, search="", archived=False, limit=_PAGE_ROWS, after=None)

    async def store(self, run_s: float) -> None:
        """Store a session with a run again and again, each as long as its run."""
        number = 0
        await asyncio.sleep(random.uniform(0, run_s))
        while True:
            number += 1
            began_s = time.monotonic()
            data = self.folder / str(number)
            await asyncio.to_thread(add_records, self.database, data, self.apparatus.rest_deg, play_s=1.0, plot_s=run_s)
            # A session has two recordings, here of a second and of the run's length, and a run.
            if self.watching:
                self.figures.stored_s += 1.0 + 2 * run_s
            await asyncio.sleep(max(0.0, began_s + run_s - time.monotonic()))


async def _serve(name: str, url: str, pages: int, run_s: float, folder: Path) -> None:
    database = Database(url, answer_s=SERVICE_ANSWER_S)
    station = _Shown(name, folder)
    clinic = _Clinic(database, station, Fleet(station, database, list), _Apparatus(), folder, StationFigures(name))
    commands = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(commands), sys.stdin)
    async with clinic.fleet.exchange_states(), asyncio.TaskGroup() as group:
        for work in (clinic.move(), clinic.store(run_s)):
            group.create_task(work)
        for page in range(pages):
            group.create_task(clinic.show(page))
            group.create_task(clinic.list_patients())
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        # The first line begins the measurement, the end of the input ends it.
        await commands.readline()
        clinic.watching = True
        await commands.read()
        clinic.figures.ended_s = time.monotonic()
        sys.stdout.write(msgspec.json.encode(clinic.figures).decode())
        sys.stdout.flush()
        # Skip asyncio's shutdown, because it would wait until the present session is stored.
        os._exit(0)


def main() -> None:
    """Run ``python -m benchmarks.stepped_station``."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.stepped_station", description=__doc__)
    parser.add_argument("--name", required=True, help="the station's name")
    parser.add_argument("--url", required=True, help="SQLAlchemy's URL of the database")
    parser.add_argument("--pages", type=int, required=True, help="number of pages that watch the stations")
    parser.add_argument("--run-s", type=float, required=True, help="length of each stored run in seconds")
    parser.add_argument("--folder", type=Path, required=True, help="an empty folder for journals")
    arguments = parser.parse_args()
    asyncio.run(_serve(arguments.name, arguments.url, arguments.pages, arguments.run_s, arguments.folder))


if __name__ == "__main__":
    main()
