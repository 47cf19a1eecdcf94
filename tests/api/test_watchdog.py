"""The service notifies systemd of its start, its running event loop and its end."""

import asyncio
import socket
from pathlib import Path

from kata.api.systemd_notify import systemd_notified


def test_systemd_receives_start_stop_and_watchdog_signals(tmp_path: Path) -> None:
    async def look() -> list[bytes]:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as heard:
            heard.bind(str(tmp_path / "notify"))
            heard.setblocking(False)
            loop = asyncio.get_running_loop()
            given = {"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "2000"}
            words = []
            async with systemd_notified(given), asyncio.timeout(30):
                words += [await loop.sock_recv(heard, 64) for _ in range(4)]
            while words[-1] != b"STOPPING=1":
                words.append(await loop.sock_recv(heard, 64))
            return words

    words = asyncio.run(look())
    assert words[:4] == [b"READY=1", b"WATCHDOG=1", b"WATCHDOG=1", b"WATCHDOG=1"]
    assert words[-1] == b"STOPPING=1"


def test_without_systemd_no_signal_is_sent() -> None:
    async def look() -> None:
        async with systemd_notified({}):
            pass

    asyncio.run(look())
