"""A stepped clock and an apparatus without a wire: the control loop's sequences, thousands of cycles in a second.

The drives here follow their setpoint at once; the simulator models real drives.
"""

import copy
import gc
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from unittest import mock

from msgspec import structs

from kata.device.bus.interface import (
    BusError,
    BusSample,
    DriveHealth,
    DriveSample,
    DriveStatus,
    InputSample,
    OtherAdapterError,
)
from kata.device.config import StationConfig
from kata.device.ipc import Heartbeats, QueuedCommand
from kata.device.ipc_messages import Command, Event, Load, Refusal, Reply, Snapshot, StopCode, stamped
from kata.device.journal import Journal, JournalDisk, JournalHeader, JournalWriter, read
from kata.device.late_command import STOPPED_MEANWHILE
from kata.device.loop import ControlLoop
from kata.device.references import build
from kata.motion.ilc import Correction
from kata.motion.trajectory import Trajectory
from kata.system.realtime import Granted

NEVER_NS = 2**62
_WRITTEN_CYCLES = 1000
"""A journal is written after so many cycles. Its buffer holds more."""


def _collect_nothing() -> int:
    return 0


WITHOUT_COLLECTION = mock.patch.object(gc, "collect", _collect_nothing)
"""The loop collects garbage when it opens a port, which here would walk through all objects of the tests."""
REST_DEG = (15.0, 109.0, 10.0, 0.0, 0.0)


@dataclass
class SteppedApparatus:
    """A :class:`~kata.device.bus.interface.Bus`; tests set its fields."""

    mismatch: list[str] = field(default_factory=lambda: [""] * 5)
    """The register with a wrong value, by drive."""
    verified: list[bool] = field(default_factory=lambda: [True] * 5)
    configured: list[int] = field(default_factory=list)
    """The configured axes in order."""
    refuses_configuration: str = ""
    """Reason why no drive can be configured; empty: each can."""
    alert: list[bool] = field(default_factory=lambda: [False] * 5)
    contacts_disagree: bool = False
    angles_deg: list[float] = field(default_factory=lambda: list(REST_DEG))
    speeds_deg_s: list[float] = field(default_factory=lambda: [0.0] * 5)
    torques_nm: list[float] = field(default_factory=lambda: [0.0] * 5)
    drift_deg_s: list[float] = field(default_factory=lambda: [0.0] * 5)
    """Speed of each shaft independent of its setpoint."""
    corrupt: set[int] = field(default_factory=set)
    torque: list[bool] = field(default_factory=lambda: [False] * 5)
    estop_open: bool = False
    pedal_down: bool | None = False
    """None: a pedal at a USB port is pulled out."""
    silent: set[int] = field(default_factory=set)
    inputs_silent: bool = False
    hardware_error: list[int] = field(default_factory=lambda: [0] * 5)
    watchdog_tripped: bool = False
    gone: bool = False
    other_adapter: bool = False
    """The port cannot be opened, because it belongs to another adapter than before."""
    stuck: set[int] = field(default_factory=set)
    deaf_to_torque_off: set[int] = field(default_factory=set)
    written: list[tuple[float, ...]] = field(default_factory=list)
    errors: int = 0
    t_ns: int = 0
    health: dict[int, DriveHealth] = field(default_factory=dict)
    """Voltage and temperature by axis, reported in every cycle."""
    _cycle: int = 0
    _read_ns: int = 0

    def open(self) -> None:
        self._check()
        if self.other_adapter:
            raise OtherAdapterError("another adapter")

    def configure(self, axes: Collection[int]) -> None:
        self._check()
        if self.refuses_configuration:
            raise BusError(self.refuses_configuration)
        for n in axes:
            assert not self.torque[n]
            self.configured.append(n)
            self.mismatch[n], self.verified[n] = "", True

    def read(self) -> BusSample:
        self._check()
        self._cycle += 1
        axis = self._cycle % 5
        since_s, self._read_ns = (self.t_ns - self._read_ns) / 1e9, self.t_ns
        for n, drift in enumerate(self.drift_deg_s):
            self.angles_deg[n] += drift * since_s
        drives = tuple(
            None
            if n in self.silent | self.corrupt
            else DriveSample(self.t_ns, angle, self.speeds_deg_s[n], self.torques_nm[n], self.alert[n])
            for n, angle in enumerate(self.angles_deg)
        )
        inputs = self._contacts()
        status = DriveStatus(
            self.t_ns,
            axis,
            self.torque[axis],
            self.hardware_error[axis],
            self.watchdog_tripped,
            self.verified[axis] and not self.mismatch[axis],
            self.mismatch[axis],
        )
        statuses = () if axis in self.silent else (status,)
        health = tuple([structs.replace(health, t_ns=self.t_ns) for health in self.health.values()])
        silent = frozenset(self.silent - self.corrupt)
        return BusSample(drives, inputs, statuses, frozenset(self.corrupt), silent, health)

    def read_inputs(self) -> InputSample | None:
        self._check()
        return self._contacts()

    def _contacts(self) -> InputSample | None:
        if self.inputs_silent:
            return None
        return InputSample(self.t_ns, self.estop_open, self.pedal_down, self.contacts_disagree)

    def write_setpoints(self, angles_deg: Sequence[float]) -> None:
        self._check()
        self.written.append(tuple(angles_deg))
        for n, angle in enumerate(angles_deg):
            if self.torque[n] and n not in self.stuck and not self.drift_deg_s[n]:
                self.angles_deg[n] = angle

    def torque_on(self, hold_deg: Sequence[float]) -> None:
        self._check()
        self.torque = [True] * 5
        self.write_setpoints(hold_deg)

    def torque_off(self) -> None:
        self._check()
        self.torque = [on and n in self.deaf_to_torque_off for n, on in enumerate(self.torque)]

    def close(self) -> None:
        pass

    def _check(self) -> None:
        if self.gone:
            raise BusError("the port is gone")


