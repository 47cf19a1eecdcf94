"""The device changes its mode only by the table of transitions."""

from collections import deque

from kata.device.state_machine_base import TRANSITIONS
from tests.support.stepped import Stepped


def test_every_mode_can_be_left_and_leads_back_to_idle() -> None:
    modes = {mode for way in TRANSITIONS for mode in way}
    for mode in modes:
        reached, waiting = {mode}, deque([mode])
        while waiting:
            here = waiting.popleft()
            for start, end in TRANSITIONS:
                if start == here and end not in reached:
                    reached.add(end)
                    waiting.append(end)
        assert "idle" in reached - ({mode} if mode != "idle" else set())


def test_every_active_mode_can_be_stopped() -> None:
    modes = {mode for way in TRANSITIONS for mode in way} - {"stopped"}
    assert {start for start, end in TRANSITIONS if end == "stopped"} == modes


def test_torque_only_comes_on_on_the_way_to_approaching(playing: Stepped) -> None:
    modes = [event.message for event in playing.link.events if event.code in ("mode", "torque")]
    assert modes == ["idle", "ready", "Torque is on.", "approaching", "paused", "playing"]
