"""Lists are read from an index, without restricted records, also with a long history of the clinic.

SQLite explains its plan before a query. It does not know the number of rows, so the plan in this empty database is that of a full one.
"""

from base64 import urlsafe_b64encode
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from typing import Any
from uuid import UUID

import pytest
from sqlalchemy import event
from sqlalchemy.orm import Session

from kata.actor import Actor
from kata.clinic.patients import service as patients
from kata.clinic.restricted import service as restricted
from kata.clinic.sessions import lists
from kata.clinic.sessions.lists import SessionFilter
from kata.clinic.statistics import outcomes, usage, worklist
from kata.clinic.statistics.recent_days import recent_days
from kata.clinic.statistics.usage import Span
from kata.clinic.statistics.worklist import FollowedProgramme
from kata.database.engine import Database
from tests.support.databases import upgraded_file

THERAPIST = Actor(UUID(int=1), UUID(int=2), "Sato Ken", "therapist", frozenset({"Station 1"}))
HIDDEN = restricted.hidden(THERAPIST)
MAY = datetime(2019, 5, 1, tzinfo=UTC)
JUNE = datetime(2019, 6, 1, tzinfo=UTC)
ALL_PATIENTS = "SCAN patients USING COVERING INDEX ix_patients_sort_key_id"
IN_ORDER = {
    "SCAN sessions USING INDEX ix_sessions_started_at_id",
    ALL_PATIENTS,
    "SCAN patients USING INDEX ix_patients_restricted",
    "SCAN unsigned",
}
"""Permitted scans: the index of the list's order, which ends with the page, the few restricted records, and the few unsigned sessions."""


