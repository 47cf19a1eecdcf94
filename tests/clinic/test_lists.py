"""Lists of patients, sessions, recordings and accesses: search, filters and pages, on SQLite and PostgreSQL."""

from base64 import urlsafe_b64encode
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, date, datetime, timedelta
from threading import Barrier
from uuid import UUID, uuid4

import pytest
from alembic import command
from alembic.config import Config
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import event, select

from kata.auth import accounts
from kata.clinic.episodes import service as episodes
from kata.clinic.episodes.schemas import EpisodeCreate
from kata.clinic.patients import search, service
from kata.clinic.patients.schemas import PatientCreate, PatientUpdate
from kata.clinic.patients.sorting import sort_key
from kata.clinic.patients.tables import PatientRow
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow, TeachingRow
from kata.clinic.restricted import service as restricted
from kata.clinic.restricted.tables import BreakGlassAccessRow
from kata.clinic.sessions import lists
from kata.clinic.sessions.lists import SessionFilter
from kata.clinic.sessions.tables import SessionRow, SessionStopRow
from kata.database.engine import Database
from kata.database.upgrade import migrations
from kata.errors import ProblemError
from tests.support.databases import SQLITE_FIRST

MONDAY = datetime(2026, 11, 16, 9, tzinfo=UTC)


def sign_up(database: Database, number: str, name: str = "Yamada Hanako", **given: object) -> UUID:
    with database.write() as session:
        wanted = PatientCreate.model_validate({"clinic_number": number, "name": name, "affected_side": "left", **given})
        return service.create(session, wanted).id


def found(database: Database, words: str = "", *, archived: bool = False) -> list[str]:
    """Return the clinic numbers of all matching patients in order, fetched two at a time."""
    numbers: list[str] = []
    after: str | None = None
    while True:
        with database.read() as session:
            rows, after = service.find(session, search=words, archived=archived, limit=2, after=after)
            numbers += [row.clinic_number for row in rows]
        if after is None:
            return numbers


# -- patients -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "words",
    ["satō", "sato", "KEN sat", "サトウ", "さとう", "ｻﾄｳ", "さとうけん", "さとう　けん", "Ａ－１７", "a-17", "1968", "1968-04",
     "1968-04-12", "1968/4/12", "1968年4月12日", "1968年4月", "ken 1968 a-",
     # In kana mode a Japanese keyboard writes the long vowel or a minus instead of a hyphen.
     "Ａー１７", "aｰ17", "A−17", "１９６８ー０４", "１９６８−４−１２", "１９６８年４月", "さとう　１９６８ー４"],
)  # fmt: skip
def test_patient_is_found_by_words_in_any_spelling(database: Database, words: str) -> None:
    sign_up(database, "A-17", "Satō Ken", kana="サトウ ケン", birth_date="1968-04-12")
    sign_up(database, "B-2", "Ito Mai", kana="イトウ マイ", birth_date="1986-12-04")
    assert found(database, words) == ["A-17"]


@SQLITE_FIRST
def test_patients_from_before_the_search_are_found_as_well(database: Database) -> None:
    sign_up(database, "A-17", "Satō Ken", kana="サトウ ケン", birth_date="1968-04-12")
    with database.read() as session:
        text = service.find(session, search="", archived=False, limit=1, after=None)[0][0].search_text
    config = Config()
    config.set_main_option("script_location", str(migrations()))
    with database.writer.connect() as connection:
        config.attributes["connection"] = connection
        command.downgrade(config, "0004")
        connection.rollback()
        command.upgrade(config, "head")
    with database.read() as session:
        assert (
            service.find(session, search="さとう 1968", archived=False, limit=1, after=None)[0][0].search_text == text
        )


@SQLITE_FIRST
@pytest.mark.parametrize("words", ["sato mai", "1968-05", "%", "_", "/", "\\", "サトウ イトウ"])
def test_unmatched_search_words_find_no_patient(database: Database, words: str) -> None:
    sign_up(database, "A17", "Satō Ken", kana="サトウ ケン", birth_date="1968-04-12")
    sign_up(database, "B2", "Ito Mai", kana="イトウ マイ", birth_date="1986-12-04")
    assert found(database, words) == []


@pytest.mark.parametrize("number", ["A-17", " A-17 ", "Ａ－１７", "Ａー１７"])
def test_hidden_record_is_found_by_whole_number_in_any_width(database: Database, number: str) -> None:
    sign_up(database, "A-17", "Satō Ken")
    sign_up(database, "A-18", "Ito Mai")
    with database.read() as session:
        everybody = select(PatientRow.id)
        rows, _ = service.find(session, search=number, archived=False, limit=9, after=None, hidden=everybody)
        assert [row.clinic_number for row in rows] == ["A-17"]


