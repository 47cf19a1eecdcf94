"""The live state as JSON, and how often it is sent."""

import asyncio
import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from uuid import uuid4

import msgspec
import pytest
from starlette.websockets import WebSocketDisconnect

from kata.api import live
from kata.api.live_serializer import LiveStateSerializer
from kata.device.ipc_messages import AxisState, Refusal, Snapshot
from kata.station import station as station_module
from kata.station.lease import Browser
from kata.station.schemas import DatabaseStatus
from kata.station.subscriptions import Subscription
from tests.support.silent_device import Silent, snapshot, station

_AXIS = AxisState(motor=1, setpoint_deg=0.0, measured_deg=0.0, speed_deg_s=0.0, torque_nm=0.0, torque="off", age_ms=1.0)
_IDLE = snapshot(axes=(_AXIS,))
_REFUSAL = Refusal.of(code="code", message="It is refused.", next_step="Look.")
_OF_EACH_MESSAGE = ("at", "age_ms")
_LIMIT_S = 10.0


@pytest.fixture
def silent(monkeypatch: pytest.MonkeyPatch) -> list[Silent]:
    made: list[Silent] = []

    def make(*args: Any) -> Silent:
        made.append(Silent(*args))
        return made[-1]

    monkeypatch.setattr(station_module, "DeviceProcess", make)
    return made


def test_json_of_every_state_is_complete(silent: list[Silent]) -> None:
    """Only changed fields are converted. The result must equal the whole state's JSON."""
    at = station(Path("/nowhere"))
    serializer = LiveStateSerializer(at, DatabaseStatus, lambda: False)
    watcher = Browser(uuid4(), "Emi Sato")

    def json_without_times(state: dict[str, Any]) -> dict[str, Any]:
        return {name: value for name, value in state.items() if name not in _OF_EACH_MESSAGE}

    moved = msgspec.structs.replace(_AXIS, measured_deg=1.0)
    steps: list[Snapshot | None] = [
        None,
        _IDLE,
        msgspec.structs.replace(_IDLE, t_ns=1, axes=(moved,)),
        msgspec.structs.replace(_IDLE, t_ns=2, axes=(moved,), refusals={"load": _REFUSAL}),
        msgspec.structs.replace(_IDLE, t_ns=3, mode="ready", stops=1),
        _IDLE,
    ]
    for step in steps:
        if step:
            silent[0].tell(step)
        shown = json_without_times(serializer.state(watcher))
        assert shown == json_without_times(at.live().model_dump(mode="json")), step
        assert shown["mode"] == (step.mode if step else "offline")


def _state(mode: str = "idle", *angles_deg: float | None) -> dict[str, Any]:
    return {"mode": mode, "axes": [{"measured_deg": angle} for angle in angles_deg]}


@pytest.mark.parametrize(
    ("last", "state", "at_rest"),
    [
        ({}, _state("idle", 0.0), False),
        (_state("idle", 0.0, None), _state("idle", 0.0, None), True),
        (_state("idle", 0.0, 50.0), _state("idle", 0.0, 50.09), True),
        (_state("idle", 0.0, 50.0), _state("idle", 0.0, 49.89), False),
        (_state("idle", None), _state("idle", 0.0), False),
        (_state("idle", 0.0), _state("idle", None), False),
        (_state("ready", 0.0), _state("idle", 0.0), False),
        *(
            (_state(mode, 0.0), _state(mode, 0.0), False)
            for mode in ("offline", "teaching", "ready", "paused", "stopped")
        ),
    ],
)
def test_only_idle_with_the_same_shown_angles_is_rest(
    last: dict[str, Any], state: dict[str, Any], at_rest: bool
) -> None:
    assert live._is_at_rest(last, state) is at_rest


def _put_item(subscription: Subscription) -> None:
    subscription.put(object())


@pytest.mark.parametrize(
    ("at_rest", "then", "ends", "period_s"),
    [
        (True, lambda subscription: subscription.changed.set(), True, 0.2),
        (True, _put_item, True, 0.2),
        (True, lambda subscription: None, False, 0.2),
        (False, _put_item, True, 0.1),
        (False, lambda subscription: subscription.changed.set(), False, 0.1),
    ],
    ids=["change at rest", "item at rest", "nothing at rest", "item", "change"],
)
def test_what_ends_the_wait_for_the_next_message(
    *, at_rest: bool, then: Callable[[Subscription], None], ends: bool, period_s: float
) -> None:
    subscription = Subscription()

    async def wait() -> bool:
        timers = _stopped_timers()
        waiting = asyncio.create_task(live._until_next(subscription, at_rest=at_rest))
        await asyncio.sleep(0)
        then(subscription)
        for _ in range(5):
            await asyncio.sleep(0)
        ended = waiting.done()
        assert timers == [period_s]
        waiting.cancel()
        return ended

    assert asyncio.run(wait()) is ends


def test_a_change_during_a_message_is_sent_at_once(silent: list[Silent]) -> None:
    at = station(Path("/nowhere"))
    sent: list[dict[str, Any]] = []

    async def send_text(text: str) -> None:
        sent.append(json.loads(text))
        if len(sent) == 2:
            _stopped_timers()
            silent[0].tell(msgspec.structs.replace(_IDLE, estop="pressed"))
        if len(sent) == 3:
            raise WebSocketDisconnect

    async def send_all() -> None:
        socket: Any = SimpleNamespace(send_text=send_text)
        page: Any = SimpleNamespace(browser=Browser(uuid4(), "Emi Sato"), note_sent=lambda sequence: None)
        redaction: Any = SimpleNamespace(apply=_unchanged)
        serializer = LiveStateSerializer(at, DatabaseStatus, lambda: False)
        silent[0].tell(_IDLE)
        with at.subscribed() as subscription:
            async with asyncio.timeout(_LIMIT_S):
                await live._send(socket, at.info, serializer, page, subscription, redaction)

    asyncio.run(send_all())
    assert [message["estop"] for message in sent] == ["closed", "closed", "pressed"]


async def _unchanged(state: dict[str, Any]) -> dict[str, Any]:
    return state


def _stopped_timers() -> list[float]:
    """Stop the running loop's timers from now on. Return a list that receives their periods."""
    periods: list[float] = []
    loop: Any = asyncio.get_running_loop()
    real = loop.call_later

    def call_later(period_s: float, *arguments: Any) -> Any:
        periods.append(period_s)
        return real(10 * _LIMIT_S, *arguments)

    loop.call_later = call_later
    return periods
