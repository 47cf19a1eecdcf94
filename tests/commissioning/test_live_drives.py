"""The drives that commissioning moves are supervised, and an arm that they hold is not dropped."""

import contextlib
from typing import Final

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.commissioning import identify_drives, registers
from kata.commissioning.gains_review import GainsChoice
from kata.commissioning.live_drives import live_drives
from kata.commissioning.workbench import ManualAction, StepError, Workbench
from kata.simulator.fault_injector import FaultKind
from kata.testing.world import RecordingWorld
from tests.support.examples import examples

MOTOR = 3
DRIVE_FAULTS: Final[list[FaultKind]] = [
    "off", "reboot", "exchanged", "hardware_error", "silent", "garbage", "wrong_crc",
]  # fmt: skip
BUS_FAULTS: Final[list[FaultKind]] = ["estop_wire_broken", "second_wire_broken", "inputs_silent"]
ANSWERED_S = 1.0
"""Time in which each of these faults must switch torque off."""


class Obedient:
    """Confirms every instruction at once."""

    def __init__(self, world: RecordingWorld) -> None:
        self._world = world
        self.instructions: list[tuple[str, list[bool]]] = []
        """Each kind with the drives' torque when it was shown."""

    def instruct(self, instruction: ManualAction) -> None:
        self.instructions.append((instruction.kind, self._world.torque))

    def has_confirmed(self) -> bool:
        return True

    def gains_choice(self) -> GainsChoice:
        return GainsChoice("keep")


def workbench_of(world: RecordingWorld) -> tuple[Workbench, Obedient]:
    technician = Obedient(world)
    return Workbench(world.config, technician, world.open_transport, world.wait, lambda: world.t_ns), technician


def hold_an_arm(workbench: Workbench, world: RecordingWorld) -> None:
    """Leave the drives with torque, as a process does that is killed."""
    with live_drives(workbench, share=1.0) as drives:
        drives.hold()
        drives.bus.close()
    world.wait(0.5)
    assert all(world.torque)


@pytest.mark.parametrize("kind", ["reboot", "hardware_error", "stuck"])
def test_motors_stop_together_when_one_fails(kind: FaultKind) -> None:
    world = RecordingWorld(seed=1)
    workbench, _ = workbench_of(world)
    failed_ns = 0

    def wait(seconds: float) -> None:
        nonlocal failed_ns
        world.wait(seconds)
        if not failed_ns and all(world.torque) and max(world.goals(MOTOR), default=0.0) > 15.0:
            world.fault(kind, MOTOR, 4.0 if kind == "hardware_error" else None)
            failed_ns = world.t_ns

    workbench.sleep = wait
    with pytest.raises(StepError, match=f"otor {MOTOR}"):
        identify_drives.identify_drives(workbench)
    world.wait(0.01)
    assert not any(world.torque)
    assert world.t_ns - failed_ns < 1e9


def test_drive_without_its_settings_gets_no_torque() -> None:
    world = RecordingWorld(seed=1)
    workbench, _ = workbench_of(world)
    with live_drives(workbench) as drives:
        drives.hold()
        drives.release()
        drives.settle(0.1)
        world.fault("reboot", MOTOR)
        world.faults.clear()
        drives.settle(0.1)
        with pytest.raises(StepError, match=f"Motor {MOTOR} has lost its settings"):
            drives.hold()
        world.wait(0.01)
        assert not any(world.torque)


def test_step_does_not_drop_a_held_arm() -> None:
    world = RecordingWorld(seed=1)
    workbench, _ = workbench_of(world)
    hold_an_arm(workbench, world)
    with pytest.raises(StepError, match="has torque"), live_drives(workbench):
        pass
    world.wait(0.1)
    assert all(world.torque)


def test_held_arm_is_released_after_it_is_supported() -> None:
    world = RecordingWorld(seed=1)
    workbench, technician = workbench_of(world)
    hold_an_arm(workbench, world)
    registers.write_registers(workbench)
    assert technician.instructions == [("support_arm", [True] * 5)]
    assert not any(world.torque)


def test_step_without_held_arm_asks_for_no_support() -> None:
    world = RecordingWorld(seed=1)
    workbench, technician = workbench_of(world)
    registers.write_registers(workbench)
    assert technician.instructions == []


def test_lost_request_leaves_no_torque_after_a_step() -> None:
    world = RecordingWorld(seed=1)
    workbench, _ = workbench_of(world)
    with live_drives(workbench) as drives:
        drives.hold()
        world.lose_requests(1, 0)
    world.wait(0.01)
    assert not any(world.torque)


def test_a_late_answer_at_the_start_ends_no_step() -> None:
    world = RecordingWorld(seed=1)
    workbench, _ = workbench_of(world)
    world.lose_requests(2, 7)
    with live_drives(workbench) as drives:
        drives.hold()
        assert all(drives.bus.read().drives)


def test_a_short_silence_after_a_step_is_no_torque() -> None:
    """A busy computer, or one that a USB adapter keeps waiting, misses answers for tens of milliseconds."""
    world = RecordingWorld(seed=1)
    workbench, _ = workbench_of(world)
    with live_drives(workbench) as drives:
        drives.hold()
        world.lose_requests(60, 0)
    world.wait(0.01)
    assert not any(world.torque)


@examples(few=4, many=100)
@given(
    fault=st.one_of(
        st.tuples(st.sampled_from(DRIVE_FAULTS), st.integers(1, 5)), st.tuples(st.sampled_from(BUS_FAULTS), st.none())
    ),
    after_s=st.floats(0.0, 2.0),
    back=st.booleans(),
)
def test_no_fault_leaves_motors_moving(fault: tuple[FaultKind, int | None], after_s: float, back: bool) -> None:
    """``back``: the fault is over at once, as after a voltage dip. Then the step may continue, but with the configured settings only."""
    kind, motor = fault
    world = RecordingWorld(seed=1)
    workbench, _ = workbench_of(world)
    begun_ns = failed_ns = 0
    gains = [world.registers(n, 84, 2) for n in range(1, 6)]

    def wait(seconds: float) -> None:
        nonlocal begun_ns, failed_ns
        world.wait(seconds)
        if not begun_ns and all(world.torque):
            begun_ns = world.t_ns
        if begun_ns and not failed_ns and world.t_ns > begun_ns + after_s * 1e9:
            world.fault(kind, motor, 4.0 if kind == "hardware_error" else None)
            failed_ns = world.t_ns
            if back:
                world.faults.clear()
        if failed_ns and world.t_ns > failed_ns + ANSWERED_S * 1e9:
            assert back or not any(world.torque), f"torque {ANSWERED_S} s after {kind}"
            assert not back or gains == [world.registers(n, 84, 2) for n in range(1, 6)] or not any(world.torque)

    workbench.sleep = wait
    with contextlib.suppress(StepError), live_drives(workbench) as drives:
        gains = [world.registers(n, 84, 2) for n in range(1, 6)]
        drives.hold()
        rest = drives.setpoint_deg.copy()
        for sign in (1.0, -1.0, 1.0, -1.0):
            drives.move(rest + sign * np.array([0.0, 0.0, 10.0, 10.0, 10.0]))
            drives.move(rest + sign * np.array([-5.0, -5.0, 10.0, 10.0, 10.0]))
    world.wait(0.01)
    assert not any(world.torque)
