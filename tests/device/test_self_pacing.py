"""Self-paced assistance: the patient's effort sets the pace along the path. The pace is never above the recording's speed."""

from itertools import pairwise
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kata.device.config import StationConfig
from kata.device.ipc_messages import Approach, EndFeel, Load, Pause, Play, Refusal, Return, SelfPacingState
from kata.device.journal import PHASE_PLAYING
from kata.device.references import build
from kata.device.self_pacing import SLOW_SHARE, PaceController, least_damping_nm_s
from kata.motion.arm_load import ArmLoad
from kata.motion.trajectory import Trajectory
from tests.support.effort_patients import HELP_NM, LETS_GO_S, PATIENTS, Effort
from tests.support.stepped import REST_DEG, Stepped
from tests.support.stepped_shoulder import AXIS, TIMES_S, way
from tests.support.trajectories import LOAD

CYCLE_S = 0.01
TOP_RAD_S = 0.3
THRESHOLD_NM = 0.8
AT_REST_WITHIN_S = 0.9
"""docs/explanation/self-paced.md states 1 s with the ramp of the movement."""
IDENTIFIED = ArmLoad(inertia=(0.0,) * 9 + (1e-6,))
"""An identified load of an arm without weight."""


def controller() -> PaceController:
    return PaceController(least_damping_nm_s(0.15), CYCLE_S)


def speeds_of(patient: Effort, seconds: float = 8.0) -> list[float]:
    """Return the speed of each cycle."""
    control = controller()
    times = np.arange(0.0, seconds, CYCLE_S)
    return [control.update(patient(float(at_s)), THRESHOLD_NM, TOP_RAD_S, near_end=False) for at_s in times]


# -- the controller ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("patient", ["relaxed", "resists", "trembles_4_hz", "trembles_10_hz"])
def test_patient_without_steady_effort_does_not_move_the_arm(patient: str) -> None:
    assert max(speeds_of(PATIENTS[patient])) == 0.0


def test_speed_follows_the_effort_above_the_threshold() -> None:
    expected = (HELP_NM - THRESHOLD_NM) / least_damping_nm_s(0.15)
    assert speeds_of(PATIENTS["helps"])[-1] == pytest.approx(expected, rel=0.01)
    assert speeds_of(lambda _: THRESHOLD_NM + 0.5)[-1] == pytest.approx(0.5 / least_damping_nm_s(0.15), rel=0.01)


def test_strong_patient_gets_the_recordings_speed_and_no_more() -> None:
    assert speeds_of(lambda _: 50.0)[-1] == TOP_RAD_S


def test_tremor_adds_no_pace_to_steady_effort() -> None:
    steady = speeds_of(lambda _: 1.5)
    trembling = speeds_of(lambda at_s: 1.5 + PATIENTS["trembles_4_hz"](at_s))
    assert np.mean(trembling[200:]) <= np.mean(steady[200:])


def test_pace_decays_to_rest_when_the_patient_lets_go() -> None:
    speeds = speeds_of(PATIENTS["lets_go"])
    assert speeds[round(LETS_GO_S / CYCLE_S) - 1] > 0.2
    assert max(speeds[round((LETS_GO_S + AT_REST_WITHIN_S) / CYCLE_S) :]) == 0.0


def test_alternating_patient_stops_and_starts_again() -> None:
    speeds = np.array(speeds_of(PATIENTS["alternates"], 12.0))
    for begins_s in (0.0, 4.0, 8.0):
        helped = speeds[round((begins_s + 1.9) / CYCLE_S)]
        resisted = speeds[round((begins_s + 3.0) / CYCLE_S)]
        assert helped > 0.2
        assert resisted == 0.0


def test_rest_forgets_earlier_effort() -> None:
    control = controller()
    for _ in range(200):
        control.update(HELP_NM, THRESHOLD_NM, TOP_RAD_S, near_end=False)
    control.rest()
    assert control.update(THRESHOLD_NM + 1.0, THRESHOLD_NM, TOP_RAD_S, near_end=False) == 0.0


def test_speed_only_falls_near_an_end() -> None:
    control = controller()
    for _ in range(400):
        control.update(1.5, THRESHOLD_NM, TOP_RAD_S, near_end=False)
    before = control.speed_rad_s
    assert before < TOP_RAD_S
    for _ in range(400):
        control.update(20.0, THRESHOLD_NM, TOP_RAD_S, near_end=True)
    assert control.speed_rad_s == before


