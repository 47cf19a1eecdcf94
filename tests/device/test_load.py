"""Checks of a recording before it is loaded, outside the control thread: for each method, and of its correction."""

import math
import re
from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from kata.device.config import StationConfig
from kata.device.ipc import QueuedCommand
from kata.device.ipc_messages import RESISTANCE_LEVELS, Load, Refusal
from kata.device.references import build
from kata.motion.arm_load import ArmLoad
from kata.motion.ilc import MAX_CORRECTION_DEG, rows
from kata.motion.linkage import motor_angles_deg
from kata.motion.trajectory import Trajectory, ZeroOrderHold
from tests.support.load_messages import SECONDS, TIMES_S, angles, correction, message

Loading = Callable[..., QueuedCommand]


@pytest.fixture
def loading() -> Loading:
    """Return the function that checks a Load at a station."""

    def load(command: Load, config: StationConfig | None = None) -> QueuedCommand:
        built = build(command, config or StationConfig())
        if isinstance(built, Refusal):
            return QueuedCommand(1, command, None, built)
        return QueuedCommand(1, command, built.trajectory, None, built.correction)

    return load


@pytest.mark.parametrize("method", ["paper", "smooth", "learned"])
def test_each_method_has_its_reference(loading: Loading, method: str) -> None:
    taken = loading(message(method=method))
    assert taken.refusal is None
    assert isinstance(taken.trajectory, ZeroOrderHold if method == "paper" else Trajectory)
    assert isinstance(taken.trajectory, ZeroOrderHold) == (method == "paper")
    assert taken.correction is None


@pytest.mark.parametrize("method", ["paper", "smooth", "learned"])
def test_every_method_refuses_recordings_beyond_the_range_by_motor(loading: Loading, method: str) -> None:
    far = angles(motor3=10 + 117 * np.sin(np.pi * TIMES_S / SECONDS))
    refusal = loading(message(far, method=method)).refusal
    assert refusal is not None
    assert refusal.code == "unplayable"
    assert "motor 3 would go to 127.0° at 1.5 s; its range is 0 to 120°" in refusal.message


@pytest.mark.parametrize("method", ["paper", "smooth"])
def test_recording_slightly_beyond_patient_limits_is_refused(loading: Loading, method: str) -> None:
    limits = [(-180.0, 180.0)] * 5
    limits[2] = (5.0, 40.0)
    up = angles(motor3=10 + 30.01 * np.sin(np.pi * TIMES_S / SECONDS))
    assert loading(message(up, method=method)).refusal is None
    refusal = loading(message(up, method=method, limits_deg=tuple(limits))).refusal
    assert refusal is not None
    assert "motor 3 would go to 40.0° at 1.5 s; its range is 5 to 40°" in refusal.message


def test_half_an_axis_acceleration_is_reserved_for_feed_forward(loading: Loading) -> None:
    wave = angles(motor4=5.0 * np.sin(2 * np.pi * 3.0 * TIMES_S))
    sharp = (2 * np.pi * 3.0) ** 2 * 5.0 * (1 / (1 + (3 / 6) ** 4))

    def station(acceleration: float) -> StationConfig:
        axes = tuple(
            msgspec.structs.replace(axis, max_speed_deg_s=80.0, max_acceleration_deg_s2=acceleration)
            for axis in StationConfig().axes
        )
        return StationConfig(axes=axes)

    assert loading(message(wave), station(2 * sharp * 1.05)).refusal is None
    refusal = loading(message(wave), station(2 * sharp * 0.95)).refusal
    assert refusal is not None
    assert "motor 4 would jerk at" in refusal.message


def test_paper_method_may_use_the_whole_acceleration(loading: Loading) -> None:
    """Samples that alternate by 7.9 deg: 1,580 deg/s2 at 10 Hz."""
    stepping = angles(motor4=7.9 * (np.floor(TIMES_S * 10 + 0.5) % 2))
    axes = tuple(
        msgspec.structs.replace(axis, max_speed_deg_s=80.0, max_acceleration_deg_s2=2900.0)
        for axis in StationConfig().axes
    )
    assert loading(message(stepping, method="paper"), StationConfig(axes=axes)).refusal is None
    refusal = loading(message(stepping), StationConfig(axes=axes)).refusal
    assert refusal is not None
    assert "motor 4 would" in refusal.message


