"""Evaluates in real time, through the service's processes: on the simulated apparatus behind a pseudo-terminal, or on the configured
apparatus.
"""

import asyncio
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kata.clinic.recordings.tables import RecordingRow
from kata.device.journal import PHASE_PLAYING
from kata.errors import ProblemError
from kata.evaluation.outcome import CaseResult, PlaybackSamples, TaughtRecording
from kata.evaluation.run import Job
from kata.evaluation.service_driver import ServiceDriver, ServiceDriverError, Show, driving_service
from kata.motion.axes import Side
from kata.motion.linkage import OutOfReachError, motor_angles_deg
from kata.settings import Settings
from kata.simulator.hand import HandRefusedError


def evaluate_jobs(
    jobs: Sequence[Job],
    station: Path | None,
    confirm_side: Callable[[Side], None],
    show: Show,
    done: Callable[[Job], None],
) -> list[CaseResult]:
    """Run all jobs one after another and return their outcomes in the order of the jobs.

    ``station``: the configured apparatus. ``confirm_side`` asks a person to turn it, once for each side. One service runs all jobs of a
    side, so that the emergency stop is tested once and not before each case. In the simulation each job has its own apparatus.
    """
    results: dict[int, list[CaseResult]] = {}
    with TemporaryDirectory(prefix="kata-evaluate-") as parent:
        if station is None:
            for place, job in enumerate(jobs):
                with TemporaryDirectory(dir=parent) as folder:
                    (results[place],) = asyncio.run(_play([job], None, Path(folder), show, done))
        else:
            # Turning the apparatus needs two people. Do it once for each side.
            for side in dict.fromkeys(job.case.side for job in jobs):
                confirm_side(side)
                remaining = [place for place, job in enumerate(jobs) if job.case.side == side]
                while remaining:
                    played = asyncio.run(_play([jobs[place] for place in remaining], station, Path(parent), show, done))
                    results.update(zip(remaining, played, strict=False))
                    remaining = remaining[len(played) :]
    return [outcome for place in range(len(jobs)) for outcome in results[place]]


async def _play(
    jobs: Sequence[Job], station: Path | None, folder: Path, show: Show, done: Callable[[Job], None]
) -> list[list[CaseResult]]:
    """Run the jobs with one service until the first job fails, because that may leave a latched stop. Return at least one result."""
    results: list[list[CaseResult]] = []
    settings = Settings(
        data=folder, database_url="", station=station, simulate=station is None, seed=jobs[0].seed, rate_hz=None
    )
    try:
        async with driving_service(settings, show) as driver:
            for job in jobs:
                results.append([])
                await _repeat(driver, job, results[-1], simulated=settings.simulate)
                done(job)
            driver.end()
    except (ServiceDriverError, ProblemError, HandRefusedError, OutOfReachError) as error:
        if not results:
            results.append([])
        failed = jobs[len(results) - 1]
        results[-1].append(
            CaseResult(failed.case, failed.method, len(results[-1]) + 1, failed.seed, problem=str(error))
        )
        done(failed)
    return results


async def _repeat(driver: ServiceDriver, job: Job, outcomes: list[CaseResult], *, simulated: bool) -> None:
    """Teach and play ``job.repetitions`` times. ``outcomes`` receives each completed playback, so that they are kept if a
    later one fails.
    """
    recording = await _recording(driver, job, simulated=simulated)
    for repetition in range(1, job.repetitions + 1):
        if simulated:
            repositioning = job.case.repositioning(job.seed, repetition)
            await driver.guide(repositioning, "Putting the arm back", pedal=False)
        run = await driver.play(recording, job.method)
        taught, played = driver.samples(run)
        playing = np.flatnonzero(played["phase"] == PHASE_PLAYING)
        measured = PlaybackSamples(*(played[name][playing] for name in ("path_s", "measured_deg", "torque_nm")))
        outcome = CaseResult(job.case, job.method, repetition, job.seed)
        outcomes.append(outcome.compared(TaughtRecording(taught.times_s, taught.angles_deg), measured))


async def _recording(driver: ServiceDriver, job: Job, *, simulated: bool) -> RecordingRow:
    """Teach with the simulated hand. On a real apparatus, save the motion itself as the recording."""
    case = job.case
    if simulated:
        return await driver.teach(case.motion, case.side)
    # A person has confirmed that the apparatus is turned.
    await driver.set_side(case.side)
    return driver.save_recording(
        case.name, case.side, case.motion.times_s, motor_angles_deg(case.motion.poses_deg, case.side)
    )