def test_rested_patient_can_complete_the_motion_slowly() -> None:
    control = controller()
    for _ in range(400):
        control.update(20.0, THRESHOLD_NM, TOP_RAD_S, near_end=True)
    assert control.speed_rad_s == pytest.approx(SLOW_SHARE * TOP_RAD_S)


efforts = st.lists(
    st.tuples(st.floats(-10.0, 10.0), st.integers(1, 60), st.floats(0.0, 1.0), st.booleans()), min_size=1, max_size=8
)


@settings(max_examples=60, deadline=None)
@given(parts=efforts)
def test_controller_keeps_its_bounds_for_every_patient(parts: list[tuple[float, int, float, bool]]) -> None:
    """Pace within the recording's speed, no energy given beyond that of the virtual mass, slower towards ends, and rest after letting go."""
    control = controller()
    given_j, most_j = 0.0, 0.5 * control.mass_nm_s2
    for effort_nm, cycles, top_rad_s, near_end in parts:
        for _ in range(cycles):
            before = control.speed_rad_s
            speed = control.update(effort_nm, THRESHOLD_NM, top_rad_s, near_end=near_end)
            assert 0.0 <= speed <= top_rad_s
            if near_end:
                assert speed <= max(before, SLOW_SHARE * top_rad_s)
            given_j -= effort_nm * speed * CYCLE_S
            # In total the apparatus gives nothing, and what it still may give is the energy of the virtual mass.
            assert given_j + most_j * speed**2 <= 1e-9
    for _ in range(round(AT_REST_WITHIN_S / CYCLE_S)):
        control.update(0.0, THRESHOLD_NM, 1.0, near_end=False)
    assert control.speed_rad_s == 0.0


# -- stability --------------------------------------------------------------------------------------------------------


def swings_rad(stiffness_nm_rad: float, delay_s: float = 0.15) -> float:
    """Return the last swing of a linear loop of admittance, delay and stiffness, after a push of 1 Nm."""
    damping = least_damping_nm_s(delay_s)
    behind = [0.0] * round(delay_s / 0.001)
    angle = speed = 0.0
    angles = []
    for _ in range(20_000):
        behind.append(angle)
        effort_nm = 1.0 - stiffness_nm_rad * behind.pop(0)
        speed += 0.001 * (effort_nm - damping * speed) / (0.25 * damping)
        angle += 0.001 * speed
        angles.append(angle)
    return max(angles[-3000:]) - min(angles[-3000:])


def test_damping_keeps_a_gain_margin_of_2() -> None:
    assert swings_rad(25.0) < 1e-3
    assert swings_rad(48.0) < swings_rad(52.0)
    assert swings_rad(52.0) > 0.05


def test_longer_delay_needs_more_damping() -> None:
    dampings = [least_damping_nm_s(delay_s) for delay_s in (0.05, 0.1, 0.15, 0.2, 0.3)]
    assert all(less < more for less, more in pairwise(dampings))


# -- the device -------------------------------------------------------------------------------------------------------


FAR_DEG = 30.0
FULL_DEG_S = 15.0


