"""Live and stored end-range time beside the truth, on the simulated station in stepped time."""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest

from kata.clinic.sessions import end_range
from kata.clinic.sessions.schemas import EndRangePrescription
from kata.device.config import simulated
from kata.device.ipc_messages import RESISTANCE_LEVELS, Load, Snapshot
from kata.evaluation.end_feel import BALANCER_KG, STARTS_DEG, EndFeelCase, PatientStation, StiffPlant
from kata.evaluation.excitation import identified
from kata.motion.edit import Motion
from kata.motion.end_range import EndRange, EndRangeThreshold, end_range_time_s
from kata.simulator.independent.plant import IndependentPlant
from kata.simulator.mechanics import MakeMechanics
from kata.simulator.parameters import REST_DEG
from kata.station.live_end_range import LiveEndRange

MOTOR, ABDUCTION = 3, 4
"""Motor, and number of its motion in Table 2."""
START_DEG = STARTS_DEG[MOTOR]


@dataclass(frozen=True)
class Holding:
    """How the end of the motion is reached and held."""

    moved_s: float
    held_s: float
    held_nm: float
    """Torque of the capsule at the end."""
    holds: int


LONG = Holding(moved_s=3.0, held_s=5.0, held_nm=1.6, holds=1)
SLOW = Holding(moved_s=6.0, held_s=6.0, held_nm=1.2, holds=3)
"""A larger part of the counted time is near the prescribed torque, so that an error of the torque changes it more."""


class Watched(PatientStation):
    """A station whose snapshots are counted live, and whose arm is noted in every cycle."""

    def __init__(self, case: EndFeelCase) -> None:
        self.live: LiveEndRange | None = None
        self.snapshots: list[Snapshot] = []
        weight: MakeMechanics = partial(StiffPlant, dummy=True, motor=case.motor)
        if case.plant == "mujoco":
            weight = partial(IndependentPlant, balancer_kg=BALANCER_KG, dummy=True)
        super().__init__(case, identified(simulated("virtual"), case.seed, weight))

    def after_cycle(self) -> None:
        super().after_cycle()
        newest = self._link.snapshot
        if self.live and newest and newest.run and (not self.snapshots or newest is not self.snapshots[-1]):
            self.snapshots.append(newest)
            self.live.take(newest)


@dataclass(frozen=True)
class Counted:
    """Seconds of one playback."""

    true_s: float
    live_s: float
    stored_s: float


def held(end_deg: float, holding: Holding) -> Motion:
    """Return a motion that holds its end several times."""
    times, angles = [0.0], [START_DEG]
    for _ in range(holding.holds):
        for lasts_s in (1.0, holding.moved_s, holding.held_s, holding.moved_s):
            times.append(times[-1] + lasts_s)
        angles += [START_DEG, end_deg, end_deg, START_DEG]
    at = np.arange(0.0, times[-1], 0.01)
    postures = np.tile(np.array(REST_DEG), (len(at), 1))
    # Slow at each end, as a hand guides an arm.
    share = (np.interp(at, times, angles) - START_DEG) / (end_deg - START_DEG)
    postures[:, MOTOR - 1] = START_DEG + (end_deg - START_DEG) * share * share * (3 - 2 * share)
    return Motion(at, postures)


def counted(case: EndFeelCase, prescribed: EndRangePrescription, holding: Holding) -> Counted:
    """Play to the end, hold there, and count in three ways."""
    station = Watched(case)
    grid = np.arange(START_DEG, 118.0, 0.1)
    end_deg = float(grid[np.argmax(station.elastic_nm(grid) > holding.held_nm)])
    motion = held(end_deg, holding)
    station.live = end_range.live(motion, "right", station.config, prescribed, RESISTANCE_LEVELS)
    assert station.live
    station.against_nm.clear()
    load = Load(
        run_id="run", recording_id="recording", times_s=motion.times_s.astype("<f8").tobytes(),
        angles_deg=motion.angles_deg.astype("<f8").tobytes(),
    )  # fmt: skip
    journal = station.play(load, motion.duration_s)
    times = np.array([t_ns for t_ns, _ in station._arm]) / 1e9
    angles = np.array([row[MOTOR - 1] for _, row in station._arm])
    truth = EndRange(end_deg, 1, EndRangeThreshold(prescribed.band_deg, prescribed.torque_nm))
    true_s = end_range_time_s(times, angles, station.against_nm[-len(times) :], truth)
    counter = end_range.counter(motion, "right", station.config, prescribed)
    counter.add((journal.t_ns - journal.t_ns[0]) / 1e9, journal.measured_deg, journal.torque_nm)
    live_s = station.live.live().counted_s
    assert live_s is not None
    return Counted(true_s, live_s, counter.times_s()[MOTOR])


def test_live_and_stored_time_are_within_two_percent() -> None:
    prescribed = EndRangePrescription(motion=ABDUCTION, minutes=5.0, band_deg=8.0, torque_nm=0.7)
    found = counted(EndFeelCase("simple", 0, "healthy", MOTOR), prescribed, LONG)
    assert found.true_s > LONG.holds * LONG.held_s
    assert found.stored_s == pytest.approx(found.true_s, rel=0.02)
    assert found.live_s == pytest.approx(found.stored_s, rel=0.02)
    assert found.live_s == pytest.approx(found.true_s, rel=0.02)


@pytest.mark.campaign
@pytest.mark.timeout(600)
def test_slow_movements_near_the_torque_are_within_two_percent() -> None:
    """On the plant whose arm is a rigid body, as the identified load assumes."""
    prescribed = EndRangePrescription(motion=ABDUCTION, minutes=5.0, band_deg=10.0, torque_nm=0.5)
    found = counted(EndFeelCase("mujoco", 0, "frozen", MOTOR), prescribed, SLOW)
    assert found.true_s > SLOW.holds * SLOW.held_s
    assert found.stored_s == pytest.approx(found.true_s, rel=0.02)
    assert found.live_s == pytest.approx(found.true_s, rel=0.03)
