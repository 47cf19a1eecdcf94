"""Programmes: versions, completed repetitions and adherence, on both databases."""

import re
from contextlib import nullcontext
from datetime import UTC, date, datetime, timedelta, timezone
from html import unescape
from queue import Queue
from threading import Event, Thread
from typing import Any
from uuid import UUID, uuid4
from zoneinfo import ZoneInfo

import pytest
from sqlalchemy import event, select

from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate, PatientUpdate
from kata.clinic.programmes import adherence, planned, service
from kata.clinic.programmes.adherence import HeldSession, VersionTarget, by_week
from kata.clinic.programmes.planned import Setting
from kata.clinic.programmes.schemas import (
    ProgrammeCreate,
    ProgrammeItem,
    ProgrammeItemRequest,
    ProgrammeUpdate,
    VersionCreate,
)
from kata.clinic.programmes.tables import ProgrammeRow, ProgrammeVersionRow
from kata.clinic.recordings.tables import RecordingRow, TeachingRow
from kata.clinic.sessions.schemas import EndRangePrescription
from kata.clinic.sessions.tables import MotionTrackingRow, RunRow, SessionRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.errors import ProblemError
from kata.interop import bundle, patient_export
from kata.interop.codes import ExportSettings
from kata.reporting import episode as episode_report
from kata.reporting import rehabilitation_plan, rendering
from kata.reporting import session as session_report
from kata.reporting.phrases import Language
from tests.support.databases import SQLITE_FIRST
from tests.support.reports import print_options

MONDAY = datetime(2026, 11, 16, 9, 0, tzinfo=UTC)
DAY = timedelta(days=1)
PRESCRIBED = EndRangePrescription(motion=4, minutes=2.0, band_deg=5.0, torque_nm=1.0)


class Clinic:
    """A patient whose right shoulder is treated."""

    def __init__(self, database: Database) -> None:
        self.database = database
        self.patient_id = self.sign_up("1")

    def sign_up(self, number: str) -> UUID:
        with self.database.write() as session:
            return patients.create(session, PatientCreate(clinic_number=number, name="N", affected_side="right")).id

    def recording(self, name: str = "Lift", side: str = "right", patient_id: UUID | None = None) -> UUID:
        common = {"patient_id": patient_id or self.patient_id, "name": name, "side": side}
        with self.database.write() as session:
            session.add(teaching := TeachingRow(id=uuid4(), started_at=utc_now(), **common))
            session.flush()
            row = RecordingRow(
                id=uuid4(), teaching_id=teaching.id, take=1, station="S", taught_at=utc_now(), duration_s=4.0,
                rate_hz=100, samples=401, note="", **common,
            )  # fmt: skip
            session.add(row)
            return row.id

    def programme(self, *recordings: UUID, **given: Any) -> ProgrammeRow:
        wanted = ProgrammeCreate(name="Morning", made_by="Aoki", items=items(*recordings), **given)
        with self.database.write() as session:
            return service.create(session, self.patient_id, wanted, [10.0] * len(recordings))

    def version(self, programme_id: UUID, based_on: int, *recordings: UUID, **given: Any) -> ProgrammeRow:
        wanted = VersionCreate(based_on=based_on, made_by="Baba", items=items(*recordings), **given)
        with self.database.write() as session:
            return service.add_version(session, programme_id, wanted, [10.0] * len(recordings))

    def newest(self, programme_id: UUID) -> ProgrammeVersionRow:
        with self.database.read() as session:
            return service.get(session, programme_id).versions[-1]

    def visit(self, at: datetime, version_id: UUID | None, *runs: dict[str, Any]) -> UUID:
        with self.database.write() as session:
            patient = patients.get(session, self.patient_id)
            assert patient.episode
            visit = SessionRow(
                id=uuid4(), patient_id=patient.id, episode_id=patient.episode.id, programme_version_id=version_id,
                started_at=at, note="",
            )  # fmt: skip
            session.add(visit)
            session.flush()
            session.add_all(played(session_id=visit.id, started_at=at, **run) for run in runs)
            return visit.id


def items(*recordings: UUID, **given: Any) -> list[ProgrammeItemRequest]:
    return [
        ProgrammeItemRequest(**{"recording_id": recording, "repetitions": 10, "resistance_level": 8} | given)
        for recording in recordings
    ]


