"""Shows step responses in a terminal, and reads which gains the technician chooses."""

from collections.abc import Sequence
from typing import Final

from kata.commissioning.gain_proposal import Gains
from kata.commissioning.gains_review import GainsChoice, GainsReview, MotorGains
from kata.commissioning.record import RecordedCurve
from kata.commissioning.step_response import StepResponse

GAINS_KEYS: Final = (
    "  [Enter: keep, p: measure with the proposed gains, MOTOR P I D: measure with these gains, u: take back, q: end]"
)
_COLUMNS: Final = 60
_ROWS: Final = 10
_GOAL, _FORMER, _PRESENT = "-", "o", "*"


def review_lines(review: GainsReview) -> str:
    """Return figures of every motor, and a plot of each motor whose gains have changed (of all motors, if none has)."""
    lines = ["     motor            P     I     D   rise s  overshoot %  steady error deg"]
    for motor in review.motors:
        if former_gains := _changed_from(motor):
            lines.append(_row(motor.motor, "former", former_gains, motor.former_response))
        lines.append(_row(motor.motor, "now", motor.gains, motor.response))
        if motor.proposed != motor.gains:
            gains = motor.proposed
            lines.append(f"     {motor.motor:5d} propose {gains.p:6d}{gains.i:6d}{gains.d:6d}   {motor.advice}")
    changed = [motor.motor for motor in review.motors if _changed_from(motor)] or [m.motor for m in review.motors]
    for number in changed:
        now = [curve for curve in review.curves if curve.motor == number]
        former = [curve for curve in review.former_curves if curve.motor == number]
        if now:
            lines += ["", f"     motor {number}: {_PRESENT} now, {_FORMER} former, {_GOAL} step", *_plot(former, now)]
    return "\n".join([*lines, *([f"     {review.fault}"] if review.fault else [])])


def choice_of(line: str, review: GainsReview) -> GainsChoice | None:
    """Return what a line of the technician chooses. None: the line is not understood, or its gains are outside the limits."""
    words = line.split()
    gains = [motor.gains for motor in review.motors]
    choice = None
    match words:
        case []:
            choice = GainsChoice("keep")
        case ["u"]:
            choice = GainsChoice("take_back")
        case ["p"]:
            choice = GainsChoice("measure", tuple(motor.proposed for motor in review.motors))
        case [*numbers] if len(numbers) == 4 and all(number.isascii() and number.isdigit() for number in numbers):
            motor, p, i, d = map(int, numbers)
            if 1 <= motor <= len(gains):
                gains[motor - 1] = Gains(p, i, d)
                choice = GainsChoice("measure", tuple(gains))
    return choice if choice and review.accepts(choice) else None


def _changed_from(motor: MotorGains) -> Gains | None:
    """Return the former gains if the present ones differ."""
    return motor.former_gains if motor.former_gains != motor.gains else None


def _row(motor: int, label: str, gains: Gains, response: StepResponse | None) -> str:
    figures = "   not measured"
    if response:
        figures = f"{response.rise_s:9.2f}{100 * response.overshoot:13.0f}{response.steady_error_deg:18.2f}"
    return f"     {motor:5d} {label:7s} {gains.p:6d}{gains.i:6d}{gains.d:6d}{figures}"


def _plot(former: Sequence[RecordedCurve], now: Sequence[RecordedCurve]) -> list[str]:
    """Return rows of characters: time to the right, angle upwards. The present response covers the former one."""
    curves = [*former, *now]
    step, end_s = now[0].step_deg, max(curve.times_s[-1] for curve in curves)
    low = min(0.0, *(min(curve.angles_deg) for curve in curves))
    high = max(step, *(max(curve.angles_deg) for curve in curves))
    cells = [[" "] * _COLUMNS for _ in range(_ROWS)]

    def row_of(angle: float) -> int:
        return round((high - angle) / (high - low) * (_ROWS - 1))

    cells[row_of(step)] = [_GOAL] * _COLUMNS
    for mark, marked_curves in ((_FORMER, former), (_PRESENT, now)):
        for curve in marked_curves:
            for time, angle in zip(curve.times_s, curve.angles_deg, strict=True):
                cells[row_of(angle)][round(time / end_s * (_COLUMNS - 1))] = mark
    labels = {0: f"{high:.1f}", _ROWS - 1: f"{low:.1f}"}
    return [f"     {labels.get(n, ''):>5s} |{''.join(row)}" for n, row in enumerate(cells)] + [
        f"{'':12s}0 s{end_s:>{_COLUMNS - 5}.1f} s"
    ]
