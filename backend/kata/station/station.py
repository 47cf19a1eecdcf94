"""The station: one door for commands, one stream of telemetry."""

import asyncio
import itertools
import logging
import time
from collections import deque
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final
from uuid import UUID

import msgspec

from kata.device.config import StationConfig, write
from kata.device.messages import (
    COMMAND_NAMES,
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
from kata.motion.axes import Side
from kata.station import texts
from kata.station.device_process import DeviceProcess
from kata.station.guard import StateClock
from kata.station.lease import Browser, Due
from kata.station.operating import Operating
from kata.station.schemas import AxisInfo, EventLive, Live, PatientRef, StationInfo, TextKey

log = logging.getLogger(__name__)

_REPLY_LIMIT_S: Final = 2.0
_LOAD_LIMIT_S: Final = 35.0
"""Limits a Load, which is answered when the recording has been checked; the device process gives that up after 30 s."""
_EVENTS_WAITING: Final = 1000
_STILL_STOPPING: Final = "still_stopping"
"""Code of the device's refusal to acknowledge while the arm slows down."""
_TORQUE_OFF_NS: Final = 500_000_000
"""Drives report that their torque is off within ten cycles of 20 ms after it was switched; until then a stop shows no held arm."""
NO_ANSWER: Final = "no_answer"
"""Code of a refusal that is none for sure: the command may have been carried out."""
_NOT_NOW: Final = Refusal.of(
    code="not_idle",
    message=texts.TURN_ONLY_WHEN_IDLE(),
    next_step=texts.END_OR_ACKNOWLEDGE_FIRST(),
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


@dataclass
class Subscription:
    """One listener's share of the telemetry: a nudge when something changed, and every event since the last look."""

    changed: asyncio.Event = field(default_factory=asyncio.Event)
    waiting: deque[object] = field(default_factory=deque)
    overflown: bool = False
    """So far behind that events would have to be dropped; it has to begin anew."""

    def put(self, item: object) -> None:
        """An event, or a notice of something saved."""
        if len(self.waiting) >= _EVENTS_WAITING:
            self.overflown = True
        else:
            self.waiting.append(item)
        self.changed.set()


@dataclass(frozen=True)
class Occupation:
    """Whose arm it is and what was loaded: known to the service, not to the device."""

    id: str
    """The teaching's or the run's."""
    patient: PatientRef
    recording_name: str | None = None
    session_id: UUID | None = None
    changes: tuple[str, ...] = ()
    """What was done to the recording for this run."""


@dataclass(frozen=True)
class _Asked:
    """A command on its way, and what it would begin."""

    reply: asyncio.Future[Refusal | None]
    """Done without an answer when whoever asked has stopped waiting."""
    occupation: Occupation | None
    refused_late: Callable[[], None] | None


class Station:
    """One apparatus. Lives in the service's event loop; every method is to be called there."""

    def __init__(
        self,
        config: StationConfig,
        station_file: Path,
        journal_folder: Path,
        *,
        simulated: bool,
        real_time: bool,
        on_journal: Callable[[Path | None], None],
        on_due: Callable[[Browser, Due], None] = lambda browser, due: None,
    ) -> None:
        """``on_journal`` is called with a journal that is complete, or with None when a device process has ended and may
        have left some behind; ``on_due`` when the station pauses or stops for want of the browser that operates it.
        """
        self.config = config
        self.info = StationInfo(
            name=config.name,
            rate_hz=config.rate_hz,
            cycle_hz=config.cycle_hz,
            simulated=simulated,
            axes=[
                AxisInfo(motor=n, min_deg=a.min_deg, max_deg=a.max_deg, max_speed_deg_s=a.max_speed_deg_s)
                for n, a in enumerate(config.axes, start=1)
            ],
        )
        self._on_journal = on_journal
        self._station_file = station_file
        self._turning = asyncio.Lock()
        self._process = DeviceProcess(
            station_file, journal_folder, self._take, self._ended, self._believed, real_time=real_time
        )
        self._numbers = itertools.count(1)
        self._asked: dict[int, _Asked] = {}
        self._snapshot: Snapshot | None = None
        self._snapshot_at_s = 0.0
        self._verified_since: datetime | None = None
        self._torque_since_ns: int | None = None
        """Of the device's clock: since then torque has not been off although a stop has come to its end."""
        self._has_run = False
        self._occupation: Occupation | None = None
        self._resistance: Event | None = None
        self.clock = StateClock()
        self.operating = Operating(self.command, self._changed, on_due)
        self._changes = 0
        self._subscriptions: list[Subscription] = []

    def start(self) -> None:
        """Start the device process and keep it running."""
        self._process.start()

    async def close(self) -> None:
        """Let the device process come to its end: torque off, journal kept."""
        await self._process.close()
        self._on_journal(None)

    # -- the door -------------------------------------------------------------------------------------------------

    async def command(
        self,
        command: Command,
        occupation: Occupation | None = None,
        *,
        by: Browser | None = None,
        refused_late: Callable[[], None] | None = None,
    ) -> Refusal | None:
        """Ask the device for something; None when it is accepted.

        ``occupation`` says for whom, where the command is one that begins something; ``refused_late`` is called where the
        device refuses it after all, when nobody waits any more. ``by`` needs the lease, and takes it when it is free, for anything
        but Stop; None: the station itself, which needs none.
        """
        # At the last moment: while a recording was being checked somebody else may have taken over.
        if by and not isinstance(command, Stop) and (elsewhere := self.operating.take(by)):
            return elsewhere
        # The mode may have changed while the recording was being checked: the device is not burdened with it then.
        if isinstance(command, Load | Teach) and (
            refusal := self.refusal("load" if isinstance(command, Load) else "teach")
        ):
            return refusal
        # Whatever is known of the device: a Stop goes out if there is anybody to hear it.
        if not self._process.running or (self._snapshot is None and not isinstance(command, Stop)):
            return _OFFLINE
        number = next(self._numbers)
        reply: asyncio.Future[Refusal | None] = asyncio.get_running_loop().create_future()
        self._asked[number] = _Asked(reply, occupation, refused_late)
        self._process.send(Request(id=number, command=command))
        try:
            async with asyncio.timeout(_LOAD_LIMIT_S if isinstance(command, Load) else _REPLY_LIMIT_S):
                refusal = await reply
        except TimeoutError:
            self._occupy(occupation)
            refusal = Refusal.of(
                code=NO_ANSWER,
                message=texts.NO_ANSWER(),
                next_step=texts.LOOK_BEFORE_TRYING_AGAIN(),
            )
        return refusal

    def refusal(self, name: CommandName) -> Refusal | None:
        """Return why the device would refuse this command, by its newest snapshot; None when it would not, or is not known to."""
        if not self._process.running or self._snapshot is None:
            return _OFFLINE
        return self._snapshot.refusals.get(name)

    async def set_side(self, side: Side, meanwhile: Callable[[], Awaitable[None]]) -> Refusal | None:
        """The apparatus is to stand, or already stands, for a side; None when it then counts as doing so.

        The drives then turn the other way round, so that a device process must know before it asks them for the first time: the one
        that runs ends, and another begins. ``meanwhile`` is awaited in between. The next one verifies every drive again, so that the
        emergency stop has to be tested again.
        """
        async with self._turning:
            if side == self.config.side:
                return None
            if refusal := self._turning_refusal():
                return refusal
            await self._process.close()
            self._ended()
            try:
                await meanwhile()
                self.config = msgspec.structs.replace(self.config, side=side)
                await asyncio.to_thread(write, self.config, self._station_file)
            finally:
                self._process.start()
        return None

    def _turning_refusal(self) -> Refusal | None:
        """Return why the device process may not be ended now.

        Offline with unknown torque, the apparatus may be turned: that is how one that is switched off looks. Nothing is latched then, and
        neither end nor start of a device process changes the torque of a drive that it has not switched on. Drives that hold an arm
        when the next one connects are its fault ``torque_found``.
        """
        snapshot = self._snapshot
        if snapshot is None or not self._process.running:
            return _OFFLINE
        if snapshot.mode not in ("idle", "offline"):
            return _NOT_NOW
        if snapshot.torque == "on" or (snapshot.torque == "unknown" and snapshot.mode == "idle"):
            return _MAY_HOLD
        return None

    @property
    def torque(self) -> TorqueState:
        """Of all drives; unknown while a command is on its way that may switch it on, and without a device process."""
        if self._snapshot is None or not self._process.running:
            return "unknown"
        if self._asked and self._snapshot.torque == "off":
            return "unknown"
        return self._snapshot.torque

    @property
    def occupied(self) -> bool:
        """Return True while the motors move or hold an arm, or may do so, and the control loop needs this computer.

        Offline with unknown torque does not count: the loop controls nothing, and a station that is switched off at night looks so.
        """
        live = self.live()
        return live.torque == "on" or (live.torque == "unknown" and live.mode != "offline")

    @property
    def at_the_arm(self) -> UUID | None:
        """Return the operator's sign-in while a motor has torque or may have it, else None. Callable from any thread."""
        snapshot, holder = self._snapshot, self.operating.by
        return holder.id if snapshot and holder and snapshot.torque != "off" else None

    # -- telemetry ------------------------------------------------------------------------------------------------

    @property
    def version(self) -> object:
        """Another one whenever :meth:`live` would tell something else, but for its time and age."""
        return self._changes, self._process.running, self.config.side

    @property
    def age_ms(self) -> float | None:
        """Since the device process last said anything; None when it never has."""
        return None if self._snapshot is None else (time.monotonic() - self._snapshot_at_s) * 1000

    def live(self) -> Live:
        """The newest state, with its age."""
        snapshot = self._snapshot
        running = self._process.running and snapshot is not None
        if running and snapshot is not None:
            state = msgspec.to_builtins(snapshot)
            state["run"] = self._with_occupation(state["run"], "run_id")
            state["teaching"] = self._with_occupation(state["teaching"], "teaching_id")
            if snapshot.run:
                met = self._resistance if snapshot.run.reversals else None
                state["run"]["resistance"] = met and met.message
                state["run"]["resistance_key"] = met and msgspec.to_builtins(met.message_key)
            if snapshot.stop:
                state["stop"]["arm_held"] = self._may_hold(snapshot)
        else:
            state = self._unknown(snapshot)
        device = "running" if running else "restarting" if self._has_run else "starting"
        around = {
            "device": device,
            "at": self.clock.now(),
            "age_ms": self.age_ms,
            "side": self.config.side,
            "verified_since": self._verified_since if running else None,
            "lease": self.operating.told(None),
        }
        return Live.model_validate(state | around)

    @property
    def occupation(self) -> Occupation | None:
        """What was last begun: it may have ended since, which the live state tells."""
        return self._occupation

    @contextmanager
    def subscribed(self) -> Iterator[Subscription]:
        """Listen for as long as the context lasts."""
        subscription = Subscription()
        self._subscriptions.append(subscription)
        try:
            yield subscription
        finally:
            self._subscriptions.remove(subscription)

    def tell(self, item: object) -> None:
        """Something that every listener has to know besides the device's own events."""
        for subscription in self._subscriptions:
            subscription.put(item)

    # -- what the device process says -----------------------------------------------------------------------------

    def _take(self, message: FromDevice) -> None:
        match message:
            case Reply():
                self._answered(message)
            case Snapshot():
                self._note_verification(message)
                self._note_torque(message)
                self._snapshot = message
                self._has_run = True
                self._snapshot_at_s = time.monotonic()
                self._changed()
                self.operating.look(message)
            case Event():
                if message.code == "load_reversal":
                    self._resistance = message
                    self._changes += 1
                since = timedelta(microseconds=(time.monotonic_ns() - message.t_ns) / 1000)
                self.tell(
                    EventLive(
                        number=message.number,
                        code=message.code,
                        message=message.message,
                        message_key=msgspec.to_builtins(message.message_key),
                        at=datetime.now(UTC) - since,
                    )
                )
            case JournalClosed():
                self._on_journal(Path(message.path))

    def _answered(self, message: Reply) -> None:
        asked = self._asked.pop(message.id, None)
        if asked is None:
            return
        if message.refusal is None:
            self._occupy(asked.occupation)
        if not asked.reply.done():
            asked.reply.set_result(message.refusal)
        elif message.refusal and asked.refused_late:
            asked.refused_late()

    def _note_verification(self, snapshot: Snapshot) -> None:
        """Put the device's monotonic time on the wall clock once, when it changes: events in the database have that clock."""
        since_ns = snapshot.verified_since_ns
        if since_ns is None:
            self._verified_since = None
        elif self._snapshot is None or self._snapshot.verified_since_ns != since_ns:
            ago = timedelta(microseconds=(time.monotonic_ns() - since_ns) / 1000)
            self._verified_since = datetime.now(UTC) - ago

    def _note_torque(self, snapshot: Snapshot) -> None:
        acknowledging = snapshot.refusals.get("acknowledge")
        slowing_down = acknowledging is not None and acknowledging.code == _STILL_STOPPING
        if snapshot.stop is None or snapshot.torque == "off" or slowing_down:
            self._torque_since_ns = None
        elif self._torque_since_ns is None:
            self._torque_since_ns = snapshot.t_ns

    def _occupy(self, occupation: Occupation | None) -> None:
        """Something has begun, and the device hears at once that we know: before any command that could put torque on."""
        if occupation:
            self._occupation = occupation
            self._resistance = None
            self._changed()
            self._process.beat()

    def _changed(self) -> None:
        self._changes += 1
        for subscription in self._subscriptions:
            subscription.changed.set()

    def _believed(self) -> str:
        return self._occupation.id if self._occupation else ""

    def _ended(self) -> None:
        self._snapshot = None
        self._occupation = None
        for asked in self._asked.values():
            if not asked.reply.done():
                asked.reply.set_result(_OFFLINE)
        self._asked.clear()
        self._changed()
        self._on_journal(None)

    def _with_occupation(self, state: dict[str, Any] | None, key: str) -> dict[str, Any] | None:
        if state is None:
            return None
        known = self._occupation if self._occupation and self._occupation.id == state[key] else None
        return state | {
            "patient": known.patient if known else None,
            "recording_name": known.recording_name if known else None,
            "changes": known.changes if known else (),
            "changes_keys": [TextKey.of(one) for one in known.changes] if known else [],
            "session_id": known.session_id if known else None,
        }

    def _may_hold(self, snapshot: Snapshot) -> bool:
        """Return True if the motors hold the arm after a stop, or may hold it.

        A stop of category 2 holds from its beginning. The others end with torque off: there it counts when torque is unknown, or
        remains, after the arm has slowed down.
        """
        if snapshot.stop is None or snapshot.torque == "off":
            return False
        if all(cause.category == 2 for cause in snapshot.stop.causes):
            return True
        since_ns = self._torque_since_ns
        return since_ns is not None and (snapshot.torque == "unknown" or snapshot.t_ns - since_ns >= _TORQUE_OFF_NS)

    @staticmethod
    def _unknown(snapshot: Snapshot | None) -> dict[str, Any]:
        """With nobody there to say otherwise, everything is unknown."""
        refusal = msgspec.to_builtins(_OFFLINE)
        return {
            "mode": "offline",
            "torque": "unknown",
            "stops": 0,
            "estop": "unknown",
            "pedal": "unknown",
            "axes": [msgspec.to_builtins(axis) | {"torque": "unknown"} for axis in snapshot.axes] if snapshot else [],
            "stop": None,
            "run": None,
            "teaching": None,
            "refusals": {name: refusal for name in COMMAND_NAMES if name != "stop"},
            "loop": None,
        }
