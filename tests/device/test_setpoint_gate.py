"""The setpoint gate refuses no setpoint that the control program computes: at any rate, speed limit and turn."""

from pathlib import Path
from types import SimpleNamespace
from typing import Final, cast

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from kata.device.config import StationConfig, simulated
from kata.device.config_rules import REVERSAL_RAMP_S
from kata.device.cycle_state import CycleState
from kata.device.end_feel import TURN_BACK_RAMP_S
from kata.device.ipc_messages import EndFeel, Load
from kata.device.journal import JournalDisk, JournalWriter
from kata.device.movement import RAMP_S, Movement
from kata.device.references import Reference, build
from kata.device.run import Run
from kata.device.setpoint_gate import SetpointGate, refused_setpoints
from kata.device.state_machine import StateMachine
from tests.support.examples import examples
from tests.support.journals import HEADER
from tests.support.stepped import REST_DEG

MOVED: Final = 3
"""Index of motor 4, which moves."""
WAY_DEG: Final = 60.0


@st.composite
def stations(draw: st.DrawFn) -> StationConfig:
    """Return a station. A setpoint of a Modbus drive with function 23 arrives a cycle later, and leads the most."""
    cycle_hz = draw(st.sampled_from([100, 50, 40, 20]))
    config = simulated("memory")
    return msgspec.structs.replace(
        config,
        inputs=msgspec.structs.replace(config.inputs, max_age_cycles=5),
        protocol=draw(st.sampled_from(["dynamixel", "modbus"])),
        cycle_hz=cycle_hz,
        rate_hz=draw(st.sampled_from([cycle_hz, 10])),
        silence_ms=300,
        bus_watchdog_ms=200,
    )


def way_out(speed_deg_s: float, *, end_feel: bool) -> Load:
    """Return a way with one speed from end to end, like the way of an end-feel test."""
    times_s = np.linspace(0.0, WAY_DEG / speed_deg_s, 601)
    angles_deg = np.tile(np.array(REST_DEG), (len(times_s), 1))
    angles_deg[:, MOVED] += speed_deg_s * times_s
    return Load(
        run_id="r",
        recording_id="a",
        times_s=times_s.tobytes(),
        angles_deg=angles_deg.tobytes(),
        max_speed_deg_s=1.05 * speed_deg_s,
        end_feel=EndFeel(motor=MOVED + 1, torque_nm=1.0, expected_nm=(0.0, 0.0)) if end_feel else None,
    )


def change(movement: Movement, event: str) -> None:
    """Do what a pause, a resisting patient, an end-feel test and Play do with a movement. Only an arm at rest or at an end is played."""
    if event == "pause":
        movement.direction = 0
    elif event != "play":
        movement.direction, movement.reverse_to_s = -1, 0.0
        movement.ramp_s = REVERSAL_RAMP_S if event == "resistance" else TURN_BACK_RAMP_S
    elif movement.at_rest or movement.ended:
        movement.direction, movement.ramp_s = 1, RAMP_S


@pytest.mark.parametrize("end_feel", [False, True])
@settings(examples(few=4, many=100), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    config=stations(),
    speed_deg_s=st.sampled_from([2.0, 5.0, 10.0, 15.0, 45.0, 90.0]),
    events=st.lists(
        st.tuples(
            st.integers(1, 40),
            st.sampled_from(["pause", "resistance", "turn", "play"]),
            st.sampled_from([0.0, -10.0, 10.0]),
        ),
        max_size=8,
    ),
)
def test_no_turn_is_refused(
    tmp_path: Path, end_feel: bool, config: StationConfig, speed_deg_s: float, events: list[tuple[int, str, float]]
) -> None:
    """``events``: setpoints before the event, the event, and the offset in deg by which the setpoint yields from then on."""
    load = way_out(speed_deg_s, end_feel=end_feel)
    found = build(load, config)
    assume(isinstance(found, Reference))
    assert isinstance(found, Reference)
    run = Run(load, found.trajectory, JournalWriter(tmp_path, HEADER, JournalDisk()), config)
    run.start_path(found.trajectory.start_deg)
    movement = run.movement_along(found.trajectory, direction=1)
    sent = [tuple(found.trajectory.start_deg.tolist())]
    for count, event, offset_deg in [*events, (40, "play", 0.0)]:
        for _ in range(count):
            setpoint = run.setpoint(movement)
            assert refused_setpoints(sent[-2:], setpoint, run.limits_deg, run.config, run.rate_hz) == []
            sent.append(setpoint)
            movement.advance(1.0 / run.rate_hz)
        change(movement, event)
        run._yield_offset.offset_deg = np.full(5, offset_deg)


ANYWHERE: Final = ((-90.0, 90.0),) * 5
EVERY_MOTOR: Final = range(5)


def test_acceleration_of_the_limit_passes_and_more_is_refused() -> None:
    config = simulated("memory")
    still = [(0.0,) * 5] * 2
    assert [axis.max_acceleration_deg_s2 for axis in config.axes] == [4000.0] * 5
    assert refused_setpoints(still, (0.4,) * 5, ANYWHERE, config, rate_hz=100) == []
    too_fast = refused_setpoints(still, (0.41,) * 5, ANYWHERE, config, rate_hz=100)
    assert too_fast == [("setpoint_acceleration", n) for n in EVERY_MOTOR]


class Gate:
    """The gate with a machine that has only what the gate reads."""

    def __init__(self) -> None:
        self.gate = SetpointGate()
        self.refused: list[object] = []

    def check(self, angle_deg: float, *, torque_on: bool = True, measured_deg: float = 0.0) -> None:
        config = simulated("memory")
        machine = SimpleNamespace(
            torque_on=torque_on,
            setpoint_due=True,
            setpoint_deg=(angle_deg,) * 5,
            limits_deg=ANYWHERE,
            config=config,
            rate_hz=config.rate_hz,
            refused_pose=list,
            abort=lambda state, faults: self.refused.extend(faults),
        )
        state = SimpleNamespace(measured_deg=(measured_deg,) * 5)
        self.gate.check(cast(StateMachine, machine), cast(CycleState, state))


def test_gate_compares_three_setpoints_in_a_row() -> None:
    gate = Gate()
    gate.check(0.0)
    gate.check(0.0)
    gate.check(0.0)
    assert not gate.refused
    assert len(gate.gate._sent_deg) == 2, "a playback of an hour fills no memory"
    gate.check(1.0)
    assert gate.refused == [("setpoint_acceleration", n) for n in EVERY_MOTOR]


def test_setpoints_before_torque_was_off_do_not_count() -> None:
    """Without torque a hand moves the arm. The first setpoint afterwards is compared with the measured angles."""
    gate = Gate()
    gate.check(0.0)
    gate.check(30.0, torque_on=False)
    gate.check(30.0, measured_deg=30.0)
    assert not gate.refused
    gate.check(60.0, measured_deg=30.0)
    assert gate.refused == [("setpoint_step", n) for n in EVERY_MOTOR]