@SQLITE_FIRST
def test_voiced_kana_is_a_different_letter(database: Database) -> None:
    sign_up(database, "1", "N", kana="カトウ")
    sign_up(database, "2", "N", kana="ガトウ")
    assert found(database, "かとう") == ["1"]
    assert found(database, "ｶﾞﾄｳ") == ["2"]


def test_changed_record_is_found_by_its_new_values(database: Database) -> None:
    key = sign_up(database, "1", "Ito Mai", birth_date="1968-04-12")
    with database.write() as session:
        service.update(session, key, PatientUpdate(name="Abe Mai", birth_date=None))
    assert found(database, "abe") == ["1"]
    assert found(database, "ito") == found(database, "1968") == []


def test_patients_come_in_the_order_of_their_names_each_once(database: Database) -> None:
    for number, name in enumerate(["Ito", "Abe", "Ito", "Ito", "Ueda", "Ito", "Abe"]):
        sign_up(database, str(number), name)
    with database.write() as session:
        row = next(iter(service.find(session, search="ueda", archived=False, limit=1, after=None)[0]))
        service.update(session, row.id, PatientUpdate(archived=True))
    numbers = found(database)
    assert sorted(numbers) == ["0", "1", "2", "3", "5", "6"]
    assert set(numbers[:2]) == {"1", "6"}
    assert found(database, archived=True) == ["4"]


def test_patients_come_in_the_order_of_their_readings(database: Database) -> None:
    for number, (name, kana) in enumerate(
        [("山田 花子", "ヤマダ ハナコ"), ("林 葵", "ハヤシ アオイ"), ("森田 葵", "モリタ アオイ"), ("森 蓮", "もり れん"),
         ("Sato Ken", "サトウ ケン"), ("abe Mai", None), ("阿部 健", "アベ ケン"), ("Ōta Jun", "オオタ ジュン")]
    ):  # fmt: skip
        sign_up(database, str(number), name, kana=kana)
    assert found(database) == ["5", "7", "4", "6", "1", "3", "2", "0"]
    with database.write() as session:
        [row] = service.find(session, search="阿部", archived=False, limit=1, after=None)[0]
        service.update(session, row.id, PatientUpdate(kana="ワベ ケン"))
    assert found(database)[-1] == "6"


@pytest.mark.parametrize(
    "readings",
    [
        # Voiced kana count first as the plain ones, and only then differ.
        ["カイ", "ガイ", "かき", "カギ", "がき", "ガギ"],
        ["キョウ", "きよう", "きょうこ"],
        ["オオタ", "オータカ", "オオタキ"],
        ["ハラ", "ばらい", "ﾊﾟﾗｳ"],
        ["ヴァン", "うい"],
    ],
    ids=str,
)
def test_readings_sort_in_the_order_of_the_kana(readings: list[str]) -> None:
    keys = [sort_key("名", reading) for reading in readings]
    assert keys == sorted(set(keys))


@SQLITE_FIRST
def test_new_patient_moves_no_one_between_pages(database: Database) -> None:
    for number, name in enumerate(["B", "D", "F", "H"]):
        sign_up(database, str(number), name)
    with database.read() as session:
        first, after = service.find(session, search="", archived=False, limit=2, after=None)
    sign_up(database, "new", "A")
    with database.read() as session:
        second, end = service.find(session, search="", archived=False, limit=2, after=after)
    assert [row.name for row in (*first, *second)] == ["B", "D", "F", "H"]
    assert end is None


def test_recordings_are_paged_newest_first_archived_ones_last(database: Database) -> None:
    patient_id = sign_up(database, "1")
    with database.write() as session:
        teaching = TeachingRow(id=uuid4(), patient_id=patient_id, name="Lift", side="left", started_at=MONDAY)
        session.add(teaching)
        session.flush()
        for hours, take, archived in ((0, 1, False), (1, 2, False), (1, 3, False), (2, None, True), (1, None, False)):
            row = RecordingRow(
                id=uuid4(), patient_id=patient_id, teaching_id=teaching.id if take else None, take=take, name="Lift",
                side="left", station="Station 1", taught_at=MONDAY + timedelta(hours=hours), duration_s=1.0, rate_hz=100,
                samples=0, note="", archived_at=MONDAY if archived else None,
            )  # fmt: skip
            session.add(row)
    seen, after, pages = [], None, 0
    while pages == 0 or after:
        with database.read() as session:
            rows, after = recordings.of_patient(session, patient_id, 2, after)
            seen += [(row.taught_at.hour, row.take, row.archived_at is not None) for row in rows]
        pages += 1
    assert pages == 3
    assert seen == [(10, 3, False), (10, 2, False), (10, None, False), (9, 1, False), (11, None, True)]


