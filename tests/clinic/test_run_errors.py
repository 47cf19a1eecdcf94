"""A run's errors include the compared share, the start, the clock, and the changes by settings."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from kata.clinic.progress import service as progress
from kata.clinic.sessions import runs
from kata.clinic.sessions.schemas import Run
from kata.clinic.sessions.tables import RunRow, SessionRow
from kata.database.engine import Database
from kata.device.config import StationConfig
from kata.device.journal import (
    PHASE_PAUSED,
    PHASE_REDUCED_RANGE,
    Journal,
    JournalEnd,
    JournalHeader,
    synthetic_journal,
)
from kata.motion.edit import PlaybackSettings
from kata.motion.linkage import Floats
from kata.plotting import figures
from tests.support.databases import SQLITE_FIRST
from tests.support.imported_runs import STARTED, Clinic, pose


@pytest.fixture
def clinic(tmp_path: Path, database: Database) -> Clinic:
    return Clinic(tmp_path, database)


def lifted(clinic: Clinic) -> Callable[..., Run]:
    """Teach an arm that is lifted and lowered in 4 s; return a function that plays it with a journal of the given angles."""
    clinic.journal("teaching", clinic.begin_teaching(), [4.0], at=pose, end=JournalEnd(reason="finished"))
    clinic.importer.run()
    recording_id = clinic.saved[-1].id

    def play(change: Callable[[Journal, Floats], Journal], asked: PlaybackSettings | None = None) -> Run:
        run_id = clinic.begin_run(recording_id, asked or PlaybackSettings())
        header = JournalHeader(
            kind="run",
            id=str(run_id),
            recording_id=None,
            station="Station 1",
            rate_hz=100,
            started_at=STARTED,
            started_ns=0,
        )
        with clinic.database.write() as session:
            motion = runs.motion_of(session, runs.get(session, run_id))
            times_s = np.arange(0.0, motion.duration_s, 0.01)
            angles = motion.at(times_s)
            plain = synthetic_journal(
                header, times_s, angles, angles, np.zeros_like(angles), JournalEnd(reason="completed")
            )
            runs.complete(session, change(plain, angles), StationConfig())
        with clinic.database.read() as session:
            return runs.as_run(runs.get(session, run_id))

    return play


def third(run: Run) -> dict[str, float | None]:
    assert run.comparison
    return run.comparison.motors[2].model_dump()


# -- Reduce range ---------------------------------------------------------------------------------------------------


def reduced_from(first: int) -> Callable[[Journal, Floats], Journal]:
    """Reduce the range from a sample on: the arm is at half of its way, and 5 deg off besides."""

    def change(journal: Journal, angles: Floats) -> Journal:
        phase, measured = journal.phase.copy(), angles.copy()
        phase[first:] = PHASE_REDUCED_RANGE
        measured[first:] = angles[0] + (angles[first:] - angles[0]) / 2 + 5.0
        return replace(journal, phase=phase, measured_deg=measured.astype(np.float32))

    return change


@SQLITE_FIRST
def test_run_with_reduced_range_is_partial_and_not_in_progress(clinic: Clinic) -> None:
    run = lifted(clinic)(reduced_from(30))
    assert run.comparison
    assert run.comparison.samples == 30
    assert run.compared_percent == pytest.approx(100 * 30 / 400, abs=0.1)
    assert run.partial
    with clinic.database.read() as session:
        row = session.get_one(RunRow, run.id)
        assert (row.worst_rmse_deg, row.worst_peak_deg) == (None, None)
        episode_id = session.get_one(SessionRow, run.session_id).episode_id
        assert episode_id
        assert progress.tracked(session, progress.timeline_of(session, episode_id)) == []


@SQLITE_FIRST
def test_run_reduced_for_a_moment_is_a_whole_figure(clinic: Clinic) -> None:
    run = lifted(clinic)(reduced_from(365))
    assert run.compared_percent == pytest.approx(100 * 365 / 400, abs=0.3)
    assert not run.partial
    with clinic.database.read() as session:
        assert session.get_one(RunRow, run.id).worst_peak_deg is not None


@SQLITE_FIRST
def test_run_reduced_at_once_says_that_nothing_was_compared(clinic: Clinic) -> None:
    run = lifted(clinic)(reduced_from(0))
    assert (run.comparison, run.compared_percent, run.partial) == (None, 0.0, True)


def ended_after(seconds: float, reason: Literal["stopped", "returned"]) -> Callable[[Journal, Floats], Journal]:
    """End the playback early."""

    def change(journal: Journal, _: Floats) -> Journal:
        count = round(seconds * 100)
        names = ("t_ns", "phase", "path_s", "setpoint_deg", "measured_deg", "torque_nm")
        shorter = {name: getattr(journal, name)[:count] for name in names}
        return replace(journal, **shorter, end=JournalEnd(reason=reason))

    return change


@SQLITE_FIRST
@pytest.mark.parametrize("reason", ["stopped", "returned"])
def test_playback_ended_in_its_first_repetition_is_partial(
    clinic: Clinic, reason: Literal["stopped", "returned"]
) -> None:
    """All its time is compared, but the error of two seconds once counted like that of the whole motion."""
    play = lifted(clinic)
    short = play(ended_after(2.0, reason), PlaybackSettings(repetitions=2))
    whole = play(ended_after(5.0, reason), PlaybackSettings(repetitions=2))
    assert (short.compared_percent, whole.compared_percent) == (100.0, 100.0)
    assert (short.repetitions_done, whole.repetitions_done) == (0, 1)
    assert (short.partial, whole.partial) == (True, False)
    with clinic.database.read() as session:
        assert session.get_one(RunRow, short.id).worst_rmse_deg is None
        assert session.get_one(RunRow, whole.id).worst_rmse_deg is not None
        episode_id = session.get_one(SessionRow, short.session_id).episode_id
        assert episode_id
        (tracked,) = progress.tracked(session, progress.timeline_of(session, episode_id))
        assert tracked.playbacks == 1


def test_former_run_with_reduced_range_is_partial(clinic: Clinic) -> None:
    """Before 0011 the compared share was not stored."""
    play = lifted(clinic)
    reduced, whole = play(reduced_from(100)), play(lambda journal, _: journal)
    with clinic.database.write() as session:
        for run in (reduced, whole):
            session.get_one(RunRow, run.id).compared_percent = None
    with clinic.database.read() as session:
        assert runs.as_run(session.get_one(RunRow, reduced.id)).partial
        assert not runs.as_run(session.get_one(RunRow, whole.id)).partial


# -- the start ------------------------------------------------------------------------------------------------------


@SQLITE_FIRST
def test_start_is_apart_with_its_sign(clinic: Clinic) -> None:
    def change(journal: Journal, angles: Floats) -> Journal:
        error = -2.0 * np.exp(-journal.path_s / 0.05) + np.where(journal.path_s > 2.0, 0.5, 0.0)
        return replace(journal, measured_deg=(angles + error[:, None]).astype(np.float32))

    figures_ = third(lifted(clinic)(change))
    assert figures_["start_deg"] == pytest.approx(-2.0, abs=1e-3)
    assert figures_["peak_deg"] == pytest.approx(0.5, abs=1e-3)
    assert figures_["rmse_deg"] == pytest.approx(0.5 * np.sqrt(199 / 350), rel=0.02)


# -- the clock ------------------------------------------------------------------------------------------------------

RAMP_S = 0.094


def slow_start(journal: Journal, angles: Floats) -> Journal:
    """The wall clock is ahead of the path by a start ramp; the arm is exactly where the path is, with a pause of 3 s."""
    times_s = journal.path_s + RAMP_S * np.minimum(journal.path_s / 0.2, 1.0)
    phase = journal.phase.copy()
    phase[200:210] = PHASE_PAUSED
    times_s[205:] += 3.0
    return replace(journal, t_ns=np.round(times_s * 1e9).astype(np.int64), phase=phase)


@SQLITE_FIRST
def test_wall_clock_shows_the_start_ramp_and_no_pause(clinic: Clinic) -> None:
    run = lifted(clinic)(slow_start)
    assert run.clock_offset_s == pytest.approx(RAMP_S, abs=1e-3)
    figures_ = third(run)
    assert figures_["peak_deg"] == pytest.approx(0.0, abs=1e-3)
    # 80 deg up and down in 4 s: at most 62.8 deg/s, all of it before the pause at the top.
    assert figures_["wall_peak_deg"] == pytest.approx(-62.8 * RAMP_S, rel=0.02)
    assert figures_["wall_rmse_deg"] == pytest.approx(62.8 * RAMP_S / np.sqrt(2) / np.sqrt(2), rel=0.15)


@SQLITE_FIRST
def test_figure_offers_the_wall_clock(clinic: Clinic) -> None:
    run = lifted(clinic)(slow_start)
    with clinic.database.read() as session:
        wall = figures.run_lines(runs.figure_samples(session, run.id, clock="wall"))
        path = figures.run_lines(runs.figure_samples(session, run.id))
        part = figures.run_lines(runs.figure_samples(session, run.id, (1.0, 1.5), "wall"))
        drawn = json.loads(figures.run(runs.figure_samples(session, run.id, clock="wall")))
    assert np.abs(path["error_deg"]).max() < 1e-3
    assert wall["error_deg"][:, 2].min() == pytest.approx(-62.8 * RAMP_S, rel=0.02)
    assert wall["played_s"][100, 2] == pytest.approx(path["played_s"][100, 2] + RAMP_S)
    # A window does not move the clock.
    assert part["played_s"].min() >= 1.0
    assert part["error_deg"][:, 2].min() == pytest.approx(wall["error_deg"][:, 2].min())
    assert drawn["motors"][0]["figure"]["layout"]["xaxis"]["title"]["text"] == "Real time, s"


# -- following, and change by settings ------------------------------------------------------------------------------


@SQLITE_FIRST
def test_half_the_range_follows_and_is_half_changed(clinic: Clinic) -> None:
    run = lifted(clinic)(lambda journal, _: journal, PlaybackSettings(range_percent=50.0, repetitions=2, pause_s=0.5))
    figures_ = third(run)
    assert figures_["peak_deg"] == pytest.approx(0.0, abs=1e-3)
    assert figures_["change_deg"] == pytest.approx(-40.0, abs=0.1)
    assert run.comparison
    scapula, arm = run.comparison.motions
    # The scapula's angle is not linear in the motors' angles: half of these is about half of it.
    assert scapula.change_deg == pytest.approx(-5.0, abs=0.5)
    assert arm.change_deg == pytest.approx(-40.0, abs=0.1)


@SQLITE_FIRST
def test_run_as_taught_is_not_changed(clinic: Clinic) -> None:
    run = lifted(clinic)(lambda journal, angles: replace(journal, measured_deg=(angles + 0.5).astype(np.float32)))
    assert third(run)["change_deg"] == 0.0
    assert third(run)["peak_deg"] == pytest.approx(0.5, abs=1e-3)


@SQLITE_FIRST
def test_reduce_range_is_a_change_too(clinic: Clinic) -> None:
    # Half of the 80 deg at the top, and the 5 deg.
    assert third(lifted(clinic)(reduced_from(30)))["change_deg"] == pytest.approx(-35.0, abs=0.1)
