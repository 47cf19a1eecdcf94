"""No motion is allowed with another configuration than that of the last commissioning, whatever the disk does."""

import errno
import os
import tempfile
import time
from pathlib import Path
from typing import Any, Final
from unittest import mock

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule
from msgspec import structs

from kata.commissioning import texts
from kata.device import config
from kata.device.config import StationConfig
from kata.device.ipc_messages import Refusal
from kata.motion.axes import Side
from kata.station.guard import Guard
from tests.support.silent_device import Silent, snapshot, station

_NOT_COMMISSIONED: Final = Refusal.of(
    code="not_commissioned",
    message=texts.NOT_COMMISSIONED(reason=texts.RUN_COMMISSION()),
    next_step=texts.RUN_COMMISSION(),
)
_LAGS_S: Final = st.sampled_from([0.02, 0.04, 0.07])


def with_lag(before: StationConfig, lag_s: float) -> StationConfig:
    return structs.replace(before, axes=tuple(structs.replace(axis, lag_s=lag_s) for axis in before.axes))


class Reading(Silent):
    """Reads the station's file whenever it starts, as the device process does."""

    def __init__(self, launch: Any, *others: Any) -> None:
        super().__init__(launch, *others)
        self._file = launch.station_file
        self.in_use: StationConfig | None = None

    def start(self) -> None:
        super().start()
        self.running = True
        self.in_use = config.read(self._file)
        self.tell(snapshot())

    async def close(self) -> None:
        self.running = False


async def stop() -> Refusal | None:
    return None


async def meanwhile() -> None:
    """Do nothing: the apparatus has been turned by hand."""


class Configurations(RuleBasedStateMachine):
    """Commissionings, turns of the apparatus, records, restarts of the device process, and a disk that is full at times."""

    @initialize()
    def start(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        made: list[Reading] = []

        def make(*arguments: Any) -> Reading:
            made.append(Reading(*arguments))
            return made[-1]

        with mock.patch("kata.station.station.DeviceProcess", make):
            self.station = station(Path(self._folder.name))
        config.write(self.station.config, Path(self._folder.name) / "station.toml")
        self.device = made[0]
        self.device.running = False
        self.station.start()
        self.commissioned = self.station.config
        self.side: Side = self.station.config.side
        self.recorded = True

    def teardown(self) -> None:
        self._folder.cleanup()

    def _on_disk(self, *, full: bool) -> Any:
        def no_space(*_: object) -> None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        return mock.patch("kata.station.station.write", no_space if full else config.write)

    @rule(lag_s=st.none() | _LAGS_S, full=st.booleans())
    def the_drives_are_commissioned(self, lag_s: float | None, full: bool) -> None:
        """A procedure takes the drives. It ends without a new configuration, or passes."""
        self.device.during(self.station.hand_over(stop, Guard(0, time.monotonic_ns() + 10**12)))
        new = None if lag_s is None else with_lag(self.station.config, lag_s)
        with self._on_disk(full=full):
            self.station.take_back(new)
        self.commissioned = new or self.commissioned

    @rule(side=st.sampled_from(["right", "left"]), full=st.booleans())
    def the_apparatus_is_turned(self, side: Side, full: bool) -> None:
        with self._on_disk(full=full):
            refusal = self.device.during(self.station.set_side(side, meanwhile))
        if refusal is None:
            self.side = side

    @rule(valid=st.booleans())
    def the_record_is_read(self, valid: bool) -> None:
        self.recorded = valid
        self.station.set_not_commissioned(None if valid else _NOT_COMMISSIONED)

    @rule()
    def the_device_process_restarts(self) -> None:
        self.device.running = False
        self.device.end()
        self.device.start()

    @invariant()
    def motions_use_what_was_commissioned(self) -> None:
        if self.station.refusal("load") is not None:
            return
        assert self.recorded
        assert self.device.in_use == structs.replace(self.commissioned, side=self.side)


TestConfigurations = Configurations.TestCase
TestConfigurations.settings = settings(max_examples=60, stateful_step_count=15)
