"""Every cell of the fault matrix, run under the stepped clock."""

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kata.device.config import StationConfig
from kata.device.ipc_messages import Approach, Mode, Pause, Play, Return, Teach
from kata.motion.trajectory import Trajectory
from tests.support.fault_matrix import (
    KINDS,
    MODES,
    SIGNALS,
    Continues,
    Expected,
    Kind,
    ProcessEnds,
    StaysOffline,
    Stops,
    expected,
)
from tests.support.faulty_apparatus import FaultyApparatus
from tests.support.stepped import Stepped
from tests.support.trajectories import LOAD

CONFIG = StationConfig(approach_speed_deg_s=45.0)
_WATCHED_MS = 1200
"""How long the test observes the apparatus."""


def _everywhere() -> Trajectory:
    """Return a recording in which all five axes move, from a start far from the rest position, without long pauses."""
    times = np.linspace(0.0, 8.0, 801)
    start = np.array([33.0, 94.0, 40.0, 40.0, -35.0])
    reach = np.array([-20.0, 20.0, 40.0, 60.0, -40.0])
    angles = start + reach * (1 - np.cos(2 * np.pi * times / 8.0))[:, None] / 2
    return Trajectory(times, angles)


def _reach(stepped: Stepped, mode: Mode) -> None:
    """Bring the apparatus into a mode by commands only."""
    if mode in ("offline", "idle"):
        return
    if mode == "teaching":
        assert stepped.send(Teach(teaching_id="t")) is None
        return
    assert stepped.send(LOAD, _everywhere()) is None
    if mode == "ready":
        return
    assert stepped.send(Approach()) is None
    stepped.forward(0.5)
    if mode == "approaching":
        return
    stepped.until("paused")
    if mode == "paused":
        return
    assert stepped.send(Play()) is None
    stepped.forward(1.0)
    if mode == "playing":
        return
    if mode == "returning":
        assert stepped.send(Pause()) is None
        stepped.until("paused")
        assert stepped.send(Return()) is None
        stepped.forward(0.5)
        return
    stepped.link.request_stop()
    stepped.forward(0.5)


def _ail_service(stepped: Stepped, kind: Kind, cycle: int) -> None:
    """Inject the service's faults into the link."""
    link = stepped.link
    match kind:
        case "off" | "garbage":
            link.closing = True
            link.service_silent_ms = float("inf")
        case "stuck":
            link.service_silent_ms += 10.0
        case "wrong":
            link.naming = "another"
        case "slow":
            link.service_silent_ms = cycle * 10.0 % 300.0
        case "delayed":
            link.service_silent_ms = min(600.0, link.service_silent_ms + 10.0)
        case "intermittent":
            link.naming = "another" if cycle % 2 else None


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> dict[Mode, Stepped]:
    """Return an apparatus without a fault in each mode but offline. A cell runs on a copy, because reaching a mode takes most of its time."""
    reached: dict[Mode, Stepped] = {}
    for mode in MODES:
        if mode != "offline":
            stepped = Stepped(tmp_path_factory.mktemp(mode), CONFIG, FaultyApparatus())
            _reach(stepped, mode)
            assert stepped.mode == mode, "the cells of this mode cannot be run"
            reached[mode] = stepped
    return reached


def _begin_cell(healthy: dict[Mode, Stepped], folder: Path, kind: Kind, signal: str, mode: Mode) -> Stepped:
    """Return an apparatus in the mode, with the fault. In ``offline`` the fault has existed since before the first read."""
    if mode != "offline":
        stepped = healthy[mode].copied(folder)
        assert isinstance(stepped.apparatus, FaultyApparatus)
        stepped.apparatus.kind, stepped.apparatus.signal = kind, signal
        return stepped
    apparatus = FaultyApparatus()
    apparatus.last = apparatus.read()
    apparatus.kind, apparatus.signal = kind, signal
    stepped = Stepped(folder, CONFIG, apparatus, settle=False)
    assert stepped.mode == mode, "the cell could not be run"
    return stepped


