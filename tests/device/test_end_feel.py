"""The end-feel test: the arm moves back before the chosen torque, three times. The patient ends the test by the pedal."""

import msgspec
import numpy as np
import pytest

from kata.device.config import StationConfig
from kata.device.ipc_messages import Approach, EndFeel, Load, Pause, Play, ReduceRange, Refusal
from kata.device.references import build
from kata.motion.trajectory import Trajectory
from tests.support.stepped import REST_DEG, Stepped
from tests.support.stepped_shoulder import (
    AXIS,
    CHOSEN_NM,
    END_DEG,
    FRICTION_NM,
    SPEED_DEG_S,
    TEST,
    TIMES_S,
    Shoulder,
    growth,
    started,
    way,
)
from tests.support.trajectories import LOAD

ONCE = msgspec.structs.replace(TEST, repetitions=1)
"""For what each repetition does alike: a repetition takes 2,400 cycles."""


def turns(stepped: Stepped) -> list[float]:
    """Return the angles at which the arm turned back, from the journal."""
    journal = stepped.journal()
    path = journal.path_s[journal.phase == 2]
    angles = journal.setpoint_deg[journal.phase == 2][:, AXIS]
    back = np.flatnonzero((path[1:-1] > path[:-2]) & (path[1:-1] >= path[2:]))
    return [float(angles[n]) for n in back]


def test_three_repetitions_stay_below_the_chosen_torque(stepped: Stepped) -> None:
    started(stepped)
    shoulder = Shoulder(stepped)
    shoulder.until("idle")
    assert CHOSEN_NM - 0.4 < shoulder.largest_nm < CHOSEN_NM
    assert len(turns(stepped)) == 3
    end = stepped.journal().end
    assert end is not None and end.reason == "completed"


@pytest.mark.counted
def test_shoulder_that_resists_nowhere_is_measured_to_the_end(stepped: Stepped) -> None:
    started(stepped, ONCE)
    shoulder = Shoulder(stepped, onset_deg=90.0)
    shoulder.until("idle")
    assert shoulder.farthest_deg == pytest.approx(END_DEG, abs=0.3)
    assert len(turns(stepped)) == 1


def test_patient_ends_the_test_by_the_pedal(stepped: Stepped) -> None:
    started(stepped)
    shoulder = Shoulder(stepped)
    shoulder.forward(3.0)
    stepped.apparatus.pedal_down = True
    shoulder.forward(0.2)
    stepped.apparatus.pedal_down = False
    shoulder.until("idle")
    assert shoulder.farthest_deg < 3.0 * SPEED_DEG_S + 0.5
    assert len(turns(stepped)) == 1
    end = stepped.journal().end
    assert end is not None and end.reason == "returned"


@pytest.mark.counted
def test_pulled_out_pedal_ends_the_test(stepped: Stepped) -> None:
    """The patient could not end it any more."""
    started(stepped)
    shoulder = Shoulder(stepped)
    shoulder.forward(3.0)
    stepped.apparatus.pedal_down = None
    shoulder.until("idle")
    assert shoulder.farthest_deg < 3.0 * SPEED_DEG_S + 0.5
    assert len(turns(stepped)) == 1


def test_pedal_on_the_way_back_ends_the_test_too(stepped: Stepped) -> None:
    started(stepped)
    shoulder = Shoulder(stepped, onset_deg=20.0)
    while shoulder.largest_nm < 1.5:
        shoulder.cycle()
    shoulder.forward(2.0)
    stepped.apparatus.pedal_down = True
    shoulder.until("idle")
    assert len(turns(stepped)) == 1


def with_weighing(**changes: object) -> EndFeel:
    expected = tuple([FRICTION_NM] * 100)
    return msgspec.structs.replace(TEST, expected_nm=expected, arm_nm=(growth(),), weighed_s=(0.6, 5.6), **changes)


@pytest.mark.parametrize("heavier_nm", [-3.0, pytest.param(-1.5, marks=pytest.mark.campaign), 1.5])
def test_arm_of_another_weight_is_weighed_on_the_way(stepped: Stepped, heavier_nm: float) -> None:
    started(stepped, with_weighing(repetitions=1))
    shoulder = Shoulder(stepped, heavier_nm=heavier_nm)
    shoulder.until("idle")
    assert CHOSEN_NM - 0.4 < shoulder.largest_nm < CHOSEN_NM + 0.1


