"""Writes a station's file and commissioning record for simulated drives that a program treats as real drives."""

from datetime import UTC, datetime
from pathlib import Path

from msgspec import structs

from kata.commissioning.procedure import STEPS, begin_record
from kata.commissioning.record import CommissioningRecord, RecordedStep, record_path, sealed, write_record
from kata.device import config
from kata.device.config import StationConfig


def write_commissioned(station: StationConfig, path: Path, ended_at: datetime | None = None) -> CommissioningRecord:
    """Write the file of a station and its record. ``ended_at``: end of the commissioning; None: now."""
    at = (ended_at or datetime.now(UTC)).isoformat(timespec="seconds")
    config.write(station, path)
    steps = tuple(RecordedStep(step.key, at, at, passed=True) for step in STEPS)
    record = sealed(structs.replace(begin_record(config.read(path), "simulated drives"), steps=steps, passed=True))
    return write_record(record, record_path(path))