@dataclass
class SteppedServiceLink:
    """Replaces the I/O thread's queues; journals are written to a folder when they are read."""

    folder: Path
    commands: list[QueuedCommand] = field(default_factory=list)
    stop_requests: int = 0
    stop_requested: StopCode | None = None
    closing: bool = False
    service_silent_ms: float = 0.0
    journal_ok: bool = True
    naming: str | None = None
    """Run id in the service's heartbeats, one per cycle."""
    heartbeat_count: int = 0
    dropped: int = 0
    replies: list[Reply] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    snapshots: list[Snapshot] = field(default_factory=list)
    journals: list[JournalWriter] = field(default_factory=list)

    @property
    def heartbeats(self) -> Heartbeats:
        self.heartbeat_count += 1
        return Heartbeats(self.heartbeat_count, self.naming)

    def take_stop(self) -> StopCode | None:
        requested, self.stop_requested = self.stop_requested, None
        return requested

    def request_stop(self, because: StopCode = "operator_stop") -> None:
        """A Stop arrives: it discards every command that waits."""
        self.stop_requests += 1
        self.stop_requested = self.stop_requested or because
        self.replies += [Reply(id=taken.id, refusal=STOPPED_MEANWHILE) for taken in self.commands]
        self.commands.clear()

    def request(self, number: int, command: Command, config: StationConfig) -> None:
        """A command arrives; a recording is checked."""
        built = build(command, config) if isinstance(command, Load) else None
        if isinstance(built, Refusal):
            self.replies.append(Reply(id=number, refusal=built))
        elif built:
            self.commands.append(QueuedCommand(number, command, built.trajectory, None, built.correction))
        else:
            self.commands.append(QueuedCommand(number, command))

    def take_command(self) -> QueuedCommand | None:
        return self.commands.pop(0) if self.commands else None

    def service_age_ms(self, t_ns: int) -> float:
        return self.service_silent_ms

    def reply(self, reply: Reply) -> None:
        self.replies.append(reply)

    def publish_event(self, event: Event) -> None:
        self.events.append(event)

    def publish_snapshot(self, snapshot: Snapshot) -> None:
        self.snapshots.append(snapshot)

    def open_journal(self, header: JournalHeader) -> JournalWriter:
        self.journals.append(JournalWriter(self.folder, header, JournalDisk()))
        return self.journals[-1]

    def wake(self) -> None:
        pass


