"""Runs the device's control loop in this thread, without the service, to play motions for commissioning and evaluation.

Patients are treated with the same loop, supervision, references and driver.
"""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final

from msgspec import structs

from kata.device import journal, references
from kata.device.bus.factory import make_bus
from kata.device.bus.interface import BusError
from kata.device.bus.serial_transport import Transport
from kata.device.config import StationConfig
from kata.device.ipc import Heartbeats, QueuedCommand
from kata.device.ipc_messages import (
    Approach,
    Command,
    Event,
    Load,
    Mode,
    Play,
    Refusal,
    Reply,
    Snapshot,
    stamped,
)
from kata.device.journal import Journal, JournalDisk, JournalHeader, JournalWriter
from kata.device.loop import ControlLoop
from kata.motion.axes import N_AXES
from kata.system.realtime import Granted

_NEVER_NS: Final = 2**62
"""Expiry of commands. Commands are executed in the next cycle, so they need not expire."""
_OFF_ATTEMPTS: Final = 100
"""Largest number of torque-off messages. No drive confirms the message, and it may be lost."""
_SPARE_S: Final = 30.0
"""A wait that lasts this much longer than expected ends with an error."""


class PlaybackError(Exception):
    """A motion could not be taught or played to its end. The exception's message states the reason."""


class RefusedPlayError(PlaybackError):
    """A command was refused before a motor moved, or a motor could not carry the arm from where it was."""


class DirectStation:
    """One apparatus with its control loop. Creating it connects to the drives."""

    def __init__(
        self,
        config: StationConfig,
        open_transport: Callable[[str, int], Transport],
        now_ns: Callable[[], int],
        sleep: Callable[[float], None],
    ) -> None:
        """Connect. ``config`` contains the side. ``now_ns`` and ``sleep``: the clock of the transport.

        :raises PlaybackError: when the apparatus does not connect.
        """
        self.config = config
        self._now_ns = now_ns
        self._link = _DirectLink(config)
        self._bus = make_bus(config, open_transport)
        self._loop = ControlLoop(
            config,
            self._bus,
            self._link,
            Granted(scheduling=False, memory_lock=False),
            now_ns=now_ns,
            sleep=sleep,
        )
        try:
            self.until(lambda: self._link.mode == "idle", "the apparatus does not connect", 0.0)
        except BaseException:
            # Torque is left unchanged, because a drive may have held an arm before.
            self._bus.close()
            raise

    def play(self, load: Load, duration_s: float) -> Journal:
        """Load a recording, approach its start, play it and return.

        :raises PlaybackError: when a command is refused, the apparatus stops, or the arm moves back because it met resistance.
        """
        self._link.reversal = ""
        self.send(structs.replace(load, side=self.config.side))
        self.send(Approach())
        self.until(lambda: self._link.mode == "paused", "the start is not reached", _SPARE_S)
        self.send(Play())
        self.until(lambda: self._link.mode in ("idle", "paused"), "the end is not reached", duration_s + _SPARE_S)
        if self._link.mode == "paused":
            raise PlaybackError(self._link.reversal)
        return self.journal()

    def journal(self) -> Journal:
        """Return the last journal, which must have ended."""
        return self._link.journal()

    def send(self, command: Command) -> None:
        """Send a command and run the cycle that executes it.

        :raises RefusedPlayError: when the command is refused.
        """
        self._link.queue(command)
        self._cycle()
        refusal = self._link.refusal
        if refusal:
            raise RefusedPlayError(f"{refusal.message} {refusal.next_step}")

    def until(self, done: Callable[[], bool], failure: str, duration_s: float) -> None:
        """Run cycles until ``done`` returns True.

        :raises PlaybackError: with ``failure``, some time after ``duration_s``; or when the apparatus stops.
        """
        limit_ns = self._now_ns() + int((duration_s + _SPARE_S) * 1e9)
        while not done():
            if self._now_ns() > limit_ns:
                raise PlaybackError(failure)
            self._cycle()

    def close(self) -> None:
        """Switch torque off until every drive reports it, and close the port. It does not sleep, because a stopped step must not sleep."""
        unconfirmed = set(range(N_AXES))
        try:
            with suppress(BusError):
                for _ in range(_OFF_ATTEMPTS):
                    self._bus.torque_off()
                    unconfirmed -= {status.axis for status in self._bus.read().statuses if not status.torque_on}
                    if not unconfirmed:
                        break
        finally:
            self._bus.close()

    def _cycle(self) -> None:
        self._loop.tick()
        self.after_cycle()
        stop = self._link.snapshot and self._link.snapshot.stop
        if stop:
            causes = [cause.message for cause in stop.causes]
            unmoved = any(cause.code == "arm_too_heavy" for cause in stop.causes)
            failed = RefusedPlayError if unmoved else PlaybackError
            raise failed(" ".join([self._link.reversal, *causes] if self._link.reversal else causes))

    def after_cycle(self) -> None:
        """Do nothing. An evaluation overrides this to read its simulated arm."""


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
        self.reversal = ""
        """Reason why the arm moved back since the last Load; empty if it did not."""

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
        if event.code == "load_reversal":
            self.reversal = event.message

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
    """Return a command in the form in which the device process passes it to the control thread."""
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
