"""Carrying cases out on virtual time, over all processors, with the same figures in the same order whatever they do."""

import gc
import logging
import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from typing import Final

import numpy as np
from msgspec import structs

from kata.device.config import StationConfig, simulated
from kata.device.journal import PHASE_PLAYING, Journal
from kata.device.messages import Load
from kata.evaluation.cases import Case
from kata.evaluation.outcome import Outcome, Played, Recording
from kata.evaluation.station import EvaluationError, VirtualStation
from kata.motion.learning import Correction, learn
from kata.motion.linkage import OutOfReachError
from kata.motion.method import Method, reference
from kata.simulator.hand import HandRefusedError

PLAYS_TO_LEARN: Final = 5
"""After four repetitions there is little left to learn; the fifth play shows it."""


@dataclass(frozen=True)
class Job:
    """A case taught once to an apparatus of its own, and played by one method several times: what one process does at a time.

    A figure does not depend on what else was asked for.
    """

    case: Case
    method: Method
    repetitions: int
    seed: int | None


def carry_out(jobs: Sequence[Job], done: Callable[[Job], None]) -> list[Outcome]:
    """Every playback, in the order of the jobs; ``done`` hears of each job as it ends, in any order."""
    spawning = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(mp_context=spawning, initializer=_settle) as pool:
        futures = {pool.submit(play, job): job for job in jobs}
        for future in as_completed(futures):
            future.result()
            done(futures[future])
        return [outcome for future in futures for outcome in future.result()]


def play(job: Job) -> list[Outcome]:
    """Teach, and play as often as wanted; what goes wrong is told and ends the job."""
    case, method, config = job.case, job.method, simulated("virtual")
    outcomes: list[Outcome] = []
    correction: Correction | None = None
    try:
        station = VirtualStation(config, job.seed, case.side)
        began_ns = station.t_ns
        taught = _recorded(station.teach(case.motion))
        for repetition in range(1, job.repetitions + 1):
            station.put_back(case.laid_down(job.seed, repetition))
            run = station.play(_load(taught, method, repetition, correction), case.motion.duration_s)
            clock_s = (station.t_ns - began_ns) / 1e9
            began_ns = station.t_ns
            outcomes.append(Outcome(case, method, repetition, job.seed, clock_s=clock_s).compared(taught, _played(run)))
            if method == "learned":
                correction = _learned(correction, taught, run, config)
    except (EvaluationError, HandRefusedError, OutOfReachError) as error:
        outcomes.append(Outcome(case, method, len(outcomes) + 1, job.seed, problem=str(error)))
    return outcomes


def _recorded(teaching: Journal) -> Recording:
    """The recording that a teaching's first take becomes."""
    taken = teaching.take == 1
    times_ns = teaching.t_ns[taken]
    return Recording((times_ns - times_ns[0]) / 1e9, teaching.measured_deg[taken].astype(np.float64))


def _played(run: Journal) -> Played:
    playing = run.phase == PHASE_PLAYING
    measured, torque = run.measured_deg[playing].astype(np.float64), run.torque_nm[playing].astype(np.float64)
    return Played(run.path_s[playing], measured, torque)


def _load(taught: Recording, method: Method, repetition: int, correction: Correction | None) -> Load:
    load = Load(
        run_id=str(repetition),
        recording_id="recording",
        times_s=taught.times_s.astype("<f8").tobytes(),
        angles_deg=taught.angles_deg.astype("<f8").tobytes(),
        method=method,
    )
    if correction is None:
        return load
    data = correction.angles_deg.astype("<f8").tobytes()
    return structs.replace(load, correction_deg=data, correction_step_s=correction.step_s)


def _learned(before: Correction | None, taught: Recording, run: Journal, config: StationConfig) -> Correction:
    """What the station has learned after this run."""
    threshold_nm = np.array([axis.max_torque_nm for axis in config.axes])
    trajectory = reference("learned", taught.times_s, taught.angles_deg)
    return learn(before, trajectory, run.repetition, config.lag, threshold_nm, np.array(config.mechanism_deg))


def _settle() -> None:
    """What was imported stays: the collector need not look at it again and again."""
    logging.disable(logging.INFO)
    gc.collect()
    gc.freeze()