def played(**given: Any) -> RunRow:
    usual = {
        "id": uuid4(), "ended_at": utc_now(), "started_at": MONDAY, "outcome": "completed", "repetitions": 10,
        "repetitions_done": 10, "resistance_level": 8, "method": "smooth", "played_s": 60.0, "speed_percent": 100.0,
        "pause_s": 0.0, "range_percent": 100.0, "self_paced": False,
    }  # fmt: skip
    return RunRow(**usual | given)


@pytest.fixture
def clinic(database: Database) -> Clinic:
    return Clinic(database)


def refused(status: int, code: str) -> Any:
    return pytest.raises(ProblemError, check=lambda error: (error.status, error.code) == (status, code))


@SQLITE_FIRST
def test_every_change_is_a_version_and_notes_remain(clinic: Clinic) -> None:
    lift, turn = clinic.recording("Lift"), clinic.recording("Turn")
    made = clinic.programme(lift, turn, timer_minutes=20, sessions_per_week=3, note="After the injection.")
    clinic.version(made.id, 1, turn, note="Only what hurts less.")

    with clinic.database.read() as session:
        detail = service.as_detail(session, service.get(session, made.id))
        listed = [service.as_programme(row) for row in service.of_patient(session, clinic.patient_id)]
    second, first = detail.versions
    assert (first.number, first.made_by, first.note) == (1, "Aoki", "After the injection.")
    assert [(item.position, item.recording_name, item.repetitions) for item in first.items] == [
        (1, "Lift", 10),
        (2, "Turn", 10),
    ]
    assert (first.timer_minutes, first.sessions_per_week, first.duration_s) == (20.0, 3, 20.0)
    assert (second.number, second.made_by, second.duration_s) == (2, "Baba", 10.0)
    assert [item.recording_id for item in second.items] == [turn]
    assert detail.current == second
    assert [programme.current for programme in listed] == [second]
    assert detail.side == "right"


@SQLITE_FIRST
def test_second_of_two_editors_is_refused_and_nothing_is_lost(clinic: Clinic) -> None:
    lift = clinic.recording()
    made = clinic.programme(lift)
    clinic.version(made.id, 1, lift, note="First.")
    with refused(409, "edited_meanwhile"):
        clinic.version(made.id, 1, lift, note="Second.")
    assert (clinic.newest(made.id).number, clinic.newest(made.id).note) == (2, "First.")
    with clinic.database.write() as session, refused(409, "edited_meanwhile"):
        service.update(session, made.id, ProgrammeUpdate(name="Evening", updated_at=made.created_at))


@SQLITE_FIRST
def test_one_of_two_simultaneous_saves_is_refused(clinic: Clinic) -> None:
    """The second request reads before the first has committed, and writes after it."""
    lift = clinic.recording()
    made = clinic.programme(lift)
    outcomes: Queue[str] = Queue()
    began = Event()

    def second() -> None:
        began.set()
        try:
            clinic.version(made.id, 1, lift, note="Second.")
        except ProblemError as error:
            outcomes.put(error.code)

    with clinic.database.write() as session:
        wanted = VersionCreate(based_on=1, made_by="Baba", items=items(lift), note="First.")
        service.add_version(session, made.id, wanted, [10.0])
        Thread(target=second).start()
        assert began.wait(5)
    assert outcomes.get(timeout=10) == "edited_meanwhile"
    assert (clinic.newest(made.id).number, clinic.newest(made.id).note) == (2, "First.")


def test_archived_programmes_come_last_and_take_no_version(clinic: Clinic) -> None:
    lift = clinic.recording()
    old, new = clinic.programme(lift), clinic.programme(lift)
    with clinic.database.write() as session:
        service.update(session, new.id, ProgrammeUpdate(archived=True))
    with clinic.database.read() as session:
        assert [row.programme_id for row in service.of_patient(session, clinic.patient_id)] == [old.id, new.id]
    with refused(409, "archived"):
        clinic.version(new.id, 1, lift)
    with clinic.database.write() as session:
        assert service.update(session, new.id, ProgrammeUpdate(archived=False, name="Noon")).archived_at is None
    assert clinic.version(new.id, 1, lift).name == "Noon"


