"""The outcome of a case, and its JSON form."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from kata.evaluation.cases import Case
from kata.motion.linkage import Floats, pose_deg
from kata.motion.method import Method
from kata.motion.tracking import Comparison, MotionTracking, MotorTracking, compare, compare_motions


@dataclass(frozen=True)
class TaughtRecording:
    """Times ``(n,)`` from 0 and motor angles ``(n, 5)`` of a recording."""

    times_s: Floats
    angles_deg: Floats


@dataclass(frozen=True)
class PlaybackSamples:
    """Samples of a playback: path times of the recording ``(m,)``, measured motor angles and torques ``(m, 5)``."""

    path_s: Floats
    measured_deg: Floats
    torque_nm: Floats


@dataclass(frozen=True)
class Outcome:
    """One playback of one case. If it was not completed, ``comparison`` is None and ``problem`` is the reason."""

    case: Case
    method: Method
    repetition: int
    """From 1."""
    seed: int | None
    comparison: Comparison | None = None
    motions: tuple[MotionTracking, ...] = ()
    """Tracking in the angles of the body."""
    problem: str | None = None
    clock_s: float = 0.0
    """Duration by the apparatus' clock, including teaching, approach and return."""

    @property
    def motors(self) -> tuple[MotorTracking, ...]:
        """Tracking of the case's motors."""
        return (
            tuple(motor for motor in self.comparison.motors if motor.motor in self.case.motors)
            if self.comparison
            else ()
        )

    def compared(self, recording: TaughtRecording, played: PlaybackSamples) -> "Outcome":
        """Return the outcome with its figures."""
        series = (recording.times_s, recording.angles_deg, played.path_s, played.measured_deg)
        return replace(
            self,
            comparison=compare(*series, played.torque_nm),
            motions=compare_motions(*series, lambda angles_deg: pose_deg(angles_deg, self.case.side)),
        )


def as_json(outcomes: Sequence[Outcome], *, simulated: bool) -> dict[str, Any]:
    """Return the errors of each motor, in degrees with sign. ``problems`` lists the playbacks that were not completed."""
    return {
        "simulated": simulated,
        "cases": [
            _identity(outcome)
            | {
                "motors": [
                    {
                        "motor": motor.motor,
                        "peak_deg": motor.peak_deg,
                        "rmse_deg": motor.rmse_deg,
                        "start_deg": motor.start_deg,
                        "lag_ms": motor.lag_ms,
                    }
                    for motor in outcome.motors
                ]
            }
            for outcome in outcomes
            if outcome.comparison
        ],
        "problems": [_identity(outcome) | {"problem": outcome.problem} for outcome in outcomes if outcome.problem],
    }


def _identity(outcome: Outcome) -> dict[str, Any]:
    return {
        "name": outcome.case.name,
        "side": outcome.case.side,
        "method": outcome.method,
        "repetition": outcome.repetition,
        "seed": outcome.seed,
    }
