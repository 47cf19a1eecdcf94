"""The checklist before a recording is played."""

from datetime import UTC, date, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest

from kata.clinic.sessions import checks, identity
from kata.clinic.sessions.checklist import (
    Answer,
    CheckName,
    CheckState,
    match_answers,
    playback_fixtures,
    required_checks,
)
from kata.errors import ProblemError

NOON = datetime(2026, 11, 21, 12, 0, tzinfo=UTC)
NOTHING: dict[CheckName, datetime | None] = {"pedal": None, "estop": None}
EVERYTHING: dict[CheckName, datetime | None] = {"pedal": NOON, "estop": NOON}


def still_open(checks: tuple[CheckState, ...]) -> list[str]:
    return [check.need.check for check in checks if check.answer is None]


def answer(check: CheckName, subject: str, minutes: int = 0) -> Answer:
    return Answer(check, subject, NOON + timedelta(minutes=minutes), "Ito Mai")


IDENTIFIED = answer("identity", "birth_date+name")


@pytest.mark.parametrize(
    ("taught_with", "rotates", "fixtures"),
    [
        ((), False, ("arm_fixer_1",)),
        ((), True, ("arm_fixer_2", "elbow_fixer_2")),
        (("arm_fixer_1",), True, ("arm_fixer_1",)),
        (("arm_fixer_2", "elbow_fixer_1"), False, ("arm_fixer_2", "elbow_fixer_2")),
    ],
)
def test_fixer_follows_teaching_or_else_the_rotation(
    taught_with: tuple[str, ...], rotates: bool, fixtures: tuple[str, ...]
) -> None:
    assert playback_fixtures(taught_with, rotates=rotates) == fixtures


def test_all_checks_are_open_at_first_and_have_names() -> None:
    checks = match_answers(required_checks("left", ("arm_fixer_2", "elbow_fixer_2")), [], NOTHING)
    assert still_open(checks) == ["identity", "side", "fixtures", "belt", "pedal", "estop"]
    assert checks[1].need.sentence == "The apparatus is set to the left shoulder, and its pin is in."
    assert checks[2].need.sentence == "The arm lies in arm fixer 2 and elbow fixer 2, and all fixtures are closed."


def test_automatic_checks_cannot_be_ticked() -> None:
    ticked = [answer("pedal", ""), answer("estop", ""), answer("belt", "")]
    checks = match_answers(required_checks("left", ("arm_fixer_1",)), ticked, NOTHING)
    assert still_open(checks) == ["identity", "side", "fixtures", "pedal", "estop"]
    seen = match_answers(required_checks("left", ("arm_fixer_1",)), ticked, EVERYTHING)
    assert [(check.answer.by, check.answer.at) for check in seen[4:] if check.answer] == [("", NOON), ("", NOON)]


def test_changed_fixtures_reopen_only_their_own_check() -> None:
    given = [IDENTIFIED, answer("side", "left"), answer("fixtures", "arm_fixer_1"), answer("belt", "")]
    assert still_open(match_answers(required_checks("left", ("arm_fixer_1",)), given, EVERYTHING)) == []
    other = required_checks("left", ("arm_fixer_2", "elbow_fixer_2"))
    assert still_open(match_answers(other, given, EVERYTHING)) == ["fixtures"]
    assert still_open(match_answers(required_checks("right", ("arm_fixer_1",)), given, EVERYTHING)) == ["side"]


def test_going_back_to_the_first_fixtures_asks_once_more() -> None:
    given = [
        IDENTIFIED,
        answer("side", "left"),
        answer("belt", ""),
        answer("fixtures", "arm_fixer_1"),
        answer("fixtures", "arm_fixer_2+elbow_fixer_2", minutes=5),
    ]
    assert still_open(match_answers(required_checks("left", ("arm_fixer_1",)), given, EVERYTHING)) == ["fixtures"]


