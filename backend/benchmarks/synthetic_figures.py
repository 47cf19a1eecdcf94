"""Calculates the derived rows of an invented clinic's figures, because the bulk insertion does not run
:mod:`kata.clinic.statistics.derived_tables`.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Final
from uuid import UUID

from kata.clinic.statistics import episode_changes, parts

_HOUR_SUMS: Final = (
    "sessions", "playbacks", "stopped", "played_s", "repetitions", "compared", "left_out", "rmse_sum_deg", "rmse_square_sum_deg2", "peak_deg",
)  # fmt: skip


def _no_sums() -> dict[str, float]:
    return dict.fromkeys(_HOUR_SUMS, 0)


@dataclass
class StationHours:
    """Sums the sessions of each hour and station."""

    _sums: dict[tuple[datetime, str], dict[str, float]] = field(default_factory=lambda: defaultdict(_no_sums))

    def add(self, began: datetime, station: str, runs: Sequence[dict[str, Any]]) -> None:
        """Add a session with its rows of runs. All its runs were played."""
        sums = self._sums[parts.begin_of(began), station]
        sums["sessions"] += 1
        for run in runs:
            rmse_deg = run["worst_rmse_deg"]
            sums["playbacks"] += 1
            sums["stopped"] += run["outcome"] == "stopped"
            sums["played_s"] += run["played_s"]
            sums["repetitions"] += run["repetitions_done"]
            sums["compared"] += 1
            sums["rmse_sum_deg"] += rmse_deg
            sums["rmse_square_sum_deg2"] += rmse_deg**2
            sums["peak_deg"] = max(sums["peak_deg"], run["worst_peak_deg"])

    def rows(self) -> list[dict[str, Any]]:
        """Return the rows of ``station_hours``."""
        return [{"hour": stored_time(hour), "station": station} | sums for (hour, station), sums in self._sums.items()]


def outcome_row(episode_id: UUID, values: dict[str, list[tuple[datetime, float]]]) -> dict[str, Any]:
    """Return the row of ``episode_outcomes``. ``values``: time and value of each measure, in order."""
    begin_at, end_at = episode_changes.ends(values)
    return {
        "episode_id": episode_id.hex, "begin_at": stored_time(begin_at), "end_at": stored_time(end_at),
        "changes": episode_changes.pack(values),
    }  # fmt: skip


def stored_time(at: datetime) -> str:
    """Return a time in SQLite's storage form. PostgreSQL accepts it if its time zone is UTC."""
    return at.replace(tzinfo=None).isoformat(" ", "microseconds")