@pytest.fixture(scope="module")
def at_start(tmp_path_factory: pytest.TempPathFactory) -> Stepped:
    """Return an apparatus at the start of a self-paced way of 30 deg that takes 2 s. Tests use copies of it."""
    config = msgspec.structs.replace(StationConfig(), arm=IDENTIFIED)
    stepped = Stepped(tmp_path_factory.mktemp("paced"), config)
    times = np.arange(0.0, FAR_DEG / FULL_DEG_S + 0.001, 0.02)
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, AXIS] = FULL_DEG_S * times
    assert stepped.send(msgspec.structs.replace(LOAD, self_paced=True), Trajectory(times, angles)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    return stepped


@pytest.fixture
def self_paced(at_start: Stepped, tmp_path: Path) -> Stepped:
    """Return an apparatus that plays a self-paced way of 30 deg with a patient who does nothing yet."""
    stepped = at_start.copied(tmp_path)
    assert stepped.send(Play()) is None
    return stepped


def helped(stepped: Stepped, seconds: float, effort_nm: float) -> None:
    """Let time pass while the patient acts with an effort. The drive reports the opposite of it."""
    stepped.apparatus.torques_nm[AXIS] = -effort_nm
    stepped.forward(seconds)


def pacing(stepped: Stepped) -> SelfPacingState:
    run = stepped.snapshot.run
    assert run is not None and run.self_pacing is not None
    return run.self_pacing


def angle_deg(stepped: Stepped) -> float:
    return stepped.apparatus.angles_deg[AXIS]


def test_arm_moves_with_the_patients_effort_and_rests_without(self_paced: Stepped) -> None:
    helped(self_paced, 0.5, 0.0)
    assert angle_deg(self_paced) == pytest.approx(0.0, abs=0.01)
    assert self_paced.mode == "playing"
    helped(self_paced, 0.8, 1.0)
    assert 0.0 < pacing(self_paced).pace_percent < 100.0
    helped(self_paced, 0.9, 3.0)
    assert pacing(self_paced).pace_percent == 100.0
    assert pacing(self_paced).effort_nm == pytest.approx(3.0)
    helped(self_paced, 1.0, 0.0)
    let_go_deg = angle_deg(self_paced)
    helped(self_paced, 0.5, -1.0)
    assert angle_deg(self_paced) == pytest.approx(let_go_deg, abs=0.01)
    assert np.radians(let_go_deg) < pacing(self_paced).work_j < 3.0 * np.radians(let_go_deg)


@pytest.mark.counted
def test_effort_and_work_are_stored_with_the_run(self_paced: Stepped) -> None:
    helped(self_paced, 3.5, 3.0)
    self_paced.apparatus.torques_nm[AXIS] = 0.0
    self_paced.until("idle")
    end = self_paced.journal().end
    assert end is not None and end.reason == "completed"
    assert end.work_j == pytest.approx(3.0 * np.radians(FAR_DEG), rel=0.05)
    assert end.mean_effort_nm == pytest.approx(3.0, rel=0.02)
    written = np.array(self_paced.apparatus.written)[:, AXIS]
    playing = np.array([written[n + 10] - written[n] for n in range(len(written) - 10)])
    assert playing.max() <= 1.02 * FULL_DEG_S * 10 / self_paced.config.rate_hz
    assert written.max() <= FAR_DEG + 0.2


def test_mean_pace_contains_waiting_for_the_patient_but_no_pause(self_paced: Stepped) -> None:
    helped(self_paced, 1.0, 0.0)
    helped(self_paced, 1.0, 3.0)
    assert self_paced.send(Pause()) is None
    helped(self_paced, 2.0, 0.0)
    assert self_paced.send(Play()) is None
    helped(self_paced, 3.0, 3.0)
    self_paced.apparatus.torques_nm[AXIS] = 0.0
    self_paced.until("idle")
    journal = self_paced.journal()
    played_s = np.count_nonzero(journal.phase == PHASE_PLAYING) / self_paced.config.rate_hz
    assert played_s > 3.0
    assert journal.end is not None
    assert journal.end.mean_pace_percent == pytest.approx(100.0 * FAR_DEG / FULL_DEG_S / played_s, rel=0.05)


def test_pause_and_stop_act_above_the_patients_pace(self_paced: Stepped) -> None:
    helped(self_paced, 1.2, 3.0)
    assert self_paced.send(Pause()) is None
    helped(self_paced, 0.3, 3.0)
    assert self_paced.mode == "paused"
    held_deg = angle_deg(self_paced)
    helped(self_paced, 0.5, 3.0)
    assert angle_deg(self_paced) == pytest.approx(held_deg, abs=0.05)
    assert self_paced.send(Play()) is None
    helped(self_paced, 0.1, 3.0)
    assert angle_deg(self_paced) == pytest.approx(held_deg, abs=0.05)
    helped(self_paced, 0.7, 3.0)
    assert angle_deg(self_paced) > held_deg + 1.0
    self_paced.link.request_stop()
    helped(self_paced, 0.5, 3.0)
    assert not self_paced.torque


def test_resistance_moves_a_self_paced_arm_back(self_paced: Stepped) -> None:
    helped(self_paced, 1.5, 3.0)
    resisted_deg = angle_deg(self_paced)
    helped(self_paced, 0.3, -4.2)
    self_paced.apparatus.torques_nm[AXIS] = 0.0
    self_paced.until("paused")
    assert angle_deg(self_paced) < resisted_deg - 3.0
    assert pacing(self_paced).pace_percent == 0.0
    assert self_paced.send(Return()) is None
    self_paced.until("returning")


def test_return_after_the_end_has_no_pace_of_the_patient(self_paced: Stepped) -> None:
    helped(self_paced, 1.0, 3.0)
    assert pacing(self_paced).pace_percent == 100.0
    self_paced.until("returning")
    assert pacing(self_paced).pace_percent == 0.0


def reversals(stepped: Stepped) -> int:
    run = stepped.snapshot.run
    assert run is not None
    return run.reversals


def test_help_above_the_level_takes_no_resting_arm_back(self_paced: Stepped) -> None:
    """The patient pushes the other way before, so that the mean effort is negative and the arm rests for longer than resistance must last."""
    helped(self_paced, 0.5, -3.0)
    helped(self_paced, 0.3, 4.2)
    assert (reversals(self_paced), self_paced.mode) == (0, "playing")
    assert angle_deg(self_paced) == pytest.approx(0.0, abs=0.1)
    helped(self_paced, 0.8, 4.2)
    assert angle_deg(self_paced) > 3.0


def test_push_against_a_resting_arm_is_resistance(self_paced: Stepped) -> None:
    helped(self_paced, 1.0, 3.0)
    helped(self_paced, 1.0, 0.0)
    assert reversals(self_paced) == 0
    helped(self_paced, 0.3, -4.2)
    assert reversals(self_paced) == 1


@pytest.mark.counted
def test_help_above_the_level_counts_as_resistance_while_paused(self_paced: Stepped) -> None:
    helped(self_paced, 1.2, 3.0)
    assert self_paced.send(Pause()) is None
    helped(self_paced, 0.5, 0.0)
    assert self_paced.mode == "paused"
    helped(self_paced, 0.3, 4.2)
    assert self_paced.mode == "stopped"


def test_arm_slows_down_towards_the_end_of_the_range(self_paced: Stepped) -> None:
    helped(self_paced, 1.0, 2.0)
    while angle_deg(self_paced) < FAR_DEG - 9.0:
        helped(self_paced, 0.2, 1.4)
    before = pacing(self_paced).pace_percent
    assert before < 100.0
    helped(self_paced, 0.4, 3.0)
    assert 0.0 < pacing(self_paced).pace_percent <= before + 1e-9


@pytest.mark.counted
def test_recorded_rest_passes_without_effort(tmp_path: Path) -> None:
    """Setpoints are sent in every second cycle here."""
    stepped = Stepped(tmp_path, msgspec.structs.replace(StationConfig(), arm=IDENTIFIED, rate_hz=50))
    times = np.arange(0.0, 3.001, 0.02)
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, AXIS] = FULL_DEG_S * np.maximum(times - 1.0, 0.0)
    assert stepped.send(msgspec.structs.replace(LOAD, self_paced=True), Trajectory(times, angles)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    assert stepped.send(Play()) is None
    stepped.forward(0.3)
    assert pacing(stepped).pace_percent == 100.0
    stepped.forward(1.7)
    run = stepped.snapshot.run
    assert run is not None and 0.6 < run.position_s < 1.1
    assert angle_deg(stepped) == pytest.approx(0.0, abs=0.3)
    assert pacing(stepped).pace_percent == 0.0
    helped(stepped, 1.0, 3.0)
    assert angle_deg(stepped) > 3.0


def message(**changes: object) -> Load:
    angles = way()
    load = msgspec.structs.replace(LOAD, times_s=TIMES_S.tobytes(), angles_deg=angles.tobytes(), self_paced=True)
    return msgspec.structs.replace(load, **changes)


def test_station_without_an_identified_load_refuses_a_self_paced_run() -> None:
    refusal = build(message(), StationConfig())
    assert isinstance(refusal, Refusal) and refusal.code == "not_self_paced"
    assert "not identified" in refusal.message
    assert not isinstance(build(message(self_paced=False), StationConfig()), Refusal)


@pytest.mark.parametrize(
    "changes",
    [{"method": "paper"}, {"method": "learned"}, {"end_feel": EndFeel(motor=4, torque_nm=1.0, expected_nm=(0.0, 0.0))}],
)
def test_only_the_smooth_method_is_self_paced(changes: dict[str, object]) -> None:
    config = msgspec.structs.replace(StationConfig(), arm=IDENTIFIED)
    refusal = build(message(**changes), config)
    assert isinstance(refusal, Refusal) and refusal.code == "not_self_paced"
    assert not isinstance(build(message(), config), Refusal)
