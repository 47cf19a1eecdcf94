"""Runs a station in virtual time: the real control loop, supervisor and driver with simulated drives and mechanics in one process.

Every byte passes through driver, CRC and simulated registers. Only the clock is stepped and the disk is in memory. The result depends
only on configuration and seed.
"""

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from kata.commissioning.direct_station import DirectStation
from kata.device.config import StationConfig
from kata.device.ipc_messages import FinishTeaching, Load, Teach
from kata.device.journal import Journal
from kata.evaluation.world import World
from kata.motion.axes import CANONICAL_SIDE, Side
from kata.motion.linkage import Floats
from kata.motion.taught import Taught
from kata.simulator.hand import GuidedMotion
from kata.simulator.mechanics import MakeMechanics
from kata.simulator.plant import Plant


class VirtualStation(DirectStation):
    """One simulated apparatus and its control, from switching it on. The therapist's hands hold the arm until the motors do."""

    def __init__(
        self,
        config: StationConfig,
        seed: int | None = None,
        side: Side = CANONICAL_SIDE,
        *,
        make_mechanics: MakeMechanics = Plant,
    ) -> None:
        """Connect. ``config``: for the canonical side. ``seed``: varies the simulated mechanics, which ``make_mechanics`` makes."""
        config = structs.replace(config, side=side)
        turned = side != CANONICAL_SIDE
        self._world = World(config, seed, turned=turned, make_mechanics=make_mechanics)
        self._world.apparatus.support()
        self._arm: list[tuple[int, tuple[float, ...]]] = []
        super().__init__(config, self._world.open_transport, lambda: self._world.t_ns, self._world.sleep)

    @property
    def t_ns(self) -> int:
        """Time of the station's clock."""
        return self._world.t_ns

    def arm_deg(self, t_ns: NDArray[np.int64]) -> Floats:
        """Return the true angles of the arm at times since the last teaching or load, ``(n,)`` to ``(n, 5)``."""
        times = np.array([at_ns for at_ns, _ in self._arm])
        angles = np.array([row for _, row in self._arm])
        return np.column_stack([np.interp(t_ns, times, column) for column in angles.T])

    def teach(self, motion: Taught) -> Journal:
        """Teach with the simulated hand and the pedal pressed. Return the journal.

        :raises PlaybackError: when the apparatus stops.
        """
        self._arm.clear()
        self.send(Teach(teaching_id="teaching", side=self.config.side))
        self._guide(motion, pedal=True)
        self.send(FinishTeaching())
        return self.journal()

    def reposition(self, motion: Taught) -> None:
        """Let the hand guide the arm without recording."""
        self._guide(motion, pedal=False)

    def play(self, load: Load, duration_s: float) -> Journal:
        """See :meth:`DirectStation.play`."""
        self._arm.clear()
        return super().play(load, duration_s)

    def after_cycle(self) -> None:
        """Record the arm's true angles."""
        self._arm.append((self._world.t_ns, self._world.apparatus.arm_deg))

    def _guide(self, motion: Taught, *, pedal: bool) -> None:
        hand = GuidedMotion()
        hand.add(motion.times_s.tolist(), motion.poses_deg.tolist())
        self._world.apparatus.guide(motion.name, hand, pedal)
        duration_s = self._world.apparatus.state().hand.left_s
        self.until(lambda: self._world.apparatus.hand_is_away, "the hand does not finish", duration_s)