def test_break_glass_accesses_are_paged_unreviewed_ones_first(database: Database) -> None:
    patient_id = sign_up(database, "1")
    with database.write() as session:
        account = accounts.create(session, "sato", "Sato Ken", "therapist", [], MONDAY)
        session.flush()
        for hours, reviewed in ((0, False), (1, True), (2, False), (3, True), (4, True)):
            at = MONDAY + timedelta(hours=hours)
            row = BreakGlassAccessRow(
                id=uuid4(), patient_id=patient_id, account_id=account.id, reason="Acute pain", at=at, until=at,
                reviewed_at=at if reviewed else None,
            )  # fmt: skip
            session.add(row)
    seen, after, pages = [], None, 0
    while pages == 0 or after:
        with database.read() as session:
            items, after = restricted.break_glass_accesses(session, 2, after)
            seen += [(item.at.hour, item.reviewed_at is not None, item.name) for item in items]
        pages += 1
    assert pages == 3
    assert [entry[:2] for entry in seen] == [(11, False), (9, False), (13, True), (12, True), (10, True)]
    assert {entry[2] for entry in seen} == {"Sato Ken"}


@SQLITE_FIRST
@pytest.mark.parametrize(
    "cursor",
    ["", "x", "%%%%", urlsafe_b64encode(b"[]").decode(), urlsafe_b64encode(b'["a", "b"]').decode(),
     urlsafe_b64encode(b'["a\\u0000", "00000000-0000-0000-0000-000000000000"]').decode(), "ÿ"],
)  # fmt: skip
def test_a_damaged_cursor_is_refused(database: Database, cursor: str) -> None:
    with database.read() as session, pytest.raises(ProblemError) as refused:
        service.find(session, search="", archived=False, limit=2, after=cursor)
    assert (refused.value.status, refused.value.code) == (422, "damaged_cursor")


@given(st.text(max_size=100), st.text(max_size=100), st.text(min_size=1, max_size=32), st.dates())
def test_every_field_of_a_record_finds_it(name: str, kana: str, number: str, born: date) -> None:
    text = search.text_of(name, kana, number, born)
    assert len(text) <= search.MAX_SEARCH_LETTERS
    if len(text) < search.MAX_SEARCH_LETTERS:
        assert born.isoformat() in text
        for forms in (*search.words_of(name), *search.words_of(kana), *search.words_of(number)):
            assert any(form in text for form in forms)


def test_second_patient_with_the_same_number_is_refused(database: Database) -> None:
    outcomes = _at_once(lambda: sign_up(database, "K-1"))
    assert sorted(outcomes) == ["done", "number_taken"]


def test_second_open_episode_of_the_same_shoulder_is_refused(database: Database) -> None:
    key = sign_up(database, "K-1")

    def open_right() -> None:
        with database.write() as session:
            episodes.open_new(session, key, EpisodeCreate(side="right"))

    assert sorted(_at_once(open_right)) == ["done", "episode_open"]


def test_second_change_of_the_same_version_is_refused(database: Database) -> None:
    key = sign_up(database, "K-1")
    with database.read() as session:
        seen = service.get(session, key).updated_at

    def change() -> None:
        with database.write() as session:
            service.update(session, key, PatientUpdate(notes="Mine", updated_at=seen))

    assert sorted(_at_once(change)) == ["done", "edited_meanwhile"]


def _at_once(do: Callable[[], object]) -> list[str]:
    """Run it in two threads at once, and return both results."""
    both = Barrier(2, timeout=20)

    def one(_: int) -> str:
        both.wait()
        try:
            do()
        except ProblemError as error:
            return error.code
        return "done"

    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(one, range(2)))


# -- sessions -------------------------------------------------------------------------------------------------------


def visit(
    database: Database, patient_id: UUID, hour: int, therapist: str = "", station: str = "", stops: tuple[str, ...] = ()
) -> UUID:
    began = MONDAY + timedelta(hours=hour)
    with database.write() as session:
        row = SessionRow(
            id=uuid4(), patient_id=patient_id, started_at=began, note="", therapist=therapist, station=station,
            run_count=4, stop_count=len(stops),
        )  # fmt: skip
        session.add(row)
        session.flush()
        common = {"started_at": began, "therapist": therapist, "station": station}
        session.add_all([SessionStopRow(session_id=row.id, code=code, **common) for code in stops])
        return row.id


def listed(database: Database, **wanted: object) -> list[UUID]:
    """Return all matching sessions, newest first, fetched two at a time."""
    keys: list[UUID] = []
    after: str | None = None
    while True:
        with database.read() as session:
            items, after = lists.find(session, SessionFilter(**wanted), 2, after)  # type: ignore[arg-type]
            keys += [item.id for item in items]
        if after is None:
            return keys