@pytest.mark.parametrize(("chosen_nm", "allowed_nm"), [(1.0, 1.7), (2.0, 2.9)])
def test_shoulder_that_resists_from_the_start_is_no_weight(
    stepped: Stepped, chosen_nm: float, allowed_nm: float
) -> None:
    """A freezing shoulder has no free range. Its torque grows as a weight does."""
    started(stepped, with_weighing(torque_nm=chosen_nm, repetitions=1))
    shoulder = Shoulder(stepped, onset_deg=3.0, nm_deg=0.1)
    shoulder.until("idle")
    assert shoulder.largest_nm < allowed_nm
    assert len(turns(stepped)) == 1


def test_patient_who_works_while_weighed_is_taken_back(stepped: Stepped) -> None:
    """The weight would be wrong by as much at the turn, and the shoulder would get more than the chosen torque."""
    started(stepped, with_weighing(repetitions=1))
    shoulder = Shoulder(stepped, onset_deg=45.0)
    shoulder.forward(2.5)
    shoulder.guarding_nm = -1.5
    shoulder.forward(2.0)
    shoulder.guarding_nm = 0.0
    shoulder.until("idle")
    assert shoulder.farthest_deg < 30.0
    assert len(turns(stepped)) == 1


def test_push_on_the_way_back_makes_it_faster(stepped: Stepped) -> None:
    started(stepped)
    shoulder = Shoulder(stepped)
    while shoulder.largest_nm < CHOSEN_NM - 0.35:
        shoulder.cycle()
    shoulder.forward(0.5)
    before_deg = stepped.apparatus.angles_deg[AXIS]
    shoulder.guarding_nm = 2.5
    shoulder.forward(0.6)
    assert before_deg - stepped.apparatus.angles_deg[AXIS] > 1.5 * 0.6 * SPEED_DEG_S


@pytest.mark.parametrize("start_deg", [0.0, 20.0])
def test_push_does_not_take_the_arm_beyond_the_start(stepped: Stepped, start_deg: float) -> None:
    stepped.apparatus.angles_deg[AXIS] = start_deg
    started(stepped, ONCE, start_deg)
    shoulder = Shoulder(stepped, onset_deg=start_deg + 10.0)
    while shoulder.largest_nm < CHOSEN_NM - 0.35:
        shoulder.cycle()
    shoulder.forward(0.5)
    shoulder.guarding_nm = 2.5
    shoulder.until("idle")
    assert min(stepped.journal().setpoint_deg[:, AXIS]) > start_deg - 0.2


def test_other_motors_stay_at_rest_in_every_repetition(stepped: Stepped) -> None:
    started(stepped, msgspec.structs.replace(TEST, repetitions=2))
    Shoulder(stepped, onset_deg=5.0).until("idle")
    assert len(turns(stepped)) == 2
    others = np.delete(stepped.journal().setpoint_deg, AXIS, axis=1)
    assert np.abs(others - np.delete(REST_DEG, AXIS)).max() < 1e-5


def test_heavier_arm_without_weighing_is_taken_back_early(stepped: Stepped) -> None:
    started(stepped, ONCE)
    shoulder = Shoulder(stepped, heavier_nm=1.5)
    shoulder.until("idle")
    assert 0.5 < shoulder.largest_nm < CHOSEN_NM - 0.7


@pytest.mark.parametrize("guarding_nm", [2.5, 3.0])
def test_sudden_guarding_is_answered_within_50_ms(stepped: Stepped, guarding_nm: float) -> None:
    started(stepped)
    shoulder = Shoulder(stepped, onset_deg=90.0)
    shoulder.forward(3.0)
    shoulder.guarding_nm = guarding_nm
    highest_deg = stepped.apparatus.angles_deg[AXIS]
    cycles = 0
    while stepped.apparatus.angles_deg[AXIS] >= highest_deg:
        highest_deg = stepped.apparatus.angles_deg[AXIS]
        shoulder.cycle()
        cycles += 1
    # The first cycle brings the torque, and the last one shows that the arm came back.
    assert cycles - 2 <= 5


