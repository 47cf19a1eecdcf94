"""The time zone that this computer is set to, as a name."""

import os
from pathlib import Path
from typing import Final
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

_LOCAL_TIME: Final = Path("/etc/localtime")
_ZONES: Final = "zoneinfo/"
"""The part of a path before the names of time zones."""
_UNNAMED: Final = frozenset(
    {"UTC", "UCT", "Universal", "Zulu", "GMT", "GMT0", "GMT+0", "GMT-0", "Greenwich", "Factory"}
)


def computer_zone(local_time: Path = _LOCAL_TIME) -> str:
    """Return the IANA name of this computer's time zone; empty if it is unknown.

    UTC is the zone of computers and containers that were not set to a zone, so it says nothing about the clinic. Neither does an offset.
    """
    variable = os.environ.get("TZ")
    name = _linked_zone(local_time) if variable is None else variable.removeprefix(":")
    if name in _UNNAMED or name.startswith("Etc/"):
        return ""
    try:
        return ZoneInfo(name).key
    except (ZoneInfoNotFoundError, ValueError, OSError):
        return ""


def _linked_zone(local_time: Path) -> str:
    try:
        target = str(local_time.readlink())
    except OSError:
        return ""
    _, separator, name = target.partition(_ZONES)
    return name.removeprefix("posix/") if separator else ""