def test_only_suitable_recordings_are_prescribed(clinic: Clinic) -> None:
    other = clinic.sign_up("2")
    with refused(409, "other_patient"):
        clinic.programme(clinic.recording(patient_id=other))
    with refused(409, "other_side"):
        clinic.programme(clinic.recording(side="left"))
    with refused(404, "not_found"):
        clinic.programme(uuid4())
    lift = clinic.recording()
    with clinic.database.write() as session:
        session.get_one(RecordingRow, lift).archived_at = utc_now()
    with pytest.raises(ProblemError, match="Item 2, Lift, is archived") as caught:
        clinic.programme(clinic.recording(), lift)
    assert caught.value.code == "archived"
    with clinic.database.read() as session:
        assert service.of_patient(session, clinic.patient_id) == []


def test_no_more_resistance_is_prescribed_than_the_doctor_allows(clinic: Clinic) -> None:
    lift = clinic.recording()
    with clinic.database.write() as session:
        episode = patients.get(session, clinic.patient_id).episode
        assert episode
        episode.max_resistance_level, episode.limits_by = 7, "Dr. Endo"
    with pytest.raises(ProblemError, match=r"Item 1, Lift, has resistance level 8; Dr\. Endo allows at most 7"):
        clinic.programme(lift)
    with clinic.database.write() as session:
        session.get_one(EpisodeRow, episode.id).max_resistance_level = 8
    clinic.programme(lift)


@SQLITE_FIRST
def test_a_closed_episode_and_an_archived_patient_take_no_programme(clinic: Clinic) -> None:
    lift = clinic.recording()
    made = clinic.programme(lift)
    with refused(404, "not_found"):
        clinic.programme(lift, episode_id=uuid4())
    with clinic.database.write() as session:
        patients.update(session, clinic.patient_id, PatientUpdate(archived=True))
    with refused(409, "archived"):
        clinic.programme(lift)
    with clinic.database.write() as session:
        patients.update(session, clinic.patient_id, PatientUpdate(archived=False))
        episode = patients.get(session, clinic.patient_id).episode
        assert episode
        episode.closed_at = utc_now()
    for episode_id in (None, episode.id):
        with refused(409, "episode_closed"):
            clinic.programme(lift, episode_id=episode_id)
    with refused(409, "episode_closed"):
        clinic.version(made.id, 1, lift)
    with clinic.database.read() as session:
        assert service.as_detail(session, service.get(session, made.id)).closed


def test_a_patient_without_an_episode_has_no_programme(clinic: Clinic) -> None:
    with clinic.database.write() as session:
        session.delete(patients.get(session, clinic.patient_id).episodes[0])
    with refused(409, "no_episode"):
        clinic.programme(clinic.recording())


# -- planned and done -----------------------------------------------------------------------------------------------

LIFT, TURN = RecordingRow(id=uuid4(), name="Lift"), RecordingRow(id=uuid4(), name="Turn")


def item(position: int, recording: RecordingRow, **given: Any) -> ProgrammeItem:
    return ProgrammeItem(
        **{
            "position": position, "recording_id": recording.id, "recording_name": recording.name, "duration_s": 40.0,
            "recording_archived": False, "repetitions": 10, "resistance_level": 8,
        } | given
    )  # fmt: skip


def run(position: int | None, recording: RecordingRow, **given: Any) -> RunRow:
    values = {"session_id": uuid4(), "recording_id": recording.id, "recording": recording}
    return played(programme_position=position, **values | given)


def test_each_item_has_its_runs_and_others_are_separate() -> None:
    plan = planned.compare(
        [item(1, LIFT), item(2, TURN), item(3, LIFT)],
        [
            run(2, TURN, repetitions_done=4, outcome="returned"),
            run(1, LIFT),
            run(2, TURN, repetitions_done=5, outcome="stopped"),
            run(None, TURN),
            run(1, TURN),
            run(9, LIFT),
        ],
    )
    assert [(part.done, part.repetitions_done, len(part.runs)) for part in plan.items] == [
        ("all", 10, 1),
        ("some", 9, 2),
        ("none", 0, 0),
    ]
    assert (plan.repetitions_done, plan.repetitions_planned) == (19, 30)
    # A recording chosen without the programme, a recording that its item does not have, and an item that does not exist.
    assert [other.recording_name for other in plan.besides] == ["Turn", "Turn", "Lift"]


def test_more_than_planned_makes_up_for_nothing() -> None:
    plan = planned.compare([item(1, LIFT), item(2, TURN)], [run(1, LIFT), run(1, LIFT, repetitions_done=7)])
    assert [part.repetitions_done for part in plan.items] == [17, 0]
    assert (plan.repetitions_done, plan.repetitions_planned) == (10, 20)


