"""The same in real time: through the service's own processes, to the simulated apparatus behind a pseudo-terminal or to the
configured one.
"""

import asyncio
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kata.clinic.recordings.tables import RecordingRow
from kata.device.journal import PHASE_PLAYING
from kata.errors import ProblemError
from kata.evaluation.outcome import Outcome, Played, Recording
from kata.evaluation.run import Job
from kata.evaluation.service_driver import Rehearsal, RehearsalError, Show, rehearsing
from kata.motion.axes import Side
from kata.motion.linkage import OutOfReachError, motor_angles_deg
from kata.settings import Settings
from kata.simulator.hand import HandRefusedError


def carry_out(
    jobs: Sequence[Job],
    station: Path | None,
    turn_to: Callable[[Side], None],
    show: Show,
    done: Callable[[Job], None],
) -> list[Outcome]:
    """Every playback, in the order of the jobs, one after another.

    ``station``: the configured apparatus. It is turned once for each side, which ``turn_to`` asks for, and one service carries out all
    jobs of a side, so that its emergency stop is tested once and not before each case. A simulated one is new for each job.
    """
    found: dict[int, list[Outcome]] = {}
    with TemporaryDirectory(prefix="kata-evaluate-") as kept:
        if station is None:
            for place, job in enumerate(jobs):
                with TemporaryDirectory(dir=kept) as folder:
                    (found[place],) = asyncio.run(_play([job], None, Path(folder), show, done))
        else:
            # Turning the apparatus is work for two.
            for side in dict.fromkeys(job.case.side for job in jobs):
                turn_to(side)
                left = [place for place, job in enumerate(jobs) if job.case.side == side]
                while left:
                    played = asyncio.run(_play([jobs[place] for place in left], station, Path(kept), show, done))
                    found.update(zip(left, played, strict=False))
                    left = left[len(played) :]
    return [outcome for place in range(len(jobs)) for outcome in found[place]]


async def _play(
    jobs: Sequence[Job], station: Path | None, folder: Path, show: Show, done: Callable[[Job], None]
) -> list[list[Outcome]]:
    """Carry the jobs out with one service, up to and including the first that fails, which may leave a stop behind; at least one."""
    found: list[list[Outcome]] = []
    settings = Settings(
        data=folder, database_url="", station=station, simulate=station is None, seed=jobs[0].seed, rate_hz=None
    )
    try:
        async with rehearsing(settings, show) as rehearsal:
            for job in jobs:
                found.append([])
                await _repeat(rehearsal, job, found[-1], simulated=settings.simulate)
                done(job)
            rehearsal.end()
    except (RehearsalError, ProblemError, HandRefusedError, OutOfReachError) as error:
        if not found:
            found.append([])
        failed = jobs[len(found) - 1]
        found[-1].append(Outcome(failed.case, failed.method, len(found[-1]) + 1, failed.seed, problem=str(error)))
        done(failed)
    return found


async def _repeat(rehearsal: Rehearsal, job: Job, outcomes: list[Outcome], *, simulated: bool) -> None:
    """Teach, and play as often as wanted; what has been played stays in ``outcomes`` when the next one fails."""
    recording = await _recording(rehearsal, job, simulated=simulated)
    for repetition in range(1, job.repetitions + 1):
        if simulated:
            laid_down = job.case.laid_down(job.seed, repetition)
            await rehearsal.guide(laid_down, "Putting the arm back", pedal=False)
        run = await rehearsal.play(recording, job.method)
        taught, played = rehearsal.samples(run)
        playing = np.flatnonzero(played["phase"] == PHASE_PLAYING)
        measured = Played(*(played[name][playing] for name in ("path_s", "measured_deg", "torque_nm")))
        outcome = Outcome(job.case, job.method, repetition, job.seed)
        outcomes.append(outcome.compared(Recording(taught.times_s, taught.angles_deg), measured))


async def _recording(rehearsal: Rehearsal, job: Job, *, simulated: bool) -> RecordingRow:
    """Taught by the simulated hand; where there is none, the motion itself."""
    case = job.case
    if simulated:
        return await rehearsal.teach(case.motion, case.side)
    # Whoever was asked to turn the apparatus has done so.
    await rehearsal.stand_for(case.side)
    return rehearsal.given(
        case.name, case.side, case.motion.times_s, motor_angles_deg(case.motion.poses_deg, case.side)
    )