@pytest.mark.parametrize(("cycle_hz", "refused"), [(100, False), (50, False), (125, True)])
def test_the_papers_ten_hertz_must_fit_the_stations_cycles(loading: Loading, cycle_hz: int, refused: bool) -> None:
    config = StationConfig(cycle_hz=cycle_hz, rate_hz=25)
    refusal = loading(message(method="paper"), config).refusal
    assert (refusal is not None) == refused
    assert refusal is None or (refusal.code, refusal.next_step) == ("unusable", "Choose another method.")
    assert loading(message(), config).refusal is None


def test_learned_correction_is_sent_with_the_recording(loading: Loading) -> None:
    given = np.random.default_rng(0).uniform(-MAX_CORRECTION_DEG, MAX_CORRECTION_DEG, (rows(SECONDS), 5))
    taken = loading(message(method="learned", correction_deg=given.tobytes(), correction_step_s=0.02))
    assert taken.refusal is None
    assert taken.correction is not None
    assert taken.correction.step_s == 0.02
    assert np.array_equal(taken.correction.angles_deg, given)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"method": "smooth"}, "belongs to the learned method"),
        ({"method": "paper"}, "belongs to the learned method"),
        ({"correction_deg": correction()[:-8]}, "is incomplete"),
        ({"correction_deg": correction(MAX_CORRECTION_DEG + 0.001)}, "exceeds 3°"),
        ({"correction_deg": correction(-MAX_CORRECTION_DEG - 0.001)}, "exceeds 3°"),
        ({"correction_deg": correction(math.nan)}, "exceeds 3°"),
        ({"correction_step_s": 0.0}, "differ in length"),
        ({"correction_step_s": -0.02}, "differ in length"),
        ({"correction_step_s": math.nan}, "differ in length"),
        ({"correction_step_s": math.inf}, "differ in length"),
        ({"correction_step_s": 1000.0, "correction_deg": correction(count=2)}, "differ in length"),
        ({"correction_step_s": 0.03}, "differ in length"),
        ({"correction_deg": correction(count=rows(SECONDS) - 2)}, "differ in length"),
        ({"correction_deg": correction(count=rows(SECONDS) + 2)}, "differ in length"),
        ({"correction_deg": correction(count=1), "correction_step_s": 3.0}, "differ in length"),
    ],
)
def test_learned_correction_must_be_complete_bounded_and_match_the_recording(
    loading: Loading, changes: dict[str, object], sentence: str
) -> None:
    good = message(method="learned", correction_deg=correction(), correction_step_s=0.02)
    assert loading(good).refusal is None
    refusal = loading(msgspec.structs.replace(good, **changes)).refusal
    assert refusal is not None
    assert refusal.code == "unusable"
    assert sentence in refusal.message


def test_a_correction_at_the_bound_is_good(loading: Loading) -> None:
    for deg in (MAX_CORRECTION_DEG, -MAX_CORRECTION_DEG):
        taken = loading(message(method="learned", correction_deg=correction(deg), correction_step_s=0.02))
        assert taken.refusal is None


@pytest.mark.parametrize("method", ["paper", "smooth", "learned"])
def test_a_recording_faster_than_the_patient_may_go_is_refused(loading: Loading, method: str) -> None:
    """31 deg/s, where the station itself allows more."""
    up = angles(motor3=10 + 30 * np.sin(np.pi * TIMES_S / SECONDS))
    assert loading(message(up, method=method, max_speed_deg_s=33.0)).refusal is None
    refusal = loading(message(up, method=method, max_speed_deg_s=30.0)).refusal
    assert refusal is not None
    assert refusal.code == "unplayable"
    assert "motor 3 would move at 31°/s" in refusal.message
    assert "its limit is 30°/s" in refusal.message


@pytest.mark.parametrize("limit_deg_s", [0.0, -1.0, math.nan, math.inf])
def test_invalid_speed_limit_is_refused(loading: Loading, limit_deg_s: float) -> None:
    refusal = loading(message(max_speed_deg_s=limit_deg_s)).refusal
    assert refusal is not None
    assert "speed limit must be above 0°/s" in refusal.message


