"""The stretch: the arm is moved out to the chosen torque, held there, and released. The therapist can reduce the torque."""

import msgspec
import numpy as np
import pytest

from kata.device.config import StationConfig
from kata.device.ipc_messages import EndFeel, Pause, Play, ReduceRange, Refusal, Return, StretchState
from kata.device.references import build
from tests.support.stepped import Stepped
from tests.support.stepped_shoulder import (
    AXIS,
    CHOSEN_NM,
    END_DEG,
    FRICTION_NM,
    SPEED_DEG_S,
    TIMES_S,
    Shoulder,
    growth,
    started,
    way,
)
from tests.support.trajectories import LOAD

HOLD_S = 3.0
STRETCH = EndFeel(
    motor=AXIS + 1,
    torque_nm=CHOSEN_NM,
    expected_nm=(FRICTION_NM,) * 100,
    back_nm=(-FRICTION_NM,) * 100,
    arm_nm=(growth(),),
    weighed_s=(0.6, 4.0),
    repetitions=1,
    hold_s=HOLD_S,
)


class _Held(Shoulder):
    """A shoulder in an apparatus whose friction changes its direction over 0.3 deg and fades in 1 s at rest, as on the simple plant."""

    def __init__(self, stepped: Stepped, **has: float) -> None:
        super().__init__(stepped, **has)
        self._direction = 0.0

    def cycle(self) -> None:
        angles = self._stepped.apparatus.angles_deg
        before_deg = angles[AXIS]
        super().cycle()
        moved_deg = angles[AXIS] - before_deg
        at_once_nm = FRICTION_NM * np.sign(moved_deg)
        self._direction += min(abs(moved_deg) / 0.3, 1.0) * (np.sign(moved_deg) - self._direction)
        if moved_deg == 0.0:
            self._direction *= 0.99
        self._stepped.apparatus.torques_nm[AXIS] += FRICTION_NM * self._direction - at_once_nm


def stretch_of(stepped: Stepped) -> StretchState:
    run = stepped.snapshot.run
    assert run is not None and run.stretch is not None
    return run.stretch


def until_held(shoulder: Shoulder, stepped: Stepped) -> None:
    for _ in range(3000):
        if stretch_of(stepped).phase == "hold":
            return
        shoulder.cycle()
    raise AssertionError("the torque was not reached")


def held(stepped: Stepped, stretch: EndFeel = STRETCH, **shoulder_has: float) -> Shoulder:
    """Return a shoulder that is held at the torque of a stretch."""
    started(stepped, stretch)
    shoulder = _Held(stepped, **shoulder_has)
    until_held(shoulder, stepped)
    return shoulder


def test_torque_is_reached_held_and_released(stepped: Stepped) -> None:
    shoulder = held(stepped)
    assert shoulder.largest_nm > CHOSEN_NM - 0.5
    shoulder.forward(HOLD_S - 0.5)
    assert stretch_of(stepped).phase == "hold"
    shoulder.forward(1.0)
    assert stretch_of(stepped).phase == "release"
    shoulder.until("idle")
    assert CHOSEN_NM - 0.4 < shoulder.largest_nm < CHOSEN_NM + 0.05
    end = stepped.journal().end
    assert end is not None and end.reason == "completed"
    assert end.held_s is not None and HOLD_S - 0.5 < end.held_s < HOLD_S + 3.5
    assert end.target_nm == CHOSEN_NM


@pytest.mark.counted
def test_every_repetition_holds_the_torque(stepped: Stepped) -> None:
    started(stepped, msgspec.structs.replace(STRETCH, repetitions=2))
    shoulder = _Held(stepped)
    until_held(shoulder, stepped)
    assert stretch_of(stepped).repetitions_left == 2
    shoulder.forward(HOLD_S + 0.5)
    assert stretch_of(stepped).phase == "release"
    until_held(shoulder, stepped)
    assert stretch_of(stepped).repetitions_left == 1
    shoulder.until("idle")


@pytest.mark.counted
def test_shoulder_that_resists_nowhere_is_held_at_the_end(stepped: Stepped) -> None:
    """The end of the path is the largest angle."""
    shoulder = held(stepped, onset_deg=90.0)
    shoulder.forward(HOLD_S - 0.5)
    assert stepped.apparatus.angles_deg[AXIS] == pytest.approx(END_DEG, abs=0.3)
    assert stretch_of(stepped).phase == "hold"
    shoulder.until("idle")
    assert stepped.journal().end.held_s == 0.0  # type: ignore[union-attr]


def test_relaxing_capsule_is_followed_slowly(stepped: Stepped) -> None:
    shoulder = held(stepped, msgspec.structs.replace(STRETCH, hold_s=20.0))
    shoulder.forward(1.0)
    before_deg = stepped.apparatus.angles_deg[AXIS]
    shoulder.guarding_nm = -0.6
    shoulder.forward(1.0)
    crept_deg = stepped.apparatus.angles_deg[AXIS] - before_deg
    assert 0.1 < crept_deg < 0.05 * SPEED_DEG_S
    shoulder.forward(10.0)
    assert stretch_of(stepped).torque_nm == pytest.approx(CHOSEN_NM - 0.15, abs=0.15)
    assert stretch_of(stepped).phase == "hold"


