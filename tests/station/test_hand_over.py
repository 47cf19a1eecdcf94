"""The station gives the drives to another program and takes them back."""

import asyncio
from pathlib import Path

from msgspec import structs

from kata.device import config
from kata.device.ipc_messages import Refusal
from tests.support.silent_device import Silent, snapshot, station


async def stop() -> Refusal | None:
    return None


def test_a_planned_restart_is_no_missing_answer(silent: list[Silent]) -> None:
    at = station()
    silent[0].tell(snapshot())
    asyncio.run(at.hand_over(stop))
    assert at.live().refusals["teach"].code == "commissioning_runs"
    silent[0].running = False
    at.take_back()
    assert at.live().device == "starting"
    silent[0].running = True
    silent[0].tell(snapshot())
    assert at.live().device == "running"
    silent[0].running = False
    silent[0].end()
    assert at.live().device == "restarting", "not planned"


def test_a_new_configuration_keeps_the_side(tmp_path: Path, silent: list[Silent]) -> None:
    at = station(tmp_path)
    at.config = structs.replace(at.config, side="left")
    asyncio.run(at.hand_over(stop))
    axes = tuple(structs.replace(axis, lag_s=0.07) for axis in at.config.axes)
    at.take_back(structs.replace(at.config, axes=axes, side="right"))
    assert silent[0].starts == 1
    assert at.config == config.read(tmp_path / "station.toml")
    assert (at.config.axes, at.config.side) == (axes, "left")
