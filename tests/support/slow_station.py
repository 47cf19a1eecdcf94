"""The simulated apparatus with few cycles per second, for tests that do not depend on the rate."""

from pathlib import Path
from typing import Final

from kata.bench.running_service import at_cycle_rate
from kata.device import config
from kata.device.config import StationConfig

RATE_HZ: Final = 20
"""Bus cycles, samples and setpoints per second. At the default of 100, device process and simulator take a fifth of a processor all the
time.
"""
_USUAL: Final = config.simulated


def slow_simulated(port: str) -> StationConfig:
    """Return the configuration of the simulated apparatus with few cycles per second."""
    return at_cycle_rate(_USUAL(port), cycle_hz=RATE_HZ, rate_hz=RATE_HZ)


def slow_station_file(folder: Path) -> Path:
    """Write the station file of :func:`slow_simulated` into a folder and return it."""
    file = folder / "slow-station.toml"
    config.write(slow_simulated("simulator"), file)
    return file
