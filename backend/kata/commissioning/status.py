"""Determines from its record and configuration whether a station is commissioned, and when the periodic check is due."""

from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final

from kata.commissioning import texts
from kata.commissioning.record import CHECKED, RecordError, has_configuration, read_record, record_path
from kata.device.config import StationConfig
from kata.messages import Text

PERIODIC_CHECK_INTERVAL: Final = timedelta(days=7)
"""Longest time from the commissioning, or from a periodic check, to the next periodic check."""


@dataclass(frozen=True)
class CommissioningStatus:
    """``missing``: the reason why the station is not commissioned; None if it is. ``due_at``: date of the next periodic check."""

    missing: Text | None
    due_at: datetime | None = None
    commissioned_at: datetime | None = None


def commissioning_status(station: Path, config: StationConfig) -> CommissioningStatus:
    """Return the status of the station with this file. ``config``: the file's content."""
    try:
        record = read_record(record_path(station))
    except RecordError:
        return CommissioningStatus(texts.RECORD_CHANGED())
    if record is None:
        return CommissioningStatus(texts.NO_RECORD())
    if not record.passed:
        return CommissioningStatus(texts.COMMISSIONING_UNFINISHED())
    if not has_configuration(record, config):
        return CommissioningStatus(texts.CONFIGURATION_CHANGED())
    newest = {ran.step: ran for ran in record.checks}
    if not all(ran.passed for ran in newest.values()):
        return CommissioningStatus(texts.CHECK_FAILED())
    # The date of a check is that of its oldest step. Without a check, the commissioning's own runs of these steps count.
    checked = newest or {ran.step: ran for ran in record.steps if ran.step in CHECKED}
    ended_at = [ran.ended_at for ran in checked.values()] or [record.steps[-1].ended_at]
    due_at = datetime.fromisoformat(min(ended_at)) + PERIODIC_CHECK_INTERVAL
    return CommissioningStatus(None, due_at, datetime.fromisoformat(record.steps[-1].ended_at))
