"""Every row of the fault table: it does not hold exactly at its limit, and holds just beyond it."""

import json
import math
import re
from typing import Any

import msgspec
import pytest

from kata.device.config import StationConfig
from kata.device.cycle_state import CycleState, LoopContext
from kata.device.faults import FAULTS, evaluate_faults
from kata.device.setpoint_gate import refused_setpoints
from tests.support.paths import ROOT
from tests.support.stepped import REST_DEG

CONFIG = StationConfig()
LIMITS = CONFIG.mechanism_deg
LOW_DEG, HIGH_DEG = LIMITS[1]
"""Setpoint limits of axis 1, which stands for all axes in most tests."""

MOVING = CycleState(
    t_ns=0,
    context=LoopContext(
        late_ms=0.0, service_age_ms=0.0, run_id_mismatches=0, journal_ok=True, limits_deg=LIMITS, rate_hz=100
    ),
    bus_ok=True,
    complete=False,
    estop="closed",
    pedal_down=False,
    measured_deg=REST_DEG,
    speed_deg_s=(0.0,) * 5,
    torque_nm=(0.0,) * 5,
    drive_age_ms=(0.0,) * 5,
    status_age_ms=(0.0,) * 5,
    corrupt=(False,) * 5,
    measured_t_ns=0,
    hardware_error=(0,) * 5,
    watchdog_tripped=(False,) * 5,
    torque_reported=(True,) * 5,
    contacts_disagree_ms=0.0,
    torque=("on",) * 5,
    unbroken=(True,) * 5,
    verified=(True,) * 5,
    mismatch=("",) * 5,
    settings_lost=(False,) * 5,
    torque_on=True,
    setpoint_deg=REST_DEG,
    setpoint_cycles=0,
    following_ms=(0.0,) * 5,
    overtorque_ms=(0.0,) * 5,
    accelerating_ms=(0.0,) * 5,
    jump_deg=(0.0,) * 5,
    frozen_deg=(0.0,) * 5,
)
"""A state without any fault, with torque on."""


def facts_with(field: str, value: object) -> CycleState:
    """Return the state without faults, with one field changed; a value for axes is given for axis 1."""
    if hasattr(MOVING.context, field):
        return msgspec.structs.replace(MOVING, context=_situation(field, value))
    changes: dict[str, Any] = {field: value}
    was = getattr(MOVING, field)
    if isinstance(was, tuple):
        changes[field] = (was[0], value, *was[2:])
    return msgspec.structs.replace(MOVING, **changes)


def _situation(field: str, value: object) -> LoopContext:
    changes: dict[str, Any] = {field: value}
    return msgspec.structs.replace(MOVING.context, **changes)


def test_nothing_holds_when_all_is_well() -> None:
    assert evaluate_faults(MOVING, CONFIG) == []
    assert evaluate_faults(msgspec.structs.replace(MOVING, torque_on=False, torque_reported=(False,) * 5), CONFIG) == []


@pytest.mark.counted
@pytest.mark.parametrize(
    ("code", "field", "still_good", "bad"),
    [
        ("estop_pressed", "estop", "closed", "open"),
        ("estop_unknown", "estop", "closed", "unknown"),
        ("bus_lost", "bus_ok", True, False),
        ("other_adapter", "other_adapter", False, True),
        ("contacts_disagree", "contacts_disagree_ms", 100.0, 100.1),
        ("drive_reset", "settings_lost", False, True),
        ("drive_silent", "drive_age_ms", 100.0, 100.1),
        ("drive_silent", "drive_age_ms", 0.0, math.inf),
        ("drive_silent", "status_age_ms", 1000.0, 1000.1),
        ("drive_error", "hardware_error", 0, 1),
        ("drive_watchdog", "watchdog_tripped", False, True),
        ("torque_lost", "torque_reported", None, False),
        ("position_jump", "jump_deg", 5.0, 5.1),
        ("position_frozen", "frozen_deg", 8.0, 8.1),
        ("overtorque", "overtorque_ms", 100.0, 100.1),
        ("overacceleration", "accelerating_ms", 30.0, 30.1),
        # The range, the half of the tolerance that setpoints may use, and the other half.
        ("position_limit", "measured_deg", 129.0 + 4.0, 129.0 + 4.001),
        ("position_limit", "measured_deg", 88.0 - 4.0, 88.0 - 4.001),
        ("position_limit", "measured_deg", 100.0, math.nan),
        ("overspeed", "speed_deg_s", 150.0, 150.1),
        ("overspeed", "speed_deg_s", -150.0, -150.1),
        ("following_error", "following_ms", 250.0, 250.1),
        ("setpoint_frozen", "setpoint_cycles", 3, 4),
        ("overrun", "late_ms", 250.0, 250.1),
        ("service_silent", "service_age_ms", 500.0, 500.1),
        ("other_run", "run_id_mismatches", 2, 3),
        ("journal_fault", "journal_ok", True, False),
    ],
)
def test_each_fault_holds_beyond_its_limit_and_not_at_it(
    code: str, field: str, still_good: object, bad: object
) -> None:
    of_an_axis = isinstance(getattr(MOVING, field, None), tuple)
    assert evaluate_faults(facts_with(field, still_good), CONFIG) == []
    assert evaluate_faults(facts_with(field, bad), CONFIG) == [(code, 1 if of_an_axis else None)]


