"""The station: sends commands to the device process and publishes its state."""

import asyncio
import itertools
import logging
import time
from collections.abc import Awaitable, Callable, Collection
from contextlib import AbstractContextManager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final
from uuid import UUID

import msgspec

from kata.device.config import StationConfig, write
from kata.device.ipc_messages import (
    Command,
    CommandName,
    Event,
    FromDevice,
    JournalClosed,
    Load,
    Refusal,
    Reply,
    Request,
    Snapshot,
    Stop,
    Teach,
    TorqueState,
)
from kata.device.late_command import out_of_date
from kata.motion.axes import Side
from kata.station import texts
from kata.station.device_process import DeviceLaunch, DeviceProcess
from kata.station.drive_trend import DriveTrend
from kata.station.guard import Guard, StateClock
from kata.station.lease import AbsenceAction, Browser
from kata.station.lease_manager import LeaseManager
from kata.station.live_builder import LiveBuilder
from kata.station.schemas import AxisInfo, EventLive, Live, StationInfo
from kata.station.snapshot_tracker import Occupation, SnapshotTracker
from kata.station.subscriptions import Subscription, Subscriptions

log = logging.getLogger(__name__)

_REPLY_LIMIT_S: Final = 2.0
_LOAD_LIMIT_S: Final = 35.0
"""Longest wait for the reply to a Load. The device checks the recording first, for at most 30 s."""
_SNAPSHOT_LIMIT_S: Final = 2.0
"""Longest wait for a snapshot. The device sends at least ten a second."""
_SNAPSHOT_POLL_S: Final = 0.005
NO_ANSWER: Final = "no_answer"
"""Code of a refusal after a timeout. The device may have carried out the command."""
_NO_ANSWER: Final = Refusal.of(
    code=NO_ANSWER,
    message=texts.NO_ANSWER(),
    next_step=texts.LOOK_BEFORE_TRYING_AGAIN(),
)
_NOT_NOW: Final = Refusal.of(
    code="not_idle",
    message=texts.TURN_ONLY_WHEN_IDLE(),
    next_step=texts.END_OR_ACKNOWLEDGE_FIRST(),
)
_COMMISSIONING: Final = Refusal.of(
    code="commissioning_runs",
    message=texts.COMMISSIONING_RUNS(),
    next_step=texts.WAIT_FOR_COMMISSIONING(),
)
_MAY_HOLD: Final = Refusal.of(
    code="torque_not_off",
    message=texts.MAY_HOLD_ARM(),
    next_step=texts.SUPPORT_UNTIL_TORQUE_OFF(),
)
_OFFLINE: Final = Refusal.of(
    code="device_offline",
    message=texts.DEVICE_OFFLINE(),
    next_step=texts.WAIT_FOR_RESTART(),
)


@dataclass(frozen=True)
class _PendingCommand:
    """A command without a reply yet, and the run or teaching that it begins."""

    reply: asyncio.Future[Refusal | None]
    """Cancelled when the caller has stopped waiting."""
    occupation: Occupation | None
    refused_late: Callable[[], None] | None