def test_paused_test_goes_on_and_still_turns(stepped: Stepped) -> None:
    started(stepped, ONCE)
    shoulder = Shoulder(stepped)
    shoulder.forward(2.0)
    assert stepped.send(Pause()) is None
    shoulder.until("paused")
    assert stepped.send(Play()) is None
    shoulder.until("idle")
    assert CHOSEN_NM - 0.4 < shoulder.largest_nm < CHOSEN_NM


@pytest.mark.parametrize("times", [1, 3])
def test_pause_on_the_way_back_does_not_repeat_the_stretch(stepped: Stepped, times: int) -> None:
    """A therapist pauses because the patient is in pain. To continue must not take the arm out again."""
    started(stepped, ONCE)
    shoulder = Shoulder(stepped)
    while shoulder.largest_nm < CHOSEN_NM - 0.35:
        shoulder.cycle()
    for _ in range(times):
        shoulder.forward(1.0)
        assert stepped.send(Pause()) is None
        shoulder.until("paused")
        paused_deg = stepped.apparatus.angles_deg[AXIS]
        shoulder.farthest_deg = 0.0
        assert stepped.send(Play()) is None
        shoulder.forward(0.5)
        assert shoulder.farthest_deg < paused_deg + 0.1
    shoulder.until("idle")
    assert len(turns(stepped)) == 1


@pytest.mark.parametrize("played_s", [0.3, 3.0])
def test_pedal_during_a_pause_ends_the_test(stepped: Stepped, played_s: float) -> None:
    started(stepped)
    shoulder = Shoulder(stepped)
    shoulder.forward(played_s)
    assert stepped.send(Pause()) is None
    shoulder.until("paused")
    stepped.apparatus.pedal_down = True
    shoulder.forward(0.2)
    stepped.apparatus.pedal_down = False
    shoulder.forward(0.2)
    paused_deg = shoulder.farthest_deg
    assert stepped.send(Play()) is None
    shoulder.until("idle")
    assert shoulder.farthest_deg == paused_deg
    end = stepped.journal().end
    assert end is not None and end.reason == "returned"


def test_pedal_before_the_first_way_ends_nothing(stepped: Stepped) -> None:
    """The therapist shows the pedal to the patient."""
    assert stepped.send(msgspec.structs.replace(LOAD, end_feel=ONCE), Trajectory(TIMES_S, way())) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    stepped.apparatus.pedal_down = True
    stepped.forward(0.2)
    stepped.apparatus.pedal_down = False
    stepped.forward(0.2)
    assert stepped.send(Play()) is None
    shoulder = Shoulder(stepped)
    shoulder.until("idle")
    assert len(turns(stepped)) == 1
    end = stepped.journal().end
    assert end is not None and end.reason == "completed"


def test_range_of_a_test_is_not_reduced(stepped: Stepped) -> None:
    started(stepped)
    refusal = stepped.send(ReduceRange())
    assert refusal is not None and refusal.code == "is_end_feel_test"


def test_resistance_above_the_patients_level_still_holds_the_arm(stepped: Stepped) -> None:
    started(stepped)
    shoulder = Shoulder(stepped)
    shoulder.forward(2.0)
    stepped.apparatus.torques_nm[2] = 3.95
    shoulder.forward(0.15)
    stepped.apparatus.torques_nm[2] = 0.0
    shoulder.until("paused")
    assert stepped.snapshot.run is not None and stepped.snapshot.run.reversals == 1


def on_the_way_back(stepped: Stepped) -> Shoulder:
    """Test a shoulder once at level 15, and return it two seconds after the arm was near the chosen torque."""
    load = msgspec.structs.replace(LOAD, end_feel=ONCE, resistance_level=15)
    assert stepped.send(load, Trajectory(TIMES_S, way())) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    assert stepped.send(Play()) is None
    shoulder = Shoulder(stepped)
    while shoulder.largest_nm < CHOSEN_NM - 0.35:
        shoulder.cycle()
    shoulder.forward(2.0)
    return shoulder


def test_resistance_on_the_way_back_holds_the_arm(stepped: Stepped) -> None:
    """The way back is not continued against the patient."""
    shoulder = on_the_way_back(stepped)
    before_deg = stepped.apparatus.angles_deg[AXIS]
    shoulder.guarding_nm = -3.0
    shoulder.until("stopped", within_s=0.5)
    assert stepped.causes() == ["load_on_the_way"]
    shoulder.forward(1.0)
    assert stepped.torque
    assert stepped.apparatus.angles_deg[AXIS] > before_deg - 0.5 * SPEED_DEG_S