def test_corrupt_answers_differ_from_missing_ones() -> None:
    for field, limit_ms in (("drive_age_ms", 100.0), ("status_age_ms", 1000.0)):
        good = msgspec.structs.replace(facts_with(field, limit_ms), corrupt=(False, True, False, False, False))
        assert evaluate_faults(good, CONFIG) == []
        bad = msgspec.structs.replace(facts_with(field, limit_ms + 0.1), corrupt=(False, True, False, False, False))
        assert evaluate_faults(bad, CONFIG) == [("drive_garbled", 1)]


def test_lost_bus_says_nothing_about_drives_and_switch() -> None:
    lost = msgspec.structs.replace(
        MOVING, bus_ok=False, estop="unknown", drive_age_ms=(math.inf,) * 5, status_age_ms=(math.inf,) * 5
    )
    assert evaluate_faults(lost, CONFIG) == [("bus_lost", None)]


def test_torque_remaining_after_switching_off_is_a_fault() -> None:
    off = msgspec.structs.replace(MOVING, torque_on=False, torque_reported=(False, True, None, False, False))
    assert evaluate_faults(off, CONFIG) == [("torque_remains", 1)]


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("watchdog_tripped", True),
        ("jump_deg", 100.0),
        ("overtorque_ms", 1000.0),
        ("accelerating_ms", 1000.0),
        ("measured_deg", 170.0),
        ("speed_deg_s", 400.0),
        ("setpoint_cycles", 1000),
        ("late_ms", 1000.0),
        ("service_age_ms", math.inf),
        ("run_id_mismatches", 100),
    ],
)
def test_moving_an_arm_without_torque_is_no_fault(field: str, value: object) -> None:
    """Loads of the computer that move nothing are no fault either."""
    resting = msgspec.structs.replace(facts_with(field, value), torque_on=False, torque_reported=(False,) * 5)
    assert evaluate_faults(resting, CONFIG) == []


@pytest.mark.parametrize(("rate_hz", "cycle_hz", "cycles"), [(100, 100, 3), (10, 100, 30), (50, 200, 12)])
def test_a_plan_may_be_three_of_its_own_periods_old(rate_hz: int, cycle_hz: int, cycles: int) -> None:
    """The periods are those of the run, which may be slower than the station's."""
    config = msgspec.structs.replace(CONFIG, cycle_hz=cycle_hz)
    for waited, judged in ((cycles, []), (cycles + 1, [("setpoint_frozen", None)])):
        state = facts_with("setpoint_cycles", waited)
        assert (
            evaluate_faults(
                msgspec.structs.replace(state, context=msgspec.structs.replace(state.context, rate_hz=rate_hz)),
                config,
            )
            == judged
        )


def test_each_fault_has_its_own_way_of_stopping() -> None:
    """0: torque off at once. 1: ramp down, then off. 2: ramp down and hold."""
    categories: dict[int, set[str]] = {0: set(), 1: set(), 2: set()}
    for fault in FAULTS:
        categories[fault.category].add(fault.code)

    assert categories == {
        0: {
            "estop_pressed", "estop_unknown", "bus_lost", "drive_silent", "drive_garbled", "drive_error",
            "drive_watchdog", "torque_lost", "torque_remains", "position_jump", "position_frozen", "overtorque",
            "overacceleration", "overspeed", "setpoint_step", "setpoint_limit", "setpoint_acceleration",
            "unexpected_error", "contacts_disagree", "drive_reset", "other_adapter",
        },
        1: {
            "position_limit", "following_error", "setpoint_frozen", "overrun", "service_silent", "other_run",
            "journal_fault", "operator_stop", "browser_lost",
        },
        2: {"torque_found", "load_repeated", "load_on_the_way", "load_while_held", "arm_too_heavy"},
    }  # fmt: skip


