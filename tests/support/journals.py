"""Journal headers and samples."""

from datetime import UTC, datetime

from kata.device.journal import JournalHeader, JournalWriter, Sample

HEADER = JournalHeader(
    kind="run",
    id="a-run",
    recording_id="a-recording",
    station="S",
    rate_hz=100,
    started_at=datetime(2026, 1, 2, tzinfo=UTC),
    started_ns=0,
)


MS = 1_000_000


def values(t_ns: int) -> list[float]:
    return [t_ns / MS + axis for axis in range(5)]


def give(writer: JournalWriter, t_ns: int) -> None:
    angles = values(t_ns)
    writer.append_sample(Sample(
        t_ns=t_ns, take=1, phase=0, path_s=0.0, setpoint_deg=angles, measured_deg=angles, torque_nm=[0.0] * 5))  # fmt: skip