@pytest.mark.parametrize(
    ("given", "done"),
    [
        ({"outcome": "unloaded", "repetitions_done": 0, "played_s": 0.0}, "none"),
        ({"outcome": "stopped", "repetitions_done": 0, "played_s": 0.0}, "none"),
        ({"outcome": "stopped", "repetitions_done": 0, "played_s": 3.0}, "some"),
        ({"outcome": "loaded", "repetitions_done": None, "played_s": None}, "some"),
        ({"outcome": "interrupted", "repetitions_done": None, "played_s": None}, "some"),
    ],
)
def test_item_begins_with_its_first_playback(given: dict[str, Any], done: str) -> None:
    assert planned.compare([item(1, LIFT)], [run(1, LIFT, **given)]).items[0].done == done


def test_settings_that_were_changed_are_named() -> None:
    def changed(planned_: dict[str, Any], done: dict[str, Any]) -> list[Setting]:
        return planned.compare([item(1, LIFT, **planned_)], [run(1, LIFT, **done)]).items[0].runs[0].changed

    assert changed({}, {}) == []
    given: dict[str, Any] = {
        "speed_percent": 50.0,
        "range_percent": 80.0,
        "resistance_level": 5,
        "method": "learned",
        "repetitions": 5,
        "self_paced": True,
    }
    assert set(changed({}, given)) == set(given)
    assert changed({"pause_s": 2.0}, {}) == ["pause_s"]
    assert changed({"pause_s": 2.0, "repetitions": 1}, {"repetitions": 1}) == []
    assert planned.compare([], [run(1, LIFT, speed_percent=50.0)]).besides[0].changed == []


def test_when_the_timer_has_run_out_nothing_is_left() -> None:
    assert [planned.left_s(20.0, played_s) for played_s in (0.0, 1199.0, 1200.0, 1500.0)] == [1200.0, 1.0, 0.0, 0.0]


@SQLITE_FIRST
def test_a_sessions_plan_is_that_of_its_version(clinic: Clinic) -> None:
    lift, turn = clinic.recording("Lift"), clinic.recording("Turn")
    made = clinic.programme(lift, turn, timer_minutes=2)
    first = clinic.newest(made.id)
    clinic.version(made.id, 1, lift)
    visit = clinic.visit(
        MONDAY, first.id, {"recording_id": turn, "programme_position": 2, "played_s": 90.5, "repetitions_done": 6}
    )
    with clinic.database.read() as session:
        plan = planned.of_session(session, visit)
    assert plan.programme
    assert (plan.programme.name, plan.programme.number, plan.programme.version_id) == ("Morning", 1, first.id)
    assert [(part.recording_name, part.done) for part in plan.items] == [("Lift", "none"), ("Turn", "some")]
    assert plan.timer
    assert (plan.timer.minutes, plan.timer.played_s, plan.timer.left_s) == (2.0, 90.5, 29.5)
    assert not plan.ended


@SQLITE_FIRST
@pytest.mark.parametrize(("played_s", "over"), [(119.9, False), (120.0, True)])
def test_when_its_time_is_over_no_further_item_is_begun(clinic: Clinic, played_s: float, over: bool) -> None:
    lift = clinic.recording("Lift")
    first = clinic.newest(clinic.programme(lift, lift, timer_minutes=2).id)
    visit = clinic.visit(MONDAY, first.id, {"recording_id": lift, "programme_position": 1, "played_s": played_s})
    with clinic.database.read() as session, refused(409, "timer_over") if over else nullcontext():
        planned.check_timer(session, visit)


def test_a_session_without_a_programme_has_everything_besides(clinic: Clinic) -> None:
    visit = clinic.visit(MONDAY, None, {"recording_id": clinic.recording()}, {"recording_id": clinic.recording("Turn")})
    with clinic.database.read() as session:
        plan = planned.of_session(session, visit)
        with refused(404, "not_found"):
            planned.of_session(session, uuid4())
    assert (plan.programme, plan.items, plan.timer, plan.played_s) == (None, [], None, 120.0)
    assert len(plan.besides) == 2


# -- adherence ------------------------------------------------------------------------------------------------------


def week_numbers(weeks: list[adherence.AdherenceWeek]) -> list[tuple[date, int, int | None]]:
    return [(week.begins_on, week.sessions, week.sessions_prescribed) for week in weeks]


