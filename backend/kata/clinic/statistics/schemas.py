"""Response models of the clinic's figures."""

from datetime import date
from typing import Final, Literal

from pydantic import Field

from kata.clinic.sessions.lists import SessionSummary
from kata.clinic.sessions.schemas import SessionPatient
from kata.types import Moment, Schema

OutcomeMeasure = Literal["spadi", "pain", "flexion", "abduction", "external_rotation"]
"""SPADI 0 to 100; average pain of the last week, 0 to 10; passive range of motion of the affected shoulder, degrees."""
Period = Literal["day", "week"]
LEAST_SHOWN: Final = 10
"""A group of fewer patients is hidden. Japan's guideline for the use of its claims database (NDB) publishes no count below 10."""


class Estimate(Schema):
    """An estimate with its 95 % confidence interval."""

    value: float
    low: float
    high: float


class DuePatient(Schema):
    """A patient whose next session is due by the programme."""

    patient: SessionPatient
    due_at: Moment = Field(description="Last session plus a week divided by the sessions per week. UTC.")
    last_session_at: Moment | None = Field(description="Null: no session since the programme was made.")
    sessions_per_week: int = Field(ge=1, description="Prescribed.", examples=[2])
    therapist: str = Field(description="Of the last session; empty if unknown.")


class PatientChange(Schema):
    """A change since the assessment before, of a patient whom you have treated."""

    patient: SessionPatient
    last_session_at: Moment = Field(description="Your last session with the patient. UTC.")
    assessed_at: Moment
    measure: Literal["spadi", "pain"] = Field(description="spadi: 0 to 100. pain: average of the last week, 0 to 10.")
    before: float
    now: float


class Worklist(Schema):
    """The work of one day. Patients whose records are not open to you are left out."""

    sessions: list[SessionSummary] = Field(description="Today's sessions and all that have not ended, newest first.")
    due: list[DuePatient] = Field(description="Due today or earlier, the longest overdue first.")
    due_count: int = Field(ge=0, description="Their number; the list shows at most 50.")
    unsigned: list[SessionSummary] = Field(
        description="Your ended sessions without a signed note, oldest first, at most 50."
    )
    changes: list[PatientChange] = Field(description="Of your last patients, the newest session first.")


class StationUse(Schema):
    """The use of one station in one day or week."""

    begins_on: date = Field(description="The day, or the week's Monday.", examples=["2026-11-16"])
    station: str
    sessions: int = Field(ge=0)
    playbacks: int = Field(ge=0)
    stopped: int = Field(ge=0, description="Stopped playbacks.")
    hours: float = Field(ge=0, description="Playing time, hours.")
    repetitions: int = Field(ge=0, description="Completed repetitions.")


class Usage(Schema):
    """The use of the stations. A day or week without a session has no row."""

    rows: list[StationUse] = Field(description="In the order of time.")


class StationTracking(Schema):
    """Tracking error of one station in one week."""

    begins_on: date = Field(description="The Monday.", examples=["2026-11-16"])
    station: str
    playbacks: int = Field(ge=1, description="Compared playbacks.")
    rmse_deg: float = Field(ge=0, description="Mean of the worst motor's RMSE, degrees.")
    peak_deg: float = Field(ge=0, description="Largest error, degrees.")


class StationDrift(Schema):
    """Tracking error of one station in the last four weeks, compared with the twelve weeks before."""

    station: str
    playbacks: int = Field(ge=0, description="Compared playbacks of the last four weeks.")
    rmse_deg: float | None = Field(description="Their mean RMSE of the worst motor, degrees; null without any.")
    before_deg: float | None = Field(description="The mean of the twelve weeks before; null without any.")
    change_deg: Estimate | None = Field(description="Null with fewer than two playbacks in either time.")
    drifting: bool = Field(
        description="The interval of the change lies above one encoder count of a drive (0.088 degrees)."
    )


class TrackingQuality(Schema):
    """Tracking error of the stations."""

    rows: list[StationTracking] = Field(description="In the order of time.")
    drift: list[StationDrift] = Field(description="By station.")


class StopCount(Schema):
    """Stops by one cause at one station."""

    code: str = Field(examples=["estop_pressed"])
    station: str
    sessions: int = Field(ge=0, description="Sessions in which a playback was stopped.")
    alarms: int = Field(ge=0, description="Alarms of the device, also outside sessions.")


class Stops(Schema):
    """Stops and alarms of the stations, the most frequent first."""

    rows: list[StopCount]
    sessions: int = Field(ge=0, description="All sessions of the stations in this time, with and without a stop.")


class OutcomeChange(Schema):
    """The change of one measure in one group of patients."""

    measure: OutcomeMeasure
    patients: int = Field(ge=0, description="With at least two values.")
    first: float = Field(description="Mean of the first values.")
    last: float = Field(description="Mean of the last values.")
    change: Estimate | None = Field(description="Mean of last minus first.")
    important: Estimate | None = Field(
        description="Share with an important improvement; null without a verified limit."
    )
    detectable: Estimate | None = Field(
        description="Share with an improvement beyond chance; null without a verified limit."
    )
    weeks_to_important: list[float] | None = Field(
        description="Quartiles of the weeks until the first important improvement, of the patients who reached it; null for fewer than 10."
    )


class OutcomeGroup(Schema):
    """One group of patients."""

    by: Literal["all", "stage", "programme"]
    name: str = Field(description="Stage at the first assessment or name of the newest programme; empty: none, or all.")
    patients: int | None = Field(
        description="Null: hidden, because the group or the one it could be computed from is small."
    )
    changes: list[OutcomeChange] = Field(
        description="Empty for a hidden group; a measure with fewer than 10 patients is left out."
    )


class ProgrammeAdherence(Schema):
    """How the present programmes with prescribed sessions were followed in the last four weeks."""

    programmes: int = Field(
        ge=0, description="Programmes of open episodes, with a session or made in the last four weeks."
    )
    overdue: int = Field(ge=0, description="Of them, those whose next session is overdue by more than a day.")
    prescribed: int = Field(ge=0, description="Sessions prescribed in this time, from each programme's date on.")
    held: int = Field(ge=0, description="Sessions held, at most as many of each programme as prescribed.")


class Outcomes(Schema):
    """Outcomes of the patients whose last assessment is in the chosen time. Restricted records are counted: no patient is named."""

    limits: dict[str, list[float | None]] = Field(
        description="By measure: the improvement that is important, and the one beyond chance.",
        examples=[{"spadi": [13.0, 17.0]}],
    )
    least_patients: int = Field(description="Smaller groups are hidden.")
    groups: list[OutcomeGroup]
    adherence: ProgrammeAdherence | None = Field(description="Null while fewer than 10 programmes are followed.")
