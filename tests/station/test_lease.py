"""The lease, on a stepped clock."""

from datetime import UTC, datetime
from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.device.ipc_messages import Mode, TorqueState
from kata.station.lease import PRESENT_AFTER_SHOWN_S, AbsenceAction, Browser, ClockReading, Lease, OpenPage
from kata.station.lease_manager import ListeningPage

SATO = Browser(UUID(int=1), "Sato")
KATO = Browser(UUID(int=2), "Kato")
NOON = ClockReading(0.0, datetime(2026, 5, 1, 12, tzinfo=UTC))
TORQUE: dict[Mode, TorqueState] = {
    "offline": "off", "idle": "off", "teaching": "off", "ready": "off", "approaching": "on", "playing": "on",
    "paused": "on", "returning": "on", "stopped": "off",
}  # fmt: skip


def at(s: float) -> ClockReading:
    return NOON.later(s)


@pytest.fixture
def lease() -> Lease:
    """Return a lease that Sato took at noon, with :func:`page` open."""
    made = Lease()
    made.page_opened(SATO, NOON)
    assert made.take(SATO, NOON) is None
    return made


@pytest.fixture
def page(lease: Lease) -> OpenPage:
    (opened,) = lease._pages[SATO.id]
    return opened


def closed(lease: Lease, page: OpenPage, s: float, browser: Browser = SATO) -> None:
    """Close a page that has shown the live state until then."""
    page.shown = at(s)
    lease.page_closed(browser, page, at(s))


def due(lease: Lease, s: float, mode: Mode, torque: TorqueState | None = None) -> AbsenceAction | None:
    return lease.absence_action(at(s), mode, torque or TORQUE[mode])


# -- who operates -----------------------------------------------------------------------------------------------------


def test_first_to_command_takes_a_free_lease() -> None:
    lease = Lease()
    assert lease.live(SATO, NOON).holder is None
    assert lease.refusal(SATO) is None
    assert lease.refusal(KATO) is None

    assert lease.take(SATO, NOON) is None

    assert lease.refusal(SATO) is None
    refusal = lease.refusal(KATO)
    assert refusal is not None
    assert refusal.code == "not_operating"
    assert refusal.message == "Sato operates the apparatus from another browser."


def test_each_browser_learns_whether_the_lease_is_its_own(lease: Lease) -> None:
    mine, watched, neutral = lease.live(SATO, at(0.5)), lease.live(KATO, at(0.5)), lease.live(None, at(0.5))
    assert (mine.holder, mine.mine, mine.since, mine.unreachable_since) == ("Sato", True, NOON.at, None)
    assert (watched.holder, watched.mine) == ("Sato", False)
    assert (neutral.holder, neutral.mine) == ("Sato", False)


def test_takeover_must_be_explicit_and_both_users_are_notified(lease: Lease) -> None:
    refusal = lease.take(KATO, at(1))
    assert refusal is not None
    assert refusal.code == "not_operating"
    assert lease.holder == SATO

    assert lease.take(KATO, at(2), take_over=True) is None

    for browser, mine in ((SATO, False), (KATO, True)):
        seen = lease.live(browser, at(2))
        assert (seen.holder, seen.mine, seen.taken_from, seen.since) == ("Kato", mine, "Sato", at(2).at)
    assert lease.refusal(SATO) is not None


def test_same_person_in_another_browser_counts_as_another(lease: Lease) -> None:
    elsewhere = Browser(UUID(int=3), "Sato")
    assert lease.refusal(elsewhere) is not None
    assert lease.live(elsewhere, NOON).mine is False


def test_taking_an_own_lease_changes_nothing(lease: Lease) -> None:
    assert lease.take(SATO, at(9), take_over=True) is None
    seen = lease.live(SATO, at(9))
    assert (seen.since, seen.taken_from) == (NOON.at, None)


def test_lease_is_returned_only_without_torque_and_by_its_holder(lease: Lease) -> None:
    refusal = lease.release(SATO, "on")
    assert refusal is not None
    assert refusal.code == "torque_on"
    refusal = lease.release(KATO, "off")
    assert refusal is not None
    assert refusal.code == "not_operating"
    assert lease.holder == SATO

    assert lease.release(SATO, "off") is None
    assert lease.holder is None
    assert lease.release(SATO, "off") is None
    assert lease.take(KATO, at(1)) is None
    assert lease.live(KATO, at(1)).taken_from is None


