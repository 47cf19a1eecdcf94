"""The highest age of the state that a command is based on."""

from datetime import UTC, datetime, timedelta

import pytest

from kata.device.ipc_messages import Refusal
from kata.station.guard import COMMAND_VALID_S, Guard, StateClock


class Steps:
    """A monotonic clock that a test moves."""

    def __init__(self) -> None:
        self.ns = 5_000_000_000

    def __call__(self) -> int:
        return self.ns

    def forward(self, s: float) -> None:
        self.ns += round(s * 1e9)


@pytest.fixture
def steps() -> Steps:
    return Steps()


@pytest.fixture
def clock(steps: Steps) -> StateClock:
    return StateClock(steps)


def code(guard: Guard | Refusal) -> str | None:
    return guard.code if isinstance(guard, Refusal) else None


def test_a_fresh_command_expires_after_its_state(steps: Steps, clock: StateClock) -> None:
    steps.forward(100.0)
    seen_at = clock.now()
    seen_ns = steps.ns

    assert clock.guard(7, seen_at) == Guard(stops=7, expires_ns=seen_ns + round(COMMAND_VALID_S * 1e9))


def test_waiting_does_not_extend_the_expiry(steps: Steps, clock: StateClock) -> None:
    seen_at = clock.now()
    at_once = clock.guard(7, seen_at)
    steps.forward(COMMAND_VALID_S - 0.1)

    assert clock.guard(7, seen_at) == at_once


@pytest.mark.parametrize(
    ("old_s", "refused"),
    [(COMMAND_VALID_S - 0.001, None), (COMMAND_VALID_S + 0.001, "expired"), (86_400.0, "expired")],
)
def test_an_old_state_is_refused(steps: Steps, clock: StateClock, old_s: float, refused: str | None) -> None:
    seen_at = clock.now()
    steps.forward(old_s)

    assert code(clock.guard(0, seen_at)) == refused


@pytest.mark.parametrize(("ahead_s", "refused"), [(0.05, None), (0.2, "seen_in_future"), (86_400.0, "seen_in_future")])
def test_a_state_from_the_future_is_refused(clock: StateClock, ahead_s: float, refused: str | None) -> None:
    assert code(clock.guard(0, clock.now() + timedelta(seconds=ahead_s))) == refused


@pytest.mark.parametrize("seen_at", [datetime.min.replace(tzinfo=UTC), datetime.max.replace(tzinfo=UTC)])
def test_the_extreme_dates_are_refused(clock: StateClock, seen_at: datetime) -> None:
    assert code(clock.guard(0, seen_at)) in ("expired", "seen_in_future")


def test_setting_the_computers_clock_changes_nothing(
    steps: Steps, clock: StateClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Set(datetime):
        @classmethod
        def now(cls, tz: object = None) -> "Set":
            return cls(2031, 1, 1, tzinfo=UTC)

    seen_at = clock.now()
    monkeypatch.setattr("kata.station.guard.datetime", Set)
    steps.forward(1.0)

    assert clock.now() - seen_at == timedelta(seconds=1)
    assert code(clock.guard(0, seen_at)) is None