def test_weeks_without_a_session_are_included() -> None:
    visits = [HeldSession(MONDAY), HeldSession(MONDAY + 6 * DAY), HeldSession(MONDAY + 14 * DAY)]
    assert week_numbers(by_week(visits, [], MONDAY + 22 * DAY, UTC)) == [
        (date(2026, 11, 16), 2, None),
        (date(2026, 11, 23), 0, None),
        (date(2026, 11, 30), 1, None),
        (date(2026, 12, 7), 0, None),
    ]
    assert by_week([], [], MONDAY, UTC) == []


def test_monday_begins_where_the_clinic_is() -> None:
    """Sunday night in London is Monday morning in Tokyo."""
    night = HeldSession(MONDAY - 10 * timedelta(hours=1))
    [london, *_] = by_week([night], [], night.started_at, UTC)
    [tokyo] = by_week([night], [], night.started_at, timezone(timedelta(hours=9)))
    assert (london.begins_on, tokyo.begins_on) == (date(2026, 11, 9), date(2026, 11, 16))


def test_goal_is_the_last_one_set_by_each_week() -> None:
    one, other = uuid4(), uuid4()
    said = [
        VersionTarget(one, MONDAY, 2, None),
        VersionTarget(one, MONDAY + 8 * DAY, 3, None),
        VersionTarget(other, MONDAY + 15 * DAY, None, None),
        VersionTarget(other, MONDAY + 22 * DAY, 4, MONDAY + 30 * DAY),
        VersionTarget(one, MONDAY + 43 * DAY, None, None),
    ]
    wishes = [week.sessions_prescribed for week in by_week([], said, MONDAY + 43 * DAY, UTC)]
    # The other programme is archived in the fifth week. The first has no wish from the seventh week.
    assert wishes == [2, 3, 3, 4, 4, 3, None]


def test_repetitions_are_added_up_by_week() -> None:
    visits = [HeldSession(MONDAY, 20, 10), HeldSession(MONDAY + DAY, 10, 8), HeldSession(MONDAY)]
    [week] = by_week(visits, [], MONDAY, UTC)
    assert (week.sessions, week.repetitions_planned, week.repetitions_done) == (3, 30, 18)


def test_an_episodes_weeks_come_from_its_sessions(clinic: Clinic) -> None:
    lift = clinic.recording()
    version = clinic.newest(clinic.programme(lift, lift, sessions_per_week=2).id)
    first = {"recording_id": lift, "programme_position": 1}
    second = {"recording_id": lift, "programme_position": 2}
    clinic.visit(MONDAY, version.id, first | {"repetitions_done": 4}, first | {"repetitions_done": 3}, second)
    clinic.visit(MONDAY + DAY, None, {"recording_id": lift})
    clinic.visit(MONDAY + 2 * DAY, version.id, first | {"outcome": "unloaded", "repetitions_done": 0})
    clinic.visit(MONDAY + 3 * DAY, version.id)
    with clinic.database.write() as session:
        episode = patients.get(session, clinic.patient_id).episode
        assert episode
        episode.closed_at = MONDAY + 5 * DAY
        # The version is as old as its sessions.
        session.get_one(ProgrammeVersionRow, version.id).made_at = MONDAY
    with clinic.database.read() as session:
        [week] = adherence.of_episode(session, episode.id, UTC).weeks
        with refused(404, "not_found"):
            adherence.of_episode(session, uuid4(), UTC)
    # A session without a playback has no repetitions, and a session without a programme has no planned ones.
    assert (week.sessions, week.sessions_prescribed) == (2, 2)
    assert (week.repetitions_done, week.repetitions_planned) == (17, 20)


