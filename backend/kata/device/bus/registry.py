"""Finds drivers by name: those of this package, and those that other packages install."""

import logging
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING, Any, Final

import msgspec

from kata.device.bus.plugin import ENTRY_POINTS, Driver

if TYPE_CHECKING:
    from kata.device.config import StationConfig

log = logging.getLogger(__name__)

_BUILT_IN: Final = tuple(
    EntryPoint(name, f"kata.device.bus.{name}.driver:DRIVER", ENTRY_POINTS) for name in ("dynamixel", "modbus")
)
BUILT_IN_DRIVERS: Final = tuple(entry.name for entry in _BUILT_IN)


class DriverError(ValueError):
    """A driver cannot be used; the message says why."""


def installed_drivers() -> list[str]:
    """Return the names of all installed drivers, those of this package first."""
    others = {entry.name for entry in entry_points(group=ENTRY_POINTS)} - set(BUILT_IN_DRIVERS)
    return [*BUILT_IN_DRIVERS, *sorted(others)]


@cache
def find_driver(name: str) -> Driver:
    """Return the driver with this name. Other packages cannot replace a built-in driver.

    :raises DriverError: when it is not installed, installed twice, or cannot be loaded.
    """
    found = [entry for entry in _BUILT_IN if entry.name == name]
    if not found:
        # A package that is on the path twice has two equal entry points.
        found = list({entry.value: entry for entry in entry_points(group=ENTRY_POINTS, name=name)}.values())
    if not found:
        raise DriverError(f"no driver is named {name!r}; installed are {', '.join(installed_drivers())}")
    if len(found) > 1:
        raise DriverError(f"several packages have a driver named {name!r}: {', '.join(entry.value for entry in found)}")
    return _load(found[0])


def _load(entry: EntryPoint) -> Driver:
    try:
        driver = entry.load()
    except Exception as error:
        # A package may raise any exception. The station's file is then refused with the reason.
        log.exception("the driver %s cannot be loaded", entry.name)
        raise DriverError(
            f"the driver {entry.name!r} ({entry.value}) cannot be loaded: {type(error).__name__}: {error}"
        ) from error
    if not isinstance(driver, Driver):
        raise DriverError(
            f"the driver {entry.name!r} ({entry.value}) is a {type(driver).__name__}, not a kata.device.bus.plugin.Driver"
        )
    return driver


def driver_settings(config: "StationConfig") -> Any:
    """Return the driver's own settings, an instance of :attr:`Driver.settings`; None if it has none.

    :raises DriverError: when the table ``[driver]`` does not fit them.
    """
    kind = find_driver(config.protocol).settings
    if kind is None:
        if config.driver:
            raise DriverError(f"the driver {config.protocol!r} has no settings of its own")
        return None
    try:
        return msgspec.convert(config.driver, kind)
    except msgspec.ValidationError as error:
        raise DriverError(str(error)) from error
