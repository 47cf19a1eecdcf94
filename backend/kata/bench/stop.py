"""Implements ``kata bench stop``: measures the time from a Stop on the service's socket to torque off at all drives under load.

A Stop ramps a moving arm down before torque is switched off. The benchmark therefore holds the arm at rest. Torque is then switched off
in the cycle in which a moving arm would get the first setpoint of its ramp. The time begins when the Stop is written to the socket, after
all earlier messages. It ends when the last byte of the instruction reaches the simulated drive. Both times are on the same clock.

No recording can be loaded while torque is on. In the row ``loaded`` the time therefore ends at the answer to a Stop that follows a Load.
"""

import random
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final
from uuid import uuid4

import numpy as np
from msgspec import structs

from kata.bench.device import Device
from kata.bench.report import Report
from kata.bench.running_service import BenchError
from kata.device.ipc_messages import Acknowledge, Approach, Load, Refusal, Request, Stop, Unload, frames_of, parts_of
from kata.device.loader import ReferenceLoader
from kata.device.refusals import ANGLES_NOT_CURRENT
from kata.motion.axes import AXES, N_AXES
from kata.simulator.apparatus import State

GOAL_MS: Final = 15.0
_CYCLE_HZ: Final = 100
_HOUR_SAMPLES: Final = 360_000
_EXTREME_DEG: Final = 1e308
_SHORT_S: Final = 2.0
_HOLD_S: Final = (0.02, 0.06)
"""Range of the time for which the arm is held before a Stop. It spans several cycles, so that the phase of the Stop is random."""
_READ_AFTER_S: Final = 0.03
"""Wait before reading the simulator's state, because reading takes time that the drives' answers need."""
_LIMIT_S: Final = 5.0
_VALID_S: Final = 2.0
_FEWER: Final = 10
"""Divisor of the number of Stops after an hour-long Load, because each takes seconds."""
_BUILDING_S: Final = 0.5
"""Longest time from an hour-long Load to its Stop. Half of the Stops follow at once."""
_DRAWS: Final = 100
"""Number of consecutive Loads accepted before their Stop was sent, after which the benchmark fails."""
_PAUSE_S: Final = 0.002
"""Pause between two disturbances."""
OPERATOR_STOP: Final = "operator_stop"
"""Cause of a stop by the benchmark's Stop command."""
_UNANSWERED: Final = 0
"""Id of the Loads that only keep the device process busy. The benchmark does not wait for their answers."""

Disturbance = Callable[[Device], AbstractContextManager[None]]


@dataclass(frozen=True)
class StopLoad:
    """A kind of work that the device process does while the benchmark sends Stops."""

    name: str
    title: str
    busy: Disturbance = field(default=lambda device: nullcontext())
    module: str = "kata.device"
    torque: bool = True
    """True: measure until torque is off at the drives. False: measure until the answer to a Stop after an hour-long Load."""


@dataclass(frozen=True)
class StopFigures:
    """The figures that were measured under one :class:`StopLoad`."""

    took_ms: list[float]
    missed: int
    """Number of cycles missed during the measurement."""
    other_causes: list[str]
    """Causes of the stops that happened before the benchmark sent its Stop."""
    accepted_first: int = 0
    """Number of Loads that the device process accepted before the Stop was sent. They are not counted as samples."""


