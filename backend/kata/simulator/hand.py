"""Simulates the therapist's hand: it takes the arm, presses the pedal, traces a motion and lets go. Internal angles are in radians.

The hand traces the motion with tremor and a slow deviation, like a human hand.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final, Literal

import numpy as np

from kata.motion.approach import MinimumJerkMove
from kata.motion.axes import N_AXES
from kata.motion.linkage import OutOfReachError, motor_angles_deg
from kata.simulator import parameters, texts
from kata.simulator.parameters import SLOW_STEPS, STEP_S, TURNED, Waves

Phase = Literal["away", "reaching", "tracing", "leaving"]

STRIDE_S: Final = SLOW_STEPS * STEP_S
"""Interval between the hand's targets. Between two targets it moves linearly."""
_DEVIATION_RAMP_S: Final = 1.0
"""Time in which the hand's deviations grow from zero, after it has taken the arm."""


class HandRefusedError(Exception):
    """The hand cannot do this now. The exception's message states the reason."""


class GuidedMotion:
    """A motion for the hand. It is added in parts, so that a long motion does not delay the servos' bus."""

    def __init__(self) -> None:
        """Start without rows."""
        self.times_s: list[float] = []
        self.angles: list[list[float]] = []
        """Motor angles in radians, one row for each time."""
        self.turned_angles: list[list[float]] = []
        """The same motion for the other shoulder, in the drives' angles of the turned apparatus."""

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.times_s)

    def add(self, times_s: Sequence[float], poses_deg: Sequence[Sequence[float]]) -> None:
        """Append rows: times (n,) and poses (n, 5).

        :raises HandRefusedError: when times and poses do not fit together, or the apparatus cannot reach a pose.
        """
        if len(times_s) != len(poses_deg) or any(len(pose) != N_AXES for pose in poses_deg):
            raise HandRefusedError(texts.MOTION_NEEDS_FIVE_ANGLES())
        if any(later <= earlier for earlier, later in pairwise([*self.times_s[-1:], *times_s])):
            raise HandRefusedError(texts.MOTION_NEEDS_INCREASING_TIME())
        if not times_s:
            return
        try:
            angles = np.radians(motor_angles_deg(poses_deg))
            turned = np.radians(motor_angles_deg(poses_deg, "left")) * TURNED
        except OutOfReachError as error:
            location = {"row": error.index, "first_s": times_s[0]}
            raise HandRefusedError(texts.COUNTED_FROM(reason=error.text, **location)) from error
        self.times_s += times_s
        self.angles += angles.tolist()
        self.turned_angles += turned.tolist()


class SimulatedHand:
    """Pulls the arm along a motion like a spring with a damper and limited force."""

    def __init__(self, seed: int | None = None, *, turned: bool = False) -> None:
        """Start away from the arm. ``seed``: chooses another therapist with other deviations. ``turned``: True if the
        apparatus is turned.
        """
        self.parameters = parameters.hand(seed)
        self.phase: Phase = "away"
        self.motion: str | None = None
        self.wants_pedal = False
        """True while the therapist's foot presses the pedal for this motion."""
        self._turned = turned
        self._with_pedal = False
        self._time_s = 0.0
        self._reach: MinimumJerkMove | None = None
        self._times_s: list[float] = []
        self._angles: list[list[float]] = []
        self._row = 0
        self._guiding_s = 0.0
        """Total guiding time, so that deviations differ between motions."""
        random_source, values = parameters.random_stream("hand", seed), self.parameters
        self._deviations = tuple(
            (
                Waves.drawn(random_source, math.radians(values.tremor_deg), values.tremor_hz),
                Waves.drawn(random_source, math.radians(values.wander_deg), values.wander_hz),
            )
            for _ in range(N_AXES)
        )

    def guide(self, name: str, motion: GuidedMotion, here_deg: Sequence[float], pedal: bool) -> None:
        """Begin a motion of two or more rows. ``here_deg``: present motor angles of the arm."""
        self.phase, self.motion, self._with_pedal = "reaching", name, pedal
        self._time_s, self._row = 0.0, 0
        self._times_s, self._angles = motion.times_s, motion.turned_angles if self._turned else motion.angles
        self._reach = MinimumJerkMove(np.array(here_deg), np.degrees(self._angles[0]), self.parameters.reach_deg_s)

    def let_go(self) -> None:
        """Release arm and pedal at once."""
        self.phase, self.motion, self.wants_pedal = "away", None, False

    @property
    def left_s(self) -> float:
        """Time until the hand lets go, seconds."""
        return max(0.0, self._ends_s - self._time_s) if self.phase != "away" else 0.0

    def next_target(self) -> list[float] | None:
        """Return the target in radians for the time :data:`STRIDE_S` from now. At the end let go and return None."""
        target = self._target(STRIDE_S)
        if target is None:
            self.let_go()
            return None
        self._guiding_s += STRIDE_S
        share = min(self._time_s / _DEVIATION_RAMP_S, 1.0)
        return [
            angle + share * (tremor.at(self._guiding_s) + wander.at(self._guiding_s))
            for angle, (tremor, wander) in zip(target, self._deviations, strict=True)
        ]

    @property
    def _traces_s(self) -> float:
        return (self._reach.duration_s if self._reach else 0.0) + self.parameters.rest_s

    @property
    def _duration_s(self) -> float:
        return self._times_s[-1] - self._times_s[0]

    @property
    def _ends_s(self) -> float:
        return self._traces_s + self._duration_s + 2 * self.parameters.rest_s

    def _target(self, dt_s: float) -> list[float] | None:
        """Return the next target in radians without deviations; None at the end."""
        assert self._reach is not None
        self._time_s += dt_s
        since_s = self._time_s - self._traces_s
        if since_s < 0:
            # The pedal is pressed shortly before the motion and released shortly after it.
            self.wants_pedal = self._with_pedal and since_s > -self.parameters.rest_s / 3
            return [math.radians(angle) for angle in self._reach.at(self._time_s).tolist()]
        if since_s <= self._duration_s:
            self.phase = "tracing"
            self.wants_pedal = self._with_pedal
            return self._along(self._times_s[0] + since_s)
        self.phase = "leaving"
        self.wants_pedal = self._with_pedal and since_s < self._duration_s + self.parameters.rest_s / 3
        return self._angles[-1] if self._time_s < self._ends_s else None

    def _along(self, time_s: float) -> list[float]:
        while self._row < len(self._times_s) - 2 and self._times_s[self._row + 1] <= time_s:
            self._row += 1
        begins, ends = self._times_s[self._row], self._times_s[self._row + 1]
        share = min(max((time_s - begins) / (ends - begins), 0.0), 1.0)
        return [a + (b - a) * share for a, b in zip(self._angles[self._row], self._angles[self._row + 1], strict=True)]