class Station:
    """One apparatus as the service uses it. Use this class only in the service's event loop."""

    def __init__(
        self,
        config: StationConfig,
        launch: DeviceLaunch,
        *,
        simulated: bool,
        on_journal: Callable[[Path | None], None],
        on_absence_action: Callable[[Browser, AbsenceAction], None] = lambda browser, action: None,
        not_commissioned: Refusal | None = None,
    ) -> None:
        """``on_journal`` is called with each complete journal, and with None when a device process has ended and may have left journals
        behind. ``on_absence_action`` is called when the station pauses or stops because the operator's browser is unreachable.
        ``not_commissioned``: a refusal of every motion for a patient, or None.
        """
        self.config = config
        self.info = _info(config, simulated=simulated)
        self._on_journal = on_journal
        self._station_file = launch.station_file
        self._unfit: dict[CommandName, Refusal] = {}
        """Commands that the station refuses because it is not commissioned, or because its new configuration could not be stored."""
        self._not_stored: Refusal | None = None
        """Why the last commissioning's configuration could not be stored. The device process then has the former one."""
        self._setting_side = asyncio.Lock()
        self._stop_user: Callable[[], Awaitable[Refusal | None]] | None = None
        """Stops the program that uses the drives instead of the device process; None while the device process uses them."""
        self._process = DeviceProcess(launch, self._take, self._ended, self._occupation_id)
        self._numbers = itertools.count(1)
        self._pending: dict[int, _PendingCommand] = {}
        self._tracker = SnapshotTracker()
        self._subscriptions = Subscriptions()
        self.drive_trend = DriveTrend()
        self.clock = StateClock()
        self._live: tuple[object, Live] | None = None
        self._live_builder = LiveBuilder()
        self.lease_manager = LeaseManager(self.command, self._subscriptions.note_change, on_absence_action)
        self.set_not_commissioned(not_commissioned)

    def set_not_commissioned(self, refusal: Refusal | None) -> None:
        """Refuse every motion for a patient with ``refusal``; None allows motions again, unless a new configuration could not be stored."""
        commands: tuple[CommandName, ...] = ("load", "teach")
        unfit = self._not_stored or refusal
        self._unfit = dict.fromkeys(commands, unfit) if unfit else {}
        self._subscriptions.note_change()

    def start(self) -> None:
        """Start the device process and restart it whenever it ends."""
        self._process.start()

    async def close(self) -> None:
        """Stop the device process. It switches torque off and saves its journal."""
        await self._process.close()
        self._on_journal(None)

    # -- commands -------------------------------------------------------------------------------------------------

    async def command(
        self,
        command: Command,
        occupation: Occupation | None = None,
        *,
        by: Browser | None = None,
        refused_late: Callable[[], None] | None = None,
    ) -> Refusal | None:
        """Send a command to the device. Return None when the device accepts it.

        ``occupation``: the run or teaching that the command begins. ``refused_late`` is called when the device refuses the command after
        the timeout. ``by``: the browser that sends the command. For every command except Stop it needs the lease, and takes it if it is
        free. None: the station itself, which needs no lease.
        """
        if self._stop_user is not None:
            return await self._stop_user() if isinstance(command, Stop) else _COMMISSIONING
        # Check the lease only now, because another browser may have taken over while the recording was checked.
        if by and not isinstance(command, Stop) and (elsewhere := self.lease_manager.take(by)):
            return elsewhere
        # The mode may have changed while the recording was checked.
        if isinstance(command, Load | Teach) and (
            refusal := self.refusal("load" if isinstance(command, Load) else "teach")
        ):
            return refusal
        # A Stop is sent to every running process, also before its first snapshot.
        if not self._process.running or (self._tracker.snapshot is None and not isinstance(command, Stop)):
            return _OFFLINE
        number = next(self._numbers)
        reply: asyncio.Future[Refusal | None] = asyncio.get_running_loop().create_future()
        self._pending[number] = _PendingCommand(reply, occupation, refused_late)
        self._process.send(Request(id=number, command=command))
        try:
            async with asyncio.timeout(_LOAD_LIMIT_S if isinstance(command, Load) else _REPLY_LIMIT_S):
                refusal = await reply
        except TimeoutError:
            self._occupy(occupation)
            refusal = _NO_ANSWER
        return refusal

    def refusal(self, name: CommandName) -> Refusal | None:
        """Return the refusal of this command, by the newest snapshot or because the station is not commissioned; None if it is allowed."""
        if self._stop_user is not None:
            return _COMMISSIONING
        if not self._process.running or self._tracker.snapshot is None:
            return _OFFLINE
        return self._tracker.snapshot.refusals.get(name) or self._unfit.get(name)

    async def hand_over(self, stop: Callable[[], Awaitable[Refusal | None]], guard: Guard) -> Refusal | None:
        """End the device process, so that another program can use the drives. Return None when they are free.

        Until :meth:`take_back` a user's Stop calls ``stop``, which stops the other program. ``guard`` is that of the request.
        """
        async with self._setting_side:
            if self._stop_user is not None:
                return _COMMISSIONING
            # Without a connected device process no drive has torque that this service has switched on.
            snapshot = await _present_snapshot(self._process, self._tracker, self._pending)
            if isinstance(snapshot, Refusal):
                return snapshot
            if refusal := _late(snapshot, guard) or (_side_refusal(snapshot) if snapshot else None):
                return refusal
            self._stop_user = stop
            await self._process.close()
            self._ended()
        return None

    def take_back(self, config: StationConfig | None = None) -> None:
        """Start the device process again after :meth:`hand_over`. ``config``: the new configuration; None: unchanged."""
        if config is not None:
            self._not_stored = self._store(msgspec.structs.replace(config, side=self.config.side))
            if self._not_stored:
                self.set_not_commissioned(self._not_stored)
        self._stop_user = None
        self._tracker.has_run = False  # A planned restart is no control program that does not answer.
        self._process.start()
        self._subscriptions.note_change()

    async def set_side(self, side: Side, meanwhile: Callable[[], Awaitable[None]]) -> Refusal | None:
        """Set the side of the apparatus. Return None if the side is set, or was set before.

        Two drives then turn in the opposite direction. A device process must know the side before its first request to the drives.
        Therefore the running process ends and another one starts. ``meanwhile`` is awaited between the two. The new process verifies every
        drive, and the emergency stop must be tested again.
        """
        async with self._setting_side:
            if side == self.config.side:
                return None
            snapshot = await _present_snapshot(self._process, self._tracker, self._pending)
            if refusal := snapshot if isinstance(snapshot, Refusal) else _side_refusal(snapshot):
                return refusal
            await self._process.close()
            self._ended()
            try:
                await meanwhile()
                return await asyncio.to_thread(self._store, msgspec.structs.replace(self.config, side=side))
            finally:
                self._process.start()

    def _store(self, config: StationConfig) -> Refusal | None:
        """Use a configuration from the next device process on. Return a refusal if its file cannot be written."""
        if refusal := _write(config, self._station_file):
            return refusal
        self.config, self.info = config, _info(config, simulated=self.info.simulated)
        return None

    # -- state ----------------------------------------------------------------------------------------------------

    @property
    def torque(self) -> TorqueState:
        """Torque of all drives. It is unknown without a device process, and while a command that may switch torque on has no reply."""
        snapshot = self._tracker.snapshot
        if snapshot is None or not self._process.running or (self._pending and snapshot.torque == "off"):
            return "unknown"
        return snapshot.torque

    @property
    def occupied(self) -> bool:
        """True while the motors move or hold an arm, or may do so, and the control loop therefore needs this computer.

        Offline with unknown torque does not count, because the loop controls nothing; a station that is off at night has this state.
        """
        live = self.live()
        return live.torque == "on" or (live.torque == "unknown" and live.mode != "offline")

    @property
    def operator_under_torque(self) -> UUID | None:
        """Return the operator's login session while a motor has torque or may have it, else None. Callable from any thread."""
        snapshot, holder = self._tracker.snapshot, self.lease_manager.holder
        return holder.id if snapshot and holder and snapshot.torque != "off" else None

    @property
    def verified_since_s(self) -> float | None:
        """Return the time of the monotonic clock since which every drive is verified without interruption, else None."""
        snapshot = self._tracker.snapshot
        since_ns = snapshot.verified_since_ns if snapshot and self._process.running else None
        return None if since_ns is None else since_ns / 1e9

    @property
    def version(self) -> object:
        """Return a value that changes with :meth:`live`, apart from time and age."""
        return self._subscriptions.changes, self._process.running, self.config.side

    @property
    def age_ms(self) -> float | None:
        """Return the age of the newest snapshot, None without one."""
        return self._tracker.age_ms

    def live(self) -> Live:
        """Return the newest state with its age. The part that lasts until the next change is built once for all callers."""
        if self._live is None or self._live[0] != self.version:
            self._live = self.version, self._new_live()
            return self._live[1]
        return self._live[1].model_copy(update=self._changing_fields())

    def _changing_fields(self) -> dict[str, Any]:
        """Return the fields of :meth:`live` that change without a change of :attr:`version`."""
        return {"at": self.clock.now(), "age_ms": self.age_ms, "lease": self.lease_manager.lease_for(None)}

    def _new_live(self) -> Live:
        tracker = self._tracker
        if self._process.running and tracker.snapshot is not None:
            device, state = "running", tracker.known_fields(tracker.snapshot)
            state["refusals"] = msgspec.to_builtins(self._unfit) | state["refusals"]
        else:
            why = _OFFLINE if self._stop_user is None else _COMMISSIONING
            device, state = "restarting" if tracker.has_run else "starting", tracker.unknown_fields(why)
        around = {"device": device, "side": self.config.side}
        return self._live_builder.build(state | around | self._changing_fields())

    @property
    def occupation(self) -> Occupation | None:
        """Return the last run or teaching that began. It may have ended since; the live state shows that."""
        return self._tracker.occupation

    def subscribed(self) -> AbstractContextManager[Subscription]:
        """Subscribe to changes and events during the block."""
        return self._subscriptions.subscribed()

    def publish(self, item: object) -> None:
        """Send an item to every listener, in addition to the device's events."""
        self._subscriptions.put(item)

    # -- messages of the device process ---------------------------------------------------------------------------

    def _take(self, message: FromDevice) -> None:
        match message:
            case Reply():
                self._take_reply(message)
            case Snapshot():
                self._subscriptions.note_snapshot(self._tracker.snapshot, message)
                self._tracker.take(message, self.config.side)
                self.drive_trend.take(message)
                self.lease_manager.act_if_due(message)
            case Event():
                self._take_event(message)
            case JournalClosed():
                self._on_journal(Path(message.path))

    def _take_reply(self, message: Reply) -> None:
        pending = self._pending.pop(message.id, None)
        if pending is None:
            return
        if message.refusal is None:
            self._occupy(pending.occupation)
        if not pending.reply.done():
            pending.reply.set_result(message.refusal)
        elif message.refusal and pending.refused_late:
            pending.refused_late()

    def _take_event(self, message: Event) -> None:
        if message.code == "load_reversal":
            self._tracker.note_reversal(message)
            self._subscriptions.note_change()
        ago = timedelta(microseconds=(time.monotonic_ns() - message.t_ns) / 1000)
        self.publish(
            EventLive(
                number=message.number,
                code=message.code,
                message=message.message,
                message_key=msgspec.to_builtins(message.message_key),
                at=datetime.now(UTC) - ago,
            )
        )

    def _occupy(self, occupation: Occupation | None) -> None:
        """Store the run or teaching that has begun, and send it to the device before any command that could switch torque on."""
        if occupation:
            self._tracker.begin(occupation)
            self._subscriptions.note_change()
            self._process.beat()

    def _occupation_id(self) -> str:
        return self.occupation.id if self.occupation else ""

    def _ended(self) -> None:
        self._tracker.clear()
        for pending in self._pending.values():
            if not pending.reply.done():
                pending.reply.set_result(_OFFLINE)
        self._pending.clear()
        self._subscriptions.note_change()
        self._on_journal(None)


