"""What came of a case, and how it goes into JSON."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from kata.evaluation.cases import Case
from kata.motion.linkage import Floats, pose_deg
from kata.motion.method import Method
from kata.motion.tracking import Comparison, MotionTracking, MotorTracking, compare, compare_motions


@dataclass(frozen=True)
class Recording:
    """What was taught: times ``(n,)`` from 0 and motor angles ``(n, 5)``."""

    times_s: Floats
    angles_deg: Floats


@dataclass(frozen=True)
class Played:
    """What was measured while the recording played: places on its clock ``(m,)``, motor angles and torques ``(m, 5)``."""

    path_s: Floats
    measured_deg: Floats
    torque_nm: Floats


@dataclass(frozen=True)
class Outcome:
    """One playback of one case. ``comparison`` is None when it did not come to its end, ``problem`` says why."""

    case: Case
    method: Method
    repetition: int
    """From 1."""
    seed: int | None
    comparison: Comparison | None = None
    motions: tuple[MotionTracking, ...] = ()
    """In the body's angles."""
    problem: str | None = None
    clock_s: float = 0.0
    """How much the apparatus' clock went on for it, teaching and moving there and back included."""

    @property
    def motors(self) -> tuple[MotorTracking, ...]:
        """Of the motors that the case is about."""
        return tuple(one for one in self.comparison.motors if one.motor in self.case.motors) if self.comparison else ()

    def compared(self, recording: Recording, played: Played) -> "Outcome":
        """With its figures."""
        laid = (recording.times_s, recording.angles_deg, played.path_s, played.measured_deg)
        return replace(
            self,
            comparison=compare(*laid, played.torque_nm),
            motions=compare_motions(*laid, lambda angles_deg: pose_deg(angles_deg, self.case.side)),
        )


def as_json(outcomes: Sequence[Outcome], *, simulated: bool) -> dict[str, Any]:
    """Errors per motor in degrees, with their signs; what was not played to its end stands under ``problems``."""
    return {
        "simulated": simulated,
        "cases": [
            _named(one)
            | {
                "motors": [
                    {
                        "motor": motor.motor,
                        "peak_deg": motor.peak_deg,
                        "rmse_deg": motor.rmse_deg,
                        "start_deg": motor.start_deg,
                        "lag_ms": motor.lag_ms,
                    }
                    for motor in one.motors
                ]
            }
            for one in outcomes
            if one.comparison
        ],
        "problems": [_named(one) | {"problem": one.problem} for one in outcomes if one.problem],
    }


def _named(one: Outcome) -> dict[str, Any]:
    return {
        "name": one.case.name,
        "side": one.case.side,
        "method": one.method,
        "repetition": one.repetition,
        "seed": one.seed,
    }
