"""Runs cases on virtual time on all processors. Figures and their order do not depend on the processors."""

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
from kata.evaluation.outcome import Outcome, PlaybackSamples, TaughtRecording
from kata.evaluation.station import EvaluationError, VirtualStation
from kata.motion.ilc import Correction, next_correction
from kata.motion.linkage import OutOfReachError
from kata.motion.method import Method, reference
from kata.simulator.hand import HandRefusedError

PLAYS_TO_LEARN: Final = 5
"""The method learns little after four repetitions; the fifth play shows the result."""


@dataclass(frozen=True)
class Job:
    """A case taught once to its own apparatus and played several times by one method. One process runs one job.

    A figure does not depend on the other jobs.
    """

    case: Case
    method: Method
    repetitions: int
    seed: int | None


def jobs(
    cases: Sequence[Case], methods: Sequence[Method], repetitions: int | None, seeds: Sequence[int | None]
) -> list[Job]:
    """Return a job for every seed, case and method, in this order."""
    return [
        Job(case, method, repetitions or (PLAYS_TO_LEARN if method == "learned" else 1), seed)
        for seed in seeds
        for case in cases
        for method in methods
    ]


def evaluate_jobs(to_run: Sequence[Job], done: Callable[[Job], None]) -> list[Outcome]:
    """Run all jobs and return their outcomes in the order of the jobs; call ``done`` when a job ends, in any order."""
    spawning = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(mp_context=spawning, initializer=_settle) as pool:
        futures = {pool.submit(play, job): job for job in to_run}
        for future in as_completed(futures):
            future.result()
            done(futures[future])
        return [outcome for future in futures for outcome in future.result()]


def play(job: Job) -> list[Outcome]:
    """Teach and play ``job.repetitions`` times. An error becomes an outcome with a problem and ends the job."""
    case, method, config = job.case, job.method, simulated("virtual")
    outcomes: list[Outcome] = []
    correction: Correction | None = None
    try:
        station = VirtualStation(config, job.seed, case.side)
        began_ns = station.t_ns
        taught = _recorded(station.teach(case.motion))
        for repetition in range(1, job.repetitions + 1):
            station.reposition(case.repositioning(job.seed, repetition))
            run = station.play(_load(taught, method, repetition, correction), case.motion.duration_s)
            clock_s = (station.t_ns - began_ns) / 1e9
            began_ns = station.t_ns
            outcomes.append(Outcome(case, method, repetition, job.seed, clock_s=clock_s).compared(taught, _played(run)))
            if method == "learned":
                correction = _learn(correction, taught, run, config)
    except (EvaluationError, HandRefusedError, OutOfReachError) as error:
        outcomes.append(Outcome(case, method, len(outcomes) + 1, job.seed, problem=str(error)))
    return outcomes


def _recorded(teaching: Journal) -> TaughtRecording:
    """Return the recording of a teaching's first take."""
    taken = teaching.take == 1
    times_ns = teaching.t_ns[taken]
    return TaughtRecording((times_ns - times_ns[0]) / 1e9, teaching.measured_deg[taken].astype(np.float64))


def _played(run: Journal) -> PlaybackSamples:
    playing = run.phase == PHASE_PLAYING
    measured, torque = run.measured_deg[playing].astype(np.float64), run.torque_nm[playing].astype(np.float64)
    return PlaybackSamples(run.path_s[playing], measured, torque)


def _load(taught: TaughtRecording, method: Method, repetition: int, correction: Correction | None) -> Load:
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


def _learn(before: Correction | None, taught: TaughtRecording, run: Journal, config: StationConfig) -> Correction:
    """Return the station's correction after this run."""
    threshold_nm = np.array([axis.max_torque_nm for axis in config.axes])
    trajectory = reference("learned", taught.times_s, taught.angles_deg)
    return next_correction(
        before, trajectory, run.repetition, config.servo_model, threshold_nm, np.array(config.mechanism_deg)
    )


def _settle() -> None:
    """Exclude imported objects from garbage collection."""
    logging.disable(logging.INFO)
    gc.collect()
    gc.freeze()
