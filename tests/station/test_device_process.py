"""Messages to the device process: a Stop never waits for a recording."""

import asyncio
import socket
from collections.abc import Awaitable, Callable
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import msgspec
import pytest

from kata.device.config_rules import RANGES
from kata.device.ipc_messages import (
    Heartbeat,
    Load,
    LoadPart,
    Mode,
    Refusal,
    Reply,
    Request,
    Stop,
    ToDevice,
    frame,
    frames,
    frames_of,
)
from kata.station.device_process import _HEARTBEAT_S, DeviceLaunch, DeviceProcess
from tests.support.silent_device import snapshot

AN_HOUR = Load(run_id="r", recording_id="a", times_s=bytes(8 * 360_000), angles_deg=bytes(40 * 360_000))
PARTS = sum(1 for _ in frames_of(Request(id=1, command=AN_HOUR))) - 1
REFUSED = Reply(id=1, refusal=Refusal(code="is_playing", message="It is playing.", next_step="Pause first."))
LIMIT_S = 10.0


class Device:
    """The device's end of the socket, in the same event loop."""

    def __init__(self, process: DeviceProcess, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.process = process
        self._reader = reader
        self._writer = writer
        self._incoming = bytearray()
        self._decoder = msgspec.msgpack.Decoder(ToDevice)

    async def hear(self) -> list[object]:
        """Wait for some more messages; none when nothing comes any more."""
        self._incoming += await self._reader.read(1 << 16)
        return [self._decoder.decode(encoded) for encoded in frames(self._incoming)]

    def say(self, reply: Reply) -> None:
        self._writer.write(frame(reply))

    def hang_up(self) -> None:
        self._writer.close()


def with_device(play: Callable[[Device], Awaitable[None]]) -> None:
    async def played() -> None:
        ours, theirs = socket.socketpair()
        process = DeviceProcess(DeviceLaunch(Path(), Path(), real_time=False), lambda message: None, lambda: None, str)
        reader, process._writer = await asyncio.open_connection(sock=ours)
        device = Device(process, *await asyncio.open_connection(sock=theirs))
        listening = asyncio.create_task(process._listen(reader))
        async with asyncio.timeout(LIMIT_S):
            await play(device)
            device.hang_up()
            await listening
        process._writer.close()

    asyncio.run(played())


def test_stop_is_sent_between_the_parts_of_a_load() -> None:
    async def play(device: Device) -> None:
        device.process.send(Request(id=1, command=AN_HOUR))
        heard = await device.hear()
        for _ in range(PARTS):  # all that does not wait for the socket
            await asyncio.sleep(0)
        device.process.send(Request(id=2, command=Stop()))
        while not (isinstance(heard[-1], LoadPart) and heard[-1].last):
            heard += await device.hear()
        stop = heard.index(Request(id=2, command=Stop()))
        assert stop < PARTS / 4
        parts = [message for message in heard if isinstance(message, LoadPart)]
        assert b"".join(part.data for part in parts if part.field == "angles_deg") == AN_HOUR.angles_deg
        assert len(parts) == PARTS

    with_device(play)


def test_a_refused_load_is_sent_no_further() -> None:
    async def play(device: Device) -> None:
        device.process.send(Request(id=1, command=AN_HOUR))
        heard = await device.hear()
        (sending,) = device.process._sending.values()
        device.say(REFUSED)
        await asyncio.wait([sending])
        device.process.send(Request(id=2, command=Stop()))
        while heard[-1] != Request(id=2, command=Stop()):
            heard += await device.hear()
        assert len(heard) < PARTS / 4
        assert device.process._sending == {}

    with_device(play)


def heartbeats(*modes: Mode, monkeypatch: pytest.MonkeyPatch) -> list[float | None]:
    """Return the device process's heartbeats after snapshots with these modes: the time until the next one, None without a timer."""
    sent: list[float | None] = []

    async def sleep(seconds: float) -> None:
        sent[-1] = seconds
        await asyncio.Event().wait()

    async def listen_and_beat() -> None:
        launch = DeviceLaunch(Path(), Path(), real_time=False)
        process = DeviceProcess(launch, lambda message: None, lambda: None, str)
        monkeypatch.setattr(process, "send", lambda message: sent.append(None))
        reader = asyncio.StreamReader()
        for mode in modes:
            reader.feed_data(frame(snapshot(mode=mode)))
        reader.feed_eof()
        await process._listen(reader)
        monkeypatch.setattr(asyncio, "sleep", sleep)
        beating = asyncio.create_task(process._beat())
        await asyncio.wait([beating], timeout=0)
        beating.cancel()

    asyncio.run(listen_and_beat())
    return sent


def test_before_the_first_snapshot_heartbeats_have_a_timer(monkeypatch: pytest.MonkeyPatch) -> None:
    assert heartbeats(monkeypatch=monkeypatch) == [_HEARTBEAT_S]


@pytest.mark.parametrize("mode", ["idle", "offline"])
def test_at_rest_a_heartbeat_follows_each_snapshot(mode: Mode, monkeypatch: pytest.MonkeyPatch) -> None:
    assert heartbeats("playing", mode, mode, monkeypatch=monkeypatch) == [None, None]


@pytest.mark.parametrize("mode", [mode for mode in get_args(Mode) if mode not in ("idle", "offline")])
def test_in_every_other_mode_heartbeats_have_a_timer(mode: Mode, monkeypatch: pytest.MonkeyPatch) -> None:
    assert heartbeats("idle", mode, mode, monkeypatch=monkeypatch) == [None, _HEARTBEAT_S]


def test_leaving_rest_sends_a_heartbeat_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[ToDevice] = []

    async def leave() -> None:
        launch = DeviceLaunch(Path(), Path(), real_time=False)
        process = DeviceProcess(launch, lambda message: None, lambda: None, str)
        process._beat_after(snapshot(mode="idle"))
        monkeypatch.setattr(process, "send", sent.append)
        beating = asyncio.create_task(process._beat())
        await asyncio.sleep(0)
        assert sent == []
        process._beat_after(snapshot(mode="ready"))
        for _ in range(3):
            await asyncio.sleep(0)
        beating.cancel()

    asyncio.run(leave())
    assert sent == [Heartbeat(run_id="")]


def test_four_heartbeats_may_be_lost() -> None:
    (silence,) = (found for found in RANGES if found.field == "service_silence_ms")
    assert silence.low >= 4 * _HEARTBEAT_S * 1000


def test_closing_while_a_process_starts_leaves_no_socket(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[socket.socket] = []

    def noted() -> tuple[socket.socket, socket.socket]:
        opened.extend(socket.socketpair())
        return opened[0], opened[1]

    monkeypatch.setattr("kata.station.device_process.socket", SimpleNamespace(socketpair=noted))

    async def close_at_once() -> None:
        launch = DeviceLaunch(tmp_path / "station.toml", tmp_path, real_time=False)
        process = DeviceProcess(launch, lambda message: None, lambda: None, str)
        process.start()
        while not opened:  # noqa: ASYNC110
            await asyncio.sleep(0)
        await process.close()

    asyncio.run(close_at_once())
    assert [end.fileno() for end in opened] == [-1, -1]
