"""The measured motion of a run for the page's 3-D apparatus: few samples in real time."""

import numpy as np
from pydantic import Field
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.recordings.motion_preview import resampled
from kata.clinic.sessions import phases
from kata.clinic.sessions.tables import RUN_SAMPLES, RunRow
from kata.database.arrays import UnreadableError
from kata.database.series import unpack
from kata.errors import ProblemError
from kata.plotting import figures
from kata.types import Moment, Schema, Side, side_of


class PlayedMotion(Schema):
    """A run as it was measured. The angles are linear between two samples."""

    side: Side
    started_at: Moment = Field(description="Time at which the run was loaded.")
    times_s: list[float] = Field(description="Seconds since the run's first sample, ascending; the first is 0.")
    measured_deg: list[list[float]] = Field(
        description="One row per time: measured motor angles in axis order 1-5, degrees."
    )
    setpoint_deg: list[list[float]] = Field(description="Setpoints sent to the motors, in the form of measured_deg.")
    reversals_s: list[float] = Field(
        description="Times at which resistance began to take the arm back, seconds as in times_s."
    )


def of_run(session: Session, row: RunRow) -> PlayedMotion:
    """Return the measured motion of a run.

    :raises ProblemError: 409 when nothing was played; 410 when its samples are damaged.
    """
    series = RUN_SAMPLES.read(session, row.id)
    if not series.head:
        raise ProblemError(409, "nothing_played", texts.NOTHING_PLAYED(), texts.NOTHING_TO_COMPARE())
    try:
        samples = unpack(series)
    except UnreadableError as error:
        raise figures.samples_damaged() from error
    times_s, measured_deg = resampled(samples["time_s"], samples["measured_deg"])
    _, setpoint_deg = resampled(samples["time_s"], samples["setpoint_deg"])
    reversed_at = samples["time_s"][phases.reversal_starts(samples["phase"])]
    return PlayedMotion(
        side=side_of(row.recording.side),
        started_at=row.started_at,
        times_s=times_s,
        measured_deg=measured_deg,
        setpoint_deg=setpoint_deg,
        reversals_s=np.round(reversed_at, 2).tolist(),
    )