def with_end_range_times(clinic: Clinic) -> tuple[UUID, UUID]:
    """Return an episode with two minutes counted of four prescribed ones, and the session in which they were counted."""
    lift, turn = clinic.recording(), clinic.recording("Turn")
    wanted = ProgrammeCreate(
        name="Morning", made_by="Aoki", sessions_per_week=3,
        items=[*items(lift, lift, end_range=PRESCRIBED), *items(turn)],
    )  # fmt: skip
    with clinic.database.write() as session:
        programme = service.create(session, clinic.patient_id, wanted, [10.0] * 3)
    version = clinic.newest(programme.id)
    visit_id = clinic.visit(
        MONDAY, version.id,
        *({"recording_id": lift, "programme_position": 1, "motions": reached(seconds)} for seconds in (70.0, 20.0, None)),
        {"recording_id": lift, "programme_position": 2, "motions": reached(30.0)},
        # Neither the other item's time nor that of a run outside the programme counts.
        {"recording_id": turn, "programme_position": 3, "motions": reached(500.0)},
        {"recording_id": lift, "programme_position": None, "motions": reached(500.0)},
    )  # fmt: skip
    clinic.visit(MONDAY + DAY, version.id, {"recording_id": turn, "programme_position": 3})
    with clinic.database.write() as session:
        for visit in session.scalars(select(SessionRow)):
            visit.ended_at = visit.started_at + timedelta(minutes=30)
        session.get_one(ProgrammeVersionRow, version.id).made_at = MONDAY
        episode_id = session.get_one(SessionRow, visit_id).episode_id
    assert episode_id
    return episode_id, visit_id


def test_counted_end_range_time_is_beside_the_prescribed_one(clinic: Clinic) -> None:
    episode_id, visit_id = with_end_range_times(clinic)
    with clinic.database.read() as session:
        week = adherence.of_episode(session, episode_id, UTC).weeks[0]
        plan = planned.of_session(session, visit_id)
    assert [(done.motion, done.counted_s, done.prescribed_s) for done in week.end_range] == [(4, 120.0, 3 * 240.0)]
    assert [[(done.counted_s, done.prescribed_s) for done in one.motions] for one in week.end_range_sessions] == [
        [(120.0, 240.0)],
        [(None, 240.0)],
    ]
    assert [item.end_range_s for item in plan.items] == [90.0, 30.0, None]
    assert [item.end_range for item in plan.items] == [PRESCRIBED, PRESCRIBED, None]


@SQLITE_FIRST
def test_reports_print_prescribed_and_counted_minutes(clinic: Clinic) -> None:
    episode_id, visit_id = with_end_range_times(clinic)
    with clinic.database.read() as session:
        visit = session_report.read_content(session, visit_id, UTC)
        care = episode_report.read_content(session, episode_id, UTC)
    said: dict[Language, tuple[str, str]] = {
        "en": ("Abduction / adduction (motion 4) last 5°, at least 1 Nm 2.0 of 4.0 2.0 of 12.0", "16 Nov 2026 Abduction / adduction (motion 4) 2.0 of 12.0"),
        "ja": ("終点の手前5°以内、1 Nm以上 2.0／処方4.0 2.0／処方12.0", "2.0／処方12.0"),
    }  # fmt: skip
    for language, (of_session, of_week) in said.items():
        options = print_options(language)
        assert of_session in text_of(rendering.session_page(visit, options).html)
        assert of_week in text_of(rendering.episode_page(care, options).html)


@SQLITE_FIRST
def test_exports_have_prescribed_and_counted_end_range_times(clinic: Clinic) -> None:
    _, visit_id = with_end_range_times(clinic)
    names = ExportSettings(zone=ZoneInfo("Asia/Tokyo"))
    with clinic.database.read() as session:
        patient = patients.get(session, clinic.patient_id)
        rows = list(patient_export._end_range_rows(session, patient, names))
        resources = list(bundle.resources(session, patient, names))
    figures = [
        (row["period"], row["begins_at"][:10], row["counted_s"], row["prescribed_s"], row["side"]) for row in rows
    ]
    assert figures[:3] == [
        ("session", "2026-11-16", 120.0, 240.0, "right"),
        ("session", "2026-11-17", None, 240.0, "right"),
        ("week", "2026-11-16", 120.0, 720.0, "right"),
    ]
    assert rows[0]["session_id"] == visit_id

    plan = next(resource for resource in resources if resource["resourceType"] == "CarePlan")
    description = plan["activity"][0]["detail"]["description"]
    assert description.endswith("2 min a session, last 5 deg with at least 1 Nm between apparatus and shoulder")
    assert "pace set by the patient" not in description
    of_session, not_counted, of_week = [
        resource
        for resource in resources
        if resource["resourceType"] == "Observation"
        and resource["code"]["coding"][0]["code"] in ("motion-4-end-range-session", "motion-4-end-range-week")
    ][:3]
    assert of_session["valueQuantity"]["value"] == 120.0
    assert of_session["component"][0]["valueQuantity"]["value"] == 240.0
    assert of_session["partOf"][0]["reference"] == f"urn:uuid:{visit_id}"
    assert "valueQuantity" not in not_counted and "dataAbsentReason" in not_counted
    assert of_week["component"][0]["valueQuantity"]["value"] == 720.0
    assert of_week["effectivePeriod"] == {"start": "2026-11-16", "end": "2026-11-22"}