def run(stops: int, loads: Sequence[str], real_time: bool, progress: Callable[[str], None]) -> Report:
    """Stop ``stops`` times under each of the named :data:`LOADS`.

    :raises BenchError: when torque does not switch off, or a command of the benchmark is refused.
    """
    report = Report(
        f"Stop to torque off, {_CYCLE_HZ} Hz, {stops} each",
        ("While", "Stops", "p50, ms", "p99.9, ms", "goal, ms", "max, ms", "missed cycles"),
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        for case in [case for case in CASES if case.name in loads]:
            _add_row(report, case, _measure(Path(folder) / case.name, case, stops, real_time, progress))
    report.notes += [
        "From the Stop's write to the socket until the last of the five drives has no torque, by the simulator's clock. The arm is held "
        "at rest. A moving arm gets the first setpoint of its ramp in the same cycle.",
        "A second client's Loads are refused because torque is on; the frames sent before the refusal pass through the same socket.",
        "being built: by a builder of the benchmark, because the device's own builder has no work while torque is on.",
        f"being loaded, torque off: until the answer to the Stop, which follows the Load at once or within {_BUILDING_S:g} s. One "
        f"{_FEWER}th of the Stops. A Load that is accepted before its Stop is sent is no sample.",
    ]
    return report


def _measure(folder: Path, case: StopLoad, stops: int, real_time: bool, progress: Callable[[str], None]) -> StopFigures:
    with Device(folder, cycle_hz=_CYCLE_HZ, real_time=real_time, module=case.module) as device:
        device.until_mode("idle")
        time.sleep(0.2)  # until the reading of every drive has settled
        at_rest = _motionless([axis.angle_deg for axis in device.hand.state().axes], round(_SHORT_S * _CYCLE_HZ))
        before = device.snapshot.loop.overruns
        took_ms: list[float] = []
        other_causes: list[str] = []
        accepted_first = 0
        with case.busy(device):
            while len(took_ms) < (stops if case.torque else -(-stops // _FEWER)):
                progress(f"{case.title}: {len(took_ms)} of {stops} stops")
                try:
                    if case.torque:
                        took_ms.append(_stop_held(device, at_rest))
                    else:
                        sample_ms, accepted = _stop_loading(device)
                        took_ms.append(sample_ms)
                        accepted_first += accepted
                except BenchError as error:
                    other_causes.append(_leave_out(device, error))
        return StopFigures(took_ms, device.snapshot.loop.overruns - before, other_causes, accepted_first)


def _leave_out(device: Device, error: BenchError) -> str:
    """Acknowledge a fault that came before the Stop. Return its cause.

    :raises BenchError: ``error``, when no fault came first, because a slow Stop must not be omitted.
    """
    stop = device.snapshot.stop
    if not stop or stop.causes[0].code == OPERATOR_STOP:
        raise error
    return _acknowledge(device, stop.causes[0].code)


def _stop_held(device: Device, recording: Load) -> float:
    """Hold the arm, stop, and acknowledge. Return the time in ms until torque is off."""
    device.insist(structs.replace(recording, run_id=str(uuid4())))  # the name of its journal must be unique
    device.until_mode("ready")
    _approach(device)
    device.until_mode("paused")
    time.sleep(random.uniform(*_HOLD_S))
    _, sent_ns = device.send(Stop())
    time.sleep(_READ_AFTER_S)
    state = _wait_for_state(device, lambda state: not any(axis.torque_on for axis in state.axes))
    off = {event.motor: event.t_ns for event in state.events if event.what == "torque_off" and event.t_ns >= sent_ns}
    if set(off) != set(AXES):
        raise BenchError("torque went off before the Stop was sent")
    device.until_mode("stopped")
    _acknowledge(device, OPERATOR_STOP)
    return (max(off.values()) - sent_ns) / 1e6


def _approach(device: Device) -> None:
    """Switch torque on. Try again if the device waits for the answer of a drive, because no Stop is measured yet.

    :raises BenchError: when it is refused for another reason, or still after some seconds.
    """
    limit = time.monotonic() + _LIMIT_S
    while True:
        approach = Approach(stops=device.snapshot.stops, expires_ns=_expires_ns())
        refusal = device.answer(device.send(approach)[0]).refusal
        if refusal is None:
            return
        if refusal.code != ANGLES_NOT_CURRENT or time.monotonic() > limit:
            raise BenchError(f"the approach was refused: {refusal.message} {refusal.next_step}")
        time.sleep(_READ_AFTER_S)


def _stop_loading(device: Device) -> tuple[float, int]:
    """Send Loads of an hour until one is stopped before it is accepted.

    Return the time in ms until the Stop's answer, and the number of Loads that were accepted before their Stop was sent.

    :raises BenchError: when every Load is accepted before its Stop is sent, or a Load is refused for another reason.
    """
    for accepted_first in range(_DRAWS):
        took_ms = _stop_one_load(device)
        limit = time.monotonic() + 10 * _LIMIT_S
        while (refusal := device.answer(device.send(_extreme())[0]).refusal) and refusal.code == "busy":
            if time.monotonic() > limit:
                raise BenchError("the builder does not finish")
            time.sleep(0.1)
        if took_ms is not None:
            return took_ms, accepted_first
    raise BenchError(f"{_DRAWS} Loads in a row were accepted before the Stop was sent")


def _stop_one_load(device: Device) -> float | None:
    """Send an hour-long Load, then a Stop. Return the time in ms until the Stop's answer; None if the Load was accepted before the Stop."""
    load, _ = device.send(structs.replace(_hour(), run_id=str(uuid4())))  # the name of its journal must be unique
    time.sleep(random.choice((0.0, random.uniform(0.0, _BUILDING_S))))
    if device.answered(load):
        _check_load(device.answer(load).refusal)
        device.insist(Unload())
        return None
    number, sent_ns = device.send(Stop())
    loaded = device.answer(load)
    _check_load(loaded.refusal)
    stopped = device.answer(number)
    if loaded.refusal is None:
        # The Load was accepted while the Stop was being sent. A Stop of a loaded station is latched.
        _acknowledge(device, OPERATOR_STOP)
        if loaded.at_ns < sent_ns:
            return None
    return (stopped.at_ns - sent_ns) / 1e6


def _check_load(refusal: Refusal | None) -> None:
    if refusal and refusal.code != "stopped_meanwhile":
        raise BenchError(f"the Load was refused: {refusal.message} {refusal.next_step}")


def _acknowledge(device: Device, cause: str) -> str:
    """Acknowledge a stop. Return its cause.

    :raises BenchError: when the stop cannot be acknowledged.
    """
    limit = time.monotonic() + _LIMIT_S
    while device.answer(device.send(Acknowledge(stops=device.snapshot.stops, expires_ns=_expires_ns()))[0]).refusal:
        if time.monotonic() > limit:
            raise BenchError(f"a stop by {cause} cannot be acknowledged")
        time.sleep(0.05)
    device.until_mode("idle")
    return cause


def _wait_for_state(device: Device, condition: Callable[[State], object]) -> State:
    limit = time.monotonic() + _LIMIT_S
    while not condition(state := device.hand.state()):
        if time.monotonic() > limit:
            raise BenchError(f"torque was not switched off within {_LIMIT_S:g} s")
        time.sleep(0.01)
    return state


def _expires_ns() -> int:
    return time.monotonic_ns() + int(_VALID_S * 1e9)


# -- loads of the device process ----------------------------------------------------------------------------------


def _motionless(angles_deg: list[float], samples: int) -> Load:
    """Return a recording without movement. With the paper's method its approach only holds the arm."""
    times = np.arange(samples) / _CYCLE_HZ
    angles = np.tile(angles_deg, (samples, 1))
    return Load(
        run_id="bench", recording_id="bench", times_s=times.tobytes(), angles_deg=angles.tobytes(), method="paper"
    )


def _hour() -> Load:
    return _motionless([15.0, 109.0, 10.0, 0.0, 0.0], _HOUR_SAMPLES)


def _extreme() -> Load:
    return _motionless([_EXTREME_DEG] * N_AXES, round(_SHORT_S * _CYCLE_HZ))


@contextmanager
def _repeating(step: Callable[[], None]) -> Iterator[None]:
    """Call ``step`` repeatedly in a thread until the block ends."""
    block_ended = threading.Event()

    def repeat() -> None:
        while not block_ended.wait(_PAUSE_S):
            step()

    thread = threading.Thread(target=repeat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        block_ended.set()
        thread.join()


def _sending(load: Callable[[], Load]) -> Disturbance:
    """Return a disturbance that sends a Load repeatedly, as a second client would. It sends only while the arm is held,
    because otherwise the Load would be accepted.
    """

    def busy(device: Device) -> AbstractContextManager[None]:
        parts = list(frames_of(Request(id=_UNANSWERED, command=load())))

        def send() -> None:
            if device.snapshot.mode == "paused":
                device.send_until_answered(_UNANSWERED, parts)

        return _repeating(send)

    return busy


@contextmanager
def _building(device: Device) -> Iterator[None]:
    """Build hour-long recordings, one after another, with a builder of the benchmark."""
    hour = _hour()
    built = threading.Event()
    loader = ReferenceLoader(device.config)
    loader.start(built.set)

    def build() -> None:
        built.clear()
        for message in parts_of(_UNANSWERED, hour):
            loader.send(message)
        built.wait()
        list(loader.results())

    try:
        with _repeating(build):
            yield
    finally:
        loader.finish()


CASES: Final = (
    StopLoad("idle", "nothing else"),
    StopLoad("built", "an hour is being built", _building),
    StopLoad("loaded", "an hour is being loaded, torque off", torque=False),
    StopLoad("second_client", "a second client sends hour-long Loads", _sending(_hour)),
    StopLoad("slow_disk", "the journal's disk blocks every other second", module="kata.bench.slow_disk"),
    StopLoad("extreme", "a second client sends Loads of 1e308 deg", _sending(_extreme)),
)
LOADS: Final = tuple(case.name for case in CASES)
"""Names of the cases."""


def _add_row(report: Report, case: StopLoad, measured: StopFigures) -> None:
    p50, p999 = np.percentile(measured.took_ms, (50, 99.9), method="inverted_cdf").tolist()
    longest = max(measured.took_ms)
    report.figures |= {
        f"stop_p50_ms_{case.name}": p50,
        f"stop_p999_ms_{case.name}": p999,
        f"stop_max_ms_{case.name}": longest,
        f"stop_missed_{case.name}": measured.missed,
        f"stop_other_causes_{case.name}": len(measured.other_causes),
    }
    figures = (f"{p50:.2f}", f"{p999:.2f}", f"{GOAL_MS:g}", f"{longest:.2f}", str(measured.missed))
    report.rows.append((case.title, str(len(measured.took_ms)), *figures))
    if measured.accepted_first:
        report.notes.append(
            f"{case.title}: {measured.accepted_first} Loads were accepted before the Stop was sent. They were unloaded and are left out."
        )
    for cause in sorted(set(measured.other_causes)):
        count = measured.other_causes.count(cause)
        report.notes.append(
            f"{case.title}: {count} stops by {cause} came before the one that was sent. They are left out."
        )
