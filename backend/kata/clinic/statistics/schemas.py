"""Response models of the clinic's figures."""

from datetime import date
from typing import Final, Literal

from pydantic import Field

from kata.clinic.sessions.lists import SessionSummary
from kata.clinic.sessions.schemas import SessionPatient
from kata.types import Moment, Schema, Side

OutcomeMeasure = Literal["spadi", "pain", "flexion", "abduction", "external_rotation"]
"""spadi: 0 to 100; pain: average of the last week, 0 to 10; the others: passive range of motion of the affected shoulder, degrees."""
Period = Literal["day", "week"]
LEAST_SHOWN: Final = 10
"""Smallest number of patients of a group that is shown. Japan's guideline for the use of its claims database (NDB) publishes no count
below 10.
"""


class Estimate(Schema):
    """An estimate with its 95 % confidence interval."""

    value: float
    low: float
    high: float


class DuePatient(Schema):
    """A patient whose next session is due according to the programme."""

    patient: SessionPatient
    due_at: Moment = Field(description="Last session plus a week divided by the sessions per week. UTC.")
    last_session_at: Moment | None = Field(description="Null if there has been no session in the last four weeks.")
    sessions_per_week: int = Field(ge=1, description="Prescribed sessions per week.", examples=[2])
    therapist: str = Field(description="Therapist of the last session; empty if unknown.")


class PatientChange(Schema):
    """The change since the previous assessment of a patient whom you have treated."""

    patient: SessionPatient
    last_session_at: Moment = Field(description="Your last session with the patient. UTC.")
    assessed_at: Moment
    side: Side = Field(description="The assessed shoulder.")
    measure: Literal["spadi", "pain"] = Field(description="spadi: 0 to 100. pain: average of the last week, 0 to 10.")
    before: float
    now: float


class Worklist(Schema):
    """The work of one day. Patients whose records you may not see are left out."""

    sessions: list[SessionSummary] = Field(
        description="Today's sessions and all sessions that have not ended, newest first."
    )
    due: list[DuePatient] = Field(description="Patients who are due today or earlier, the longest overdue first.")
    due_count: int = Field(ge=0, description="Number of patients who are due; `due` contains at most 50.")
    unsigned: list[SessionSummary] = Field(
        description="Your ended sessions without a signed note, oldest first, at most 50."
    )
    unsigned_count: int = Field(
        ge=0, description="Number of ended sessions of all therapists without a signed note, at most 1000."
    )
    changes: list[PatientChange] = Field(description="Changes of your last patients, newest session first.")


class StationUse(Schema):
    """The use of one station on one day or in one week."""

    begins_on: date = Field(description="The day, or the Monday of the week.", examples=["2026-11-16"])
    station: str
    sessions: int = Field(ge=0)
    playbacks: int = Field(ge=0)
    stopped: int = Field(ge=0, description="Number of stopped playbacks.")
    hours: float = Field(ge=0, description="Playing time, hours.")
    repetitions: int = Field(ge=0, description="Completed repetitions.")


class Usage(Schema):
    """The use of the stations. A day or week without a session has no row."""

    rows: list[StationUse] = Field(description="In chronological order.")


class StationTracking(Schema):
    """Tracking error of one station in one week."""

    begins_on: date = Field(description="Monday of the week.", examples=["2026-11-16"])
    station: str
    playbacks: int = Field(ge=1, description="Number of compared playbacks.")
    rmse_deg: float = Field(ge=0, description="Mean of the worst motor's RMSE, degrees.")
    peak_deg: float = Field(ge=0, description="Largest error, degrees.")


class StationDrift(Schema):
    """Tracking error of one station in the last four weeks, compared with the twelve weeks before."""

    station: str
    playbacks: int = Field(ge=0, description="Number of compared playbacks in the last four weeks.")
    rmse_deg: float | None = Field(
        description="Mean RMSE of the worst motor in these playbacks, degrees; null without playbacks."
    )
    before_deg: float | None = Field(
        description="The same mean for the twelve weeks before, degrees; null without playbacks."
    )
    change_deg: Estimate | None = Field(
        description="Change of the mean; null with fewer than two playbacks in either time."
    )
    drifting: bool = Field(
        description="True if the whole interval of the change is above one encoder count of a drive (0.088 degrees)."
    )