@SQLITE_FIRST
def test_prescribed_self_pace_is_exported_and_printed(clinic: Clinic) -> None:
    lift = clinic.recording()
    with clinic.database.write() as session:
        episode = patients.get(session, clinic.patient_id).episode
        assert episode
        episode.self_paced_permitted, episode.limits_by = True, "Dr. Mori"
        wanted = ProgrammeCreate(name="Morning", made_by="Aoki", items=items(lift, self_paced=True))
        programme_id = service.create(session, clinic.patient_id, wanted, [10.0]).id
    version = clinic.newest(programme_id)
    visit_id = clinic.visit(
        MONDAY,
        version.id,
        {"recording_id": lift, "programme_position": 1, "self_paced": True, "mean_pace_percent": 61.0},
    )
    with clinic.database.read() as session:
        patient = patients.get(session, clinic.patient_id)
        resources = list(bundle.resources(session, patient, ExportSettings()))
        [item] = planned.of_session(session, visit_id).items
        visit = session_report.read_content(session, visit_id, ZoneInfo("Asia/Tokyo"))
        prescribed = rehabilitation_plan.read_content(session, episode.id, ZoneInfo("Asia/Tokyo"))
    plan = next(resource for resource in resources if resource["resourceType"] == "CarePlan")
    assert plan["activity"][0]["detail"]["description"].endswith("smooth, pace set by the patient")
    assert item.self_paced and item.runs[0].self_paced and item.runs[0].changed == []
    assert prescribed.prescriptions[0].items[0].playback_settings.self_paced
    assert text_of(rendering.session_page(visit, print_options()).html).count("pace set by the patient") >= 2


@SQLITE_FIRST
def test_a_programme_ends_with_its_episode(clinic: Clinic) -> None:
    episode_id, _ = with_end_range_times(clinic)
    with clinic.database.write() as session:
        session.get_one(EpisodeRow, episode_id).closed_at = MONDAY + 30 * DAY
    with clinic.database.read() as session:
        patient = patients.get(session, clinic.patient_id)
        plans = [
            found
            for found in bundle.resources(session, patient, ExportSettings())
            if found["resourceType"] == "CarePlan"
        ]
    # The page does not let anybody play it any more, so that it is not stated as active.
    assert [plan["status"] for plan in plans] == ["completed"]
    assert [plan["period"]["end"] for plan in plans] == [(MONDAY + 30 * DAY).isoformat()]
    assert {item["detail"]["status"] for plan in plans for item in plan["activity"]} == {"completed"}


@SQLITE_FIRST
@pytest.mark.parametrize(
    ("now", "zone", "status"),
    [
        ("2026-11-22T14:59:59Z", "Asia/Tokyo", "preliminary"),
        ("2026-11-22T15:00:00Z", "Asia/Tokyo", "final"),
        ("2026-11-22T22:59:59Z", "Europe/Berlin", "preliminary"),
        ("2026-11-22T23:00:00Z", "Europe/Berlin", "final"),
    ],
)
def test_a_week_is_preliminary_until_its_local_end(
    clinic: Clinic, monkeypatch: pytest.MonkeyPatch, now: str, zone: str, status: str
) -> None:
    with_end_range_times(clinic)
    monkeypatch.setattr(adherence, "utc_now", lambda: datetime.fromisoformat(now))
    assert _week_status(clinic, zone) == status


