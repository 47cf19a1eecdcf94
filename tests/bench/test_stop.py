"""A Stop is measured behind a Load that is still being loaded; other draws are left out and counted."""

import itertools
from collections.abc import Iterator
from types import SimpleNamespace
from typing import cast

import pytest

from kata.bench import stop
from kata.bench.device import Answered, Device
from kata.bench.report import Report
from kata.bench.running_service import BenchError
from kata.device.ipc_messages import Approach, Command, Load, Refusal, Stop
from kata.device.refusals import ANGLES_NOT_CURRENT

STOPPED = Refusal(code="stopped_meanwhile", message="It was stopped.", next_step="Load again.")
NOT_PLAYABLE = Refusal(code="unplayable", message="It cannot be played.", next_step="Teach again.")
LATE_ANSWER = Refusal(code=ANGLES_NOT_CURRENT, message="Motor 1 did not answer.", next_step="Try again.")
STOP_SENT_NS = 1_000_000_000
STOP_ANSWERED_NS = 1_002_000_000
BEFORE_THE_STOP_NS = 999_000_000
WHILE_IT_IS_SENT_NS = 1_001_000_000


class ScriptedDevice:
    """Answers each hour-long Load as scripted: refusal, time of the answer, and True for an answer before the Stop is sent."""

    def __init__(self, *loads: tuple[Refusal | None, int, bool]) -> None:
        self._loads = iter(loads)
        self._numbers = itertools.count(1)
        self._answers: dict[int, Answered] = {}
        self._early: set[int] = set()
        self.commands: list[str] = []
        self.approaches: Iterator[Refusal] = iter(())
        """Refusals of the first approaches."""

    def send(self, command: Command) -> tuple[int, int]:
        number = next(self._numbers)
        refusal, at_ns = None, STOP_ANSWERED_NS
        if isinstance(command, Load) and len(command.times_s) == stop._HOUR_SAMPLES * 8:
            refusal, at_ns, early = next(self._loads)
            self._early |= {number} if early else set()
        elif isinstance(command, Load):
            refusal = NOT_PLAYABLE
        else:
            self.commands.append(type(command).__name__)
            refusal = next(self.approaches, None) if isinstance(command, Approach) else None
        self._answers[number] = Answered(at_ns, refusal)
        return number, STOP_SENT_NS if isinstance(command, Stop) else 0

    def answered(self, number: int) -> bool:
        return number in self._early

    def answer(self, number: int) -> Answered:
        return self._answers[number]

    def insist(self, command: Command) -> None:
        assert self.answer(self.send(command)[0]).refusal is None

    def until_mode(self, mode: str) -> None:
        assert mode == "idle"

    @property
    def snapshot(self) -> "ScriptedDevice":
        return self

    stops = 1
    stop: SimpleNamespace | None = None

    def stop_by(self, cause: str | None) -> None:
        self.stop = SimpleNamespace(causes=[SimpleNamespace(code=cause)]) if cause else None


DISCARDED = (STOPPED, STOP_ANSWERED_NS, False)
ACCEPTED_EARLY = (None, BEFORE_THE_STOP_NS, True)
ACCEPTED_JUST_BEFORE = (None, BEFORE_THE_STOP_NS, False)
ACCEPTED_MEANWHILE = (None, WHILE_IT_IS_SENT_NS, False)


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stop, "_BUILDING_S", 0.0)


@pytest.mark.parametrize(
    ("loads", "accepted_first", "commands"),
    [
        ([DISCARDED], 0, ["Stop"]),
        ([ACCEPTED_EARLY, DISCARDED], 1, ["Unload", "Stop"]),
        ([ACCEPTED_JUST_BEFORE, DISCARDED], 1, ["Stop", "Acknowledge", "Stop"]),
        ([ACCEPTED_MEANWHILE], 0, ["Stop", "Acknowledge"]),
    ],
)
def test_load_accepted_before_the_stop_is_drawn_again(
    loads: list[tuple[Refusal | None, int, bool]], accepted_first: int, commands: list[str]
) -> None:
    device = ScriptedDevice(*loads)
    assert stop._stop_loading(cast(Device, device)) == (2.0, accepted_first)
    assert device.commands == commands


def test_load_refused_for_another_reason_is_an_error() -> None:
    device = ScriptedDevice((NOT_PLAYABLE, STOP_ANSWERED_NS, False))
    with pytest.raises(BenchError, match="cannot be played"):
        stop._stop_loading(cast(Device, device))


def test_benchmark_gives_up_when_every_load_is_too_early(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stop, "_DRAWS", 3)
    device = ScriptedDevice(*[ACCEPTED_EARLY] * 3)
    with pytest.raises(BenchError, match="3 Loads in a row"):
        stop._stop_loading(cast(Device, device))


def test_approach_waits_for_the_answer_of_a_drive() -> None:
    device = ScriptedDevice()
    device.approaches = iter([LATE_ANSWER, LATE_ANSWER])
    stop._approach(cast(Device, device))
    assert device.commands == ["Approach"] * 3
    device.approaches = iter([NOT_PLAYABLE])
    with pytest.raises(BenchError, match="cannot be played"):
        stop._approach(cast(Device, device))


def test_loads_left_out_are_reported() -> None:
    report = Report("Stop", ("While",))
    loaded = next(case for case in stop.CASES if case.name == "loaded")
    stop._add_row(report, loaded, stop.StopFigures([2.0], 0, [], accepted_first=3))
    assert report.rows[0][1] == "1"
    assert any("3 Loads were accepted before the Stop was sent" in note for note in report.notes)


def test_faults_are_left_out_and_slow_stops_are_errors() -> None:
    device, error = ScriptedDevice(), BenchError("torque was not switched off")
    for first in (None, stop.OPERATOR_STOP):
        device.stop_by(first)
        with pytest.raises(BenchError, match="torque was not switched off"):
            stop._leave_out(cast(Device, device), error)
    device.stop_by("timeout")
    assert stop._leave_out(cast(Device, device), error) == "timeout"
    assert device.commands == ["Acknowledge"]
