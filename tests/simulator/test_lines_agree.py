"""The stepped line of the campaigns behaves as the pseudo-terminal does, at each fault, after it is cleared, and after a new connection."""

import select
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Final, get_args

import pytest
from msgspec import structs

from kata.device.bus.factory import make_bus
from kata.device.bus.interface import Bus, BusError
from kata.device.config import StationConfig
from kata.evaluation.world import World
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.drives import SIMULATED_DRIVES
from kata.simulator.fault_injector import DriveKind, FaultInjector, SimulatedFault
from kata.simulator.ports import TerminalPort
from kata.simulator.wire import Wire

PROTOCOLS: Final = ("dynamixel", "modbus")
VALUES: Final = {
    "delayed": 1_000.0, "intermittent": 0.0, "hardware_error": 32.0, "exchanged_id": 9.0, "hot": 90.0, "supply_voltage": 9.0,
}  # fmt: skip
"""Values of the faults that need one. An answer that is always lost is the same on both lines; a random one is not."""
BUS_FAULTS: Final = (
    "noise",
    "echo",
    "gone",
    "estop_wire_broken",
    "second_wire_broken",
    "contact_welded",
    "inputs_silent",
)
FAULTS: Final = [
    *(SimulatedFault(kind=kind, motor=3, value=VALUES.get(kind)) for kind in get_args(DriveKind)),
    *(SimulatedFault(kind=kind) for kind in BUS_FAULTS),
]
LIMIT_S: Final = 20.0
READS: Final = 40
Seen = tuple[object, ...]


def config_of(protocol: str, port: str = "memory") -> StationConfig:
    return structs.replace(StationConfig(), protocol=protocol, port=port)


def seen(bus: Bus) -> Seen:
    """Return what one reading shows, without measured values and times."""
    try:
        sample = bus.read()
    except BusError:
        return ("gone",)
    inputs = sample.inputs
    return (
        tuple(drive is not None for drive in sample.drives),
        inputs and (inputs.estop_open, inputs.pedal_down, inputs.contacts_disagree),
        frozenset(sample.corrupt),
        frozenset(sample.timed_out),
    )


def reconnect(bus: Bus) -> None:
    bus.close()
    bus.open()


def stepped(protocol: str, fault: SimulatedFault) -> list[set[Seen]]:
    """Return what the last readings show with the fault, after it is cleared, and after a new connection."""
    world = World(config_of(protocol), seed=1)
    bus = make_bus(world.config, world.open_transport)
    bus.open()
    bus.configure(range(5))
    found = []
    for change in (partial(world.faults.fault, fault), world.faults.clear, partial(reconnect, bus)):
        change()
        readings = []
        for _ in range(READS):
            readings.append(seen(bus))
            world.wait(1 / world.config.cycle_hz)
        found.append(set(readings[READS // 2 :]))
    return found


@contextmanager
def served(protocol: str, path: Path) -> Iterator[Callable[[Callable[[FaultInjector], None]], None]]:
    """Serve drives at a pseudo-terminal. Yield a function that changes their faults in the serving thread and waits until it has."""
    apparatus = SimulatedApparatus(1, time.monotonic_ns())
    line, faults, _ = SIMULATED_DRIVES[protocol](apparatus, config_of(protocol).baud)
    wire = Wire(line, faults, partial(TerminalPort, path))
    changes: SimpleQueue[tuple[Callable[[FaultInjector], None], threading.Event]] = SimpleQueue()
    ended = threading.Event()

    def serve() -> None:
        while not ended.is_set():
            due_s = 0.01 if wire.due_ns is None else max(0, wire.due_ns - time.monotonic_ns()) / 1e9
            readable, _, _ = select.select(wire.sources, [], [], min(0.01, due_s))
            if readable:
                wire.receive()
            while not changes.empty():
                change, done = changes.get()
                change(faults)
                wire.serve(time.monotonic_ns())
                done.set()
            now_ns = time.monotonic_ns()
            wire.serve(now_ns)
            apparatus.advance(now_ns)

    def change(by: Callable[[FaultInjector], None]) -> None:
        done = threading.Event()
        changes.put((by, done))
        assert done.wait(LIMIT_S)

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield change
    finally:
        ended.set()
        thread.join()
        wire.close()


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.kind)
def test_both_lines_show_a_fault_alike(tmp_path: Path, protocol: str, fault: SimulatedFault) -> None:
    expected = stepped(protocol, fault)
    port = tmp_path / "port"
    with served(protocol, port) as change:
        bus = make_bus(config_of(protocol, str(port)))
        try:
            bus.open()
            configure(bus)
            changes: list[Callable[[], Any]] = [
                partial(change, lambda faults: faults.fault(fault)),
                partial(change, lambda faults: faults.clear()),
                partial(reconnect, bus),
            ]
            for step, allowed in zip(changes, expected, strict=True):
                step()
                shown = until(bus, allowed)
                assert shown in allowed, f"{shown}, stepped {allowed}"
        finally:
            bus.close()


def configure(bus: Bus) -> None:
    """Configure every drive, again while a busy computer delays an answer."""
    limit = time.monotonic() + LIMIT_S
    for axis in range(5):
        while True:
            try:
                bus.configure([axis])
                break
            except BusError:
                assert time.monotonic() < limit


def until(bus: Bus, allowed: set[Seen]) -> Seen:
    """Read until the line shows one of the allowed states; a busy computer delays answers. Return the last state."""
    limit = time.monotonic() + LIMIT_S
    while (shown := seen(bus)) not in allowed and time.monotonic() < limit:
        time.sleep(0.002)
    return shown