def _run_cell(stepped: Stepped, kind: Kind, signal: str, mode: Mode) -> None:
    known = len(stepped.causes())
    should = expected(kind, signal, mode)
    took_ms: int | None = None
    ended = False
    watched_ms = should.within_ms if isinstance(should, Stops) else _WATCHED_MS
    for cycle in range(1, watched_ms // 10 + 1):
        if signal == "service":
            _ail_service(stepped, kind, cycle)
        ended = not stepped.cycle()
        assert stepped.snapshot.torque != "off" or not stepped.torque, "torque is shown off and is on"
        stopped = len(stepped.causes()) > known and not stepped.loop._machine.torque_on
        if stopped and took_ms is None:
            took_ms = cycle * 10
        if ended or (took_ms is not None and isinstance(should, Stops)):
            break
    _check(stepped, should, mode, known, took_ms, ended)


def _check(stepped: Stepped, should: Expected, mode: Mode, known: int, took_ms: int | None, ended: bool) -> None:
    match should:
        case Stops(cause, within_ms):
            assert took_ms is not None, f"{cause} was expected; the causes are {stepped.causes()}"
            assert stepped.causes()[known] == cause
            assert took_ms <= within_ms
            assert stepped.mode == "stopped"
            # Without a port no drive can be reached; the drives' own watchdog stops them.
            stepped.forward(0.3)
            assert stepped.mode == "stopped"
            assert cause == "bus_lost" or not stepped.torque
        case Continues():
            assert stepped.causes()[known:] == []
            assert not ended
            assert (stepped.mode == "stopped") == (mode == "stopped")
            assert stepped.mode != "offline"
        case StaysOffline():
            assert stepped.mode == "offline"
            assert not stepped.torque
        case ProcessEnds():
            assert ended
            assert not stepped.torque


def _rows() -> list[Any]:
    """Return each fault kind of each signal.

    A signal of five motors is tried with one motor of each kind, chosen so that each motor is tried with some kind of each signal.
    The campaign tries the others.
    """
    rows = []
    for kind, signal in product(KINDS, SIGNALS):
        of, _, motor = signal.partition(" ")
        first = KINDS.index(kind) + len(of)
        tried = not motor.isdigit() or int(motor) - 1 == first % 5
        rows.append(pytest.param(kind, signal, marks=() if tried else pytest.mark.campaign))
    return rows


# Not counted for coverage: each line needs a test of its own, and counting takes time.
@pytest.mark.parametrize(("kind", "signal"), _rows())
def test_every_cell_of_the_fault_matrix(healthy: dict[Mode, Stepped], tmp_path: Path, kind: Kind, signal: str) -> None:
    for mode in MODES:
        stepped = _begin_cell(healthy, tmp_path, kind, signal, mode)
        try:
            _run_cell(stepped, kind, signal, mode)
        except AssertionError as error:
            raise AssertionError(f"{kind} x {signal} x {mode}: {error}") from error


def test_the_matrix_is_whole() -> None:
    cells = [expected(kind, signal, mode) for kind, signal, mode in product(KINDS, SIGNALS, MODES)]
    assert len(cells) == 7 * 30 * 9
    assert sum(isinstance(cell, Stops) for cell in cells) > 400


@pytest.mark.parametrize("kind", KINDS)
def test_faulty_pedal_records_only_what_it_clearly_requests(tmp_path: Path, kind: Kind) -> None:
    """Up, or not known to be down, counts as up. Only a pedal that reports "down" for long enough records, even if the
    report is false.
    """
    apparatus = FaultyApparatus(kind=None, pedal_down=False)
    stepped = Stepped(tmp_path, apparatus=apparatus)
    stepped.send(Teach(teaching_id="t"))
    stepped.forward(0.1)
    apparatus.kind, apparatus.signal = kind, "pedal"
    stepped.forward(1.0)

    teaching = stepped.snapshot.teaching
    assert teaching is not None
    assert (teaching.samples > 0) == (kind in ("wrong", "garbage"))
