"""How much of a run was played, counted from its journal."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal
from uuid import UUID

import numpy as np
import pytest

from kata.clinic.sessions import runs
from kata.clinic.sessions.tables import RunRow
from kata.database import series
from kata.database.engine import Database
from kata.device.config import StationConfig
from kata.device.journal import (
    PHASE_APPROACHING,
    PHASE_PAUSED,
    PHASE_PLAYING,
    PHASE_REDUCED_RANGE,
    PHASE_RETURNING,
    PHASE_REVERSING,
    Journal,
    JournalEnd,
)
from kata.motion import edit
from kata.motion.edit import PlaybackSettings
from kata.motion.method import Method
from tests.support.databases import upgraded_file
from tests.support.imported_runs import Clinic

Reason = Literal["completed", "returned", "stopped", "unloaded"]
Part = tuple[int, float, float]
"""A phase, and its first and last place on the path, in seconds."""
THRICE = PlaybackSettings(repetitions=3, pause_s=1.0)
"""The recording lasts 2 s and ends at another place and in full motion (:func:`ends_s`)."""


@pytest.fixture
def clinic(tmp_path: Path) -> Iterator[Clinic]:
    database = Database(upgraded_file(tmp_path / "kata.db"))
    yield Clinic(tmp_path, database)
    database.close()


def ends_s(number: int) -> float:
    """Eased at both ends by 0.2 s; a pause, 20 deg back by minimum jerk at 15 deg/s, and a pause between."""
    return number * 2.4 + (number - 1) * (1.0 + 1.875 * 20 / 15 + 1.0)


def journal(run_id: UUID, parts: list[Part], end: JournalEnd | None, rate_hz: int) -> Journal:
    steps = [(phase, np.arange(0.0, abs(to - begin), 1 / rate_hz), begin, to) for phase, begin, to in parts]
    phase = np.concatenate([[value] * len(step) for value, step, *_ in steps]) if parts else np.zeros(0)
    path_s = np.concatenate([begin + np.sign(to - begin) * step for _, step, begin, to in steps]) if parts else phase
    count = len(phase)
    angles = np.zeros((count, 5), dtype=np.float32)
    return Journal(
        kind="run", id=str(run_id), recording_id=None, station="Station 1", rate_hz=rate_hz,
        started_at=datetime(2026, 11, 21, tzinfo=UTC), started_ns=0,
        t_ns=np.arange(count, dtype=np.int64) * (1_000_000_000 // rate_hz), take=np.zeros(count, dtype=np.uint32),
        phase=phase.astype(np.uint8), path_s=path_s, setpoint_deg=angles, measured_deg=angles, torque_nm=angles,
        end=end, truncated=False,
    )  # fmt: skip


def play(
    clinic: Clinic,
    *parts: Part,
    reason: Reason | None = "returned",
    asked: PlaybackSettings = THRICE,
    method: Method = "smooth",
) -> RunRow:
    run_id = clinic.begin_run(clinic.recording(), asked, method)
    end = JournalEnd(reason=reason) if reason else None
    with clinic.database.write() as session:
        stored = runs.complete(
            session, journal(run_id, list(parts), end, 10 if method == "paper" else 100), StationConfig()
        )
        assert stored
        return stored


@pytest.mark.parametrize(
    ("reached_s", "done"), [(1.0, 0), (ends_s(1) - 0.05, 0), (ends_s(1), 1), (ends_s(2) - 0.05, 1), (ends_s(2) + 1, 2)]
)
def test_aborted_run_counts_the_repetitions_it_finished(clinic: Clinic, reached_s: float, done: int) -> None:
    run = play(clinic, (PHASE_APPROACHING, 0.0, 0.0), (PHASE_PLAYING, 0.0, reached_s), (PHASE_RETURNING, 0.0, 9.0))
    assert run.repetitions_done == done
    assert run.played_s == pytest.approx(reached_s, abs=0.02)


def test_run_played_to_its_end_counts_all_repetitions(clinic: Clinic) -> None:
    assert play(clinic, (PHASE_PLAYING, 0.0, ends_s(3)), reason="completed").repetitions_done == 3


def test_last_sample_counts_at_ten_hertz_too(clinic: Clinic) -> None:
    assert play(clinic, (PHASE_PLAYING, 0.0, ends_s(1) - 0.05), method="paper").repetitions_done == 1


def test_reduced_or_reversed_repetitions_count_as_repetitions(clinic: Clinic) -> None:
    run = play(
        clinic,
        (PHASE_REDUCED_RANGE, 0.0, 2.0),
        (PHASE_REVERSING, 2.0, 1.0),
        (PHASE_PAUSED, 1.0, 1.0),
        (PHASE_REDUCED_RANGE, 1.0, ends_s(1)),
    )
    assert run.repetitions_done == 1
    # Forward, back and forward again: all three count as time on the path.
    assert run.played_s == pytest.approx(ends_s(1) + 2.0, abs=0.05)


@pytest.mark.parametrize(("parts", "reason"), [([], "unloaded"), ([(PHASE_APPROACHING, 0.0, 1.0)], "stopped")])
def test_unplayed_run_has_no_repetitions(clinic: Clinic, parts: list[Part], reason: Any) -> None:
    run = play(clinic, *parts, reason=reason)
    assert (run.repetitions_done, run.played_s) == (0, 0.0)


def test_run_of_a_dead_process_counts_what_it_recorded(clinic: Clinic) -> None:
    run = play(clinic, (PHASE_PLAYING, 0.0, ends_s(2)), reason=None)
    assert (run.outcome, run.repetitions_done) == ("interrupted", 2)


def test_recording_is_read_and_edited_once_per_run(clinic: Clinic, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[object] = []
    made: list[object] = []
    unpack, with_settings = series.unpack, edit.with_settings

    def counted_unpack(*given: Any) -> Any:
        read.append(given)
        return unpack(*given)

    def counted_with_settings(motion: Any, asked: Any) -> Any:
        made.append(asked)
        return with_settings(motion, asked)

    monkeypatch.setattr("kata.clinic.sessions.run_results.unpack", counted_unpack)
    monkeypatch.setattr(edit, "with_settings", counted_with_settings)

    # Counted, held against with less range, and compared.
    run = play(clinic, (PHASE_REDUCED_RANGE, 0.0, 2.0), (PHASE_PLAYING, 2.0, ends_s(1)))

    assert (run.repetitions_done, run.least_range_percent, run.samples is None) == (1, 0, False)
    assert len(read) == 1
    assert made == [THRICE]