def test_unknown_torque_keeps_the_lease(lease: Lease) -> None:
    refusal = lease.release(SATO, "unknown")

    assert refusal is not None
    assert refusal.code == "torque_unknown"
    assert lease.holder == SATO


# -- without its browser ----------------------------------------------------------------------------------------------


def test_browser_whose_page_shows_states_may_be_silent_for_hours(lease: Lease, page: OpenPage) -> None:
    page.shown = at(3 * 3600)
    assert due(lease, 3 * 3600 + 1, "playing") is None
    assert lease.live(SATO, at(3 * 3600 + 1)).unreachable_since is None


def test_open_page_whose_script_hangs_is_absent(lease: Lease, page: OpenPage) -> None:
    """The browser answers the pings of the connection by itself."""
    page.shown = at(10)
    absent_since = 10 + PRESENT_AFTER_SHOWN_S
    assert lease.shows(SATO, at(absent_since - 0.1))
    assert not lease.shows(SATO, at(absent_since))
    assert due(lease, absent_since + 1.9, "playing") is None
    assert due(lease, absent_since + 2.0, "playing") == "pause"
    assert due(lease, absent_since + 30.0, "approaching") == "stop"
    assert lease.live(KATO, at(13)).unreachable_since == at(absent_since).at
    # It shows states again.
    page.shown = at(45)
    assert due(lease, 45, "playing") is None
    # The end of a hung page is no sign of life.
    lease.page_closed(SATO, page, at(50))
    assert due(lease, 50, "playing") == "pause"


def test_page_that_lags_behind_is_absent(lease: Lease, page: OpenPage) -> None:
    """It confirms states that were sent long ago. A state counts from the time at which it was sent."""
    now_s = 10.0
    listening = ListeningPage(SATO, page, lambda: at(now_s))
    for number in range(1, 6):
        listening.note_sent(number)
        now_s += 1.0
    listening.note_shown(2)
    assert page.shown == at(11)
    assert not lease.shows(SATO, at(11 + PRESENT_AFTER_SHOWN_S))
    # A number that was never sent confirms only what was sent.
    listening.note_shown(99)
    assert page.shown == at(14)


@given(
    st.lists(st.tuples(st.floats(0.0, 40.0), st.sampled_from(["shown", "opened", "closed", "request"])), max_size=20)
)
def test_lease_never_outlives_the_last_sign_of_life(events: list[tuple[float, str]]) -> None:
    """Pages open, show states, hang and close in any order."""
    lease, s, sign_s = Lease(), 0.0, 0.0
    pages = [lease.page_opened(SATO, NOON)]
    assert lease.take(SATO, NOON) is None
    for wait_s, what in events:
        s += wait_s
        if what == "opened":
            pages.append(lease.page_opened(SATO, at(s)))
            sign_s = s
        elif what == "closed" and pages:
            closing = pages.pop()
            lease.page_closed(SATO, closing, at(s))
        elif what == "shown" and pages:
            pages[0].shown = at(s)
            sign_s = s
        elif what == "request":
            lease.note_request(SATO, at(s))
            sign_s = s
        for later_s in (0.0, 1.0, 3.1, 31.1):
            if s + later_s >= sign_s + PRESENT_AFTER_SHOWN_S + 2.0:
                assert due(lease, s + later_s, "playing") in ("pause", "stop")
            if s + later_s >= sign_s + PRESENT_AFTER_SHOWN_S + 30.0:
                assert due(lease, s + later_s, "approaching") == "stop"


def test_playback_without_browser_pauses_after_2_and_releases_after_30s(lease: Lease, page: OpenPage) -> None:
    closed(lease, page, 10)
    assert due(lease, 11.99, "playing") is None
    assert due(lease, 12.0, "playing") == "pause"
    # The pause is due until it is noted.
    assert due(lease, 12.1, "playing") == "pause"
    lease.note_pause()
    assert lease.live(KATO, at(13)).paused is True
    assert lease.live(KATO, at(13)).unreachable_since == at(10).at
    assert due(lease, 13.0, "paused") is None
    assert due(lease, 39.99, "paused") is None
    assert due(lease, 40.0, "paused") == "stop"
    # A pause that never came about does not save it.
    assert due(lease, 40.0, "playing") == "stop"
    assert due(lease, 40.0, "approaching") == "stop"
    # Held by a stop of category 2.
    assert due(lease, 40.0, "stopped", "on") == "stop"


