"""Defines the outcome of a case and its JSON form."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from kata.evaluation.cases import Case
from kata.motion.linkage import Floats, pose_deg
from kata.motion.method import Method
from kata.motion.tracking import Comparison, MotionTracking, MotorTracking, compare, compare_motions
from kata.simulator.mechanics import PlantName


@dataclass(frozen=True)
class TaughtRecording:
    """Times ``(n,)`` from 0 and motor angles ``(n, 5)`` of a recording."""

    times_s: Floats
    angles_deg: Floats
    arm_deg: Floats | None = None
    """True angles of the arm, ``(n, 5)``. Only a simulation knows them."""


@dataclass(frozen=True)
class PlaybackSamples:
    """Samples of a playback: places on the recording's clock ``(m,)``, and measured motor angles and torques ``(m, 5)``."""

    path_s: Floats
    measured_deg: Floats
    torque_nm: Floats
    arm_deg: Floats | None = None
    """True angles of the arm, ``(m, 5)``. Only a simulation knows them."""


@dataclass(frozen=True)
class CaseResult:
    """One playback of one case. If it was not completed, ``comparison`` is None and ``problem`` is the reason."""

    case: Case
    method: Method
    repetition: int
    """Number of the repetition, from 1."""
    seed: int | None
    comparison: Comparison | None = None
    arm: Comparison | None = None
    """Comparison of the arm's true angles (after play and soft tissue) in playback and teaching. None if the true angles are unknown."""
    deflection: Comparison | None = None
    """Comparison of the arm's true angle minus the encoder's in playback and teaching. No setpoint can change it much: the drive
    carries the arm in playback, but a hand carries it in teaching.
    """
    motions: tuple[MotionTracking, ...] = ()
    """Tracking in the angles of the body."""
    problem: str | None = None
    refused: bool = False
    """True if the station refused the motion before it started. False with a ``problem``: the problem occurred while the arm moved."""
    plant: PlantName | None = None
    """The simulated mechanics. None: the real apparatus, or the simulator's process."""
    clock_s: float = 0.0
    """Duration on the apparatus' clock, including teaching, approach and return."""

    @property
    def motors(self) -> tuple[MotorTracking, ...]:
        """Tracking of the case's motors."""
        return self._shown(self.comparison)

    @property
    def arm_motors(self) -> tuple[MotorTracking, ...]:
        """Tracking of the arm on the case's axes."""
        return self._shown(self.arm)

    @property
    def deflection_motors(self) -> tuple[MotorTracking, ...]:
        """Change of the deflection between encoder and arm on the case's axes."""
        return self._shown(self.deflection)

    def motors_at(self, place: Literal["encoder", "arm", "between"]) -> tuple[MotorTracking, ...]:
        """Return the figures at the place of a goal."""
        return {"encoder": self.motors, "arm": self.arm_motors, "between": self.deflection_motors}[place]

    def _shown(self, comparison: Comparison | None) -> tuple[MotorTracking, ...]:
        return tuple(motor for motor in comparison.motors if motor.motor in self.case.motors) if comparison else ()

    def compute_figures(self) -> None:
        """Compute the figures now, in the process that played, instead of at their first use."""
        _ = self.motors, self.arm_motors, self.deflection_motors

    def compared(self, recording: TaughtRecording, played: PlaybackSamples) -> "CaseResult":
        """Return the outcome with the figures of this playback."""
        arm = deflection = None
        if recording.arm_deg is not None and played.arm_deg is not None:
            arm = compare(recording.times_s, recording.arm_deg, played.path_s, played.arm_deg, played.torque_nm)
            deflection = compare(
                recording.times_s,
                recording.arm_deg - recording.angles_deg,
                played.path_s,
                played.arm_deg - played.measured_deg,
            )
        return replace(
            self,
            arm=arm,
            deflection=deflection,
            comparison=compare(
                recording.times_s, recording.angles_deg, played.path_s, played.measured_deg, played.torque_nm
            ),
            motions=compare_motions(
                recording.times_s,
                pose_deg(recording.angles_deg, self.case.side),
                played.path_s,
                pose_deg(played.measured_deg, self.case.side),
            ),
        )


def as_json(outcomes: Sequence[CaseResult], *, simulated: bool) -> dict[str, Any]:
    """Return the errors of each motor, in degrees with sign, as JSON data. ``problems`` lists the playbacks that were not completed."""
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
                    | _arm_figures(outcome, motor.motor)
                    for motor in outcome.motors
                ]
            }
            for outcome in outcomes
            if outcome.comparison
        ],
        "problems": [
            _identity(outcome) | {"problem": outcome.problem, "refused": outcome.refused}
            for outcome in outcomes
            if outcome.problem
        ],
    }


def _arm_figures(outcome: CaseResult, motor: int) -> dict[str, float | None]:
    return {
        name: value
        for arm, deflection in zip(outcome.arm_motors, outcome.deflection_motors, strict=True)
        if arm.motor == motor
        for name, value in (
            ("arm_peak_deg", arm.peak_deg),
            ("arm_rmse_deg", arm.rmse_deg),
            ("deflection_peak_deg", deflection.peak_deg),
        )
    }


def _identity(outcome: CaseResult) -> dict[str, Any]:
    return {
        "name": outcome.case.name,
        "side": outcome.case.side,
        "method": outcome.method,
        "repetition": outcome.repetition,
        "seed": outcome.seed,
    }