class TrackingQuality(Schema):
    """Tracking error of the stations."""

    rows: list[StationTracking] = Field(description="In chronological order.")
    drift: list[StationDrift] = Field(description="Change of each station.")
    left_out: int = Field(
        ge=0,
        description="Number of playbacks in the time that all these figures leave out, because their error is partial (`partial` of a run).",
    )


class StopCount(Schema):
    """Stops by one cause at one station."""

    code: str = Field(examples=["estop_pressed"])
    station: str
    sessions: int = Field(ge=0, description="Number of sessions in which a playback was stopped.")
    alarms: int = Field(ge=0, description="Number of alarms of the device, including those outside sessions.")


class Stops(Schema):
    """Stops and alarms of the stations, the most frequent first."""

    rows: list[StopCount]
    sessions: int = Field(
        ge=0, description="Number of all sessions of the stations in this time, with and without a stop."
    )
    stopped_sessions: int = Field(
        ge=0,
        description="Number of sessions with a stop. A session with several causes counts once, and in each of their rows.",
    )


class OutcomeChange(Schema):
    """The change of one measure in one group of shoulders."""

    measure: OutcomeMeasure
    patients: int = Field(ge=0, description="Number of patients with at least two values.")
    shoulders: int = Field(
        ge=0,
        description="Number of shoulders with at least two values; one for each episode. Shares and means are of these.",
    )
    first: float = Field(description="Mean of the first values.")
    last: float = Field(description="Mean of the last values.")
    change: Estimate | None = Field(description="Mean of last minus first.")
    important: Estimate | None = Field(
        description="Share of shoulders with an improvement of at least the MCID; null without a verified limit."
    )
    detectable: Estimate | None = Field(
        description="Share of shoulders with an improvement beyond chance; null without a verified limit."
    )
    weeks_to_important: list[float] | None = Field(
        description="Quartiles of the weeks until the first improvement of at least the MCID, for the shoulders that reached it; null for fewer than 10 patients."
    )


class OutcomeGroup(Schema):
    """One group of shoulders, one for each episode. It is shown or hidden by its number of patients."""

    by: Literal["all", "stage", "programme"]
    name: str = Field(
        description="Stage at the first assessment or name of the newest programme; empty: without one, or all shoulders."
    )
    patients: int | None = Field(
        description="Number of patients; null: hidden, because this group or another group of its kind is small."
    )
    changes: list[OutcomeChange] = Field(
        description="Change of each measure; empty for a hidden group. A measure with fewer than 10 patients is left out."
    )


class AdherenceDays(Schema):
    """The period of adherence: 28 days of the clinic, the last of which is today."""

    first_day: date = Field(examples=["2026-11-03"])
    last_day: date = Field(description="Today at the clinic.", examples=["2026-11-30"])


class ProgrammeAdherence(AdherenceDays):
    """Adherence to the present programmes with prescribed sessions in the last four weeks."""

    programmes: int = Field(
        ge=0, description="Programmes of open episodes, with a session or made in the last four weeks."
    )
    overdue: int = Field(ge=0, description="Programmes whose next session was due before today.")
    prescribed: int = Field(
        ge=0, description="Sessions prescribed in this time, counted from the day after each programme's date on."
    )
    held: int = Field(
        ge=0, description="Sessions held in this time. Of each programme, at most the prescribed number is counted."
    )


class ClinicAdherence(Schema):
    """Adherence to all followed programmes. Restricted records are counted, because no patient is named."""

    least_programmes: int = Field(description="Smallest number of programmes that is shown.")
    adherence: ProgrammeAdherence | None = Field(description="Null while fewer programmes are followed.")


class PatientAdherence(DuePatient):
    """How one patient followed the present programme in the last four weeks."""

    prescribed: int = Field(
        ge=0, description="Sessions prescribed in this time, counted from the day after the programme's date on."
    )
    held: int = Field(ge=0, description="Sessions held in this time, also more than prescribed.")


class PatientAdherences(AdherenceDays):
    """The followed programmes, the lowest share of held sessions first."""

    rows: list[PatientAdherence] = Field(description="At most 500.")
    count: int = Field(ge=0, description="Number of followed programmes.")


class Outcomes(Schema):
    """Outcomes of the episodes whose last assessment is in the chosen time. Restricted records are counted, because no patient is named."""

    limits: dict[str, list[float | None]] = Field(
        description="By measure: the MCID, and the largest improvement that may be measurement error.",
        examples=[{"spadi": [13.0, 17.0]}],
    )
    least_patients: int = Field(description="Smallest number of patients of a group that is shown.")
    groups: list[OutcomeGroup]
