"""Live state and allowed commands while torque is on, off or unknown."""

import asyncio
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Literal, get_args
from uuid import uuid4

import pytest

from kata.device.ipc_messages import (
    Approach,
    AxisState,
    Mode,
    Refusal,
    Snapshot,
    StopCause,
    StopState,
    TorqueState,
)
from kata.motion.axes import OPPOSITE
from kata.station.lease import Browser
from kata.station.schemas import Live
from kata.station.station import Station
from tests.support.silent_device import Silent, snapshot, station

AXES = tuple(
    AxisState(motor=n, setpoint_deg=0.0, measured_deg=0.0, speed_deg_s=0.0, torque_nm=0.0, torque="off", age_ms=1.0)
    for n in range(1, 6)
)


def stopped(category: Literal[0, 1, 2], torque: TorqueState, *, t_ms: int = 0, **given: Any) -> Snapshot:
    cause = StopCause(code="cause", category=category, message="It stopped.", next_step="Look.", cleared=True)
    state = StopState(causes=(cause,), at_ns=0)
    return snapshot(mode="stopped", torque=torque, stop=state, t_ns=t_ms * 1_000_000, **given)


def held(at: Station) -> bool:
    stop = at.live().stop
    assert stop is not None
    return stop.arm_held


# -- the shown state ------------------------------------------------------------------------------------------------------


def test_torque_is_unknown_before_the_first_snapshot(silent: list[Silent]) -> None:
    at = station()

    assert at.live().torque == "unknown"
    assert at.torque == "unknown"


def test_live_state_is_built_once_for_each_snapshot(silent: list[Silent]) -> None:
    """Five tasks read every snapshot. Time, age and lease are those of the moment of reading."""
    at = station()
    silent[0].tell(snapshot(axes=AXES, estop="released"))
    first, second = at.live(), at.live()
    assert first.axes is second.axes
    assert first.at < second.at
    assert first.age_ms is not None and second.age_ms is not None and first.age_ms < second.age_ms

    at.lease_manager.take(Browser(uuid4(), "Emi Sato"))
    assert at.live().lease.holder == "Emi Sato"
    silent[0].tell(snapshot(axes=AXES, estop="pressed"))
    assert (first.estop, at.live().estop) == ("released", "pressed")


def test_torque_is_unknown_without_a_device_process(silent: list[Silent]) -> None:
    at = station()
    silent[0].tell(snapshot(axes=AXES))
    assert {axis.torque for axis in at.live().axes} == {"off"}

    silent[0].running = False

    live = at.live()
    assert (live.torque, live.stops, live.verified_since) == ("unknown", 0, None)
    assert [axis.torque for axis in live.axes] == ["unknown"] * 5


@pytest.mark.parametrize("torque", get_args(TorqueState))
def test_the_devices_torque_is_shown(silent: list[Silent], torque: TorqueState) -> None:
    at = station()
    silent[0].tell(snapshot(torque=torque))

    assert at.live().torque == torque
    assert at.torque == torque


def test_a_command_on_its_way_makes_torque_unknown(silent: list[Silent]) -> None:
    at = station()
    silent[0].tell(snapshot(mode="ready"))

    asyncio.run(at.command(Approach(stops=0, expires_ns=time.monotonic_ns() + 10**9)))

    assert at.torque == "unknown"


def test_every_state_carries_its_time_and_stops(silent: list[Silent]) -> None:
    at = station()
    silent[0].tell(snapshot(stops=7))
    first: Live = at.live()
    second: Live = at.live()

    assert first.stops == 7
    assert first.at < second.at


def test_verification_keeps_its_time_until_it_changes(silent: list[Silent]) -> None:
    at = station()
    since_ns = time.monotonic_ns() - 60_000_000_000
    silent[0].tell(snapshot(verified_since_ns=since_ns))
    verified_since = at.live().verified_since
    assert verified_since is not None
    assert abs(datetime.now(UTC) - timedelta(seconds=60) - verified_since) < timedelta(seconds=5)

    silent[0].tell(snapshot(verified_since_ns=since_ns))
    assert at.live().verified_since == verified_since

    silent[0].tell(snapshot(verified_since_ns=since_ns + 1_000_000_000))
    later = at.live().verified_since
    assert later is not None
    assert later > verified_since
    silent[0].tell(snapshot(verified_since_ns=None))
    assert at.live().verified_since is None