def test_a_recording_too_short_to_judge_is_refused(loading: Loading) -> None:
    """Two samples within 1 ms that are 14 deg apart: less than 150 deg/s over 0.1 s."""
    short = {"times_s": np.array([0.0, 0.001]).tobytes()}
    two = angles()[:2]
    two[1, 2] += 14.0
    refusal = loading(message(two, **short)).refusal
    assert refusal is not None
    assert refusal.code == "unplayable"
    assert "it lasts 1 ms; it must last at least 200 ms" in refusal.message


def test_a_jump_at_the_very_end_is_refused(loading: Loading) -> None:
    """A jump of 10 deg in 4 ms; only the last three setpoints show more than a fifth of it."""
    times = np.append(TIMES_S, TIMES_S[-1] + 0.004)
    still = angles(motor3=np.full(len(TIMES_S), 60.0))
    jump = np.vstack([still, still[-1] + (0, 0, 10, 0, 0)])
    refusal = loading(message(jump, times_s=times.tobytes())).refusal
    assert refusal is not None
    assert "motor 3 would jerk at 3.0 s" in refusal.message


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"limits_deg": ((math.nan, 90.0),) * 5}, "a lower and a higher angle"),
        ({"limits_deg": ((90.0, -90.0),) * 5}, "a lower and a higher angle"),
        ({"limits_deg": ((-90.0, 90.0),) * 4}, "for some motors only"),
        ({"max_speed_deg_s": math.nan}, "above 0°/s"),
        ({"max_speed_deg_s": 0.0}, "above 0°/s"),
        ({"repetition_s": math.nan}, "must be 0 s or longer"),
        ({"repetition_s": -1.0}, "must be 0 s or longer"),
        ({"resistance_level": 26}, "must be 1 to 25"),
    ],
)
def test_a_limit_that_limits_nothing_is_refused(loading: Loading, changes: dict[str, object], sentence: str) -> None:
    refusal = loading(msgspec.structs.replace(message(), **changes)).refusal
    assert refusal is not None
    assert refusal.code == "unplayable"
    assert sentence in refusal.message


def test_a_patients_speed_limit_is_held(loading: Loading) -> None:
    up = angles(motor3=10 + 10 * TIMES_S)
    assert loading(message(up, max_speed_deg_s=10.5)).refusal is None
    refusal = loading(message(up, max_speed_deg_s=9.5)).refusal
    assert refusal is not None
    assert "motor 3 would move at 10°/s" in refusal.message


def carrying(weight_nm: float) -> StationConfig:
    """Return a station whose motor 4 carries an arm of this weight, raised forward."""
    inertia = (0.0,) * 8 + (-weight_nm / 9.81, 0.0)
    return StationConfig(arm=ArmLoad(inertia=inertia))


def raised(**changes: object) -> Load:
    """Return a Load that raises the arm forward to 80 deg at the middle of its time."""
    rows = angles()
    rows[:, :2] = motor_angles_deg(np.zeros(5))[:2]
    rows[:, 3] = 10.0 + 35.0 * (1 - np.cos(2 * np.pi * TIMES_S / SECONDS))
    rows[:, 2] = 0.0
    return msgspec.structs.replace(message(rows), **changes)


@pytest.mark.parametrize("method", ["paper", "smooth", "learned"])
def test_overload_is_refused_by_motor_time_and_torque(loading: Loading, method: str) -> None:
    assert loading(raised(method=method), carrying(3.2)).refusal is None
    refusal = loading(raised(method=method), carrying(6.0)).refusal
    assert refusal is not None
    # 6 Nm times sin 80 deg, and 0.85 x 0.98 of 4 Nm.
    found = re.fullmatch(
        r"This recording cannot be played: motor 4 would need (\d\.\d) Nm at (\d+\.\d) s; its limit is 3\.3 Nm\.",
        refusal.message,
    )
    assert found
    assert float(found[1]) == pytest.approx(5.9, abs=0.15)
    assert float(found[2]) == pytest.approx(SECONDS / 2, abs=0.3)
    assert "balancer" in refusal.next_step


def test_a_lower_resistance_level_carries_less(loading: Loading) -> None:
    assert loading(raised(resistance_level=RESISTANCE_LEVELS), carrying(2.0)).refusal is None
    assert loading(raised(resistance_level=RESISTANCE_LEVELS // 4), carrying(2.0)).refusal is not None


def test_unidentified_load_refuses_nothing(loading: Loading) -> None:
    config = carrying(6.0)
    assert loading(raised(), msgspec.structs.replace(config, arm=ArmLoad())).refusal is None