# -- the check before ------------------------------------------------------------------------------------------------


def checked(test: EndFeel, speed_deg_s: float = SPEED_DEG_S, **changes: object) -> Refusal | None:
    load = Load(
        run_id="r",
        recording_id="a",
        times_s=TIMES_S.astype("<f8").tobytes(),
        angles_deg=way(speed_deg_s).astype("<f8").tobytes(),
        end_feel=test,
    )
    built = build(msgspec.structs.replace(load, **changes), StationConfig())
    return built if isinstance(built, Refusal) else None


def test_a_slow_way_out_is_accepted() -> None:
    assert checked(TEST) is None
    assert checked(with_weighing()) is None


@pytest.mark.parametrize(
    "changes",
    [
        {"motor": 6},
        {"repetitions": 0},
        {"expected_nm": (0.0,)},
        {"expected_nm": (0.0, float("nan"))},
        {"arm_nm": ((0.0, 1.0, 2.0),)},
        {"arm_nm": ((0.0, float("inf")),)},
        {"torque_nm": 0.0},
        {"torque_nm": float("nan")},
    ],
)
def test_incomplete_settings_are_refused(changes: dict[str, object]) -> None:
    refusal = checked(msgspec.structs.replace(TEST, **changes))
    assert refusal is not None and "the settings of its end-feel test are incomplete" in refusal.message


def up_and_down() -> bytes:
    angles = way()
    angles[:, AXIS] = SPEED_DEG_S * np.minimum(TIMES_S, 10.0 - np.maximum(TIMES_S - 2.0, 0.0))
    return angles.astype("<f8").tobytes()


@pytest.mark.parametrize(
    ("speed_deg_s", "changes"),
    [(1.0, {}), (11.0, {}), (SPEED_DEG_S, {"method": "paper"}), (SPEED_DEG_S, {"angles_deg": up_and_down()})],
)
def test_another_way_is_refused(speed_deg_s: float, changes: dict[str, object]) -> None:
    refusal = checked(TEST, speed_deg_s, **changes)
    assert (
        refusal is not None and "motor 4 must move in one direction, by at least 10°, at 2 to 10°/s" in refusal.message
    )


def test_motor_that_stands_is_refused() -> None:
    assert checked(msgspec.structs.replace(TEST, motor=3)) is not None


def test_torque_above_the_patients_level_is_refused() -> None:
    refusal = checked(TEST, resistance_level=12)
    assert refusal is not None and "the arm and the test need 2.0 Nm of motor 4" in refusal.message
    assert "allows only 1.9 Nm" in refusal.message


def test_arm_that_leaves_no_torque_for_a_test_is_refused() -> None:
    refusal = checked(msgspec.structs.replace(TEST, expected_nm=(0.5, 3.6, 2.0)))
    assert refusal is not None and "the arm and the test need 4.1 Nm of motor 4" in refusal.message


@pytest.mark.parametrize("resting", [0, 2])
def test_resistance_of_a_resting_motor_stops_the_way_back(stepped: Stepped, resting: int) -> None:
    """On the way back of an end-feel test; the test's motor moves, another one meets resistance."""
    shoulder = on_the_way_back(stepped)
    before_deg = stepped.apparatus.angles_deg[AXIS]
    stepped.apparatus.torques_nm[resting] = 2.6
    shoulder.forward(0.5)
    assert stepped.causes() == ["load_on_the_way"]
    assert stepped.apparatus.angles_deg[AXIS] > before_deg - 0.5 * SPEED_DEG_S


def test_paused_test_gives_way_above_the_chosen_torque(stepped: Stepped) -> None:
    """The patient guards while the arm is held in the stretch. The patient's level is far above the chosen torque."""
    started(stepped, ONCE)
    shoulder = Shoulder(stepped)
    while shoulder.largest_nm < CHOSEN_NM / 2:
        shoulder.cycle()
    assert stepped.send(Pause()) is None
    shoulder.until("paused")
    before_deg = stepped.apparatus.angles_deg[3]
    shoulder.guarding_nm = 2.4
    shoulder.forward(1.0)
    assert stepped.causes() or stepped.apparatus.angles_deg[3] < before_deg - 0.5
