"""Defines origin and formats of a file of samples, and writes it.

Write it in the worker process that builds figures, because an hour of samples would block the service's heartbeats. The libraries of the
formats are imported there only.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from kata.database.series import Series, unpack

SampleFormat = Literal["csv", "parquet", "mcap", "lerobot.zip"]
"""End of the file's name. ``lerobot.zip`` only for a run."""
SIMULATED: Final = "simulated"
"""Column that marks a file from a simulated apparatus."""


@dataclass(frozen=True)
class Origin:
    """Origin of samples. Outside the clinic, the patient's id identifies no person."""

    kind: Literal["recording", "run"]
    id: str
    patient_id: str
    side: str
    station: str
    rate_hz: int | None
    begins_at: str
    """Time of the first sample in UTC, ISO 8601."""
    simulated: bool
    """True if the apparatus was simulated."""

    @property
    def marked_id(self) -> str:
        """Return the id for a file's name, with a mark if the apparatus was simulated."""
        return f"{self.id}-simulated" if self.simulated else self.id


def write(series: Series, origin: Origin, sample_format: SampleFormat, path: Path) -> None:
    """Write stored samples to a file.

    :raises UnreadableError: when they are damaged.
    """
    from kata.interop.sample_table import write_table

    write_table(unpack(series), origin, sample_format, path)
