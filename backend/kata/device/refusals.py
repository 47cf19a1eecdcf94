"""Which commands are not accepted when, and in which words that is said."""

from collections.abc import Sequence
from typing import Final

from kata.device.config import StationConfig
from kata.device.cycle_state import CycleState
from kata.device.faults import FROZEN_DEG
from kata.device.messages import CommandName, Guarded, Mode, Refusal
from kata.device.range_override import LEAST, RangeOverride
from kata.device.supervisor import LatchedStop
from kata.motion.axes import Side

_ALLOWED_IN: Final[dict[CommandName, tuple[Mode, ...]]] = {
    "teach": ("idle",),
    "finish_teaching": ("teaching",),
    "load": ("idle",),
    "unload": ("ready",),
    "approach": ("ready",),
    "play": ("paused",),
    "pause": ("playing",),
    "less": ("playing", "paused"),
    "return": ("paused",),
    "release_torque": ("stopped",),
    "acknowledge": ("stopped",),
}
"""Stop is allowed in every mode."""

_WHAT_IS_ON: Final[dict[Mode, tuple[str, str]]] = {
    "offline": ("The apparatus is not connected.", "Switch it on and check the RS-485 adapter."),
    "idle": ("No recording is loaded.", "Load a recording first."),
    "teaching": ("Teaching is going on.", "Finish teaching first."),
    "ready": ("A recording is loaded, and the arm is not at its start yet.", "Move to the start, or unload it."),
    "approaching": ("The arm is on its way to the start.", "Wait until it is there, or stop."),
    "playing": ("The recording is playing.", "Pause first, or stop."),
    "paused": ("The arm is held on the recording's path.", "Play on, go back, or stop."),
    "returning": ("The arm is on its way back.", "Wait until it is there, or stop."),
    "stopped": ("The apparatus has been stopped.", "Acknowledge the stop first."),
}
STOPPED_MEANWHILE: Final = Refusal(
    code="stopped_meanwhile",
    message="The apparatus was stopped after this command was sent.",
    next_step="Look at the arm and the patient, then try again.",
)
"""The command was sent before its sender knew of the newest stop."""

_NOTHING_TO_DO: Final[dict[CommandName, Refusal]] = {
    "acknowledge": Refusal(code="not_stopped", message="Nothing is stopped.", next_step="Nothing to do."),
    "finish_teaching": Refusal(code="not_teaching", message="Teaching is not going on.", next_step="Nothing to do."),
}


def not_in_this_mode(name: CommandName, mode: Mode) -> Refusal | None:
    """A command belongs to certain modes; what goes on in any other is the reason against it."""
    if name == "stop" or mode in _ALLOWED_IN[name]:
        return None
    if name in _NOTHING_TO_DO:
        return _NOTHING_TO_DO[name]
    message, next_step = _WHAT_IS_ON[mode]
    return Refusal(code=f"is_{mode}", message=message, next_step=next_step)


def not_yet_cleared(stop: LatchedStop, *, still_stopping: bool) -> Refusal | None:
    """A stop is acknowledged when it has come to its end, a held arm included, and none of its causes holds any more."""
    if still_stopping:
        return Refusal(code="still_stopping", message="The arm is slowing down.", next_step="Wait a moment.")
    for cause in stop.causes():
        if not cause.cleared:
            return Refusal(code=cause.code, message=cause.message, next_step=cause.next_step)
    return None


def out_of_date(command: Guarded, stops: int, t_ns: int) -> Refusal | None:
    """A command is void after a stop that its sender has not seen, and after its expiry. ``stops``: the present counter."""
    if command.stops != stops:
        return STOPPED_MEANWHILE
    if t_ns > command.expires_ns:
        return Refusal(
            code="expired",
            message="The command came too late.",
            next_step="Look at the arm and the patient, then try again.",
        )
    return None


def not_verified(facts: CycleState, problem: str) -> Refusal | None:
    """A stop is acknowledged when every drive is known to have its settings. ``problem``: why one cannot be configured."""
    if all(facts.verified):
        return None
    if problem:
        return Refusal(
            code="not_verified", message=f"A motor cannot be set up: {problem}.", next_step="Have it checked."
        )
    return Refusal(code="not_verified", message="The motors' settings are being checked.", next_step="Wait a moment.")


def no_torque_found(facts: CycleState) -> Refusal | None:
    """Torque is released by command where a drive holds an arm from before the connection, and can be reached."""
    if not facts.bus_ok:
        message, next_step = _WHAT_IS_ON["offline"]
        return Refusal(code="is_offline", message=message, next_step=next_step)
    if facts.situation.torque_left and any(state != "off" for state in facts.torque):
        return None
    return Refusal(
        code="no_torque_found", message="No motor holds the arm from before.", next_step="Acknowledge the stop."
    )


def other_side(wanted: Side, stands_for: Side) -> Refusal | None:
    """On the other shoulder motors 3 and 4 turn the other way: what lifts one arm would pull the other down."""
    if wanted == stands_for:
        return None
    return Refusal(
        code="other_side",
        message=f"This is for the {wanted} shoulder, and the apparatus stands for the {stands_for} one.",
        next_step="Turn the apparatus and say so, or choose what was taught on its side.",
    )


def no_less(comfort: RangeOverride) -> Refusal | None:
    """Less and less comes to an end."""
    if not comfort.at_least:
        return None
    return Refusal(
        code="is_at_least",
        message=f"{100 * LEAST:.0f} % of the range is the least there is.",
        next_step="Pause, or stop.",
    )


def outside_range(facts: CycleState, config: StationConfig) -> Refusal | None:
    """Torque is not switched on where the first measurement would be a fault."""
    tolerance = config.limit_tolerance_deg
    for motor, (axis, angle) in enumerate(zip(config.axes, facts.measured_deg, strict=True), start=1):
        if not axis.min_deg - tolerance <= angle <= axis.max_deg + tolerance:
            return Refusal(
                code="outside_range",
                message=f"Motor {motor} stands at {angle:.0f} deg, outside its range.",
                next_step="Move the arm back by hand.",
            )
    return None


def too_far_from_start(facts: CycleState, start_deg: Sequence[float]) -> Refusal | None:
    """Nobody goes in a single step further than what a frozen drive is known by. ``start_deg``: where that step would lead."""
    for motor, (start, angle) in enumerate(zip(start_deg, facts.measured_deg, strict=True), start=1):
        if abs(start - angle) > FROZEN_DEG:
            return Refusal(
                code="too_far_from_start",
                message=f"Motor {motor} stands {abs(start - angle):.0f} deg from where the recording begins; this method goes there in one step.",
                next_step=f"Move the arm to within {FROZEN_DEG:g} deg by hand, or choose another method.",
            )
    return None