def _write(config: StationConfig, file: Path) -> Refusal | None:
    """Write the station's file. Return a refusal if it cannot be written."""
    try:
        write(config, file)
    except OSError as error:
        log.exception("the station's file cannot be written")
        return Refusal.of(
            code="file_not_written",
            message=texts.FILE_NOT_WRITTEN(error=error.strerror or str(error)),
            next_step=texts.FREE_SPACE_OR_ASK(),
        )
    return None


async def _present_snapshot(
    process: DeviceProcess, tracker: SnapshotTracker, pending: Collection[int]
) -> Snapshot | Refusal | None:
    """Wait for a snapshot that contains the effect of every command so far. Return None without a process, and a refusal after a timeout.

    The newest snapshot is up to 100 ms old. A command, above all a Stop, may have had its reply in the meantime. ``pending``: the numbers
    of the commands without a reply.
    """
    now_ns = time.monotonic_ns()
    try:
        async with asyncio.timeout(_SNAPSHOT_LIMIT_S):
            while process.running:
                if tracker.snapshot is not None and tracker.snapshot.t_ns > now_ns and not pending:
                    return tracker.snapshot
                await asyncio.sleep(_SNAPSHOT_POLL_S)
    except TimeoutError:
        return _NO_ANSWER if tracker.snapshot else _OFFLINE
    return None


