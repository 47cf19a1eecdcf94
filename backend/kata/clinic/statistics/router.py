"""REST routes of the clinic's figures."""

from datetime import timedelta
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Query

from kata.clinic import texts
from kata.clinic.profile.zone import TheZone
from kata.clinic.statistics import outcomes, usage, worklist
from kata.clinic.statistics.recent_days import recent_days
from kata.clinic.statistics.schemas import (
    ClinicAdherence,
    Outcomes,
    PatientAdherences,
    Period,
    Stops,
    TrackingQuality,
    Usage,
    Worklist,
)
from kata.clinic.statistics.usage import Span
from kata.database.base import utc_now
from kata.dependencies import PROBLEMS, TheActor, TheDatabase
from kata.errors import ProblemError
from kata.types import LONGEST_NAME, NO_NUL, GivenMoment

router = APIRouter(tags=["statistics"])

_YEAR: Final = timedelta(days=365)


def _span(
    zone: TheZone,
    since: Annotated[
        GivenMoment | None,
        Query(description="Begin of the time; by default a year before its end.", examples=["2026-01-01T00:00:00Z"]),
    ] = None,
    until: Annotated[
        GivenMoment | None, Query(description="End of the time; by default now.", examples=["2027-01-01T00:00:00Z"])
    ] = None,
    station: Annotated[
        str | None,
        Query(
            min_length=1,
            max_length=LONGEST_NAME,
            pattern=NO_NUL,
            description="Count only this station.",
            examples=["Station 1"],
        ),
    ] = None,
) -> Span:
    """:raises ProblemError: 422 when the time is empty."""
    end = until or utc_now()
    begin = since or (end - _YEAR if end.year > 1 else end)
    if begin >= end:
        raise ProblemError(422, "empty_time", texts.TIME_ENDS_BEFORE_IT_BEGINS(), texts.CHOOSE_LATER_END())
    return Span(begin, end, zone, station)


TheSpan = Annotated[Span, Depends(_span)]


@router.get("/api/worklist", summary="Get the work of today", responses=PROBLEMS.of(422))
def get_worklist(database: TheDatabase, actor: TheActor, zone: TheZone) -> Worklist:
    """Return today's sessions, the patients who are due, your unsigned notes, and changes of your patients.

    Patients whose records you may not see are left out. A patient is due when a week divided by the prescribed number of sessions per week
    has passed since the last session. Patients without a session or a new programme in the last four weeks are not listed.
    """
    with database.read() as session:
        return worklist.worklist(session, actor, recent_days(utc_now(), zone))


@router.get("/api/statistics/usage", summary="Get the use of the stations", responses=PROBLEMS.of(422))
def get_usage(
    database: TheDatabase,
    span: TheSpan,
    by: Annotated[Period, Query(description="week: weeks begin on Monday.")] = "day",
) -> Usage:
    """Return sessions, playbacks, hours and repetitions of each station by day or week.

    A session is counted at the station and on the day on which it began. Restricted records are counted, because no patient is named.
    """
    with database.read() as session:
        return usage.usage(session, span, by)


@router.get("/api/statistics/tracking", summary="Get the tracking error of the stations", responses=PROBLEMS.of(422))
def get_tracking_quality(database: TheDatabase, span: TheSpan) -> TrackingQuality:
    """Return the mean tracking error of each station by week, and its change in the last four weeks of the time.

    The change is relative to the twelve weeks before, with Welch's 95 % confidence interval. It also depends on which motions were played.
    Playbacks whose error is partial are left out: their range was reduced, or they ended before their first repetition was complete.
    """
    with database.read() as session:
        return usage.tracking(session, span)


@router.get("/api/statistics/stops", summary="Get stops and alarms by cause", responses=PROBLEMS.of(422))
def get_stop_counts(database: TheDatabase, span: TheSpan) -> Stops:
    """Return the number of stopped sessions and of alarms by cause and station. Restricted records are counted, because no patient is
    named.
    """
    with database.read() as session:
        return usage.stops(session, span)


@router.get("/api/statistics/outcomes", summary="Get the outcomes of the clinic", responses=PROBLEMS.of(422))
def get_outcomes(database: TheDatabase, span: TheSpan) -> Outcomes:
    """Return the change of SPADI, pain and range of motion from the first to the last assessment, by stage and by programme.

    The figures cover episodes whose last assessment is in the time. Groups of fewer than 10 patients are hidden. Restricted records are
    counted, because no patient is named.
    """
    with database.read() as session:
        return outcomes.outcomes(session, span)


@router.get("/api/statistics/clinic-adherence", summary="Get the adherence of the clinic")
def get_clinic_adherence(database: TheDatabase, zone: TheZone) -> ClinicAdherence:
    """Return how the present programmes were followed in the last four weeks.

    Four weeks are 28 days of the clinic, the last of which is today. Restricted records are counted, because no patient is named.
    """
    with database.read() as session:
        return worklist.clinic_adherence(session, recent_days(utc_now(), zone))


@router.get("/api/statistics/adherence", summary="Get the patients by adherence")
def get_patient_adherence(database: TheDatabase, actor: TheActor, zone: TheZone) -> PatientAdherences:
    """Return how each patient followed the present programme in the last four weeks, the lowest share first.

    Four weeks are 28 days of the clinic, the last of which is today. Patients whose records you may not see are left out.
    """
    with database.read() as session:
        return worklist.lowest_adherence(session, actor, recent_days(utc_now(), zone))