# -- the last look at a setpoint --------------------------------------------------------------------------------------


def refused(last: float | tuple[float, float], following: float, rate_hz: int = 100) -> list[str]:
    """Return the fault codes for axis 1 with these setpoints."""
    before = [last] if isinstance(last, float) else list(last)
    sent = [(15.0, angle, 10.0, 0.0, 0.0) for angle in before]
    found = refused_setpoints(sent, (15.0, following, 10.0, 0.0, 0.0), LIMITS, CONFIG, rate_hz)
    assert all(axis == 1 for _, axis in found)
    return [code for code, _ in found]


@pytest.mark.counted
def test_setpoint_beyond_the_command_range_is_not_sent() -> None:
    assert refused(HIGH_DEG, HIGH_DEG) == []
    assert refused(HIGH_DEG, HIGH_DEG + 1e-6) == []  # rounding
    assert refused(HIGH_DEG, HIGH_DEG + 0.001) == ["setpoint_limit"]
    assert refused(LOW_DEG, LOW_DEG) == []
    assert refused(LOW_DEG, LOW_DEG - 1e-6) == []
    assert refused(LOW_DEG, LOW_DEG - 0.001) == ["setpoint_limit"]


@pytest.mark.parametrize("direction", [1, -1])
def test_step_above_one_and_a_half_maximum_speed_is_blocked(direction: int) -> None:
    # 100 deg/s at 100 Hz: 1 deg a period. At 10 Hz: 10 deg.
    assert refused(100.0, 100.0 + direction * 2.499) == []
    assert refused(100.0, 100.0 + direction * 2.501) == ["setpoint_step"]
    assert refused(110.0, 110.0 + direction * 11.999, rate_hz=10) == []
    assert refused(128.0, 128.0 - 15.999, rate_hz=10) == []
    assert refused(128.0, 128.0 - 16.001, rate_hz=10) == ["setpoint_step"]


def test_a_step_of_exactly_that_length_is_sent() -> None:
    assert refused(100.0, 102.5) == []


def test_the_step_counts_from_the_newest_setpoint() -> None:
    assert refused((97.9, 100.0), 102.4) == []
    assert refused((102.4, 100.0), 97.9) == []
    assert refused((98.0, 97.0), 99.6) == ["setpoint_step"]


@pytest.mark.counted
@pytest.mark.parametrize("direction", [1, -1])
def test_a_bend_beyond_the_highest_acceleration_is_not_sent(direction: int) -> None:
    # 4,000 deg/s2 at 100 Hz: a step may be 0.4 deg longer or shorter than the one before.
    assert refused((99.5, 100.0), 100.5) == []
    assert refused((100.0 - direction * 1.0, 100.0), 100.0 + direction * 1.3999) == []
    assert refused((100.0 - direction * 1.0, 100.0), 100.0 + direction * 1.4001) == ["setpoint_acceleration"]
    assert refused((100.0 - direction * 0.2, 100.0), 100.0 - direction * 0.2001) == ["setpoint_acceleration"]
    assert refused((100.0, 100.0), 100.0 + direction * 0.4001) == ["setpoint_acceleration"]


def test_the_first_setpoint_after_torque_on_has_no_bend() -> None:
    assert refused(100.0, 102.0) == []


def test_value_that_is_no_number_exceeds_any_limit() -> None:
    assert refused(100.0, math.nan) == ["setpoint_limit", "setpoint_step"]
    assert refused((100.0, 100.0), math.inf) == ["setpoint_limit", "setpoint_step"]


def test_every_axis_is_looked_at() -> None:
    rest = (15.0, 109.0, 10.0, 0.0, 0.0)
    gone = tuple(angle + 200.0 for angle in rest)
    found = refused_setpoints([rest], gone, LIMITS, CONFIG, 100)
    assert [axis for code, axis in found if code == "setpoint_limit"] == [0, 1, 2, 3, 4]
    assert [axis for code, axis in found if code == "setpoint_step"] == [0, 1, 2, 3, 4]


def test_every_stop_says_to_support_the_arm() -> None:
    """Without torque the arm falls within half a second (docs/explanation/safety.md)."""
    japanese = json.loads((ROOT / "frontend/src/locales/ja/server.json").read_text())
    for fault in FAULTS:
        assert re.search(r"[Ss]upport (the arm|it)", fault.next_step()), fault.code
        assert "腕を支え" in japanese[fault.next_step.code], fault.code
