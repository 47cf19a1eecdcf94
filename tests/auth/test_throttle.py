"""The throttle of failed attempts: it slows down guessing and lets a waiting user in."""

import pytest

from kata.auth.throttle import ADDRESS_POLICY, USERNAME_POLICY, BackoffPolicy, Throttle
from kata.errors import ProblemError


class Clock:
    """A clock that only the test moves."""

    def __init__(self) -> None:
        self.s = 1000.0

    def __call__(self) -> float:
        return self.s


def let_through(
    throttle: Throttle, clock: Clock, *keys: tuple[str, BackoffPolicy], tries: int, minutes: float = 1.0
) -> int:
    """Return how many of ``tries`` attempts are checked, at equal intervals."""
    through = 0
    for _ in range(tries):
        clock.s += 60.0 * minutes / tries
        try:
            throttle.begin(*keys)
        except ProblemError:
            pass
        else:
            through += 1
    return through


def test_throttle_checks_six_of_a_thousand_tries_per_minute() -> None:
    clock = Clock()
    throttle = Throttle(clock)
    # Five attempts are free; the sixth is checked half a minute later.
    assert let_through(throttle, clock, ("name sato", USERNAME_POLICY), tries=1000) == 6


def test_throttled_client_gets_its_waiting_time() -> None:
    throttle = Throttle(Clock())
    for _ in range(5):
        throttle.begin(("name sato", USERNAME_POLICY))
    with pytest.raises(ProblemError) as refused:
        throttle.begin(("name sato", USERNAME_POLICY))
    assert (refused.value.status, refused.value.code) == (429, "too_many_tries")
    assert refused.value.headers == {"Retry-After": "30"}


def test_each_wait_doubles_up_to_a_quarter_of_an_hour() -> None:
    clock = Clock()
    throttle = Throttle(clock)
    let_through(throttle, clock, ("name sato", USERNAME_POLICY), tries=5)
    waits = []
    for _ in range(8):
        began_s = clock.s
        while not let_through(throttle, clock, ("name sato", USERNAME_POLICY), tries=1, minutes=1 / 60):
            pass
        waits.append(clock.s - began_s)
    assert waits == pytest.approx([30, 60, 120, 240, 480, 900, 900, 900], abs=15)


def test_many_names_from_one_address_are_let_through_slowly() -> None:
    clock = Clock()
    throttle = Throttle(clock)
    through = 0
    for number in range(1000):
        keys = ((f"name {number}", USERNAME_POLICY), ("address 10.0.0.9", ADDRESS_POLICY))
        through += let_through(throttle, clock, *keys, tries=1, minutes=1 / 1000)
    assert through <= 33
    # Given: another user at another browser.
    throttle.begin(("name sato", USERNAME_POLICY), ("address 10.0.0.7", ADDRESS_POLICY))


def test_attempt_refused_by_one_limit_is_not_counted_by_another() -> None:
    clock = Clock()
    throttle = Throttle(clock)
    let_through(throttle, clock, ("name sato", USERNAME_POLICY), tries=5, minutes=0.01)
    both = (("name sato", USERNAME_POLICY), ("address 10.0.0.9", ADDRESS_POLICY))
    assert let_through(throttle, clock, *both, tries=200, minutes=0.1) == 0
    throttle.begin(("address 10.0.0.9", ADDRESS_POLICY))


def test_success_clears_earlier_failures() -> None:
    clock = Clock()
    throttle = Throttle(clock)
    for _ in range(10):
        assert let_through(throttle, clock, ("name sato", USERNAME_POLICY), tries=4, minutes=0.01) == 4
        throttle.succeeded("name sato")


def test_a_try_that_was_no_failure_does_not_count() -> None:
    clock = Clock()
    throttle = Throttle(clock)
    for _ in range(100):
        throttle.begin(("address 10.0.0.9", ADDRESS_POLICY))
        throttle.undo_attempt("address 10.0.0.9")


def test_invented_names_fill_no_memory() -> None:
    throttle = Throttle(Clock())
    for number in range(20_000):
        throttle.begin((f"name {number}", USERNAME_POLICY))
    assert len(throttle._attempts) <= 10_000
