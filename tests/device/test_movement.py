"""Movement along a path: from rest to full speed in 0.2 s, gently to its end, and back."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.device.movement import RAMP_S, Movement, longest_step
from kata.motion.path import PathPoint

DT_S = 0.01


@dataclass
class Straight:
    """A path whose angles equal its time, so that a place can be read from a setpoint."""

    duration_s: float = 2.0

    def motion_at(self, time_s: float) -> PathPoint:
        return PathPoint(np.full(5, time_s), np.full(5, 1.0), np.full(5, 0.5))


def advance(movement: Movement, cycles: int) -> list[float]:
    overrides = []
    for _ in range(cycles):
        movement.advance(DT_S)
        overrides.append(movement.speed_override)
    return overrides


def until_ended(movement: Movement) -> list[float]:
    overrides = []
    while not movement.ended:
        overrides += advance(movement, 1)
        assert len(overrides) < 10_000, "the movement does not end"
    return overrides


def test_movement_starts_at_the_path_start_and_then_leaves() -> None:
    movement = Movement(Straight())
    assert (movement.position_s, movement.speed_override, movement.direction, movement.reverse_to_s) == (
        0.0,
        0.0,
        1,
        0.0,
    )
    assert not movement.at_rest
    assert not movement.ended


def test_path_speed_is_reached_in_0_2_seconds_and_held() -> None:
    movement = Movement(Straight())
    overrides = advance(movement, 25)
    assert overrides == pytest.approx([min(1.0, 0.05 * (n + 1)) for n in range(25)])
    # The ramp costs 0.1 s; each cycle adds its own speed override.
    assert movement.position_s == pytest.approx(sum(overrides) * DT_S)


def test_pause_stops_the_path_within_0_2_seconds() -> None:
    movement = Movement(Straight(), speed_override=1.0)
    movement.direction = 0
    overrides = advance(movement, 20)
    assert overrides == pytest.approx([1.0 - 0.05 * (n + 1) for n in range(20)])
    assert not Movement(Straight(), speed_override=0.05, direction=0).at_rest
    advance(movement, 1)
    assert movement.at_rest
    assert not movement.ended
    assert movement.position_s == pytest.approx(0.095)


def test_change_of_direction_passes_through_rest() -> None:
    movement = Movement(Straight(), position_s=1.0, speed_override=1.0, direction=-1)
    assert advance(movement, 40) == pytest.approx([1.0 - 0.05 * (n + 1) for n in range(40)])
    assert advance(movement, 5) == pytest.approx([-1.0] * 5)


@pytest.mark.parametrize("duration_s", [0.05, 0.5, 1.0, 1.003, 2.0])
def test_the_end_is_met_exactly_and_slowly(duration_s: float) -> None:
    movement = Movement(Straight(duration_s))
    overrides = until_ended(movement)
    assert movement.position_s == duration_s
    assert overrides[-1] <= 0.3
    assert np.abs(np.diff([0.0, *overrides])).max() <= 0.05 + 1e-9
    # Slowing down begins no earlier than necessary: a ramp and a short creep.
    assert len(overrides) * DT_S <= duration_s + 0.6


@pytest.mark.parametrize(("speed_override", "ramp_way_s"), [(1.0, 0.105), (0.5, 0.0275)])
def test_slowing_down_for_the_end_begins_just_in_time(speed_override: float, ramp_way_s: float) -> None:
    """At a speed override of 1 the ramp takes 0.1 s of the path; half a cycle more is lost in steps."""
    just_in_time = Movement(
        Straight(), position_s=2.0 - ramp_way_s + speed_override * DT_S / 2, speed_override=speed_override
    )
    assert advance(just_in_time, 1)[0] < speed_override
    earlier = Movement(
        Straight(), position_s=2.0 - ramp_way_s - 1.5 * speed_override * DT_S, speed_override=speed_override
    )
    assert advance(earlier, 1)[0] >= speed_override


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("shortest_ramp_s", [0.0, 0.4])
@pytest.mark.parametrize("left_s", [0.9, 0.903, 0.907])
def test_end_is_reached_within_one_change_of_speed(
    direction: Literal[1, -1], shortest_ramp_s: float, left_s: float
) -> None:
    """The rest of the path is not a whole number of steps, so the last change may exceed the creep speed."""
    position_s = 2.0 - left_s if direction == 1 else left_s
    movement = Movement(
        Straight(),
        position_s,
        speed_override=direction * 1.0,
        direction=direction,
        shortest_ramp_s=shortest_ramp_s,
        creep=0.02,
    )
    overrides = np.abs(until_ended(movement))
    change = DT_S / max(RAMP_S, shortest_ramp_s)
    assert overrides[-1] <= 0.02 + change
    assert np.abs(np.diff(overrides)).max() <= change + 1e-12


def test_end_is_approached_at_a_tenth_of_the_speed() -> None:
    movement = Movement(Straight(), position_s=2.0 - 0.02, speed_override=0.1)
    movement.advance(DT_S)
    assert movement.speed_override == pytest.approx(0.15)  # it is early: the ramp's way from there is shorter
    # Here the ramp's way would be as short at 0.085.
    crept = Movement(Straight(), position_s=2.0 - 0.0012, speed_override=0.1)
    assert advance(crept, 1) == pytest.approx([0.1])
    assert crept.position_s == pytest.approx(2.0 - 0.0002)
    assert not crept.ended
    crept.advance(DT_S)
    assert crept.ended


def test_return_ends_exactly_at_its_target() -> None:
    movement = Movement(Straight(), position_s=1.7, direction=-1, reverse_to_s=0.4)
    overrides = until_ended(movement)
    assert movement.position_s == pytest.approx(0.4, abs=1e-12)
    assert min(overrides) == pytest.approx(-1.0)
    assert overrides[-1] >= -0.3
    assert not movement.at_rest


def test_return_from_behind_its_target_ends_at_once() -> None:
    movement = Movement(Straight(), position_s=0.3, direction=-1, reverse_to_s=0.4)
    assert movement.ended
    movement.advance(DT_S)
    assert movement.position_s == pytest.approx(0.3)


def test_direction_to_a_stop_has_no_end_even_there() -> None:
    movement = Movement(Straight(), position_s=2.0, direction=0)
    assert not movement.ended
    assert movement.at_rest


def test_slowing_to_rest_does_not_leave_the_path() -> None:
    behind = Movement(Straight(), position_s=1.999, speed_override=1.0, direction=0)
    assert advance(behind, 25)[-1] == 0.0
    assert behind.position_s == 2.0
    before = Movement(Straight(), position_s=0.001, speed_override=-1.0, direction=0)
    assert advance(before, 25)[-1] == 0.0
    assert before.position_s == 0.0


def test_pause_slows_down_normally_where_a_return_would_end() -> None:
    paused = Movement(Straight(), position_s=1.0, speed_override=-1.0, direction=0, reverse_to_s=0.95)
    assert advance(paused, 20)[-1] == pytest.approx(0.0)
    assert paused.position_s == pytest.approx(0.905)


def test_setpoint_leads_by_the_speed_over_its_lead_time() -> None:
    for speed_override, place_s in ((1.0, 1.05), (-0.5, 0.975), (0.0, 1.0)):
        movement = Movement(Straight(), position_s=1.0, speed_override=speed_override)
        assert movement.place_s(0.05) == pytest.approx(place_s)
        assert movement.motion(0.05).angles_deg == pytest.approx([place_s] * 5)


@pytest.mark.parametrize("speed_override", [1.0, 0.5, -1.0, 0.0])
def test_speed_scales_with_override_and_acceleration_with_its_square(speed_override: float) -> None:
    motion = Movement(Straight(), position_s=1.0, speed_override=speed_override).motion(0.0)
    assert motion.speed_deg_s == pytest.approx([speed_override * 1.0] * 5)
    assert motion.acceleration_deg_s2 == pytest.approx([speed_override**2 * 0.5] * 5)


def test_a_changing_speed_override_is_acceleration_too() -> None:
    movement = Movement(Straight(), position_s=1.0, speed_override=0.5)
    movement.advance(DT_S)
    # To full speed in 0.2 s: 5 per second.
    assert movement.override_rate == pytest.approx(5.0)
    assert movement.motion(0.0).acceleration_deg_s2 == pytest.approx([0.55**2 * 0.5 + 5.0] * 5)
    movement.direction = 0
    movement.advance(DT_S)
    assert movement.override_rate == pytest.approx(-5.0)
    movement = Movement(Straight(), speed_override=1.0)
    assert movement.override_rate == 0.0
    movement.advance(DT_S)
    assert movement.override_rate == 0.0


@given(st.floats(0.0, 100.0), st.floats(1e-3, 10.0))
def test_movement_of_the_longest_step_stops_within_the_distance(left: float, second_difference: float) -> None:
    moved, step = 0.0, float(longest_step(left, second_difference))
    while step > 0.0:
        moved += step
        following = float(longest_step(max(left - moved, 0.0), second_difference))
        assert following >= step - second_difference - 1e-9
        step -= second_difference
    assert moved <= left + 1e-9


@pytest.mark.parametrize("second_difference", [0.1, 2.0])
@pytest.mark.parametrize("steps", [1, 2, 7, 50])
def test_longest_step_can_shrink_by_constant_second_differences_to_zero(steps: int, second_difference: float) -> None:
    left = second_difference * sum(range(1, steps + 1))
    assert longest_step(left, second_difference) == pytest.approx(steps * second_difference)
    assert longest_step(0.0, second_difference) == pytest.approx(0.0)
