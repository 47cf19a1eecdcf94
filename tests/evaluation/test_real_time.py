"""Virtual time gives the same figures as real time through the service, the device process and a pseudo-terminal."""

from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from kata.bench.commissioned import write_commissioned
from kata.device import config
from kata.evaluation import real_time
from kata.evaluation.cases import Case
from kata.evaluation.outcome import CaseResult
from kata.evaluation.run import Job, play
from kata.motion.axes import AXES
from kata.motion.linkage import motor_angles_deg
from kata.motion.taught import Taught
from kata.simulator.process import SimulatorProcess


@pytest.mark.campaign
def test_both_agree_within_a_fifth_of_a_degree(short: Taught) -> None:
    """Compares the RMSE and the 95th percentile of the errors.

    When the computer stops for some cycles, the drives hold their last setpoint, and a few errors exceed those on virtual time. The
    station is not their cause.
    """
    job = Job(Case("short", "right", short, AXES), "smooth", 1, 1)
    (virtual,) = play(job)
    (real,) = real_time.evaluate_jobs([job], None, lambda side: None, lambda *_: None, lambda _: None)

    assert real.problem is None
    assert virtual.problem is None
    for motor, theirs in zip(virtual.motors, real.motors, strict=True):
        assert abs(motor.rmse_deg - theirs.rmse_deg) <= 0.2, motor.motor
        assert abs(motor.start_deg - theirs.start_deg) <= 0.2, motor.motor
    assert np.abs(_percentile_deg(virtual) - _percentile_deg(real)).max() <= 0.2


def test_configured_apparatus_plays_the_motion_itself(tmp_path: Path, short: Taught) -> None:
    turned: list[str] = []
    tested: list[str] = []
    with closing(SimulatorProcess(tmp_path)) as apparatus, closing(apparatus.client()) as hand:

        def obey(step: str, total_s: float, left_s: float) -> None:
            """Test the emergency stop when the step asks for it, like a person at the apparatus."""
            if step in ("Press the emergency stop", "Release it"):
                hand.estop(step.startswith("Press"))
                if left_s == 0.0:
                    tested.append(step)

        station = tmp_path / "station.toml"
        write_commissioned(config.simulated(apparatus.port), station)
        job = Job(Case("short", "right", short, AXES), "smooth", 1, None)
        outcome, again = real_time.evaluate_jobs([job, job], station, turned.append, obey, lambda _: None)

    assert turned == ["right"]
    # Once a day, not before each case.
    assert tested == ["Press the emergency stop", "Release it"]
    assert (outcome.problem, again.problem) == (None, None)
    assert outcome.comparison is not None
    wanted = motor_angles_deg(short.poses_deg)
    assert outcome.comparison.taught_deg.max(axis=0) == pytest.approx(wanted.max(axis=0), abs=0.1)
    assert all(motor.rmse_deg <= 0.5 for motor in outcome.motors)


def _percentile_deg(outcome: CaseResult) -> np.typing.NDArray[np.float64]:
    assert outcome.comparison is not None
    percentile: np.typing.NDArray[np.float64] = np.percentile(np.abs(outcome.comparison.error_deg), 95, axis=0)
    return percentile
