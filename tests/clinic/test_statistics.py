"""The clinic's figures: each agrees with a count of the records, and none names a patient who is hidden."""

from collections.abc import Iterator
from datetime import UTC, date, datetime, timedelta
from math import isclose, isnan
from typing import Any, Literal
from uuid import UUID, uuid4
from zoneinfo import ZoneInfo, available_timezones

import pytest
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from kata.actor import Actor
from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeRow, ProgrammeVersionRow
from kata.clinic.progress import service as progress
from kata.clinic.sessions import runs
from kata.clinic.sessions.tables import RunRow, SessionRow, SessionStopRow
from kata.clinic.statistics import derived_tables, episode_changes, intervals, outcomes, parts, usage, worklist
from kata.clinic.statistics.intervals import SampleSums
from kata.clinic.statistics.measures import MEASURES
from kata.clinic.statistics.recent_days import recent_days
from kata.clinic.statistics.schemas import LEAST_SHOWN
from kata.clinic.statistics.tables import EpisodeOutcomeRow, StationHourRow
from kata.clinic.statistics.usage import Span
from kata.database.engine import Database
from tests.support.databases import upgraded_file
from tests.support.treatment import DAY, treat

THERAPIST = Actor(UUID(int=1), UUID(int=2), "Sato Ken", "therapist", frozenset())
ALL_TIME = Span(datetime(2000, 1, 1, tzinfo=UTC), datetime(2100, 1, 1, tzinfo=UTC))
TOKYO, CHICAGO = ZoneInfo("Asia/Tokyo"), ZoneInfo("America/Chicago")
NOW = datetime(2026, 11, 20, 6, 0, tzinfo=UTC)
DAYS = recent_days(NOW, TOKYO)


