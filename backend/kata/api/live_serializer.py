"""The live state as JSON. The shared part is built once for all listeners; the parts that differ between browsers replace fields of it."""

from collections.abc import Callable
from typing import Any, Final

from kata.api import texts
from kata.database import availability
from kata.device.ipc_messages import COMMAND_NAMES, Refusal
from kata.station.lease import Browser
from kata.station.schemas import DatabaseStatus, Live, RefusalLive
from kata.station.station import Station

_DATABASE_UNAVAILABLE: Final = Refusal.of(
    code=availability.DATABASE_UNAVAILABLE,
    message=texts.DATABASE_UNAVAILABLE(),
    next_step=texts.TRY_AGAIN_STOP_WORKS(),
)
_FOR_BROWSER: Final = {"at", "age_ms", "lease", "database"}
"""Fields that differ with each message or browser. They are not in the shared part."""


class LiveStateSerializer:
    """Builds the live state as JSON for each browser."""

    def __init__(
        self, station: Station, database_status: Callable[[], DatabaseStatus], may_load: Callable[[], bool]
    ) -> None:
        """``may_load`` returns whether a recording can be loaded without the database."""
        self._station = station
        self._database_status = database_status
        self._may_load = may_load
        self._version: object = None
        self._live: Live | None = None
        self._state: dict[str, Any] = {}

    def state(self, seen_by: Browser) -> dict[str, Any]:
        """Return :class:`~kata.station.schemas.Live` as JSON for that browser."""
        station = self._station
        if station.version != self._version:
            self._update(station.live())
            self._version = station.version
        database_status = self._database_status()
        for_browser: dict[str, Any] = {
            "at": station.clock.now().isoformat().replace("+00:00", "Z"),
            "age_ms": station.age_ms,
            "lease": station.lease_manager.lease_for(seen_by).model_dump(mode="json"),
            "database": database_status.model_dump(mode="json"),
        }
        refusal = station.lease_manager.refusal(seen_by)
        if refusal:
            for_browser["refusals"] = _refuse_all_but_stop(refusal)
        elif database_status.unavailable_since:
            # A running session continues with its prefetched data. Everything else needs the database.
            refused = ("teach",) if self._may_load() else ("teach", "load")
            for_browser["refusals"] = dict.fromkeys(refused, _as_json(_DATABASE_UNAVAILABLE)) | self._state["refusals"]
        return self._state | for_browser

    def _update(self, live: Live) -> None:
        """Convert the fields that are other objects than in the state before. Most fields change rarely."""
        before, self._live = self._live, live
        changed = {
            name for name in Live.model_fields if before is None or getattr(live, name) is not getattr(before, name)
        }
        self._state = self._state | live.model_dump(mode="json", include=changed - _FOR_BROWSER)


def _refuse_all_but_stop(refusal: Refusal) -> dict[str, Any]:
    refused = _as_json(refusal)
    return {name: refused for name in COMMAND_NAMES if name != "stop"}


def _as_json(refusal: Refusal) -> dict[str, Any]:
    return RefusalLive.model_validate(refusal, from_attributes=True).model_dump(mode="json")