class Stepped:
    """The control loop, the apparatus and the clock."""

    def __init__(
        self,
        folder: Path,
        config: StationConfig | None = None,
        apparatus: SteppedApparatus | None = None,
        *,
        settle: bool = True,
    ) -> None:
        self.config = config or StationConfig()
        self.apparatus = apparatus or SteppedApparatus()
        self.link = SteppedServiceLink(folder)
        self._t_ns = 1_000_000_000
        self.loop = ControlLoop(
            self.config,
            self.apparatus,
            self.link,
            Granted(scheduling=False, memory_lock=False),
            now_ns=self._now_ns,
        )
        with WITHOUT_COLLECTION:
            self.loop._open()
        if settle:
            self.forward(0.2)
        else:
            self.cycle()

    def copied(self, folder: Path) -> "Stepped":
        """Return a copy that writes its journals to another folder. To copy takes less time than to reach the mode again."""
        # Immutable objects are shared: they are most of what there is to copy.
        shared = [self.config, *self.config.axes, *self.link.snapshots, *self.link.events, *self.link.replies]
        made = copy.deepcopy(self, {id(one): one for one in shared})
        made.link.folder = folder
        for writer in made.link.journals:
            writer.path = folder / writer.path.name
        return made

    def _now_ns(self) -> int:
        """Return the time. A method, because a copy of this object gets its own, and would share a lambda."""
        return self._t_ns

    def forward(self, seconds: float, late_ms: float = 0.0) -> None:
        """Let time pass, cycle by cycle."""
        for _ in range(round(seconds * self.config.cycle_hz)):
            self.cycle(late_ms)

    def cycle(self, late_ms: float = 0.0) -> bool:
        """One cycle; what :meth:`ControlLoop.cycle` says."""
        self._t_ns += 1_000_000_000 // self.config.cycle_hz
        self.apparatus.t_ns = self._t_ns
        return self.loop.cycle(self._t_ns, late_ms)

    def send(
        self, command: Command, trajectory: Trajectory | None = None, correction: Correction | None = None
    ) -> Refusal | None:
        """Send a command with the present stop counter, and run the cycle that takes it."""
        return self.send_as_it_is(stamped(command, self.snapshot.stops, NEVER_NS), trajectory, correction)

    def send_as_it_is(
        self, command: Command, trajectory: Trajectory | None = None, correction: Correction | None = None
    ) -> Refusal | None:
        """Send a command with its own counter and expiry, and run the cycle that takes it."""
        self.link.commands.append(QueuedCommand(len(self.link.replies), command, trajectory, None, correction))
        self.cycle()
        return self.link.replies[-1].refusal

    def until(self, mode: str, within_s: float = 30.0) -> None:
        """Let time pass until a mode is reached."""
        for n in range(round(within_s * self.config.cycle_hz)):
            if self.mode == mode:
                return
            self.cycle()
            if (n + 1) % _WRITTEN_CYCLES == 0 and self.link.journals:
                self.link.journals[-1].write()
        raise AssertionError(f"{mode} was not reached within {within_s} s; the mode is {self.mode}")

    @property
    def mode(self) -> str:
        return self.link.snapshots[-1].mode

    @property
    def snapshot(self) -> Snapshot:
        """The newest snapshot; advance first to see a value that changes without an event."""
        return self.link.snapshots[-1]

    @property
    def estop(self) -> str:
        return self.snapshot.estop

    @property
    def torque(self) -> bool:
        return any(self.apparatus.torque)

    def causes(self) -> list[str]:
        stop = self.snapshot.stop
        return [cause.code for cause in stop.causes] if stop else []

    def journal(self, number: int = -1) -> Journal:
        """Return a journal as it is on disk after all queued writes."""
        writer = self.link.journals[number]
        writer.write()
        return read(writer.path)
