"""Live rhythm beside the rhythm of the simulated arm, in stepped time. No encoder measures the arm's angles."""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest

from kata.device.config import simulated
from kata.device.ipc_messages import Load
from kata.device.journal import PHASE_PLAYING, Journal
from kata.evaluation.station import VirtualStation
from kata.motion.axes import APPARATUS_SIGNS, Side
from kata.motion.linkage import motor_angles_deg
from kata.motion.rhythm import rhythm_of
from kata.motion.taught import Taught
from kata.simulator.independent.plant import IndependentPlant
from kata.simulator.mechanics import MakeMechanics
from kata.simulator.plant import Plant
from kata.station.live_rhythm import LiveRhythm
from kata.station.rhythm_schemas import RhythmLive
from tests.support.rhythm_motions import evenly, times_of, wave

PLANTS: dict[str, MakeMechanics] = {"simple": Plant, "mujoco": partial(IndependentPlant, balancer_kg=3.0)}


class Watched(VirtualStation):
    """A station whose snapshots give the live rhythm."""

    def __init__(self, side: Side, plant: str) -> None:
        self.live = LiveRhythm()
        self.newest: RhythmLive | None = None
        """The live rhythm of the take or run, which is cleared at its end."""
        super().__init__(simulated("virtual"), 0, side, make_mechanics=PLANTS[plant])

    def after_cycle(self) -> None:
        super().after_cycle()
        if self._link.snapshot:
            self.live.take(self._link.snapshot, self.config.side)
            self.newest = self.live.live() or self.newest


@dataclass(frozen=True)
class Ratios:
    """Ratios of all phases and both directions, None without a ratio."""

    live: dict[str, list[float | None]]
    true: dict[str, list[float | None]]

    def errors(self) -> list[float]:
        pairs = [(a, b) for name, row in self.true.items() for a, b in zip(self.live[name], row, strict=True)]
        return [a - b for a, b in pairs if a is not None and b is not None]


def compared(station: Watched, journal: Journal) -> Ratios:
    found = station.newest
    assert found is not None
    moving = journal.t_ns[journal.phase == PHASE_PLAYING] if journal.kind == "run" else journal.t_ns
    side = station.config.side
    # The turned apparatus measures motors 3 and 4 with the other sign.
    arm_deg = station.arm_deg(moving) * (1, 1, *APPARATUS_SIGNS[side][2:])
    truth = rhythm_of((moving - moving[0]) / 1e9, arm_deg, side)
    return Ratios(
        {curve.direction: [*(band.ratio for band in curve.bands), curve.whole.ratio] for curve in found.curves},
        {one.widest.direction: [*(band.ratio for band in one.bands), one.whole.ratio] for one in truth.rhythms},
    )


def taught(station: Watched, ratio: float) -> Ratios:
    """Teach an abduction with this ratio by the simulated hand."""
    poses = evenly(wave(12.0, min(95.0, 12.0 + 19.0 * (1 + ratio)), 8.0), ratio)
    return compared(station, station.teach(Taught("Abduction", times_of(poses), poses)))


def played(station: Watched, ratio: float) -> Ratios:
    """Play the same abduction."""
    poses = evenly(wave(12.0, min(95.0, 12.0 + 19.0 * (1 + ratio)), 8.0), ratio)
    load = Load(
        run_id="run", recording_id="recording", times_s=times_of(poses).astype("<f8").tobytes(),
        angles_deg=motor_angles_deg(poses, station.config.side).astype("<f8").tobytes(),
    )  # fmt: skip
    return compared(station, station.play(load, 8.0))


@pytest.mark.parametrize(
    ("plant", "side", "ratio"),
    [("simple", "right", 2.0), pytest.param("mujoco", "left", 3.0, marks=pytest.mark.campaign)],
)
def test_live_ratio_of_a_take_and_a_playback_is_true(plant: str, side: Side, ratio: float) -> None:
    station = Watched(side, plant)
    for found in (taught(station, ratio), played(station, ratio)):
        assert set(found.live) == set(found.true) == {"raising", "lowering"}
        errors = found.errors()
        assert len(errors) >= 4
        assert np.abs(errors).max() < 0.2
