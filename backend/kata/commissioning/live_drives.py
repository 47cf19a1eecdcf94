"""Moves all five drives with a part of their torque, through the driver that treats patients.

Every cycle evaluates the fault table of the control loop. If a fault holds while the drives have torque, torque is switched off and the
step ends. The limits of the axes are not evaluated, because the early steps do not know the zeros yet.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Final

import numpy as np
from msgspec import structs

from kata.commissioning import texts
from kata.commissioning.workbench import StepError, UnstableError, Workbench
from kata.device import texts as device_texts
from kata.device.bus.factory import make_bus
from kata.device.bus.interface import BusError
from kata.device.cycle_state import CycleState, CycleStateBuilder, LoopContext
from kata.device.faults import FAULT_BY_CODE, evaluate_faults
from kata.messages import text_of
from kata.motion.approach import MinimumJerkMove
from kata.motion.axes import N_AXES
from kata.motion.linkage import Floats

TORQUE_SHARE: Final = 0.5
"""Share of the configured torque. It is enough for friction and the arm's weight, and a person can hold against it."""
SPEED_DEG_S: Final = 15.0
_VERIFY_CYCLES: Final = 600
_LATE_SHARE: Final = 0.1
"""Share of its period by which a cycle may begin late. A cycle that would begin later is skipped."""
_CONFIGURE_ATTEMPTS: Final = 4
_CONFIGURE_PAUSE_S: Final = 0.1
_MISSES: Final = 20
"""Number of consecutive cycles without an answer after which a drive counts as silent."""
_OFF_ATTEMPTS: Final = 100
"""Largest number of torque-off messages until every drive reports no torque. No drive confirms the message, and it may be lost. Without
answers the attempts take about half a second, which outlasts the delays of a busy computer.
"""
_ESTOP_FAULTS: Final = frozenset({"estop_pressed", "estop_unknown", "contacts_disagree"})


@dataclass(frozen=True)
class LiveSample:
    """One cycle: time of its deadline in s (a multiple of the period), and setpoints, measured angles and torques in axis order."""

    t_s: float
    setpoint_deg: Floats
    angle_deg: Floats
    torque_nm: Floats