@pytest.mark.parametrize("mode", ["idle", "offline"])
def test_unknown_torque_without_motion_is_waited_for(lease: Lease, page: OpenPage, mode: Mode) -> None:
    closed(lease, page, 10)

    assert due(lease, 40.0, mode, "unknown") is None
    assert lease.holder == SATO
    assert due(lease, 41.0, mode, "off") is None
    assert lease.holder is None


def test_unknown_torque_after_a_fault_is_stopped(lease: Lease, page: OpenPage) -> None:
    closed(lease, page, 10)

    assert due(lease, 40.0, "stopped", "unknown") == "stop"


def test_return_is_allowed_to_finish_where_the_arm_rests(lease: Lease, page: OpenPage) -> None:
    closed(lease, page, 0)
    assert due(lease, 3, "returning") is None
    assert due(lease, 60, "returning") is None
    assert lease.holder == SATO


@pytest.mark.parametrize("mode", ["idle", "teaching", "ready", "stopped", "offline"])
def test_without_torque_nothing_happens_and_the_lease_ends_after_30s(lease: Lease, page: OpenPage, mode: Mode) -> None:
    closed(lease, page, 0)
    assert due(lease, 29.9, mode) is None
    assert lease.refusal(KATO) is not None

    assert due(lease, 30.0, mode) is None
    assert lease.holder is None
    assert lease.take(KATO, at(30.1)) is None


def test_page_reloaded_within_the_grace_period_keeps_its_lease(lease: Lease, page: OpenPage) -> None:
    closed(lease, page, 10)
    reloaded = lease.page_opened(SATO, at(11))
    assert due(lease, 12, "playing") is None
    reloaded.shown = at(99.5)
    assert due(lease, 100, "playing") is None
    assert lease.live(SATO, at(100)).unreachable_since is None


def test_another_page_of_the_same_browser_keeps_the_lease(lease: Lease, page: OpenPage) -> None:
    second = lease.page_opened(SATO, at(1))
    closed(lease, page, 10)
    second.shown = at(19.5)
    assert due(lease, 20, "playing") is None
    closed(lease, second, 20)
    assert due(lease, 22, "playing") == "pause"


def test_other_watching_browsers_do_not_count(lease: Lease, page: OpenPage) -> None:
    other = lease.page_opened(KATO, NOON)
    closed(lease, page, 10)
    other.shown = at(12)
    assert due(lease, 12, "playing") == "pause"
    closed(lease, other, 12, KATO)


def test_request_keeps_a_takeover_present_for_two_seconds(lease: Lease) -> None:
    """Kato has no open page: present for two seconds after each request, then absent."""
    assert lease.take(KATO, at(10), take_over=True) is None
    assert due(lease, 13.5, "playing") is None
    lease.note_request(KATO, at(13.5))
    assert due(lease, 17.25, "playing") is None
    assert due(lease, 17.5, "playing") == "pause"
    # The former holder's open page does not count.
    page = lease.page_opened(KATO, at(49.5))
    assert due(lease, 50, "playing") is None
    closed(lease, page, 50, KATO)
    # It has had a page: from now on asking is a sign of that moment only.
    lease.note_request(KATO, at(51))
    assert due(lease, 52.9, "playing") is None
    assert due(lease, 53, "playing") == "pause"


def test_request_alone_takes_nothing_from_the_holder(lease: Lease, page: OpenPage) -> None:
    closed(lease, page, 10)
    lease.note_request(KATO, at(11.9))
    assert due(lease, 12, "playing") == "pause"


def test_pause_is_reported_until_the_holder_commands_again(lease: Lease, page: OpenPage) -> None:
    closed(lease, page, 0)
    lease.note_pause()
    lease.page_opened(SATO, at(5))
    assert lease.live(SATO, at(5)).paused is True
    lease.take(SATO, at(6))
    assert lease.live(SATO, at(6)).paused is False


def test_unattended_station_actions_are_left_alone() -> None:
    """`kata demo` and `kata evaluate` have no browser."""
    lease = Lease()
    assert due(lease, 100, "playing") is None
    lease.note_pause()
    assert lease.live(None, NOON).paused is False
