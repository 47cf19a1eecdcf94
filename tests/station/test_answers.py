"""What the apparatus' control program answers, in time, late or never: with a process in its place that only the test speaks for."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest

from kata.device.config import StationConfig
from kata.device.messages import FromDevice, Load, LoopState, Refusal, Reply, Request, Snapshot
from kata.station import station as module
from kata.station.schemas import PatientRef
from kata.station.station import NO_ANSWER, Occupation, Station

PATIENT = PatientRef(id=UUID(int=1), name="Sato")
REFUSED = Refusal(code="limits", message="It leaves the limits.", next_step="Choose another one.")
LOAD = Load(
    run_id="run", recording_id="recording", times_s=b"", angles_deg=b"", side="right", load_level=12,
    limits_deg=((0.0, 1.0),) * 5, method="smooth", correction_deg=b"", correction_step_s=0.0, repetition_s=1.0,
)  # fmt: skip


class Silent:
    """A control program that hears everything and says nothing by itself."""

    running = True

    def __init__(
        self,
        station_file: Path,
        journal_folder: Path,
        on_message: Callable[[FromDevice], None],
        on_end: Callable[[], None],
        occupation: Callable[[], str],
        *,
        real_time: bool,
    ) -> None:
        self.tell, self.end = on_message, on_end
        self.heard: list[Request] = []

    def send(self, message: Any) -> None:
        self.heard.append(message)

    def beat(self) -> None:
        """Nobody listens for it."""


@pytest.fixture
def silent(monkeypatch: pytest.MonkeyPatch) -> list[Silent]:
    """The control programs of the stations that a test makes."""
    made: list[Silent] = []

    def make(*args: Any, **kwargs: Any) -> Silent:
        made.append(Silent(*args, **kwargs))
        return made[-1]

    monkeypatch.setattr(module, "DeviceProcess", make)
    monkeypatch.setattr(module, "_REPLY_LIMIT_S", 0.0)
    return made


def station() -> Station:
    nowhere = Path("/nowhere")
    return Station(StationConfig(), nowhere, nowhere, simulated=True, real_time=False, on_journal=lambda path: None)


def idle() -> Snapshot:
    loop = LoopState(
        cycle_hz=100, rate_hz=100, cycles=0, overruns=0, lateness_p50_ms=0.0, lateness_p99_ms=0.0, lateness_p999_ms=0.0,
        lateness_max_ms=0.0, bus_errors=0, drive_errors=(0,) * 5, telemetry_dropped=0, real_time=False, memory_locked=False,
    )  # fmt: skip
    return Snapshot(
        t_ns=0, mode="idle", torque_on=False, estop="closed", pedal="up", axes=(), stop=None, run=None, teaching=None,
        refusals={}, loop=loop,
    )  # fmt: skip


async def loaded_in_vain(silent: list[Silent]) -> tuple[Silent, list[str]]:
    """A load that nobody waits for any more; what was forgotten."""
    forgotten: list[str] = []
    asked = station()
    (program,) = silent
    program.tell(idle())
    occupation = Occupation("run", PATIENT)
    refusal = await asked.command(LOAD, occupation, refused_late=lambda: forgotten.append("run"))
    assert refusal is not None
    assert refusal.code == NO_ANSWER
    assert forgotten == []
    return program, forgotten


def test_what_is_refused_after_nobody_waits_any_more_is_forgotten_once(silent: list[Silent]) -> None:
    async def refused_late() -> None:
        program, forgotten = await loaded_in_vain(silent)
        answer = Reply(id=program.heard[-1].id, refusal=REFUSED)

        program.tell(answer)
        program.tell(answer)

        assert forgotten == ["run"]

    asyncio.run(refused_late())


def test_what_was_done_after_nobody_waits_any_more_stands(silent: list[Silent]) -> None:
    async def accepted_late() -> None:
        program, forgotten = await loaded_in_vain(silent)

        program.tell(Reply(id=program.heard[-1].id, refusal=None))

        assert forgotten == []

    asyncio.run(accepted_late())


def test_an_answer_of_a_program_that_has_ended_counts_for_nothing(silent: list[Silent]) -> None:
    async def ended_in_between() -> None:
        program, forgotten = await loaded_in_vain(silent)

        program.end()
        program.tell(Reply(id=program.heard[-1].id, refusal=REFUSED))

        assert forgotten == []

    asyncio.run(ended_in_between())
