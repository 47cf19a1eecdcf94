"""A station on virtual time: the real control loop, supervisor and driver with simulated drives and mechanics in one process.

Every byte goes through driver, CRC and simulated registers. Only the clock is stepped and the disk is in memory. The result depends
only on configuration and seed.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from msgspec import structs

from kata.device import journal, references
from kata.device.bus.drivers import make_bus
from kata.device.config import StationConfig
from kata.device.ipc import Heartbeats, QueuedCommand
from kata.device.journal import Journal, JournalDisk, JournalHeader, JournalWriter
from kata.device.loop import ControlLoop
from kata.device.messages import (
    Approach,
    Command,
    Event,
    FinishTeaching,
    Load,
    Mode,
    Play,
    Refusal,
    Reply,
    Snapshot,
    Teach,
    stamped,
)
from kata.evaluation.world import World
from kata.motion.axes import CANONICAL_SIDE, Side
from kata.motion.taught import Taught
from kata.simulator.hand import GuidedMotion
from kata.system.realtime import Granted

_NEVER_NS: Final = 2**62
"""Commands of a virtual station are executed in the next cycle, so they do not expire."""
_SPARE_S: Final = 30.0
"""A wait is given up this long after its expected end."""


class EvaluationError(Exception):
    """A case could not be completed; the message is the reason."""


class VirtualStation:
    """One apparatus and its control, from its switching on."""

    def __init__(self, config: StationConfig, seed: int | None = None, side: Side = CANONICAL_SIDE) -> None:
        """``config``: for the canonical side. ``seed`` varies the simulated mechanics."""
        self._side = side
        config = structs.replace(config, side=side)
        self._world = World(config, seed, turned=side != CANONICAL_SIDE)
        self._link = _DirectLink(config)
        self._loop = ControlLoop(
            config,
            make_bus(config, self._world.open_transport),
            self._link,
            Granted(scheduling=False, memory_lock=False),
            now_ns=lambda: self._world.t_ns,
            sleep=self._world.sleep,
        )
        self._until(lambda: self._link.mode == "idle", "the apparatus does not connect", 0.0)

    @property
    def t_ns(self) -> int:
        """Time of the station's clock."""
        return self._world.t_ns

    def teach(self, motion: Taught) -> Journal:
        """Teach by the simulated hand with the pedal pressed.

        :raises EvaluationError: when the apparatus stops.
        """
        self._send(Teach(teaching_id=motion.name, side=self._side))
        self._guide(motion, pedal=True)
        self._send(FinishTeaching())
        return self._link.journal()

    def reposition(self, motion: Taught) -> None:
        """Let the hand guide the arm without recording."""
        self._guide(motion, pedal=False)

    def play(self, load: Load, duration_s: float) -> Journal:
        """Load a recording, approach its start, play it and return.

        :raises EvaluationError: when a command is refused, or the apparatus stops.
        """
        self._send(structs.replace(load, side=self._side))
        self._send(Approach())
        self._until(lambda: self._link.mode == "paused", "the start is not reached", _SPARE_S)
        self._send(Play())
        self._until(lambda: self._link.mode == "idle", "the end is not reached", duration_s + _SPARE_S)
        return self._link.journal()

    def _guide(self, motion: Taught, *, pedal: bool) -> None:
        hand = GuidedMotion()
        hand.add(motion.times_s.tolist(), motion.poses_deg.tolist())
        self._world.apparatus.guide(motion.name, hand, pedal)
        duration_s = self._world.apparatus.state().hand.left_s
        self._until(lambda: self._world.apparatus.hand_is_away, "the hand does not finish", duration_s)

    def _send(self, command: Command) -> None:
        self._link.queue(command)
        self._cycle()
        refusal = self._link.refusal
        if refusal:
            raise EvaluationError(f"{refusal.message} {refusal.next_step}")

    def _until(self, done: Callable[[], bool], failure: str, duration_s: float) -> None:
        limit_ns = self._world.t_ns + int((duration_s + _SPARE_S) * 1e9)
        while not done():
            if self._world.t_ns > limit_ns:
                raise EvaluationError(failure)
            self._cycle()

    def _cycle(self) -> None:
        self._loop.tick()
        stop = self._link.snapshot and self._link.snapshot.stop
        if stop:
            raise EvaluationError(" ".join(cause.message for cause in stop.causes))


class _DirectLink:
    """A :class:`~kata.device.ipc.ServiceLink` to the caller in the same thread."""

    closing = False
    stop_requests = 0
    heartbeats: Heartbeats = Heartbeats(0, None)
    dropped = 0
    journal_ok = True

    def __init__(self, config: StationConfig) -> None:
        self._config = config
        self._command: QueuedCommand | None = None
        self._reply: Reply | None = None
        self._memory = _Memory()
        self._writer: JournalWriter | None = None
        self._requests = 0
        self.snapshot: Snapshot | None = None

    def queue(self, command: Command) -> None:
        """Queue a command for the next cycle."""
        self._requests += 1
        command = stamped(command, self.snapshot.stops if self.snapshot else 0, _NEVER_NS)
        self._command = _prepare(self._requests, command, self._config)

    @property
    def refusal(self) -> Refusal | None:
        """Refusal of the last command, or None."""
        assert self._reply is not None and self._reply.id == self._requests
        return self._reply.refusal

    @property
    def mode(self) -> Mode:
        """Mode in the newest snapshot."""
        return self.snapshot.mode if self.snapshot else "offline"

    def journal(self) -> Journal:
        """Return the last journal, which must have ended."""
        self.wake()
        return journal.parse(bytes(self._memory.data), "memory")

    # -- used by the control loop ----------------------------------------------------------------------------------

    def take_stop(self) -> None:
        """See :class:`~kata.device.ipc.ServiceLink`."""

    def take_command(self) -> QueuedCommand | None:
        """See :class:`~kata.device.ipc.ServiceLink`."""
        command, self._command = self._command, None
        return command

    def service_age_ms(self, t_ns: int) -> float:
        """See :class:`~kata.device.ipc.ServiceLink`."""
        return 0.0

    def reply(self, reply: Reply) -> None:
        """See :class:`~kata.device.ipc.ServiceLink`."""
        self._reply = reply

    def publish_event(self, event: Event) -> None:
        """See :class:`~kata.device.ipc.ServiceLink`."""

    def publish_snapshot(self, snapshot: Snapshot) -> None:
        """See :class:`~kata.device.ipc.ServiceLink`."""
        self.snapshot = snapshot

    def open_journal(self, header: JournalHeader) -> JournalWriter:
        """See :class:`~kata.device.ipc.ServiceLink`."""
        self._writer = JournalWriter(Path(), header, self._memory)
        return self._writer

    def wake(self) -> None:
        """See :class:`~kata.device.ipc.ServiceLink`."""
        if self._writer:
            self._writer.write()


def _prepare(number: int, command: Command, config: StationConfig) -> QueuedCommand:
    """Return a command as the device process passes it to the control thread."""
    built = references.build(command, config) if isinstance(command, Load) else None
    if isinstance(built, references.Reference):
        return QueuedCommand(number, command, built.trajectory, None, built.correction)
    return QueuedCommand(number, command, None, built)


class _Memory(JournalDisk):
    """Stores the last journal in memory."""

    def __init__(self) -> None:
        self.data = bytearray()

    def create(self, path: Path) -> int:
        """See :class:`~kata.device.journal.JournalDisk`."""
        self.data.clear()
        return 0

    def write(self, file: int, data: bytearray) -> int:
        """See :class:`~kata.device.journal.JournalDisk`."""
        self.data += data
        return len(data)
