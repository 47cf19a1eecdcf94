"""Which snapshots wake the listeners of a station. A listener that wakes ten times a second uses most of an idle service's processor time."""

from collections.abc import Iterator
from datetime import UTC, datetime
from uuid import uuid4

import msgspec
import pytest

from kata.device.ipc_messages import AxisState, Refusal, Snapshot, StopCause, StopState
from kata.station.lease import STOP_AND_END_LEASE_AFTER_S, Browser, ClockReading
from kata.station.station import Station
from kata.station.subscriptions import Subscription
from tests.support.silent_device import Silent, snapshot, station

_AXIS = AxisState(motor=1, setpoint_deg=0.0, measured_deg=0.0, speed_deg_s=0.0, torque_nm=0.0, torque="off", age_ms=1.0)
_MOVED = msgspec.structs.replace(_AXIS, measured_deg=1.0)
_IDLE = snapshot(axes=(_AXIS,), estop="closed")
_CAUSE = StopCause(code="cause", category=0, message="It stopped.", next_step="Look.", cleared=True)
_REFUSAL = Refusal.of(code="code", message="It is refused.", next_step="Look.")


@pytest.fixture
def at(silent: list[Silent]) -> Station:
    return station()


@pytest.fixture
def heard(at: Station, silent: list[Silent]) -> Iterator[Subscription]:
    """A listener that has processed the first snapshot."""
    silent[0].tell(_IDLE)
    with at.subscribed() as subscription:
        yield subscription


def test_first_snapshot_wakes(at: Station, silent: list[Silent]) -> None:
    with at.subscribed() as subscription:
        silent[0].tell(_IDLE)
        assert subscription.changed.is_set()


def test_measured_values_are_current_and_wake_no_listener(
    at: Station, silent: list[Silent], heard: Subscription
) -> None:
    before = at.version
    loop = msgspec.structs.replace(_IDLE.loop, cycles=_IDLE.loop.cycles + 10)
    silent[0].tell(msgspec.structs.replace(_IDLE, t_ns=_IDLE.t_ns + 1, axes=(_MOVED,), loop=loop))

    assert not heard.changed.is_set()
    assert at.version != before
    live = at.live()
    assert live.axes[0].measured_deg == 1.0
    assert live.loop is not None
    assert live.loop.cycles == loop.cycles


@pytest.mark.parametrize(
    "changed",
    [
        msgspec.structs.replace(_IDLE, mode="offline"),
        msgspec.structs.replace(_IDLE, torque="unknown"),
        msgspec.structs.replace(_IDLE, stops=_IDLE.stops + 1),
        msgspec.structs.replace(_IDLE, verified_since_ns=5),
        msgspec.structs.replace(_IDLE, estop="pressed"),
        msgspec.structs.replace(_IDLE, pedal="pressed"),
        msgspec.structs.replace(_IDLE, refusals={"load": _REFUSAL}),
    ],
    ids=["mode", "torque", "stops", "verified", "estop", "pedal", "refusals"],
)
def test_every_other_change_wakes_at_once(silent: list[Silent], heard: Subscription, changed: Snapshot) -> None:
    silent[0].tell(changed)
    assert heard.changed.is_set()


def test_latched_stop_wakes_with_every_snapshot(silent: list[Silent], heard: Subscription) -> None:
    """Whether the arm may be held after a stop depends on the time that has passed."""
    stopped = msgspec.structs.replace(_IDLE, mode="stopped", stop=StopState(causes=(_CAUSE,), at_ns=0))
    silent[0].tell(stopped)
    heard.changed.clear()

    silent[0].tell(msgspec.structs.replace(stopped, t_ns=stopped.t_ns + 1))
    assert heard.changed.is_set()


def test_lease_that_ends_because_its_browser_is_absent_wakes(
    at: Station, silent: list[Silent], heard: Subscription, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise the overview would name the former operator until the next report."""
    now = ClockReading(0.0, datetime.now(UTC))
    monkeypatch.setattr(at.lease_manager, "_now", lambda: now)
    at.lease_manager.take(Browser(uuid4(), "Emi Sato"))
    heard.changed.clear()

    now = ClockReading(STOP_AND_END_LEASE_AFTER_S + 3.0, now.at)
    silent[0].tell(msgspec.structs.replace(_IDLE, t_ns=1))
    assert at.lease_manager.holder is None
    assert heard.changed.is_set()


def test_item_wakes(at: Station, heard: Subscription) -> None:
    at.publish(object())
    assert heard.changed.is_set()
    assert heard.item_arrived.is_set()