def test_slow_push_moves_the_held_arm_back(stepped: Stepped) -> None:
    shoulder = held(stepped, msgspec.structs.replace(STRETCH, hold_s=20.0))
    shoulder.forward(1.0)
    before_deg = stepped.apparatus.angles_deg[AXIS]
    for _ in range(300):
        shoulder.guarding_nm += 0.002
        shoulder.cycle()
    assert stepped.apparatus.angles_deg[AXIS] < before_deg - 0.3
    assert stretch_of(stepped).phase == "hold"


@pytest.mark.parametrize("guarding_nm", [0.6, 2.0])
def test_sudden_guarding_in_a_hold_releases_within_50_ms(stepped: Stepped, guarding_nm: float) -> None:
    shoulder = held(stepped)
    shoulder.forward(1.0)
    before_deg = stepped.apparatus.angles_deg[AXIS]
    shoulder.guarding_nm = guarding_nm
    cycles = 0
    while stepped.apparatus.angles_deg[AXIS] >= before_deg:
        shoulder.cycle()
        cycles += 1
    # The first cycle brings the torque, and the last one shows that the arm came back.
    assert cycles - 2 <= 5
    shoulder.forward(0.2)
    assert stretch_of(stepped).phase == "release"


def test_reduced_torque_moves_the_held_arm_back(stepped: Stepped) -> None:
    shoulder = held(stepped, msgspec.structs.replace(STRETCH, hold_s=20.0))
    shoulder.forward(1.0)
    assert stepped.send(ReduceRange()) is None
    shoulder.forward(4.0)
    stretch = stretch_of(stepped)
    assert stretch.phase == "hold"
    assert stretch.target_nm == pytest.approx(0.8 * CHOSEN_NM)
    assert stretch.torque_nm < stretch.target_nm
    assert any("was reduced to 1.6 Nm at" in event.message for event in stepped.link.events)


@pytest.mark.counted
def test_torque_is_reduced_four_times_at_most(stepped: Stepped) -> None:
    held(stepped)
    for _ in range(4):
        assert stepped.send(ReduceRange()) is None
    refusal = stepped.send(ReduceRange())
    assert refusal is not None and refusal.code == "is_at_least"
    assert refusal.message == "The torque of the stretch is at its minimum, 0.4 Nm."


def test_reduced_torque_stays_in_later_repetitions(stepped: Stepped) -> None:
    started(stepped, msgspec.structs.replace(STRETCH, repetitions=2))
    shoulder = _Held(stepped)
    shoulder.forward(2.0)
    for _ in range(2):
        assert stepped.send(ReduceRange()) is None
    shoulder.until("idle")
    assert shoulder.largest_nm < 0.6 * CHOSEN_NM + 0.05
    end = stepped.journal().end
    assert end is not None and end.target_nm == pytest.approx(0.6 * CHOSEN_NM)


@pytest.mark.counted
def test_patient_ends_the_stretch_by_the_pedal(stepped: Stepped) -> None:
    shoulder = held(stepped, msgspec.structs.replace(STRETCH, repetitions=3))
    stepped.apparatus.pedal_down = True
    shoulder.forward(0.2)
    assert stretch_of(stepped).phase == "release"
    shoulder.until("idle")
    end = stepped.journal().end
    assert end is not None and end.reason == "returned"


def test_pause_in_a_hold_continues_with_the_release(stepped: Stepped) -> None:
    shoulder = held(stepped)
    assert stepped.send(Pause()) is None
    shoulder.until("paused")
    held_s, paused_deg = stretch_of(stepped).held_s, stepped.apparatus.angles_deg[AXIS]
    shoulder.forward(1.0)
    assert stretch_of(stepped).held_s == pytest.approx(held_s + 1.0, abs=0.2)
    assert stepped.send(Play()) is None
    shoulder.farthest_deg = 0.0
    shoulder.forward(0.5)
    assert stretch_of(stepped).phase == "release"
    shoulder.until("idle")
    assert shoulder.farthest_deg <= paused_deg + 0.01


def test_paused_way_out_goes_on(stepped: Stepped) -> None:
    started(stepped, STRETCH)
    shoulder = _Held(stepped)
    shoulder.forward(3.0)
    assert stepped.send(Pause()) is None
    shoulder.until("paused")
    assert stepped.send(Play()) is None
    shoulder.until("idle")
    assert CHOSEN_NM - 0.4 < shoulder.largest_nm < CHOSEN_NM + 0.05


@pytest.mark.counted
def test_held_arm_returns_by_command(stepped: Stepped) -> None:
    shoulder = held(stepped)
    assert stepped.send(Pause()) is None
    shoulder.until("paused")
    assert stepped.send(Return()) is None
    shoulder.until("idle")
    end = stepped.journal().end
    assert end is not None and end.reason == "returned"


