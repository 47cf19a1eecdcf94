"""Finds drivers by name: those of this package, and those that other packages install."""

import logging
import pkgutil
from functools import cache
from typing import TYPE_CHECKING, Any, Final

import msgspec

from kata.device.bus.plugin import ENTRY_POINTS, Driver

if TYPE_CHECKING:
    from importlib.metadata import EntryPoints

    from kata.device.config import StationConfig

log = logging.getLogger(__name__)

BUILT_IN_DRIVERS: Final = ("dynamixel", "modbus")


class DriverError(ValueError):
    """A driver cannot be used; the message says why."""


def installed_drivers() -> list[str]:
    """Return the names of all installed drivers, those of this package first."""
    return [*BUILT_IN_DRIVERS, *sorted(_entry_points().names - set(BUILT_IN_DRIVERS))]


def _entry_points() -> "EntryPoints":
    """Return the drivers that other packages install."""
    # Imported here, because most stations use a built-in driver. The import takes a fifth of the device process's start.
    from importlib.metadata import entry_points

    return entry_points(group=ENTRY_POINTS)


@cache
def find_driver(name: str) -> Driver:
    """Return the driver with this name. Other packages cannot replace a built-in driver.

    :raises DriverError: when it is not installed, installed twice, or cannot be loaded.
    """
    if name in BUILT_IN_DRIVERS:
        return _load(name, f"kata.device.bus.{name}.driver:DRIVER")
    # A package that is on the path twice has two equal entry points.
    found = list(dict.fromkeys(entry.value for entry in _entry_points().select(name=name)))
    if not found:
        raise DriverError(f"no driver is named {name!r}; installed are {', '.join(installed_drivers())}")
    if len(found) > 1:
        raise DriverError(f"several packages have a driver named {name!r}: {', '.join(found)}")
    return _load(name, found[0])


def _load(name: str, reference: str) -> Driver:
    """Return the object of a reference such as ``package.module:DRIVER``.

    :raises DriverError: when it cannot be loaded or is no driver.
    """
    try:
        driver = pkgutil.resolve_name(reference)
    except Exception as error:
        # A package may raise any exception. The station's file is then refused with the reason.
        log.exception("the driver %s cannot be loaded", name)
        raise DriverError(
            f"the driver {name!r} ({reference}) cannot be loaded: {type(error).__name__}: {error}"
        ) from error
    if not isinstance(driver, Driver):
        raise DriverError(
            f"the driver {name!r} ({reference}) is a {type(driver).__name__}, not a kata.device.bus.plugin.Driver"
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
