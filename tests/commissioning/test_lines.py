"""``kata commission --lines``: the procedure for a program."""

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.cli import commission_lines
from kata.cli.commission_lines import LineTechnician
from kata.commissioning import texts
from kata.commissioning.workbench import ManualAction, StepError
from kata.device import texts as device_texts
from kata.evaluation.factory_new import FactoryNewApparatus, SimulatedTechnician

PRESS = ManualAction("press_estop", texts.PRESS_ESTOP(), seen=True)
CLEAR = ManualAction("stand_clear", texts.STAND_CLEAR())


@dataclass
class Lines:
    """A technician and the other end of its input."""

    technician: LineTechnician
    keyboard: int

    def type(self, message: dict[str, Any]) -> None:
        os.write(self.keyboard, json.dumps(message).encode() + b"\n")


@pytest.fixture
def lines() -> Iterator[Lines]:
    ours, theirs = os.pipe()
    yield Lines(LineTechnician(ours), theirs)
    os.close(ours)


def sent(capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def test_an_instruction_waits_for_its_own_confirmation(lines: Lines, capsys: pytest.CaptureFixture[str]) -> None:
    lines.technician.instruct(CLEAR)
    (message,) = sent(capsys)
    assert (message["number"], message["kind"], message["press"], message["seen"]) == (1, "stand_clear", True, False)
    assert message["text_key"]["code"] == "stand_clear"
    assert not lines.technician.has_confirmed()
    lines.type({"confirm": 7})
    assert not lines.technician.has_confirmed()
    lines.type({"confirm": 1})
    assert lines.technician.has_confirmed()
    lines.technician.instruct(PRESS)
    assert sent(capsys)[-1]["press"] is False, "the drives show it"
    assert not lines.technician.has_confirmed(), "the former confirmation counts once"


def test_a_stop_ends_the_next_wait(lines: Lines) -> None:
    slept: list[float] = []
    sleep = lines.technician.stoppable(slept.append)
    sleep(0.01)
    lines.type({"stop": True})
    with pytest.raises(StepError) as stopped:
        sleep(0.01)
    assert stopped.value.fault == texts.TECHNICIAN_STOPPED()
    assert slept == [0.01]


def test_the_end_of_the_service_is_a_stop(lines: Lines) -> None:
    os.close(lines.keyboard)
    lines.technician.instruct(CLEAR)
    with pytest.raises(StepError):
        lines.technician.has_confirmed()


def test_a_silent_service_is_a_stop(lines: Lines, monkeypatch: pytest.MonkeyPatch) -> None:
    """A service that hangs cannot pass on a Stop, and keeps standard input open."""
    now_s = [100.0]
    monkeypatch.setattr(commission_lines, "time", SimpleNamespace(monotonic=lambda: now_s[0]))
    sleep = lines.technician.stoppable(lambda seconds: None)
    now_s[0] += 60.0
    sleep(0.01)  # a program that sends no heartbeats
    for _ in range(4):
        lines.type({"beat": True})
        sleep(0.01)
        now_s[0] += 1.5
        sleep(0.01)
    now_s[0] += 1.0
    with pytest.raises(StepError) as stopped:
        sleep(0.01)
    assert stopped.value.fault == device_texts.SERVICE_SILENT()


@given(
    st.lists(
        st.tuples(st.floats(0.0, 3.0), st.sampled_from(["beat", "confirm", "unfinished line", "nothing"])),
        max_size=12,
    )
)
def test_no_movement_outlasts_two_seconds_without_a_heartbeat(events: list[tuple[float, str]]) -> None:
    """The service stops and continues at random. Motors keep moving only after heartbeats, not after other messages."""
    now_s, beat_s, moved_s = 0.0, None, []
    ours, theirs = os.pipe()
    with mock.patch.object(commission_lines, "time", SimpleNamespace(monotonic=lambda: now_s)):
        sleep = LineTechnician(ours).stoppable(lambda seconds: moved_s.append(now_s))
        for wait_s, what in events:
            now_s += wait_s
            if what == "beat":
                os.write(theirs, b'{"beat": true}\n')
            elif what == "confirm":
                os.write(theirs, b'{"confirm": 1}\n')
            elif what == "unfinished line":
                os.write(theirs, b" ")
            was_silent = beat_s is not None and now_s - beat_s > 2.0
            beat_s = now_s if what == "beat" else beat_s
            silent = was_silent and what != "beat"
            try:
                sleep(0.01)
                assert not silent
            except StepError:
                assert was_silent or silent
                # The stop is final: a later heartbeat does not let the motors go on.
                os.write(theirs, b'{"beat": true}\n')
                with pytest.raises(StepError):
                    sleep(0.01)
                break
    os.close(ours)
    os.close(theirs)


def test_simulated_hands_act_after_a_press_only(lines: Lines, capsys: pytest.CaptureFixture[str]) -> None:
    apparatus = FactoryNewApparatus(1)
    hands = SimulatedTechnician(apparatus)
    lines.technician.hands = hands
    lines.technician.instruct(PRESS)
    assert sent(capsys)[-1]["press"] is True
    assert hands.instructions == []
    lines.type({"confirm": 1})
    lines.technician.has_confirmed()
    assert [action.kind for action in hands.instructions] == ["press_estop"]
