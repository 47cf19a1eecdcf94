"""An apparatus under the stepped clock with one faulty signal."""

import random
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

from msgspec import structs

from kata.device.bus.interface import BusError, BusSample, DriveSample, DriveStatus, InputSample
from tests.support.fault_matrix import Kind
from tests.support.stepped import SteppedApparatus

_LATE_CYCLES = 10
_VERY_LATE_CYCLES = 15
_INPUT_LATE_CYCLES = 5
_SLOW = 5
_NOTHING = BusSample((None,) * 5, None, ())


@dataclass
class FaultyApparatus(SteppedApparatus):
    """A fault changes the bus's reading of a signal; the arm itself still follows its setpoints."""

    kind: Kind | None = None
    signal: str = ""
    history: deque[BusSample] = field(default_factory=lambda: deque(maxlen=20))
    number: int = 0
    dice: random.Random = field(default_factory=lambda: random.Random(1))
    last: BusSample | None = None
    statuses: list[DriveStatus] = field(default_factory=list)
    """The faulty drive's readings before the fault changed them."""

    def read(self) -> BusSample:
        true = super().read()
        self.history.append(true)
        self.number += 1
        if self.kind is None:
            self.last = true
            return true
        what, _, motor = self.signal.partition(" ")
        match what:
            case "position" | "current" | "reply":
                axis = int(motor) - 1
                drives = list(true.drives)
                drives[axis] = self._drive(what, axis, drives[axis])
                corrupt = frozenset({axis}) if (what, self.kind) == ("reply", "garbage") else frozenset()
                statuses = (
                    true.statuses if what != "reply" else tuple(s for s in true.statuses if self._status(s.axis, axis))
                )
                return structs.replace(true, drives=tuple(drives), corrupt=corrupt, statuses=statuses)
            case "registers" | "torque":
                return structs.replace(true, statuses=tuple(self._reported(what, int(motor) - 1, true.statuses)))
            case "e-stop" | "second" | "pedal":
                return structs.replace(true, inputs=self._inputs(what, true.inputs))
            case "bus":
                return self._whole(true)
        return true

    def _reported(self, what: str, faulty: int, statuses: Iterable[DriveStatus]) -> Iterator[DriveStatus]:
        """Values of the faulty drive's status."""
        for status in statuses:
            if status.axis != faulty:
                yield status
                continue
            self.statuses.append(status)
            if self.kind == "slow" and len(self.statuses) % _SLOW:
                continue
            if self.kind == "delayed":
                yield from self.statuses[-2:-1]
            elif reading := self._registers(status) if what == "registers" else self._torque_word(status):
                yield reading

    def _registers(self, now: DriveStatus) -> DriveStatus:
        match self.kind:
            case "off":
                return structs.replace(now, verified=False, mismatch="")
            case "garbage":
                return structs.replace(now, verified=False, mismatch="goal current")
            case "wrong":
                if len(self.statuses) == 1:
                    self.mismatch[now.axis] = "position gains"
                wrong = self.mismatch[now.axis]
                return structs.replace(now, verified=not wrong, mismatch=wrong)
            case "intermittent" if len(self.statuses) % 2:
                return structs.replace(now, verified=False, mismatch="goal current")
        return now

    def _torque_word(self, now: DriveStatus) -> DriveStatus | None:
        match self.kind:
            case "off":
                return None
            case "stuck":
                return structs.replace(now, torque_on=self.statuses[0].torque_on)
            case "garbage":
                return structs.replace(now, torque_on=self.dice.random() < 0.5)
            case "wrong":
                return structs.replace(now, torque_on=not now.torque_on)
            case "intermittent" if len(self.statuses) % 2:
                return structs.replace(now, torque_on=not now.torque_on)
        return now

    def _status(self, of: int, faulty: int) -> bool:
        return of != faulty or self.kind in ("stuck", "slow", "intermittent")

    def _drive(self, what: str, axis: int, now: DriveSample | None) -> DriveSample | None:
        assert now is not None and self.last is not None
        before = self.last.drives[axis]
        late = self.history[max(0, len(self.history) - 1 - _LATE_CYCLES)].drives[axis]
        assert before is not None and late is not None
        if what == "reply":
            return self._reply(now, before)
        changes: dict[Kind, Callable[[], DriveSample]] = {
            "position": {
                "off": lambda: structs.replace(now, position_deg=-180.0),
                "stuck": lambda: structs.replace(now, position_deg=before.position_deg),
                "garbage": lambda: structs.replace(now, position_deg=self.dice.uniform(-180, 180)),
                "wrong": lambda: structs.replace(now, position_deg=now.position_deg + 12.0),
                "slow": lambda: structs.replace(now, position_deg=self._slowly(axis).position_deg),
                "delayed": lambda: structs.replace(now, position_deg=late.position_deg),
                "intermittent": lambda: structs.replace(now, position_deg=-180.0) if self.number % 2 else now,
            },
            "current": {
                "off": lambda: structs.replace(now, torque_nm=0.0),
                "stuck": lambda: structs.replace(now, torque_nm=before.torque_nm),
                "garbage": lambda: structs.replace(now, torque_nm=self.dice.choice((-1, 1)) * self.dice.uniform(5, 10)),
                "wrong": lambda: structs.replace(now, torque_nm=6.0),
                "slow": lambda: structs.replace(now, torque_nm=self._slowly(axis).torque_nm),
                "delayed": lambda: structs.replace(now, torque_nm=late.torque_nm),
                "intermittent": lambda: structs.replace(now, torque_nm=6.0) if self.number % 2 else now,
            },
        }[what]  # type: ignore[assignment]
        assert self.kind is not None
        return changes[self.kind]()

    def _reply(self, now: DriveSample, before: DriveSample) -> DriveSample | None:
        match self.kind:
            case "stuck":
                return structs.replace(before, t_ns=now.t_ns)
            case "slow":
                return None if self.number % _SLOW else now
            case "intermittent":
                return None if self.number % 2 else now
        # No answer, an invalid answer, an error, or an answer after the time-out.
        return None

    def _slowly(self, axis: int) -> DriveSample:
        if self.number % _SLOW == 0 or self.last is None:
            self.last = self.history[-1]
        reading = self.last.drives[axis]
        assert reading is not None
        return reading

    def _inputs(self, what: str, now: InputSample | None) -> InputSample | None:
        assert now is not None
        if what == "pedal":
            return structs.replace(now, pedal_down=self._pedal(now.pedal_down))
        if what == "second":
            return structs.replace(now, contacts_disagree=self._disagreeing)
        match self.kind:
            case "off":
                return None
            case "garbage":
                return structs.replace(now, estop_open=self.dice.random() < 0.5)
            case "wrong":
                return structs.replace(now, estop_open=True)
            case "slow":
                return None if self.number % _SLOW else now
            case "delayed":
                return self.history[max(0, len(self.history) - 1 - _INPUT_LATE_CYCLES)].inputs
            case "intermittent":
                return None if self.number % 2 else now
        return now

    @property
    def _disagreeing(self) -> bool:
        match self.kind:
            case "garbage":
                return self.dice.random() < 0.3
            case "wrong":
                return True
            case "intermittent":
                return self.number % 2 == 0
        return False

    def _pedal(self, down: bool | None) -> bool | None:
        match self.kind:
            case "off":
                return None
            case "stuck":
                return down
            case "garbage":
                return self.dice.random() < 0.5
            case "wrong":
                return not down
            case "slow":
                return down
            case "delayed":
                late = self.history[max(0, len(self.history) - 1 - _LATE_CYCLES)].inputs
                return late.pedal_down if late else None
        return None if self.number % 2 else down

    def _whole(self, now: BusSample) -> BusSample:
        assert self.last is not None
        match self.kind:
            case "off":
                raise BusError("the port is gone")
            case "stuck":
                return self.last
            case "garbage":
                return structs.replace(_NOTHING, corrupt=frozenset(range(5)))
            case "slow":
                return _NOTHING if self.number % _SLOW else now
            case "delayed":
                return self.history[max(0, len(self.history) - 1 - _INPUT_LATE_CYCLES)]
            case "intermittent":
                return _NOTHING if self.number % 2 else now
        return _NOTHING
