"""The station gives the drives to another program and takes them back."""

import asyncio
import errno
import os
import time
from pathlib import Path
from typing import Any
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from kata.device import config
from kata.device.config import StationConfig
from kata.device.ipc_messages import Refusal, Reply, Request, Stop, Teach
from kata.station.guard import Guard
from tests.support.silent_device import Silent, snapshot, station


async def stop() -> Refusal | None:
    return None


def guard(stops: int = 0, valid_s: float = 2.0) -> Guard:
    return Guard(stops, time.monotonic_ns() + int(valid_s * 1e9))


async def meanwhile() -> None:
    """Do nothing: the apparatus has been turned by hand."""


def test_a_planned_restart_is_no_missing_answer(silent: list[Silent]) -> None:
    at = station()
    silent[0].tell(snapshot())
    silent[0].during(at.hand_over(stop, guard()))
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


@pytest.mark.parametrize(("late", "code"), [(guard(stops=1), "stopped_meanwhile"), (guard(valid_s=0.0), "expired")])
def test_a_late_request_gets_no_drives(late: Guard, code: str, silent: list[Silent]) -> None:
    at = station()
    silent[0].tell(snapshot())
    refusal = silent[0].during(at.hand_over(stop, late))
    assert refusal is not None and refusal.code == code
    assert silent[0].running


def test_a_stop_since_the_newest_snapshot_counts(silent: list[Silent]) -> None:
    """A Stop has its reply some milliseconds before the snapshot that counts it. The start of a commissioning may arrive in between."""
    at = station()
    silent[0].tell(snapshot())

    async def starting() -> Refusal | None:
        starting = asyncio.create_task(at.hand_over(stop, guard()))
        await asyncio.sleep(0)
        silent[0].tell(snapshot(t_ns=time.monotonic_ns(), stops=1))
        return await starting

    refusal = asyncio.run(starting())
    assert refusal is not None and refusal.code == "stopped_meanwhile"
    assert silent[0].running


class Stoppable(Silent):
    """Replies to a Stop at once. The snapshot that counts the Stop follows when the test sends it, or with the next regular one."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.stops = 0

    def send(self, message: Any) -> None:
        if isinstance(message, Request):
            self.stops += 1
            self.newest = snapshot(stops=self.stops)
            self.tell(Reply(id=message.id))


@given(st.lists(st.sampled_from(["page receives the state", "Stop", "snapshot"]), max_size=8))
def test_only_a_page_that_saw_every_stop_starts(steps: list[str]) -> None:
    made: list[Stoppable] = []

    def make(*arguments: Any) -> Stoppable:
        made.append(Stoppable(*arguments))
        return made[-1]

    with mock.patch("kata.station.station.DeviceProcess", make):
        at = station()
    device = made[0]
    device.tell(snapshot())
    seen = 0
    for step in steps:
        if step == "Stop":
            asyncio.run(at.command(Stop()))
        elif step == "snapshot":
            device.tell(snapshot(stops=device.stops))
        else:
            seen = at.live().stops
    refusal = device.during(at.hand_over(stop, guard(seen)))
    assert (refusal is None) == (seen == device.stops)


def test_a_command_without_a_reply_keeps_the_drives(silent: list[Silent], monkeypatch: pytest.MonkeyPatch) -> None:
    """The device process may just be carrying it out, also if its snapshots do not show the effect yet."""
    monkeypatch.setattr("kata.station.station._SNAPSHOT_LIMIT_S", 0.05)
    at = station()
    silent[0].tell(snapshot())
    silent[0].during(at.command(Teach(teaching_id="teaching", side="right")))
    for request in (at.hand_over(stop, guard()), at.set_side("left", meanwhile)):
        refusal = silent[0].during(request)
        assert refusal is not None and refusal.code == "no_answer"
    assert silent[0].running


def test_a_new_configuration_keeps_the_side(tmp_path: Path, silent: list[Silent]) -> None:
    at = station(tmp_path)
    silent[0].tell(snapshot())
    at.config = structs.replace(at.config, side="left")
    silent[0].during(at.hand_over(stop, guard()))
    axes = tuple(structs.replace(axis, lag_s=0.07) for axis in at.config.axes)
    at.take_back(structs.replace(at.config, axes=axes, side="right"))
    assert silent[0].starts == 1
    assert at.config == config.read(tmp_path / "station.toml")
    assert (at.config.axes, at.config.side) == (axes, "left")


def no_space(config: StationConfig, path: Path) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_side_that_cannot_be_stored_is_refused(silent: list[Silent], monkeypatch: pytest.MonkeyPatch) -> None:
    """The next device process would still be set up for the former side."""
    at = station()
    silent[0].tell(snapshot())
    monkeypatch.setattr("kata.station.station.write", no_space)
    refusal = silent[0].during(at.set_side("left", meanwhile))
    assert refusal is not None and refusal.code == "file_not_written"
    assert at.config.side == "right"
    assert silent[0].starts == 1


def test_a_configuration_that_cannot_be_stored_allows_no_motion(
    tmp_path: Path, silent: list[Silent], monkeypatch: pytest.MonkeyPatch
) -> None:
    at = station(tmp_path)
    silent[0].tell(snapshot())
    silent[0].during(at.hand_over(stop, guard()))
    before = at.config
    monkeypatch.setattr("kata.station.station.write", no_space)
    axes = tuple(structs.replace(axis, lag_s=0.07) for axis in before.axes)
    at.take_back(structs.replace(before, axes=axes))
    assert silent[0].starts == 1
    silent[0].tell(snapshot())
    assert at.config == before
    assert at.live().refusals["load"].code == "file_not_written"
    at.set_not_commissioned(None)
    assert at.live().refusals["load"].code == "file_not_written", "the record fits the new configuration only"
    monkeypatch.undo()
    silent[0].during(at.hand_over(stop, guard()))
    at.take_back(structs.replace(before, axes=axes))
    at.set_not_commissioned(None)
    silent[0].tell(snapshot())
    assert "load" not in at.live().refusals