@SQLITE_FIRST
@pytest.mark.parametrize(
    ("now", "is_open", "preliminary"),
    [
        # An open session in a week that has not ended.
        ("2026-11-22T14:59:59Z", True, {"session": [True, False], "week": [True]}),
        ("2026-11-22T14:59:59Z", False, {"session": [False, False], "week": [True]}),
        ("2026-11-22T15:00:00Z", True, {"session": [True, False], "week": [True]}),
        ("2026-11-22T15:00:00Z", False, {"session": [False, False], "week": [False]}),
    ],
)
def test_the_table_marks_sessions_and_weeks_that_are_not_over(
    clinic: Clinic,
    monkeypatch: pytest.MonkeyPatch,
    now: str,
    is_open: bool,
    preliminary: dict[str, list[bool]],
) -> None:
    _, visit_id = with_end_range_times(clinic)
    monkeypatch.setattr(adherence, "utc_now", lambda: datetime.fromisoformat(now))
    if is_open:
        with clinic.database.write() as session:
            session.get_one(SessionRow, visit_id).ended_at = None
    with clinic.database.read() as session:
        patient = patients.get(session, clinic.patient_id)
        rows = list(patient_export._end_range_rows(session, patient, ExportSettings(zone=ZoneInfo("Asia/Tokyo"))))
    of_week = [row for row in rows if row["begins_at"][:10] in ("2026-11-16", "2026-11-17")]
    found = {kind: [row["preliminary"] for row in of_week if row["period"] == kind] for kind in preliminary}
    assert found == preliminary
    # The day of a week is the clinic's, and the time of a session is UTC.
    zones = {row["period"]: row["time_zone"] for row in rows}
    assert zones == {"session": "UTC", "week": "Asia/Tokyo"}


@SQLITE_FIRST
def test_the_week_of_an_open_session_is_preliminary(clinic: Clinic, monkeypatch: pytest.MonkeyPatch) -> None:
    _, visit_id = with_end_range_times(clinic)
    monkeypatch.setattr(adherence, "utc_now", lambda: MONDAY + 30 * DAY)
    assert _week_status(clinic, "Asia/Tokyo") == "final"
    with clinic.database.write() as session:
        session.get_one(SessionRow, visit_id).ended_at = None
    assert _week_status(clinic, "Asia/Tokyo") == "preliminary"


def _week_status(clinic: Clinic, zone: str) -> str:
    """Return the FHIR status of the first week's end-range time."""
    with clinic.database.read() as session:
        patient = patients.get(session, clinic.patient_id)
        resources = list(bundle.resources(session, patient, ExportSettings(zone=ZoneInfo(zone))))
    weeks = [
        resource
        for resource in resources
        if resource.get("effectivePeriod") == {"start": "2026-11-16", "end": "2026-11-22"}
    ]
    (status,) = [week["status"] for week in weeks]
    return str(status)


def test_the_rehabilitation_plan_has_the_weeks_of_the_clinics_zone(clinic: Clinic) -> None:
    episode_id, _ = with_end_range_times(clinic)
    with clinic.database.write() as session:
        for row in session.scalars(select(SessionRow).where(SessionRow.episode_id == episode_id)):
            # Sunday in UTC, Monday in Tokyo.
            row.started_at = datetime(2026, 11, 15, 20, tzinfo=UTC)
    with clinic.database.read() as session:
        plans = [rehabilitation_plan.read_content(session, episode_id, zone) for zone in (UTC, ZoneInfo("Asia/Tokyo"))]
    counted = [[week.begins for week in plan.episode.end_range_weeks if week.counted_s is not None] for plan in plans]
    assert counted == [[date(2026, 11, 9)], [date(2026, 11, 16)]]


def text_of(html: str) -> str:
    """Return the words of a page without its tags."""
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", html)).split())


def reached(seconds: float | None) -> list[MotionTrackingRow]:
    """Return the motions of a run with this end-range time of abduction, and another one of flexion."""
    usual = {"peak_deg": 0.0, "peak_at_s": 0.0, "rmse_deg": 0.0, "start_deg": 0.0}
    return [
        MotionTrackingRow(motion=motion, end_range_s=time_s, **usual) for motion, time_s in ((4, seconds), (5, 7.0))
    ]


@SQLITE_FIRST
def test_many_sessions_are_no_more_questions_to_the_database(clinic: Clinic) -> None:
    """Load no samples and no single runs, which would be slow with hundreds of sessions."""
    lift = clinic.recording()
    version = clinic.newest(clinic.programme(lift).id)
    with clinic.database.read() as session:
        episode = patients.get(session, clinic.patient_id).episode
    assert episode

    def questions() -> list[str]:
        asked: list[str] = []

        def count(*given: Any) -> None:
            asked.append(given[2])

        event.listen(clinic.database.reader, "before_cursor_execute", count)
        with clinic.database.read() as session:
            adherence.of_episode(session, episode.id, UTC)
        event.remove(clinic.database.reader, "before_cursor_execute", count)
        return asked

    before = questions()
    for days in range(20):
        clinic.visit(MONDAY - days * DAY, version.id, {"recording_id": lift, "programme_position": 1})
    assert questions() == before
