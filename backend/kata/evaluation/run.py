"""Runs cases in virtual time on all processors. Figures and their order do not depend on the number of processors."""

import gc
import logging
import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np
from msgspec import structs

from kata.commissioning.direct_station import PlaybackError, RefusedPlayError
from kata.device.config import StationConfig, simulated
from kata.device.ipc_messages import Load
from kata.device.journal import PHASE_PLAYING, Journal
from kata.evaluation.cases import Case
from kata.evaluation.excitation import identified
from kata.evaluation.outcome import CaseResult, PlaybackSamples, TaughtRecording
from kata.evaluation.station import VirtualStation
from kata.motion.ilc import Correction, next_correction
from kata.motion.linkage import OutOfReachError
from kata.motion.method import Method, reference
from kata.simulator.hand import HandRefusedError
from kata.simulator.independent.patients import PatientName
from kata.simulator.mechanics import MakeMechanics, PlantName, mechanics_named

PLAYS_TO_LEARN: Final = 5
"""Number of playbacks of the learned method. It learns little after four repetitions, so the fifth playback shows the result."""


@dataclass(frozen=True)
class MechanicsChoice:
    """The simulated mechanics."""

    plant: PlantName = "simple"
    patient: PatientName = "healthy"
    """Patient of the independent plant. The simple plant has only a healthy patient."""
    balancer_kg: float | None = None
    """Balancer's weight in kg on the independent plant. None: the balancer of its parameters."""

    @property
    def make_mechanics(self) -> MakeMechanics:
        """The function that makes the mechanics of a seed for one side."""
        return mechanics_named(self.plant, self.patient, self.balancer_kg)


@dataclass(frozen=True)
class Job:
    """A case taught once to its own apparatus and played several times by one method. One process runs one job.

    The figures of a job do not depend on other jobs.
    """

    case: Case
    method: Method
    repetitions: int
    seed: int | None
    judge: MechanicsChoice = MechanicsChoice()


def jobs(
    cases: Sequence[Case],
    methods: Sequence[Method],
    repetitions: int | None,
    seeds: Sequence[int | None],
    judge: MechanicsChoice,
) -> list[Job]:
    """Return a job for every seed, case and method, in this order."""
    return [
        Job(case, method, repetitions or (PLAYS_TO_LEARN if method == "learned" else 1), seed, judge)
        for seed in seeds
        for case in cases
        for method in methods
    ]


def evaluate_jobs(to_run: Sequence[Job], done: Callable[[Job], None], processes: int | None = None) -> list[CaseResult]:
    """Run all jobs. Return their outcomes in the order of the jobs. ``done`` is called when a job ends, in any order.

    The first playback of ``learned`` has no correction and equals that of ``smooth``, so it is played only once.

    :param processes: number of processes at a time; None: one for each processor.
    """
    learning = {_played_as(job): n for n, job in enumerate(to_run) if job.method == "learned"}
    copies = {
        n: learning[_played_as(job)]
        for n, job in enumerate(to_run)
        if job.method == "smooth" and job.repetitions == 1 and _played_as(job) in learning
    }
    # Each process has one processor. Threads of NumPy's linear algebra would only take the processors from each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    spawning = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, mp_context=spawning, initializer=_settle) as pool:
        futures = {pool.submit(play, job): n for n, job in enumerate(to_run) if n not in copies}
        results: dict[int, list[CaseResult]] = {}
        for future in as_completed(futures):
            results[futures[future]] = future.result()
            done(to_run[futures[future]])
    for n, learned in copies.items():
        results[n] = [replace(results[learned][0], method="smooth", clock_s=0.0)]
        done(to_run[n])
    return [outcome for n in range(len(to_run)) for outcome in results[n]]


def _played_as(job: Job) -> tuple[object, ...]:
    return job.case.name, job.case.side, job.seed, job.judge


def play(job: Job) -> list[CaseResult]:
    """Teach once and play ``job.repetitions`` times. An error becomes an outcome with a problem and ends the job."""
    case, method = job.case, job.method
    outcomes: list[CaseResult] = []
    correction: Correction | None = None
    station: VirtualStation | None = None
    began_ns = 0
    try:
        config = _config(job.judge, job.seed)
        if isinstance(config, PlaybackError):
            raise RefusedPlayError(f"The station cannot be identified. {config}")
        station = VirtualStation(config, job.seed, case.side, make_mechanics=job.judge.make_mechanics)
        began_ns = station.t_ns
        taught = _recorded(station, station.teach(case.motion))
        for repetition in range(1, job.repetitions + 1):
            station.reposition(case.repositioning(job.seed, repetition))
            run = station.play(_load(taught, method, repetition, correction), case.motion.duration_s)
            clock_s = (station.t_ns - began_ns) / 1e9
            began_ns = station.t_ns
            outcome = CaseResult(case, method, repetition, job.seed, plant=job.judge.plant, clock_s=clock_s).compared(
                taught, _played(station, run)
            )
            outcome.compute_figures()
            outcomes.append(outcome)
            if method == "learned":
                correction = _learn(correction, taught, run, station.config)
    except (PlaybackError, HandRefusedError, OutOfReachError) as error:
        refused, plant = isinstance(error, RefusedPlayError), job.judge.plant
        clock_s = (station.t_ns - began_ns) / 1e9 if station else 0.0
        failed = CaseResult(case, method, len(outcomes) + 1, job.seed, problem=str(error), refused=refused, plant=plant)
        outcomes.append(replace(failed, clock_s=clock_s))
    return outcomes


@cache
def _config(judge: MechanicsChoice, seed: int | None) -> StationConfig | PlaybackError:
    """Return the station's configuration. On the independent plant, drives and load are first identified with a healthy arm, as in
    commissioning. Return the error, which is cached too, if the drives cannot carry this arm in any movement of the identification.

    The stored lags of the simple plant are not used on the independent plant.
    """
    config = simulated("virtual")
    healthy = replace(judge, patient="healthy")
    if judge.plant == "simple":
        return config
    try:
        return identified(config, seed, healthy.make_mechanics)
    except PlaybackError as error:
        return error


def _recorded(station: VirtualStation, teaching: Journal) -> TaughtRecording:
    """Return the recording of a teaching's first take."""
    of_first_take = teaching.take == 1
    times_ns = teaching.t_ns[of_first_take]
    measured = teaching.measured_deg[of_first_take].astype(np.float64)
    return TaughtRecording((times_ns - times_ns[0]) / 1e9, measured, station.arm_deg(times_ns))


def _played(station: VirtualStation, run: Journal) -> PlaybackSamples:
    playing = run.phase == PHASE_PLAYING
    measured, torque = run.measured_deg[playing].astype(np.float64), run.torque_nm[playing].astype(np.float64)
    return PlaybackSamples(run.path_s[playing], measured, torque, station.arm_deg(run.t_ns[playing]))


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
    """Return the correction that is learned from this run."""
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