class LiveDrives:
    """The drives of a workbench, used through the driver. :func:`live_drives` creates it."""

    def __init__(self, workbench: Workbench, share: float) -> None:
        self._workbench = workbench
        config = workbench.draft
        axes = tuple(structs.replace(axis, max_torque_nm=max(0.5, share * axis.max_torque_nm)) for axis in config.axes)
        self._config = structs.replace(config, axes=axes)
        self.bus = make_bus(self._config, workbench.open_transport)
        self._period_ns = 1_000_000_000 // config.cycle_hz
        self._next_ns = 0
        self._begin_ns = 0
        self._misses = [0] * N_AXES
        self._torque = False
        self._switched_on = False
        """True if this object has switched torque on."""
        self._state_builder = CycleStateBuilder(self._config)
        self._context = LoopContext(
            late_ms=0.0,
            service_age_ms=0.0,
            run_id_mismatches=0,
            journal_ok=True,
            limits_deg=((-math.inf, math.inf),) * N_AXES,
            rate_hz=config.cycle_hz,
        )
        self.state: CycleState
        """State of the newest cycle."""
        self.angle_deg: Floats = np.zeros(N_AXES)
        self.torque_nm: Floats = np.zeros(N_AXES)
        self.setpoint_deg: Floats = np.zeros(N_AXES)
        self.torque_on = [False] * N_AXES
        self.largest_distance_deg = math.inf
        """Largest distance of an axis from its setpoint. Beyond it torque is switched off."""

    def begin(self) -> None:
        """Open the port, configure every drive, and wait until every register is verified.

        :raises StepError: naming the drive that cannot be configured.
        """
        self.bus.open()
        for axis in range(N_AXES):
            self._configure(axis)
        self._next_ns = self._begin_ns = self._workbench.now_ns()
        self._verify()

    def _configure(self, axis: int) -> None:
        """Configure a drive. Try again after a missing answer, because a busy computer may have delayed it.

        :raises BusError: when the drive cannot be configured.
        """
        for _ in range(_CONFIGURE_ATTEMPTS - 1):
            with suppress(BusError):
                return self.bus.configure([axis])
            self._workbench.sleep(_CONFIGURE_PAUSE_S)
        return self.bus.configure([axis])

    def hold(self) -> None:
        """Switch torque on. Every motor holds its angle.

        :raises StepError: when the emergency stop is not known to be released, or a drive has lost its settings.
        """
        self._verify()
        if self.state.estop != "closed":
            raise StepError(texts.ESTOP_DURING_STEP())
        self.setpoint_deg = self.angle_deg.copy()
        self._torque = self._switched_on = True
        self.bus.torque_on(self.setpoint_deg.tolist())
        self._record_command()
        self.settle(0.3)

    def _verify(self) -> None:
        """Run cycles until every register is verified and the emergency stop is known.

        :raises StepError: naming a drive with other settings.
        """
        for _ in range(_VERIFY_CYCLES):
            self._cycle()
            if True in self.state.settings_lost:
                break
            if all(self.state.verified) and self.state.estop != "unknown":
                return
        wrong = (
            self.state.settings_lost
            if True in self.state.settings_lost
            else [not verified for verified in self.state.verified]
        )
        raise StepError(device_texts.DRIVE_RESET(motor=wrong.index(True) + 1 if True in wrong else 1))

    def release(self) -> None:
        """Switch torque off."""
        self.bus.torque_off()
        self._torque = False
        self._record_command()

    def end(self) -> None:
        """Switch off torque that this object has switched on, until every drive reports no torque.

        Other torque is not changed, because it may hold an arm. The method does not sleep, because a stopped step must not sleep.

        :raises StepError: when a drive still reports torque.
        """
        if not self._switched_on:
            return
        # While registers are verified again, a read returns the status of at most one drive.
        unconfirmed = set(range(N_AXES))
        for _ in range(_OFF_ATTEMPTS):
            self.release()
            for status in self.bus.read().statuses:
                self.torque_on[status.axis] = status.torque_on
                if not status.torque_on:
                    unconfirmed.discard(status.axis)
            if not unconfirmed:
                return
        if any(self.torque_on):
            raise StepError(texts.TORQUE_STAYS_ON(motor=self.torque_on.index(True) + 1))

    def cycle(self) -> LiveSample:
        """Run one cycle: read drives and inputs, and send the setpoints if torque is on.

        :raises StepError: when a drive is silent; and while torque is on, when a fault of the fault table holds.
        :raises UnstableError: while torque is on, when an axis is too far away from its setpoint.
        """
        self._cycle()
        if self._torque:
            self._raise_fault()
            distances = np.abs(self.setpoint_deg - self.angle_deg)
            if np.max(distances) > self.largest_distance_deg:
                self.release()
                raise UnstableError(texts.MOTOR_UNSTABLE(motor=int(np.argmax(distances)) + 1))
            self.bus.write_setpoints(self.setpoint_deg.tolist())
            self._record_command()
        return LiveSample(
            (self._next_ns - self._begin_ns) / 1e9,
            self.setpoint_deg.copy(),
            self.angle_deg.copy(),
            self.torque_nm.copy(),
        )

    def _raise_fault(self) -> None:
        """Switch torque off if a fault holds.

        :raises StepError: naming the first fault.
        """
        faults = evaluate_faults(self.state, self._config)
        if not faults:
            return
        self.release()
        code, axis = faults[0]
        message = FAULT_BY_CODE[code].message
        fault = message(motor=axis + 1) if axis is not None else message()
        raise StepError(texts.ESTOP_DURING_STEP() if code in _ESTOP_FAULTS else fault)

    def settle(self, seconds: float) -> list[LiveSample]:
        """Run cycles for a time. Return their samples."""
        return [self.cycle() for _ in range(round(seconds * self._config.cycle_hz))]

    def move(self, goal_deg: Floats, speed_deg_s: float = SPEED_DEG_S) -> list[LiveSample]:
        """Move the setpoints smoothly to a posture. Return the samples of the cycles. The drives must have torque."""
        move = MinimumJerkMove(self.setpoint_deg.copy(), np.asarray(goal_deg, dtype=np.float64), speed_deg_s)
        return self.follow(move.at(n / self._config.cycle_hz) for n in range(1, self._cycles(move.duration_s) + 1))

    def follow(self, setpoints_deg: Iterator[Floats]) -> list[LiveSample]:
        """Send these setpoints, one in each cycle. Return the samples of the cycles."""
        samples = []
        for setpoint in setpoints_deg:
            self.setpoint_deg = setpoint
            samples.append(self.cycle())
        return samples

    def move_axis(self, axis: int, by_deg: float) -> list[LiveSample]:
        """Move one axis (counted from 0) and let it settle. Return the samples of the cycles.

        :raises StepError: when the axis does not follow.
        """
        began = float(self.angle_deg[axis])
        goal = self.setpoint_deg.copy()
        goal[axis] += by_deg
        samples = [*self.move(goal), *self.settle(0.5)]
        moved = float(np.mean([sample.angle_deg[axis] for sample in samples[-5:]])) - began
        if moved * by_deg <= 0.0 and abs(moved) > abs(by_deg) / 2:
            raise StepError(texts.AXIS_REVERSED(motor=axis + 1))
        if abs(moved) < abs(by_deg) / 2:
            raise StepError(texts.AXIS_STUCK(motor=axis + 1, moved_deg=abs(moved), wanted_deg=abs(by_deg)))
        return samples

    def read_only(self) -> None:
        """Run one cycle without sending a setpoint and without evaluating faults."""
        self._cycle()

    def _record_command(self) -> None:
        now_ns = self._workbench.now_ns()
        self._state_builder.record_command(now_ns, self._torque, tuple(self.setpoint_deg.tolist()), now_ns)

    def _cycles(self, seconds: float) -> int:
        return max(1, round(seconds * self._config.cycle_hz))

    def _cycle(self) -> None:
        self._next_ns += self._period_ns
        late_ns = self._workbench.now_ns() - self._next_ns
        if late_ns > _LATE_SHARE * self._period_ns:
            # Skip missed cycles, so that the next deadline is a multiple of the period.
            self._next_ns += (late_ns // self._period_ns + 1) * self._period_ns
        self._workbench.sleep(max(0.0, (self._next_ns - self._workbench.now_ns()) / 1e9))
        sample = self.bus.read()
        for n, drive in enumerate(sample.drives):
            self._misses[n] = 0 if drive else self._misses[n] + 1
            if drive:
                self.angle_deg[n], self.torque_nm[n] = drive.position_deg, drive.torque_nm
            elif self._misses[n] > _MISSES:
                problem = device_texts.DRIVE_GARBLED if n in sample.corrupt else device_texts.DRIVE_SILENT
                raise StepError(problem(motor=n + 1))
        for status in sample.statuses:
            self.torque_on[status.axis] = status.torque_on
        self.state = self._state_builder.build(self._next_ns, sample, self._context)


@contextmanager
def live_drives(workbench: Workbench, share: float = TORQUE_SHARE) -> Iterator[LiveDrives]:
    """Configure the drives with a share of their torque. At the end of the block torque is switched off and the port closed.

    :raises StepError: when a drive or the bus cannot be used, or a drive has torque at the beginning or the end.
    """
    drives = LiveDrives(workbench, share)
    try:
        drives.begin()
        yield drives
    except BusError as error:
        raise StepError(text_of(error)) from error
    finally:
        try:
            with suppress(BusError):
                drives.end()
        finally:
            drives.bus.close()