# -- whether an arm is held ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("torque", "holds"), [("on", True), ("unknown", True), ("off", False)])
def test_a_stop_of_category_2_holds_until_torque_is_off(silent: list[Silent], torque: TorqueState, holds: bool) -> None:
    at = station()
    silent[0].tell(stopped(2, torque))

    assert held(at) is holds


@pytest.mark.parametrize("category", [0, 1])
def test_unknown_torque_after_a_stop_may_hold(silent: list[Silent], category: Literal[0, 1]) -> None:
    at = station()
    silent[0].tell(stopped(category, "unknown"))

    assert held(at)


def test_an_arm_that_slows_down_is_not_held(silent: list[Silent]) -> None:
    at = station()
    slowing = {"acknowledge": Refusal(code="still_stopping", message="", next_step="")}
    for t_ms in range(0, 2000, 100):
        silent[0].tell(stopped(1, "on", t_ms=t_ms, refusals=slowing))
        assert not held(at)


def test_torque_that_remains_after_a_stop_holds(silent: list[Silent]) -> None:
    at = station()
    shown = []
    for t_ms in (0, 100, 400, 500, 600):
        silent[0].tell(stopped(0, "on", t_ms=t_ms))
        shown.append(held(at))

    assert shown == [False, False, False, True, True]


# -- what depends on it -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mode", "torque", "occupied"),
    [
        ("idle", "off", False),
        ("playing", "on", True),
        ("idle", "unknown", True),
        ("stopped", "unknown", True),
        ("offline", "unknown", False),
        ("offline", "on", True),
    ],
)
def test_an_arm_under_torque_occupies_the_computer(
    silent: list[Silent], mode: Mode, torque: TorqueState, occupied: bool
) -> None:
    at = station()
    silent[0].tell(snapshot(mode=mode, torque=torque))

    assert at.occupied is occupied


@pytest.mark.parametrize(("torque", "operator_under_torque"), [("off", False), ("on", True), ("unknown", True)])
def test_operator_counts_as_present_while_torque_is_possible(
    silent: list[Silent], torque: TorqueState, operator_under_torque: bool
) -> None:
    at, browser = station(), Browser(uuid4(), "Sato")
    silent[0].tell(snapshot(mode="paused", torque=torque))
    assert at.operator_under_torque is None, "there is no operator"
    at.lease_manager.take(browser)

    assert at.operator_under_torque == (browser.id if operator_under_torque else None)


@pytest.mark.parametrize(
    ("mode", "torque", "refused"),
    [
        ("idle", "off", None),
        ("offline", "unknown", None),
        ("idle", "unknown", "torque_not_off"),
        ("idle", "on", "torque_not_off"),
        ("offline", "on", "torque_not_off"),
        ("stopped", "unknown", "not_idle"),
        ("ready", "off", "not_idle"),
    ],
)
def test_turning_waits_until_no_arm_is_held(
    silent: list[Silent], tmp_path: Path, mode: Mode, torque: TorqueState, refused: str | None
) -> None:
    at = station(tmp_path)
    silent[0].tell(snapshot(mode=mode, torque=torque))

    assert turned(at, silent[0]) == refused
    assert silent[0].starts == (refused is None)


def test_turning_waits_for_the_device_process(
    silent: list[Silent], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kata.station.station._SNAPSHOT_LIMIT_S", 0.05)
    at = station(tmp_path)

    assert turned(at, silent[0]) == "device_offline"
    assert silent[0].starts == 0


def turned(at: Station, device: Silent) -> str | None:
    other = OPPOSITE[at.config.side]

    async def nothing() -> None: ...

    refusal = device.during(at.set_side(other, nothing))
    return refusal.code if refusal else None
