"""Replies of the device process that come in time, late or never. The test sends them."""

import asyncio
from uuid import UUID

from kata.device.ipc_messages import Load, Refusal, Reply, Teach
from kata.station.schemas import PatientRef
from kata.station.snapshot_tracker import Occupation
from kata.station.station import NO_ANSWER
from tests.support.silent_device import Silent, snapshot, station

PATIENT = PatientRef(id=UUID(int=1), name="Sato")
REFUSED = Refusal(code="limits", message="It leaves the limits.", next_step="Choose another one.")
LOAD = Load(
    run_id="run", recording_id="recording", times_s=b"", angles_deg=b"", side="right", resistance_level=12,
    limits_deg=((0.0, 1.0),) * 5, method="smooth", correction_deg=b"", correction_step_s=0.0, repetition_s=1.0,
)  # fmt: skip


async def loaded_in_vain(silent: list[Silent]) -> tuple[Silent, list[str]]:
    """Send a Load and stop waiting for its answer. Return the device process and the forgotten runs."""
    forgotten: list[str] = []
    asked = station()
    (program,) = silent
    program.tell(snapshot())
    occupation = Occupation("run", PATIENT)
    refusal = await asked.command(LOAD, occupation, refused_late=lambda: forgotten.append("run"))
    assert refusal is not None
    assert refusal.code == NO_ANSWER
    assert forgotten == []
    return program, forgotten


def test_late_refusal_discards_its_run_once(silent: list[Silent]) -> None:
    async def refused_late() -> None:
        program, forgotten = await loaded_in_vain(silent)
        answer = Reply(id=program.heard[-1].id, refusal=REFUSED)

        program.tell(answer)
        program.tell(answer)

        assert forgotten == ["run"]

    asyncio.run(refused_late())


def test_late_acceptance_keeps_its_run(silent: list[Silent]) -> None:
    async def accepted_late() -> None:
        program, forgotten = await loaded_in_vain(silent)

        program.tell(Reply(id=program.heard[-1].id, refusal=None))

        assert forgotten == []

    asyncio.run(accepted_late())


def test_answer_of_an_ended_program_is_ignored(silent: list[Silent]) -> None:
    async def ended_in_between() -> None:
        program, forgotten = await loaded_in_vain(silent)

        program.end()
        program.tell(Reply(id=program.heard[-1].id, refusal=REFUSED))

        assert forgotten == []

    asyncio.run(ended_in_between())


PLAYING = Refusal(code="is_playing", message="The recording is playing.", next_step="Pause first, or stop.")


def test_load_in_another_mode_never_reaches_the_device(silent: list[Silent]) -> None:
    at = station()
    (program,) = silent
    program.tell(snapshot(mode="playing", torque="on", refusals={"load": PLAYING, "teach": PLAYING}))

    assert at.refusal("load") == PLAYING
    for command in (LOAD, Teach(teaching_id="teaching", side="right")):
        assert asyncio.run(at.command(command)) == PLAYING
    assert program.heard == []


def test_refusals_are_unknown_without_the_device(silent: list[Silent]) -> None:
    at = station()

    refusal = at.refusal("load")

    assert refusal is not None
    assert refusal.code == "device_offline"