def test_sessions_are_found_by_everything_the_page_offers(database: Database) -> None:
    one, other = sign_up(database, "1"), sign_up(database, "2")
    a = visit(database, one, 0, "Sato", "Station 1", ("estop_pressed",))
    b = visit(database, other, 1, "Sato", "Station 2", ("estop_pressed", "drive_silent"))
    c = visit(database, one, 2, "Ito", "Station 1")
    d = visit(database, other, 3, "Sato", "Station 1", ("drive_silent",))
    e = visit(database, one, 4)

    assert listed(database) == [e, d, c, b, a]
    assert listed(database, patient_id=one) == [e, c, a]
    assert listed(database, therapist="Sato") == [d, b, a]
    assert listed(database, station="Station 1") == [d, c, a]
    assert listed(database, stop="estop_pressed") == [b, a]
    assert listed(database, therapist="Sato", station="Station 1") == [d, a]
    assert listed(database, stop="drive_silent", station="Station 1") == [d]
    assert listed(database, stop="estop_pressed", therapist="Sato", patient_id=one) == [a]
    assert listed(database, therapist="Nobody") == []
    since, until = MONDAY + timedelta(hours=1), MONDAY + timedelta(hours=3)
    assert listed(database, since=since, until=until) == [c, b]
    assert listed(database, since=since, therapist="Sato") == [d, b]
    assert listed(database, until=until, stop="estop_pressed") == [b, a]


def test_unsigned_sessions_are_found_after_their_end(database: Database) -> None:
    patient = sign_up(database, "1")
    open_one, signed, unsigned, stopped = (
        visit(database, patient, 0), visit(database, patient, 1), visit(database, patient, 2, "Sato"),
        visit(database, patient, 3, stops=("estop_pressed",)),
    )  # fmt: skip
    with database.write() as session:
        for row in session.scalars(select(SessionRow).where(SessionRow.id != open_one)):
            row.ended_at = row.started_at + timedelta(minutes=30)
        session.get_one(SessionRow, signed).signed_at = MONDAY
    assert listed(database, unsigned=True) == [stopped, unsigned]
    assert listed(database, unsigned=True, therapist="Sato") == [unsigned]
    assert listed(database, unsigned=True, stop="estop_pressed") == [stopped]


@SQLITE_FIRST
def test_page_of_patients_loads_episodes_in_one_query(database: Database) -> None:
    both = sign_up(database, "K-1")
    with database.write() as session:
        second = episodes.open_new(session, both, EpisodeCreate(side="right")).id
    sign_up(database, "K-2")
    asked: list[str] = []
    event.listen(database.reader, "before_cursor_execute", lambda *args: asked.append(args[2]))
    with database.read() as session:
        rows, after = service.find(session, search="", archived=False, limit=2, after=None)
        seen_patients = [(row.clinic_number, len(row.episodes), row.episode_id == second) for row in rows]
    assert (sorted(seen_patients), after) == ([("K-1", 2, True), ("K-2", 1, False)], None)
    assert len([sentence for sentence in asked if sentence.startswith("SELECT")]) == 1


def test_simultaneous_sessions_are_listed_once_each(database: Database) -> None:
    patient = sign_up(database, "1")
    keys = {visit(database, patient, 0, stops=("estop_pressed",)) for _ in range(5)}
    for wanted in ({}, {"stop": "estop_pressed"}, {"patient_id": patient}):
        keys_found = listed(database, **wanted)
        assert len(keys_found) == 5
        assert set(keys_found) == keys


@SQLITE_FIRST
def test_session_list_loads_its_rows_in_one_query(database: Database) -> None:
    patient = sign_up(database, "K-1", "Satō Ken")
    for hour in range(5):
        visit(database, patient, hour, "Sato", "Station 1", ("estop_pressed",))
    asked: list[str] = []
    event.listen(database.reader, "before_cursor_execute", lambda *args: asked.append(args[2]))
    with database.read() as session:
        items, _ = lists.find(session, SessionFilter(), 50, None)
    assert len([sentence for sentence in asked if sentence.startswith("SELECT")]) == 1
    newest = items[0]
    assert (newest.patient.name, newest.patient.clinic_number) == ("Satō Ken", "K-1")
    assert (newest.therapist, newest.station, newest.runs, newest.stops) == ("Sato", "Station 1", 4, 1)
    assert newest.ended_at is newest.signed_at is None


def test_filter_options_match_the_existing_sessions(database: Database) -> None:
    patient = sign_up(database, "1")
    with database.read() as session:
        assert lists.filter_options(session) == lists.SessionFilterOptions(therapists=[], stations=[], stops=[])
    for hour, (therapist, station) in enumerate([("Sato", "S 2"), ("Ito", "S 1"), ("", ""), ("Sato", "S 2")]):
        visit(database, patient, hour, therapist, station, ("estop_pressed", "drive_silent"))
    with database.read() as session:
        options = lists.filter_options(session)
    assert options == lists.SessionFilterOptions(
        therapists=["Ito", "Sato"], stations=["S 1", "S 2"], stops=["drive_silent", "estop_pressed"]
    )