@pytest.fixture
def database(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    database = Database(upgraded_file(tmp_path_factory.mktemp("statistics") / "kata.db"))
    derived_tables.DerivedTablesHook(database)
    yield database
    database.close()


def hours(session: Session) -> dict[datetime, tuple[int, int, int, int]]:
    rows = session.scalars(select(StationHourRow))
    return {row.hour: (row.sessions, row.playbacks, row.stopped, row.repetitions) for row in rows}


def test_hours_are_counted_with_the_commit_that_changes_them(database: Database) -> None:
    with database.write() as session:
        treat(session, sessions=2, runs=3)
    with database.read() as session:
        first = parts.begin_of(DAY)
        assert hours(session) == {first: (1, 3, 1, 2), first + timedelta(days=3): (1, 3, 1, 2)}
        rmse = session.scalars(select(RunRow.worst_rmse_deg)).all()
        rows = session.scalars(select(StationHourRow)).all()
        assert isclose(sum(row.rmse_sum_deg for row in rows), sum(value or 0 for value in rmse))


def test_a_repeated_completion_is_counted_once(database: Database) -> None:
    with database.write() as session:
        treat(session, sessions=1, runs=2)
    with database.read() as session:
        before = hours(session)
    for _ in range(2):
        with database.write() as session:
            run = session.scalars(select(RunRow)).first()
            assert run
            run.resistance_level = (run.resistance_level or 0) + 1
    with database.read() as session:
        assert hours(session) == before


def test_a_session_moved_to_another_station_leaves_the_former_hour(database: Database) -> None:
    with database.write() as session:
        treat(session, sessions=1, runs=2)
    with database.write() as session:
        session.scalars(select(SessionRow)).one().station = "Kata 2"
    with database.read() as session:
        found = {row.station: row.sessions for row in session.scalars(select(StationHourRow))}
    assert found == {"Kata 1": 0, "Kata 2": 1}


def test_figures_never_fail_the_record_of_a_treatment(database: Database, caplog: pytest.LogCaptureFixture) -> None:
    with database.writer.begin() as connection:
        connection.exec_driver_sql("DROP TABLE station_hours")
    with database.write() as session:
        treat(session, sessions=1, runs=1)
    with database.read() as session:
        assert session.scalar(select(func.count()).select_from(RunRow)) == 1
    assert "figures of the clinic were not updated" in caplog.text


def test_a_withdrawn_assessment_is_no_outcome(database: Database) -> None:
    with database.write() as session:
        treat(session)
    with database.read() as session:
        outcome, spadi = spadi_of(session)
        weeks = (spadi["last_at"] - spadi["first_at"]) / timedelta(weeks=1).total_seconds()
        assert (spadi["first"], spadi["last"], spadi["improvement"], spadi["weeks"]) == (60.0, 40.0, 20.0, weeks)
        assert outcome.begin_at.timestamp() == outcome.end_at.timestamp() == spadi["last_at"]
    with database.write() as session:
        newest = session.scalars(select(AssessmentRow).order_by(AssessmentRow.assessed_at.desc())).first()
        assert newest
        newest.withdrawn_at = NOW
    with database.read() as session:
        outcome, spadi = spadi_of(session)
        assert (spadi["first"], spadi["last"], spadi["improvement"]) == (60.0, 60.0, 0.0)
        assert isnan(spadi["weeks"]) and outcome.end_at.timestamp() == spadi["first_at"]
    with database.write() as session:
        for row in session.scalars(select(AssessmentRow)):
            row.withdrawn_at = NOW
    with database.read() as session:
        assert session.scalars(select(EpisodeOutcomeRow)).all() == []


def spadi_of(session: Session) -> tuple[EpisodeOutcomeRow, Any]:
    """Return the outcomes of the only episode, and the change of its SPADI."""
    row = session.scalars(select(EpisodeOutcomeRow)).one()
    return row, episode_changes.unpack([row.changes])[0, list(MEASURES).index("spadi")]


def test_days_begin_at_the_clinics_midnight(database: Database) -> None:
    # The first session begins at 0:30 UTC, which is half past nine in Tokyo and the day before in Chicago.
    with database.write() as session:
        treat(session, sessions=1, runs=1)
    with database.read() as session:
        days = {
            zone: usage.usage(session, Span(ALL_TIME.since, ALL_TIME.until, zone), "day").rows[0].begins_on
            for zone in (TOKYO, CHICAGO)
        }
        (week,) = usage.usage(session, Span(ALL_TIME.since, ALL_TIME.until, CHICAGO), "week").rows
    assert days == {TOKYO: date(2026, 11, 2), CHICAGO: date(2026, 11, 1)}
    assert week.begins_on == date(2026, 10, 26)


@pytest.mark.parametrize(
    ("zone", "last"),
    [
        ("Asia/Kolkata", datetime(2026, 11, 2, 18, 29, 59, tzinfo=UTC)),
        ("Asia/Kathmandu", datetime(2026, 11, 2, 18, 14, 59, tzinfo=UTC)),
        # Before and in summer time, which begins on 4 October. On Lord Howe it is half an hour.
        ("Australia/Adelaide", datetime(2026, 10, 2, 14, 29, 59, tzinfo=UTC)),
        ("Australia/Adelaide", datetime(2026, 11, 2, 13, 29, 59, tzinfo=UTC)),
        ("Australia/Lord_Howe", datetime(2026, 10, 2, 13, 29, 59, tzinfo=UTC)),
        ("Australia/Lord_Howe", datetime(2026, 11, 2, 12, 59, 59, tzinfo=UTC)),
        ("Pacific/Chatham", datetime(2026, 11, 2, 10, 14, 59, tzinfo=UTC)),
        ("America/St_Johns", datetime(2026, 11, 2, 3, 29, 59, tzinfo=UTC)),
    ],
)
def test_midnight_divides_an_hour_in_some_zones(database: Database, zone: str, last: datetime) -> None:
    """The last session of a day was counted on the next day, or the other way round: hours of UTC were summed."""
    local = ZoneInfo(zone)
    moments = (last, last + timedelta(seconds=1), last + timedelta(minutes=20))
    with database.write() as session:
        treat(session, sessions=3, runs=1)
        for visit, at in zip(session.scalars(select(SessionRow)), moments, strict=True):
            visit.started_at = at
    day = last.astimezone(local).date()
    with database.read() as session:
        days = usage.usage(session, Span(ALL_TIME.since, ALL_TIME.until, local), "day").rows
        second = usage.usage(session, Span(last + timedelta(seconds=1), ALL_TIME.until, local), "day").rows
    assert [(row.begins_on, row.sessions) for row in days] == [(day, 1), (day + timedelta(days=1), 2)]
    assert [(row.begins_on, row.sessions) for row in second] == [(day + timedelta(days=1), 2)]


def test_parts_end_at_the_midnights_of_every_zone() -> None:
    midnights = {local_midnight(name, day) for name in available_timezones() for day in range(0, 14 * 365, 20)}
    assert [at for at in sorted(midnights) if at != parts.begin_of(at)] == []


def local_midnight(zone: str, day: int) -> datetime:
    """Return the time of UTC, on one day, at which a day begins with the offset that the zone has so many days after 2023."""
    offset = (datetime(2024, 1, 1, tzinfo=UTC) + timedelta(days=day)).astimezone(ZoneInfo(zone)).utcoffset()
    assert offset is not None
    return datetime(2024, 1, 1, *divmod(-round(offset.total_seconds() / 60) % 1440, 60), tzinfo=UTC)


def test_parts_follow_each_other_without_a_gap() -> None:
    begin = datetime(2026, 11, 2, tzinfo=UTC)
    while begin < datetime(2026, 11, 3, tzinfo=UTC):
        end = parts.end_of(begin)
        assert parts.begin_of(end - timedelta(microseconds=1)) == parts.begin_of(begin) == begin
        begin = end


@pytest.mark.parametrize(("station", "sessions"), [(None, 2), ("Kata 1", 2), ("Kata 2", 0), ("", 0)])
def test_every_figure_filters_the_station_alike(database: Database, station: str | None, sessions: int) -> None:
    """The sums of the hours once treated an empty name as no filter, and the stops as a station without a name."""
    with database.write() as session:
        treat(session, sessions=2, runs=3)
        for visit in session.scalars(select(SessionRow)):
            stop = {"code": "drive_silent", "started_at": visit.started_at, "station": visit.station}
            session.add(SessionStopRow(session_id=visit.id, therapist="Sato Ken", **stop))
            alarm = {"code": "drive_silent", "at": visit.started_at, "station": visit.station}
            session.add(DeviceEventRow(id=uuid4(), kind="alarm", message="", **alarm))
    with database.read() as session:
        span = Span(ALL_TIME.since, ALL_TIME.until, station=station)
        stops = usage.stops(session, span)
        used = usage.usage(session, span, "week").rows
    counted = [(row.sessions, row.alarms) for row in stops.rows]
    assert counted == ([(sessions, sessions)] if sessions else [])
    assert (stops.sessions, stops.stopped_sessions, sum(row.sessions for row in used)) == (sessions,) * 3


def add_episode(
    session: Session, change: float, programme: str = "Range", sides: tuple[Literal["left", "right"], ...] = ("left",)
) -> None:
    """Add a patient with two assessments of each side a month apart, whose SPADI changes from 60 by this."""
    at = NOW - timedelta(days=40)
    patient = PatientRow(
        id=uuid4(), clinic_number=uuid4().hex[:8], name="N", sex="female", notes="", created_at=at, updated_at=at
    )
    session.add(patient)
    session.flush()
    for side in sides:
        episode = EpisodeRow(id=uuid4(), patient_id=patient.id, side=side, limits_by="", opened_at=at, updated_at=at)
        session.add(episode)
        session.flush()
        session.add(ProgrammeRow(id=uuid4(), episode_id=episode.id, name=programme, created_at=at, updated_at=at))
        for days, score in ((0, 60.0), (30, 60.0 + change)):
            when = at + timedelta(days=days)
            session.add(
                AssessmentRow(
                    id=uuid4(), episode_id=episode.id, assessed_at=when, assessed_by="", note="", spadi_score=score,
                    updated_at=when,
                )
            )  # fmt: skip


def test_share_and_mean_are_those_of_the_patients(database: Database) -> None:
    from scipy import stats

    changes = [-30.0, -17.125, -17.0, -12.96, -12.9, -8.0, 0.0, 5.0, -40.0, -16.9]
    with database.write() as session:
        for change in changes:
            add_episode(session, change)
    with database.read() as session:
        found = outcomes.outcomes(session, ALL_TIME)
    everyone = next(group for group in found.groups if group.by == "all")
    (spadi,) = everyone.changes
    assert everyone.patients == 10
    # At least 13 points are important, and more than 17 are beyond chance, as in the verdict on one patient. 12.96 is shown as 13.
    assert spadi.important and isclose(spadi.important.value, 0.6)
    assert spadi.detectable and isclose(spadi.detectable.value, 0.3)
    low, high = stats.t.interval(0.95, 9, loc=sum(changes) / 10, scale=stats.sem(changes))
    assert (
        spadi.change and isclose(spadi.change.low, low, rel_tol=1e-9) and isclose(spadi.change.high, high, rel_tol=1e-9)
    )
    assert spadi.weeks_to_important is None, "six patients reached it"


def test_small_groups_are_hidden_and_cannot_be_computed(database: Database) -> None:
    with database.write() as session:
        for programme, count in (("A", 12), ("B", LEAST_SHOWN), ("C", 3)):
            for n in range(count):
                add_episode(session, -float(n), programme)
    with database.read() as session:
        found = outcomes.outcomes(session, ALL_TIME)
    shown = {group.name: group.patients for group in found.groups if group.by == "programme"}
    # Without B, C would be the total minus A and B.
    assert shown == {"A": 12, "B": None, "C": None}
    assert all(group.changes == [] for group in found.groups if group.patients is None)


def test_both_shoulders_of_a_patient_are_one_person(database: Database) -> None:
    """Ten shoulders of five patients are a group of five."""
    with database.write() as session:
        for n in range(LEAST_SHOWN // 2):
            add_episode(session, -float(n), sides=("left", "right"))
    with database.read() as session:
        found = outcomes.outcomes(session, ALL_TIME)
    assert {group.patients for group in found.groups} == {None}
    with database.write() as session:
        for n in range(LEAST_SHOWN // 2):
            add_episode(session, -float(n))
    with database.read() as session:
        found = outcomes.outcomes(session, ALL_TIME)
    everyone = next(group for group in found.groups if group.by == "all")
    (spadi,) = everyone.changes
    assert (everyone.patients, spadi.patients, spadi.shoulders) == (10, 10, 15)


def test_intervals_are_those_of_scipy() -> None:
    # The import takes most of a second, which each worker would spend when it collects the tests.
    from scipy import stats

    values, others = [0.7, 0.8, 0.65, 0.9, 0.75], [0.5, 0.55, 0.6, 0.52]
    samples = [SampleSums(len(of), sum(of), sum(value**2 for value in of)) for of in (values, others)]
    mine = intervals.of_difference(*samples)
    theirs = stats.ttest_ind(values, others, equal_var=False).confidence_interval(0.95)
    assert mine and isclose(mine.low, theirs.low, rel_tol=1e-9) and isclose(mine.high, theirs.high, rel_tol=1e-9)
    wilson = stats.binomtest(7, 10).proportion_ci(0.95, method="wilson")
    share = intervals.of_share(7, 10)
    assert share and isclose(share.low, wilson.low, rel_tol=1e-6) and isclose(share.high, wilson.high, rel_tol=1e-6)
    assert intervals.of_mean(SampleSums(1, 3.0, 9.0)) is None
    assert intervals.of_share(0, 0) is None


def test_a_station_drifts_when_its_error_rises(database: Database) -> None:
    until = NOW
    with database.write() as session:
        rows = []
        for station, recent in (("Rising", 1.0), ("Steady", 0.71)):
            for days, mean in ((7, recent), (60, 0.7)):
                # Twenty playbacks with a spread of 0.1.
                total, squares = 20 * mean, 20 * (mean**2 + 0.01)
                rows.append(
                    {
                        "hour": parts.begin_of(until - timedelta(days=days)), "station": station, "sessions": 10,
                        "playbacks": 20, "stopped": 0, "played_s": 60.0, "repetitions": 20, "compared": 20,
                        "rmse_sum_deg": total, "rmse_square_sum_deg2": squares, "peak_deg": 2.0,
                    }
                )  # fmt: skip
        derived_tables.upsert(session, StationHourRow, rows)
    with database.read() as session:
        found = usage.tracking(session, Span(until - timedelta(days=90), until))
    assert {station.station: station.drifting for station in found.drift} == {"Rising": True, "Steady": False}


def test_tracking_counts_the_playbacks_that_progress_counts(database: Database) -> None:
    """A partial playback has no error of the whole motion, so neither counts it. One that was stopped after a repetition counts."""
    with database.write() as session:
        made = treat(session, sessions=1, runs=4)
        played = session.scalars(select(RunRow).order_by(RunRow.started_at)).all()
        played[0].compared_percent = 41.5
        played[1].least_range_percent, played[1].repetitions_done = None, 1
        played[2].least_range_percent = None
        # A stopped test of one second, with an error that would be the largest.
        played[3].least_range_percent, played[3].repetitions_done, played[3].outcome = None, 0, "stopped"
        played[3].samples, played[3].played_s, played[3].tracking[0].rmse_deg = 100, 1.0, 30.0
        for run in played:
            run.worst_rmse_deg, run.worst_peak_deg = None, None
            runs.store_worst_errors(run)
    with database.read() as session:
        found = usage.tracking(session, ALL_TIME)
        charts = progress.tracked(session, progress.timeline_of(session, made.episode_id))
        counted = session.scalars(select(RunRow).where(RunRow.worst_rmse_deg.is_not(None))).all()
    (station,) = found.rows
    assert found.left_out == 2
    assert {run.outcome for run in counted} == {"completed", "stopped"}
    assert station.playbacks == sum(one.playbacks for one in charts) == 2
    mean = sum(one.rmse_deg * one.playbacks for one in charts) / station.playbacks
    assert isclose(station.rmse_deg, mean)
    assert station.peak_deg == max(one.peak_deg for one in charts)


def followed(database: Database, *, restricted: bool = False, last_day: int = 8) -> None:
    """Treat a patient once, this many days ago, and prescribe one session per week."""
    with database.write() as session:
        made = treat(session, sessions=1, runs=1, signed=False)
        visit = session.get_one(SessionRow, made.session_ids[0])
        visit.started_at = NOW - timedelta(days=last_day)
        visit.ended_at = visit.started_at + timedelta(minutes=30)
        session.get_one(PatientRow, visit.patient_id).restricted = restricted
        version = session.scalars(select(ProgrammeVersionRow)).all()[-1]
        version.sessions_per_week = 1


def test_patients_are_due_a_week_after_their_session(database: Database) -> None:
    followed(database, last_day=8)
    with database.read() as session:
        work = worklist.worklist(session, THERAPIST, DAYS)
        earlier = worklist.worklist(session, THERAPIST, recent_days(NOW - timedelta(days=2), TOKYO))
    assert [patient.last_session_at for patient in work.due] == [NOW - timedelta(days=8)]
    assert (work.due_count, work.due[0].therapist, work.due[0].due_at) == (1, "Sato Ken", NOW - timedelta(days=1))
    assert earlier.due == []


def test_programmes_are_overdue_from_the_day_after_the_due_day(database: Database) -> None:
    """The pages show days. NOW is 15:00 in Tokyo, so the due times of these three patients are 14:00, midnight, and 23:00 of the day before."""
    for hours in (1, 15, 16):
        followed(database)
        with database.write() as session:
            newest = session.scalars(select(SessionRow).where(SessionRow.started_at == NOW - timedelta(days=8))).one()
            newest.started_at = NOW - timedelta(days=7, hours=hours)
    with database.read() as session:
        found = worklist.adherence(worklist.followed(session, DAYS), DAYS)
    assert (found.programmes, found.overdue) == (3, 1)


def test_adherence_of_the_clinic_is_hidden_for_few_programmes(database: Database) -> None:
    for _ in range(LEAST_SHOWN - 1):
        followed(database)
    with database.read() as session:
        assert worklist.clinic_adherence(session, DAYS).adherence is None
    followed(database, restricted=True)
    with database.read() as session:
        found = worklist.clinic_adherence(session, DAYS)
        assert found.adherence == worklist.adherence(worklist.followed(session, DAYS), DAYS)
    assert found.adherence is not None
    assert (found.adherence.programmes, found.least_programmes) == (LEAST_SHOWN, LEAST_SHOWN)


def test_change_of_a_patient_names_the_shoulder(database: Database) -> None:
    followed(database)
    with database.read() as session:
        work = worklist.worklist(session, THERAPIST, DAYS)
    assert [(one.measure, one.side, one.before, one.now) for one in work.changes] == [("spadi", "left", 60.0, 40.0)]


def test_patients_away_for_four_weeks_are_not_due(database: Database) -> None:
    followed(database, last_day=29)
    with database.write() as session:
        session.scalars(select(ProgrammeVersionRow)).one().made_at = NOW - timedelta(days=60)
    with database.read() as session:
        assert worklist.worklist(session, THERAPIST, DAYS).due == []


def test_the_worklist_omits_restricted_records_and_other_therapists_notes(database: Database) -> None:
    followed(database)
    followed(database, restricted=True)
    other = Actor(UUID(int=1), UUID(int=2), "Ito Daiki", "therapist", frozenset())
    with database.read() as session:
        mine, theirs = (worklist.worklist(session, actor, DAYS) for actor in (THERAPIST, other))
        every = worklist.adherence(worklist.followed(session, DAYS), DAYS)
    assert (mine.due_count, len(mine.unsigned), len(theirs.unsigned)) == (1, 1, 0)
    assert (mine.unsigned_count, theirs.unsigned_count) == (1, 1)
    assert every.programmes == 2, "a figure that names no patient counts restricted records"


def test_an_open_session_of_another_day_stays_in_the_worklist(database: Database) -> None:
    followed(database)
    with database.write() as session:
        session.scalars(select(SessionRow)).one().ended_at = None
    with database.read() as session:
        work = worklist.worklist(session, THERAPIST, DAYS)
    assert (len(work.sessions), len(work.unsigned), work.unsigned_count) == (1, 0, 0)


def test_archived_patients_are_neither_due_nor_counted(database: Database) -> None:
    followed(database)
    with database.write() as session:
        session.scalars(select(PatientRow)).one().archived_at = NOW
    with database.read() as session:
        assert worklist.worklist(session, THERAPIST, DAYS).due_count == 0
        assert worklist.adherence(worklist.followed(session, DAYS), DAYS).programmes == 0


def test_sessions_before_a_programme_do_not_follow_it(database: Database) -> None:
    """Two sessions were prescribed since the new version. The patient came before it, and not since."""
    followed(database, last_day=20)
    with database.write() as session:
        version = session.scalars(select(ProgrammeVersionRow)).one()
        version.made_at, version.sessions_per_week = NOW - timedelta(days=7), 2
    with database.read() as session:
        found = worklist.adherence(worklist.followed(session, DAYS), DAYS)
        (due,) = worklist.worklist(session, THERAPIST, DAYS).due
    assert (found.prescribed, found.held) == (2, 0)
    assert due.last_session_at == NOW - timedelta(days=20)


def test_patients_are_listed_by_adherence_without_restricted_records(database: Database) -> None:
    """Each patient came once in four weeks. Twice as many sessions were prescribed to the second patient."""
    followed(database, last_day=2)
    followed(database, last_day=1)
    followed(database, restricted=True)
    with database.write() as session:
        for version in session.scalars(select(ProgrammeVersionRow)):
            version.made_at = NOW - timedelta(days=60)
        last = select(SessionRow).where(SessionRow.started_at == NOW - timedelta(days=1))
        second = session.scalars(last).one()
        of_second = select(ProgrammeVersionRow).join(ProgrammeRow).where(ProgrammeRow.episode_id == second.episode_id)
        session.scalars(of_second).one().sessions_per_week = 2
        patient_id = second.patient_id
    with database.read() as session:
        found = worklist.lowest_adherence(session, THERAPIST, DAYS)
    assert [(row.held, row.prescribed) for row in found.rows] == [(1, 8), (1, 4)]
    assert (found.count, found.rows[0].patient.id) == (2, patient_id)


def test_stage_of_the_first_day_is_in_the_clinics_zone(database: Database) -> None:
    """An assessment on Tuesday morning in Tokyo is on Monday in UTC. The stage was recorded on Tuesday."""
    with database.write() as session:
        for n in range(LEAST_SHOWN):
            add_episode(session, -float(n))
        for row in session.scalars(select(AssessmentRow)):
            row.assessed_at = row.assessed_at.replace(hour=23)
        first = min(row.assessed_at for row in session.scalars(select(AssessmentRow)))
        for episode_id in session.scalars(select(EpisodeRow.id)):
            session.add(
                StageRow(
                    id=uuid4(), episode_id=episode_id, stage="frozen", since=(first + timedelta(hours=9)).date(), noted_at=NOW
                )
            )  # fmt: skip
    with database.read() as session:
        found = outcomes.outcomes(session, Span(ALL_TIME.since, ALL_TIME.until, TOKYO))
    assert [(group.name, group.patients) for group in found.groups if group.by == "stage"] == [("frozen", LEAST_SHOWN)]