def _late(snapshot: Snapshot | None, guard: Guard) -> Refusal | None:
    """Return the refusal of a request that has expired, or whose sender has not seen the newest stop; None if it is in time."""
    stops = snapshot.stops if snapshot else guard.stops
    return out_of_date(guard.stops, guard.expires_ns, stops=stops, t_ns=time.monotonic_ns())


def _side_refusal(snapshot: Snapshot | None) -> Refusal | None:
    """Return the refusal to restart the device process now; None if it may be restarted. ``snapshot``: the newest one; None without a process.

    Offline with unknown torque the apparatus may be turned, because an apparatus that is switched off has this state. No stop
    is latched in this state, and ending or starting a device process does not change the torque of a drive that it has not switched
    on. If drives hold an arm when the next process connects, it reports the fault ``torque_found``.
    """
    if snapshot is None:
        return _OFFLINE
    if snapshot.mode not in ("idle", "offline"):
        return _NOT_NOW
    if snapshot.torque == "on" or (snapshot.torque == "unknown" and snapshot.mode == "idle"):
        return _MAY_HOLD
    return None


def _info(config: StationConfig, *, simulated: bool) -> StationInfo:
    return StationInfo(
        name=config.name,
        rate_hz=config.rate_hz,
        cycle_hz=config.cycle_hz,
        simulated=simulated,
        axes=[
            AxisInfo(motor=n, min_deg=a.min_deg, max_deg=a.max_deg, max_speed_deg_s=a.max_speed_deg_s)
            for n, a in enumerate(config.axes, start=1)
        ],
    )
