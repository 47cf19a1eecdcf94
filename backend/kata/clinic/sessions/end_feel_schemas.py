"""Response models of end-feel tests."""

from typing import Annotated, Literal
from uuid import UUID

from pydantic import Field

from kata.clinic.recordings.schemas import Figure
from kata.clinic.sessions.schemas import EndFeelKind, RunOutcome
from kata.device.ipc_messages import LONGEST_HOLD_S, MOST_REPETITIONS, SHORTEST_HOLD_S
from kata.motion.end_feel import FASTEST_DEG_S, SLOWEST_DEG_S, SPEED_DEG_S, Unmeasured
from kata.station.schemas import OptionalKey
from kata.types import Moment, Motor, Schema, Side

EndFeelSpeed = Annotated[
    float,
    Field(
        ge=SLOWEST_DEG_S,
        le=FASTEST_DEG_S,
        description="Speed of the way out and back, degrees per second.",
        examples=[SPEED_DEG_S],
    ),
]


class EndFeelFigures(Schema):
    """Figures of an end-feel test. Angles are apparatus angles. The torque is that of the drive's current and its nominal factor."""

    range_deg: float = Field(description="Angle at 60 % of the chosen torque, degrees.", examples=[92.4])
    onset_deg: float = Field(description="Angle at 25 % of the chosen torque, degrees.", examples=[86.1])
    stiffness_nm_deg: float = Field(
        description="Slope of the straight line from onset to range, without the cuff's part, newton metres for each degree.",
        examples=[0.11],
    )
    last_third_nm_deg: float = Field(description="The same slope over the last third of that way.", examples=[0.14])
    hysteresis_nm: float = Field(
        description="Mean difference of way out and way back from onset to range, without the apparatus' friction, newton metres.",
        examples=[0.2],
    )


HoldTime = Annotated[
    float,
    Field(
        ge=SHORTEST_HOLD_S,
        le=LONGEST_HOLD_S,
        description="Time for which a stretch holds the torque in each repetition, seconds.",
        examples=[30.0],
    ),
]
Repetitions = Annotated[
    int,
    Field(
        ge=1,
        le=MOST_REPETITIONS,
        description="Number of repetitions of a stretch. A test always has three.",
        examples=[3],
    ),
]


class StretchRecord(Schema):
    """What a stretch was asked, and what it did."""

    hold_s: HoldTime
    repetitions: Repetitions
    largest_deg: float = Field(description="Largest apparatus angle that the motor was allowed to reach, degrees.")
    held_s: float | None = Field(
        description="Time with at least 60 % of the torque, seconds, in all repetitions; null: the run has not ended, or was interrupted."
    )
    target_nm: float | None = Field(description="Torque after all requests to reduce it, newton metres; null as above.")


class EndFeelRecord(Schema):
    """An end-feel test or a baseline, and its result."""

    run_id: UUID
    session_id: UUID
    recording_id: UUID
    recording_name: str
    kind: EndFeelKind = Field(
        description="baseline: with a test weight in the fixers. test: with the patient's arm. stretch: the arm is held at the torque."
    )
    side: Side
    motion: int = Field(ge=1, le=6, description="Number of the motion in Table 2 of Sun et al. (2025).", examples=[4])
    name: str = Field(examples=["Abduction / adduction of the shoulder"])
    name_key: OptionalKey = None
    motor: Motor
    started_at: Moment
    outcome: RunOutcome
    simulated: bool = Field(description="True if the station was a simulated apparatus.")
    speed_deg_s: float = Field(description="Speed of the way, deg/s.", examples=[5.0])
    torque_nm: float = Field(
        description="Chosen torque, newton metres. For a baseline: torque at which it turned back."
    )
    baseline_run_id: UUID | None = Field(description="The baseline that is subtracted; null for a baseline.")
    unmeasured: Literal[Unmeasured, "guarding", "too_few_ways"] | None = Field(
        description="Reason why there are no figures. arm_not_weighed: the arm was taken back after the free range, because it weighs much more than the test weight, "
        "the shoulder resists from the start, or the patient worked. guarding: the repetitions differ by more than 0.2 Nm, so the patient worked with or "
        "against the apparatus. too_few_ways: fewer than two repetitions are complete. Null: there are figures, or the run has not ended."
    )
    figures: EndFeelFigures | None = Field(description="Means of the repetitions.")
    interval: EndFeelFigures | None = Field(
        description="Half of the width of each figure's 95 % interval over the repetitions."
    )
    disagreement_nm: float | None = Field(
        description="Largest RMS difference of the repetitions, newton metres; null if it was not calculated."
    )
    stretch: StretchRecord | None = Field(None, description="Null if the run was no stretch.")


class EndFeelCurves(Schema):
    """The torque-angle curve of a test with earlier ones of the same motion, and the newest of the other side."""

    result: EndFeelRecord
    earlier: list[EndFeelRecord] = Field(
        description="Earlier tests of this motion and side with figures, newest first."
    )
    other_side: EndFeelRecord | None = Field(description="Newest test of this motion on the other side with figures.")
    figure: Figure | None = Field(description="Torque over angle; null if the test has no curve.")


class EndFeelMotion(Schema):
    """A recording along which the session's patient can be measured."""

    recording_id: UUID
    recording_name: str
    motion: int = Field(ge=1, le=6, description="Number of the motion in Table 2 of Sun et al. (2025).", examples=[4])
    name: str
    name_key: OptionalKey = None
    motor: Motor
    side: Side
    baseline_run_id: UUID | None = Field(description="Baseline of today at this station; null: none yet.")
    end_deg: float = Field(description="Apparatus angle of the motor at the recorded end, degrees.", examples=[96.0])
    tests: list[EndFeelRecord] = Field(description="Tests of this recording in the session, newest first.")
    stretches: list[EndFeelRecord] = Field(description="Stretches of this recording in the session, newest first.")


class EndFeelGuide(Schema):
    """Possible measurements of a session."""

    speed_deg_s: float = Field(description="Usual speed of a way, deg/s.", examples=[5.0])
    motions: list[EndFeelMotion] = Field(description="Recordings of motions 3 to 6, the newest first.")