def test_patient_who_works_while_weighed_is_released(stepped: Stepped) -> None:
    started(stepped, STRETCH)
    shoulder = _Held(stepped, onset_deg=45.0)
    shoulder.forward(2.5)
    shoulder.guarding_nm = -1.5
    shoulder.forward(1.2)
    shoulder.guarding_nm = 0.0
    shoulder.until("idle")
    assert shoulder.farthest_deg < 30.0


def test_resistance_above_the_level_moves_a_held_arm_back(stepped: Stepped) -> None:
    """Another motor meets resistance. The repetition ends."""
    shoulder = held(stepped)
    shoulder.forward(1.0)
    before_deg = stepped.apparatus.angles_deg[AXIS]
    stepped.apparatus.torques_nm[2] = 3.95
    shoulder.forward(0.2)
    stepped.apparatus.torques_nm[2] = 0.0
    shoulder.until("paused")
    assert stepped.snapshot.run is not None and stepped.snapshot.run.reversals == 1
    assert stepped.apparatus.angles_deg[AXIS] < before_deg - 2.0
    assert stepped.send(Play()) is None
    shoulder.farthest_deg = 0.0
    shoulder.until("idle")
    assert shoulder.farthest_deg < before_deg


@pytest.mark.counted
def test_resistance_on_the_way_out_ends_the_repetition(stepped: Stepped) -> None:
    started(stepped, STRETCH)
    shoulder = _Held(stepped)
    shoulder.forward(3.0)
    assert stretch_of(stepped).phase == "out"
    before_deg = stepped.apparatus.angles_deg[AXIS]
    stepped.apparatus.torques_nm[2] = 3.95
    shoulder.forward(0.2)
    stepped.apparatus.torques_nm[2] = 0.0
    shoulder.until("paused")
    assert stepped.send(Play()) is None
    shoulder.farthest_deg = 0.0
    shoulder.until("idle")
    assert shoulder.farthest_deg < before_deg


# -- the check before ------------------------------------------------------------------------------------------------


def checked(stretch: EndFeel, **changes: object) -> Refusal | None:
    load = msgspec.structs.replace(
        LOAD,
        times_s=TIMES_S.astype("<f8").tobytes(),
        angles_deg=way().astype("<f8").tobytes(),
        end_feel=stretch,
        **changes,
    )
    built = build(load, StationConfig())
    return built if isinstance(built, Refusal) else None


def test_stretch_with_a_baseline_is_accepted() -> None:
    assert checked(STRETCH) is None


@pytest.mark.parametrize("missing", ["back_nm", "arm_nm"])
def test_stretch_without_a_baseline_is_refused(missing: str) -> None:
    refusal = checked(msgspec.structs.replace(STRETCH, **{missing: ()}))
    assert refusal is not None and "a stretch needs the baseline of motor 4 on both ways" in refusal.message


@pytest.mark.parametrize("changes", [{"hold_s": 0.5}, {"hold_s": 121.0}, {"hold_s": float("nan")}, {"repetitions": 21}])
def test_hold_of_another_length_is_refused(changes: dict[str, object]) -> None:
    refusal = checked(msgspec.structs.replace(STRETCH, **changes))
    assert refusal is not None and "a stretch holds its torque for 1 to 120 s, at most 20 times" in refusal.message


def test_level_must_carry_arm_and_torque() -> None:
    carried = tuple(np.linspace(0.5, 2.5, 100).tolist())
    refusal = checked(msgspec.structs.replace(STRETCH, expected_nm=carried))
    assert refusal is not None and "the arm and the test need 4.5 Nm of motor 4" in refusal.message


@pytest.mark.parametrize("weighed_s", [(0.0, 0.0), (4.0, 0.6), (-1.0, 4.0), (0.6, float("nan")), (0.6, 12.5)])
def test_stretch_without_a_part_to_weigh_the_arm_is_refused(weighed_s: tuple[float, float]) -> None:
    refusal = checked(msgspec.structs.replace(STRETCH, weighed_s=weighed_s))
    assert refusal is not None and refusal.code == "unplayable"


def test_arm_that_was_not_weighed_is_not_held(stepped: Stepped) -> None:
    """The patient pushes slowly from the start on, so that the torque is reached before the arm is weighed. Without its weight the torque at
    the shoulder is unknown. A hold would lead the arm out by 20 deg when the patient relaxes.
    """
    started(stepped, msgspec.structs.replace(STRETCH, hold_s=20.0))
    shoulder = _Held(stepped, heavier_nm=-1.0)
    phases = set()
    while stepped.mode == "playing":
        shoulder.guarding_nm = min(shoulder.guarding_nm + 0.02, 1.95)
        shoulder.cycle()
        if stepped.mode == "playing":
            phases.add(stretch_of(stepped).phase)
    assert phases == {"out", "release"}
    assert shoulder.farthest_deg < way()[round(STRETCH.weighed_s[1] * 50), AXIS]
