"""The same in real time: through the service's own processes, to the simulated apparatus behind a pseudo-terminal or to the
configured one.
"""

import asyncio
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kata.clinic.recordings.tables import RecordingRow
from kata.device.journal import PHASE_PLAYING
from kata.evaluate.outcome import Outcome, Played, Recording
from kata.evaluate.run import Job
from kata.motion.axes import Side
from kata.motion.linkage import OutOfReachError, motor_angles_deg
from kata.problems import ProblemError
from kata.rehearsal import Rehearsal, RehearsalError, Show, rehearsing
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

    ``station``: the configured apparatus; it is turned once, which ``turn_to`` asks for, and one folder keeps all that is known of
    it: its emergency stop is tried once a day, not before each case. A simulated one is new for each job.
    """
    sides = list(dict.fromkeys(job.case.side for job in jobs))
    found: dict[int, list[Outcome]] = {}
    with TemporaryDirectory(prefix="kata-evaluate-") as kept:
        # Turning the apparatus is work for two.
        for side in sides if station else [None]:
            if side:
                turn_to(side)
            for place, job in enumerate(jobs):
                if side in (None, job.case.side):
                    with nullcontext(kept) if station else TemporaryDirectory(dir=kept) as folder:
                        found[place] = asyncio.run(_play(job, station, Path(folder), show))
                    done(job)
    return [outcome for place in range(len(jobs)) for outcome in found[place]]


async def _play(job: Job, station: Path | None, folder: Path, show: Show) -> list[Outcome]:
    """Teach, and play as often as wanted; what goes wrong is told and ends the job."""
    outcomes: list[Outcome] = []
    settings = Settings(
        data=folder, database_url="", station=station, simulate=station is None, seed=job.seed, rate_hz=None
    )
    try:
        async with rehearsing(settings, show) as rehearsal:
            recording = await _recording(rehearsal, job, simulated=settings.simulate)
            for repetition in range(1, job.repetitions + 1):
                if settings.simulate:
                    laid_down = job.case.laid_down(job.seed, repetition)
                    await rehearsal.guide(laid_down, "Putting the arm back", pedal=False)
                run = await rehearsal.play(recording, job.method)
                taught, played = rehearsal.samples(run)
                playing = np.flatnonzero(played["phase"] == PHASE_PLAYING)
                measured = Played(*(played[name][playing] for name in ("path_s", "measured_deg", "torque_nm")))
                outcome = Outcome(job.case, job.method, repetition, job.seed)
                outcomes.append(outcome.compared(Recording(taught.times_s, taught.angles_deg), measured))
            rehearsal.end()
    except (RehearsalError, ProblemError, HandRefusedError, OutOfReachError) as error:
        outcomes.append(Outcome(job.case, job.method, len(outcomes) + 1, job.seed, problem=str(error)))
    return outcomes


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