@pytest.mark.parametrize(
    ("verified_ago_min", "counts"),
    [(30, True), (10, True), (9, False), (None, False)],
)
def test_an_estop_test_counts_since_the_drives_are_verified(verified_ago_min: int | None, counts: bool) -> None:
    now = max(datetime.now(UTC), checks.today(UTC).astimezone(UTC) + timedelta(minutes=11))
    verified = None if verified_ago_min is None else now - timedelta(minutes=verified_ago_min)
    there = checks.ApparatusState("Station 1", pedal_answers=True, verified_since=verified, tested_since_verified=True)
    tested_at = now - timedelta(minutes=10)

    assert checks.estop_test(tested_at, there) == (tested_at if counts else None)
    found = checks.check_states(required_checks("left", ("arm_fixer_1",)), [], there, tested_at)
    assert ("estop" in still_open(found)) is not counts


def test_an_estop_test_of_yesterday_does_not_count() -> None:
    long_ago = datetime(2020, 1, 1, tzinfo=UTC)
    there = checks.ApparatusState("Station 1", pedal_answers=True, tested_since_verified=True, verified_since=long_ago)

    assert checks.estop_test(there.today - timedelta(seconds=1), there) is None
    assert checks.estop_test(None, there) is None


def test_today_begins_at_midnight_of_the_clinics_zone(monkeypatch: pytest.MonkeyPatch) -> None:
    """The computer of a container has UTC. In Tokyo yesterday's test would count until 9 o'clock."""
    monkeypatch.setattr(checks, "utc_now", lambda: datetime(2026, 3, 9, 23, 30, tzinfo=UTC))
    long_ago = datetime(2020, 1, 1, tzinfo=UTC)
    tokyo = ZoneInfo("Asia/Tokyo")
    there = checks.ApparatusState(
        "Station 1", pedal_answers=True, tested_since_verified=True, verified_since=long_ago, zone=tokyo
    )

    assert there.today == datetime(2026, 3, 10, tzinfo=tokyo)
    yesterday, today = datetime(2026, 3, 9, 14, 59, tzinfo=UTC), datetime(2026, 3, 9, 15, 0, tzinfo=UTC)
    assert checks.estop_test(yesterday, there) is None
    assert checks.estop_test(today, there) == today


def test_identity_is_confirmed_once_a_day_by_two_identifiers() -> None:
    there = checks.ApparatusState("Station 1", pedal_answers=True, verified_since=None, tested_since_verified=False)
    needs = required_checks("left", ("arm_fixer_1",))

    def is_open(at: datetime) -> bool:
        given = [Answer("identity", "birth_date+name", at, "Ito Mai")]
        return "identity" in still_open(checks.check_states(needs, given, there, None))

    assert not is_open(datetime.now(UTC))
    assert is_open(there.today - timedelta(seconds=1))


@pytest.mark.parametrize(
    ("compared", "code"),
    [
        ((), "two_identifiers_needed"),
        (("name",), "two_identifiers_needed"),
        (("name", "birth_date"), "identifier_unknown"),
    ],
)
def test_identifiers_that_identify_nobody_are_refused(compared: tuple[identity.Identifier, ...], code: str) -> None:
    with pytest.raises(ProblemError) as refused:
        identity.subject(compared, None)
    assert (refused.value.status, refused.value.code) == (422, code)
    assert identity.subject(("name", "birth_date"), date(1968, 4, 12)) == "birth_date+name"


def test_an_open_identity_is_refused_with_its_own_code() -> None:
    given = [answer("side", "left"), answer("fixtures", "arm_fixer_1"), answer("belt", "")]
    checked = match_answers(required_checks("left", ("arm_fixer_1",)), given, EVERYTHING)
    with pytest.raises(ProblemError) as refused:
        checks.require_all(checked)
    assert refused.value.code == "identity_not_confirmed"
    checks.require_all(match_answers(required_checks("left", ("arm_fixer_1",)), [IDENTIFIED, *given], EVERYTHING))
