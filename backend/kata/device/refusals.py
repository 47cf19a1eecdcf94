"""Defines the rules that refuse commands, and their refusals."""

from typing import Final

import numpy as np

from kata.device import texts
from kata.device.approach_and_return import approach_path
from kata.device.config import StationConfig
from kata.device.cycle_state import CycleState
from kata.device.faults import MAX_FROZEN_SETPOINT_DEG
from kata.device.ipc_messages import CommandName, Mode, Refusal
from kata.device.latched_stop import LatchedStop
from kata.device.range_override import RangeOverride
from kata.device.run import Run, stretch_of
from kata.device.run_limits import PATH_TOLERANCE_DEG
from kata.device.setpoint_gate import largest_step_deg
from kata.messages import Text
from kata.motion.axes import Side
from kata.motion.texts import SIDES

_YIELD_DEG: Final = 0.5
"""Part of the gate's largest step that is left for a setpoint that yields to the patient."""

ANGLES_NOT_CURRENT: Final = "angles_not_current"
"""Code of a refusal whose cause can end within some cycles."""

_ALLOWED_IN: Final[dict[CommandName, tuple[Mode, ...]]] = {
    "teach": ("idle",),
    "finish_teaching": ("teaching",),
    "load": ("idle",),
    "unload": ("ready",),
    "approach": ("ready",),
    "play": ("paused",),
    "pause": ("playing",),
    "reduce_range": ("playing", "paused"),
    "return": ("paused",),
    "release_torque": ("stopped",),
    "acknowledge": ("stopped",),
}
"""The modes in which each command is allowed. Stop is allowed in every mode."""

_MODES: Final[tuple[tuple[Mode, Text, Text], ...]] = (
    ("offline", texts.IS_OFFLINE(), texts.SWITCH_ON_AND_CHECK_ADAPTER()),
    ("idle", texts.IS_IDLE(), texts.LOAD_RECORDING_FIRST()),
    ("teaching", texts.IS_TEACHING(), texts.FINISH_TEACHING_FIRST()),
    ("ready", texts.IS_READY(), texts.APPROACH_OR_UNLOAD()),
    ("approaching", texts.IS_APPROACHING(), texts.WAIT_OR_STOP()),
    ("playing", texts.IS_PLAYING(), texts.PAUSE_OR_STOP_FIRST()),
    ("paused", texts.IS_PAUSED(), texts.PLAY_RETURN_OR_STOP()),
    ("returning", texts.IS_RETURNING(), texts.WAIT_OR_STOP()),
    ("stopped", texts.IS_STOPPED(), texts.ACKNOWLEDGE_FIRST()),
)
_IN_MODE: Final[dict[Mode, Refusal]] = {
    mode: Refusal.of(code=f"is_{mode}", message=message, next_step=next_step) for mode, message, next_step in _MODES
}
"""The refusal of a command that the mode does not allow."""
_NOTHING_TO_DO: Final[dict[CommandName, Refusal]] = {
    "acknowledge": Refusal.of(code="not_stopped", message=texts.NOT_STOPPED(), next_step=texts.NOTHING_TO_DO()),
    "finish_teaching": Refusal.of(code="not_teaching", message=texts.NOT_TEACHING(), next_step=texts.NOTHING_TO_DO()),
}


def not_in_this_mode(name: CommandName, mode: Mode) -> Refusal | None:
    """Refuse a command that the mode does not allow."""
    if name == "stop" or mode in _ALLOWED_IN[name]:
        return None
    if name in _NOTHING_TO_DO:
        return _NOTHING_TO_DO[name]
    return _IN_MODE[mode]


def not_yet_cleared(stop: LatchedStop, *, still_stopping: bool) -> Refusal | None:
    """Refuse to acknowledge a stop before its ramp has ended (a held arm counts as ended) and all its causes have cleared."""
    if still_stopping:
        return Refusal.of(code="still_stopping", message=texts.STILL_STOPPING(), next_step=texts.WAIT_A_MOMENT())
    for cause in stop.causes():
        if not cause.cleared:
            return Refusal(
                code=cause.code,
                message=cause.message,
                next_step=cause.next_step,
                message_key=cause.message_key,
                next_step_key=cause.next_step_key,
            )
    return None


def not_verified(state: CycleState, problem: str) -> Refusal | None:
    """Refuse to acknowledge a stop before every drive's settings are verified. ``problem``: the reason why a drive cannot be
    configured.
    """
    if all(state.verified):
        return None
    if problem:
        return Refusal.of(
            code="not_verified", message=texts.MOTOR_CANNOT_BE_SET_UP(reason=problem), next_step=texts.HAVE_IT_CHECKED()
        )
    return Refusal.of(code="not_verified", message=texts.SETTINGS_BEING_CHECKED(), next_step=texts.WAIT_A_MOMENT())