@pytest.fixture(scope="module")
def empty(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    database = Database(upgraded_file(tmp_path_factory.mktemp("plans") / "kata.db"))
    yield database
    database.close()


def looks(database: Database, find: Callable[[Session], Any]) -> list[str]:
    """Return SQLite's plan for each table of the query."""
    asked: list[tuple[str, Any]] = []
    with database.read() as session:
        engine = session.get_bind()
        event.listen(engine, "before_cursor_execute", lambda *said: asked.append((said[2], said[3])))
        find(session)
        plans = [
            session.connection().exec_driver_sql(f"EXPLAIN QUERY PLAN {sentence}", given).all()
            for sentence, given in list(asked)
            if sentence.startswith(("SELECT", "WITH"))
        ]
    steps = [str(row[3]) for plan in plans for row in plan]
    return [step for step in steps if step.startswith(("SCAN", "SEARCH")) and " anon_" not in step]


def beside_an_index(steps: list[str]) -> list[str]:
    assert steps
    return [step for step in steps if step.startswith("SCAN") and step not in IN_ORDER]


@pytest.mark.parametrize(
    "wanted",
    [
        {},
        {"since": MAY, "until": MAY},
        {"patient_id": UUID(int=3)},
        {"therapist": "Sato"},
        {"station": "Station 1"},
        {"therapist": "Sato", "station": "Station 1"},
        {"unsigned": True},
        {"unsigned": True, "stop": "estop_pressed"},
        {"stop": "estop_pressed"},
        {"stop": "estop_pressed", "therapist": "Sato"},
        {"stop": "estop_pressed", "station": "Station 1"},
    ],
    ids=str,
)
def test_sessions_are_read_off_an_index(empty: Database, wanted: dict[str, Any]) -> None:
    found = looks(empty, lambda session: lists.find(session, SessionFilter(hidden=HIDDEN, **wanted), 50, None))
    assert not beside_an_index(found)


@pytest.mark.parametrize(
    ("whose", "index"),
    [
        ({"therapist": "Sato"}, "ix_session_stops_code_therapist_started_at (code=? AND therapist=?"),
        (
            {"therapist": "Sato", "station": "Station 1"},
            "ix_session_stops_code_therapist_started_at (code=? AND therapist=?",
        ),
        ({"station": "Station 1"}, "ix_session_stops_code_station_started_at (code=? AND station=?"),
    ],
    ids=str,
)
def test_stopped_sessions_are_found_in_order_without_scanning_every_session(
    empty: Database, whose: dict[str, Any], index: str
) -> None:
    wanted = SessionFilter(hidden=HIDDEN, stop="estop_pressed", **whose)
    found = looks(empty, lambda session: lists.find(session, wanted, 50, None))
    assert any(f"SEARCH session_stops USING COVERING INDEX {index}" in step for step in found), found


@pytest.mark.parametrize("stop", [None, "estop_pressed"])
@pytest.mark.parametrize(
    "wanted",
    [
        {"therapist": "Sato"},
        {"station": "Station 1"},
        {"therapist": "Sato", "station": "Station 1"},
        {"since": MAY},
        {"until": MAY},
    ],
    ids=str,
)
@pytest.mark.parametrize("is_first", [True, False])
def test_filters_of_unsigned_sessions_read_no_signed_session(
    empty: Database, wanted: dict[str, Any], stop: str | None, is_first: bool
) -> None:
    """SQLite once read every session of the therapist or station to find the few that are not signed."""
    after = None if is_first else urlsafe_b64encode(f'["{MAY.isoformat()}","{UUID(int=3)}"]'.encode()).decode()
    chosen = SessionFilter(hidden=HIDDEN, unsigned=True, stop=stop, **wanted)
    found = looks(empty, lambda session: lists.find(session, chosen, 50, after))
    of_sessions = {step for step in found if " sessions " in step}
    assert of_sessions == {
        "SEARCH sessions USING INDEX ix_sessions_unsigned (therapist>?)",
        "SEARCH sessions USING INDEX sqlite_autoindex_sessions_1 (id=?)",
    }


@pytest.mark.parametrize("words", ["", "yamada 1968", "K-000042"])
def test_patients_are_read_from_one_index_without_row_scans(empty: Database, words: str) -> None:
    found = looks(
        empty, lambda session: patients.find(session, search=words, archived=False, limit=50, after=None, hidden=HIDDEN)
    )
    assert ALL_PATIENTS in found
    assert not beside_an_index(found)


def test_hidden_patients_are_looked_up_only_for_their_page(empty: Database) -> None:
    found = looks(empty, lambda session: restricted.hidden_among(session, THERAPIST, [UUID(int=3), UUID(int=4)]))
    assert not [step for step in found if step.startswith("SCAN")]


def test_home_page_reads_only_the_sessions_of_the_last_weeks(empty: Database) -> None:
    """SQLite once read every session of the clinic, in the order of the episodes."""
    found = looks(empty, lambda session: worklist.followed(session, recent_days(MAY, UTC)))
    of_sessions = [step for step in found if " sessions " in step]
    assert "SEARCH sessions USING COVERING INDEX ix_sessions_started_at_episode_id (started_at>?)" in of_sessions
    assert not [step for step in of_sessions if step.startswith("SCAN")]


@pytest.mark.parametrize(
    "ask",
    [
        lambda session: worklist.worklist(session, THERAPIST, recent_days(MAY, UTC)),
        lambda session: worklist.lowest_adherence(session, THERAPIST, recent_days(MAY, UTC)),
    ],
    ids=["worklist", "adherence"],
)
def test_home_page_and_adherence_scan_only_small_indexes(empty: Database, ask: Callable[[Session], Any]) -> None:
    derived = {"SCAN among", "SCAN CONSTANT ROW", "SCAN (subquery-1)"}
    found = looks(empty, ask)
    assert set(beside_an_index(found)) <= derived | {"SCAN sessions USING INDEX ix_sessions_open"}
    assert not [step for step in found if "station_versions" in step and "(station=?)" not in step]


def test_last_therapist_is_the_first_in_an_episodes_index(empty: Database) -> None:
    programme = FollowedProgramme(UUID(int=3), UUID(int=4), 2, MAY, MAY, 1, "Yamada Hanako", "K-1")
    found = looks(empty, lambda session: worklist._therapists(session, [programme]))
    assert found == [
        "SEARCH episodes USING COVERING INDEX sqlite_autoindex_episodes_1 (id=?)",
        "SEARCH sessions USING INDEX ix_sessions_episode_id_started_at (episode_id=?)",
    ]


@pytest.mark.parametrize(
    "ask",
    [
        lambda session: usage.tracking(session, Span(MAY, JUNE)),
        lambda session: usage.usage(session, Span(MAY, JUNE), "day"),
    ],
    ids=["tracking", "usage"],
)
def test_figures_read_only_the_hours_of_their_time(empty: Database, ask: Callable[[Session], Any]) -> None:
    """SQLite once read every hour of the clinic's history to find its first and its last."""
    found = [step for step in looks(empty, ask) if " station_hours " in step]
    ends = "SEARCH station_hours USING PRIMARY KEY"
    of_time = "SEARCH station_hours USING PRIMARY KEY (hour>? AND hour<?)"
    assert set(found) == {ends, of_time}


def test_outcomes_read_only_the_episodes_of_their_time(empty: Database) -> None:
    found = looks(empty, lambda session: outcomes.outcomes(session, Span(MAY, JUNE)))
    assert found == [
        "SEARCH episode_outcomes USING INDEX ix_episode_outcomes_end_at (end_at>?)",
        "SEARCH episodes USING INDEX sqlite_autoindex_episodes_1 (id=?)",
        "SEARCH stages USING COVERING INDEX ix_stages_episode_id (episode_id=?) LEFT-JOIN",
        "SEARCH programmes USING COVERING INDEX ix_programmes_episode_id (episode_id=?)",
    ]


@pytest.mark.parametrize("station", [None, "Station 1"])
def test_stops_read_only_the_stops_and_alarms_of_their_time(empty: Database, station: str | None) -> None:
    """With a station, SQLite would read all its events, of which few are alarms."""
    found = looks(empty, lambda session: usage.stops(session, Span(MAY, JUNE, station=station)))
    assert set(found) == {
        "SEARCH session_stops USING COVERING INDEX ix_session_stops_started_at (started_at>? AND started_at<?)",
        "SEARCH device_events USING INDEX ix_device_events_alarms (at>? AND at<?)",
        "SEARCH station_hours USING PRIMARY KEY (hour>? AND hour<?)",
    }
