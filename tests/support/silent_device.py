"""Replacements for the device process: one sends only what the test sends, the other says that no apparatus is connected."""

import asyncio
import time
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any, Final, TypeVar, get_args

from msgspec import structs

from kata.device import texts
from kata.device.config import StationConfig
from kata.device.ipc_messages import CommandName, FromDevice, LoopState, Refusal, Reply, Request, Snapshot, Stop
from kata.station.device_process import DeviceLaunch
from kata.station.station import Station

_T = TypeVar("_T")
_SNAPSHOT_INTERVAL_S: Final = 0.002


class Silent:
    """Receives everything and sends nothing on its own."""

    def __init__(
        self,
        launch: DeviceLaunch,
        on_message: Callable[[FromDevice], None],
        on_end: Callable[[], None],
        occupation_id: Callable[[], str],
    ) -> None:
        self._on_message, self.end = on_message, on_end
        self.newest: Snapshot | None = None
        """The last snapshot that was sent, or that :meth:`during` sends next."""
        self.heard: list[Request] = []
        self.running = True
        self.starts = 0

    def tell(self, message: FromDevice) -> None:
        """Send a message to the station."""
        if isinstance(message, Snapshot):
            self.newest = message
        self._on_message(message)

    def during(self, request: Coroutine[Any, Any, _T]) -> _T:
        """Run a request of the station. Meanwhile send the newest snapshot with the present time, as a running device process does."""

        async def snapshots() -> None:
            while True:
                await asyncio.sleep(_SNAPSHOT_INTERVAL_S)
                if self.running and self.newest is not None:
                    self.tell(structs.replace(self.newest, t_ns=time.monotonic_ns()))

        async def both() -> _T:
            sending = asyncio.create_task(snapshots())
            try:
                return await request
            finally:
                sending.cancel()

        return asyncio.run(both())

    def start(self) -> None:
        self.starts += 1

    async def close(self) -> None:
        """Return at once: there is nothing to finish."""

    def send(self, message: Any) -> None:
        self.heard.append(message)

    def beat(self) -> None:
        """Ignore the event."""


def station(folder: Path = Path("/nowhere")) -> Station:
    launch = DeviceLaunch(folder / "station.toml", folder, real_time=False)
    return Station(StationConfig(), launch, simulated=True, on_journal=lambda path: None)


def snapshot(**given: Any) -> Snapshot:
    """Return an idle snapshot with the given changes."""
    loop = LoopState(
        cycle_hz=100, rate_hz=100, cycles=0, overruns=0, lateness_p50_ms=0.0, lateness_p99_ms=0.0, lateness_p999_ms=0.0,
        lateness_max_ms=0.0, bus_errors=0, drive_errors=(0,) * 5, telemetry_dropped=0, real_time=False, memory_locked=False,
    )  # fmt: skip
    idle: dict[str, Any] = {
        "t_ns": 0, "mode": "idle", "torque": "off", "stops": 0, "verified_since_ns": 0, "estop": "closed", "pedal": "up",
        "axes": (), "stop": None, "run": None, "teaching": None, "refusals": {}, "loop": loop,
    }  # fmt: skip
    return Snapshot(**idle | given)


_DISCONNECTED: Final = Refusal.of(
    code="is_offline",
    message=texts.NOT_CONNECTED_BECAUSE(reason=texts.PORT_CANNOT_BE_OPENED(port="/dev/ttyNONE", error="No such file")),
    next_step=texts.SWITCH_ON_AND_CHECK_ADAPTER(),
)


class Disconnected(Silent):
    """Says once that no apparatus is connected, and refuses every command but Stop, as a device process without a port does.

    A device process takes half a second of processor time to start, and a tenth of a processor while it runs.
    """

    def start(self) -> None:
        super().start()
        refusals = dict.fromkeys(get_args(CommandName), _DISCONNECTED)
        self.tell(
            snapshot(
                mode="offline",
                torque="unknown",
                verified_since_ns=None,
                estop="unknown",
                pedal="unknown",
                refusals=refusals,
            )
        )

    def send(self, message: Any) -> None:
        super().send(message)
        if isinstance(message, Request):
            self.tell(Reply(id=message.id, refusal=None if isinstance(message.command, Stop) else _DISCONNECTED))