def no_torque_found(state: CycleState) -> Refusal | None:
    """Refuse to release torque unless the port is open and a drive may still have torque from before the port was opened."""
    if not state.bus_ok:
        return _IN_MODE["offline"]
    if state.context.torque_inherited and any(torque != "off" for torque in state.torque):
        return None
    return Refusal.of(code="no_torque_found", message=texts.NO_TORQUE_FOUND(), next_step=texts.ACKNOWLEDGE_STOP())


def other_side(wanted: Side, apparatus_side: Side) -> Refusal | None:
    """Refuse a motion of the other shoulder. Motors 3 and 4 turn in the opposite direction there, so the motion would pull the
    arm down instead of lifting it.
    """
    if wanted == apparatus_side:
        return None
    return Refusal.of(
        code="other_side",
        message=texts.OTHER_SIDE(wanted=SIDES[wanted], stands_for=SIDES[apparatus_side]),
        next_step=texts.TURN_APPARATUS_OR_CHOOSE(),
    )


def range_at_minimum(range_override: RangeOverride) -> Refusal | None:
    """Refuse to reduce a range that is at its minimum."""
    if not range_override.at_minimum:
        return None
    return Refusal.of(
        code="is_at_least",
        message=texts.RANGE_IS_LEAST(least_percent=100 * range_override.least_share),
        next_step=texts.PAUSE_OR_STOP(),
    )


def not_reducible(run: Run) -> Refusal | None:
    """Refuse to reduce the range of an end-feel test, whose torque is expected at the places of its path. Refuse to reduce a range, or the torque
    of a stretch, that is at its minimum.
    """
    if run.end_feel is None:
        return range_at_minimum(run.range_override)
    if stretch := stretch_of(run):
        if not stretch.at_minimum:
            return None
        message = texts.STRETCH_IS_LEAST(target_nm=stretch.target_nm)
        return Refusal.of(code="is_at_least", message=message, next_step=texts.PAUSE_OR_STOP())
    return Refusal.of(code="is_end_feel_test", message=texts.RANGE_IS_MEASURED(), next_step=texts.PAUSE_OR_STOP())


def angles_not_current(state: CycleState) -> Refusal | None:
    """Refuse to switch torque on unless every drive has answered in this cycle and in every one since its newest status. After
    an older answer a hand may have moved the arm. A drive that did not answer may have lost its settings.
    """
    if all(state.unbroken):
        return None
    return Refusal.of(
        code=ANGLES_NOT_CURRENT,
        message=texts.MOTOR_DID_NOT_ANSWER(motor=state.unbroken.index(False) + 1),
        next_step=texts.LOOK_AT_ARM_AND_TRY_AGAIN(),
    )


def outside_range(state: CycleState, config: StationConfig) -> Refusal | None:
    """Refuse to switch torque on if a measured angle is outside the range by more than the tolerance, which would be a fault."""
    tolerance = config.limit_tolerance_deg
    for motor, (axis, angle) in enumerate(zip(config.axes, state.measured_deg, strict=True), start=1):
        if not axis.min_deg - tolerance <= angle <= axis.max_deg + tolerance:
            return Refusal.of(
                code="outside_range",
                message=texts.OUTSIDE_RANGE(motor=motor, angle_deg=angle),
                next_step=texts.MOVE_BACK_BY_HAND(),
            )
    return None


def path_leaves_limits(state: CycleState, run: Run) -> Refusal | None:
    """Refuse an approach whose path exceeds the limits of the pose. Held at these limits, the setpoint could jump."""
    _, excess_deg = approach_path(run, np.array(state.measured_deg))
    if excess_deg <= PATH_TOLERANCE_DEG:
        return None
    return Refusal.of(
        code="way_leaves_limits",
        message=texts.PATH_LEAVES_LIMITS(outwards_deg=excess_deg),
        next_step=texts.MOVE_CLOSER_BY_HAND(),
    )


def too_far_from_start(state: CycleState, run: Run) -> Refusal | None:
    """Refuse a start whose first step, from the measured angles to the recording's start, is too large for the setpoint gate, or so
    large that a drive would count as frozen.
    """
    start_deg = run.trajectory.start_deg
    for motor, (axis, here, start) in enumerate(
        zip(run.config.axes, state.measured_deg, start_deg, strict=True), start=1
    ):
        within_deg = min(largest_step_deg(axis, run.rate_hz) - _YIELD_DEG, MAX_FROZEN_SETPOINT_DEG)
        if abs(start - here) > within_deg:
            return Refusal.of(
                code="too_far_from_start",
                message=texts.TOO_FAR_FROM_START(motor=motor, distance_deg=abs(start - here)),
                next_step=texts.MOVE_WITHIN_OR_OTHER_METHOD(within_deg=within_deg),
            )
    return None
