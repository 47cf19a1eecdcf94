"""The therapist's hand: takes the arm, presses the pedal, traces a motion, lets go. Radians inside."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final, Literal

import numpy as np

from kata.motion.approach import Approach
from kata.motion.axes import N_AXES
from kata.motion.linkage import motor_angles_deg

Phase = Literal["away", "reaching", "tracing", "leaving"]

_STIFFNESS_NM: Final = 500.0
_DAMPING_NM_S: Final = 25.0
_STRENGTH_NM: Final = 15.0
_REACH_DEG_S: Final = 30.0
_REST_S: Final = 0.3


class HandRefusedError(Exception):
    """The hand cannot do this now; the message says why."""


class Motion:
    """What the hand is to trace, put together piece by piece: the wire must not wait while a long one is worked out."""

    def __init__(self) -> None:
        """Without a row yet."""
        self.times_s: list[float] = []
        self.angles: list[list[float]] = []
        """Motor angles in radians, one row for each time."""

    @property
    def rows(self) -> int:
        """How many."""
        return len(self.times_s)

    def add(self, times_s: Sequence[float], poses_deg: Sequence[Sequence[float]]) -> None:
        """Append rows: times (n,) and poses (n, 5).

        :raises HandRefusedError: when they do not fit together or the apparatus cannot reach them.
        """
        if len(times_s) != len(poses_deg) or any(len(pose) != N_AXES for pose in poses_deg):
            raise HandRefusedError("a motion needs five angles for each time")
        if any(later <= earlier for earlier, later in pairwise([*self.times_s[-1:], *times_s])):
            raise HandRefusedError("a motion needs time that increases")
        if not times_s:
            return
        try:
            angles = np.radians(motor_angles_deg(np.array(poses_deg)))
        except ValueError as error:
            raise HandRefusedError(f"{error}, counted from the one at {times_s[0]:g} s") from error
        self.times_s += times_s
        self.angles += angles.tolist()


class Hand:
    """Pulls the arm along a motion like a spring with a damper, as strongly as a hand is."""

    def __init__(self) -> None:
        self.phase: Phase = "away"
        self.motion: str | None = None
        self.wants_pedal = False
        """Whether the therapist's foot is on the pedal for this motion now."""
        self._with_pedal = False
        self._time_s = 0.0
        self._reach: Approach | None = None
        self._times_s: list[float] = []
        self._angles: list[list[float]] = []
        self._row = 0
        self._last: list[float] | None = None

    def guide(self, name: str, motion: Motion, here_deg: Sequence[float], pedal: bool) -> None:
        """Begin with a motion of two rows or more; the arm's motor angles are ``here_deg``."""
        self.phase, self.motion, self._with_pedal = "reaching", name, pedal
        self._time_s, self._row, self._last = 0.0, 0, None
        self._times_s, self._angles = motion.times_s, motion.angles
        self._reach = Approach(np.array(here_deg), np.degrees(self._angles[0]), _REACH_DEG_S)

    def let_go(self) -> None:
        """At once, and lift the foot."""
        self.phase, self.motion, self.wants_pedal, self._last = "away", None, False, None

    @property
    def left_s(self) -> float:
        """Until the hand has let go."""
        return max(0.0, self._ends_s - self._time_s) if self.phase != "away" else 0.0

    def torques_nm(self, angle: Sequence[float], speed: Sequence[float], dt_s: float) -> Sequence[float] | None:
        """What the hand does to the five axes in this step; None when it is away."""
        if self.phase == "away":
            return None
        target = self._target(dt_s)
        if target is None:
            self.let_go()
            return None
        last = self._last or target
        self._last = target
        torques = []
        for n, wanted in enumerate(target):
            torque = _STIFFNESS_NM * (wanted - angle[n]) + _DAMPING_NM_S * ((wanted - last[n]) / dt_s - speed[n])
            torques.append(min(max(torque, -_STRENGTH_NM), _STRENGTH_NM))
        return torques

    @property
    def _traces_s(self) -> float:
        return (self._reach.duration_s if self._reach else 0.0) + _REST_S

    @property
    def _duration_s(self) -> float:
        return self._times_s[-1] - self._times_s[0]

    @property
    def _ends_s(self) -> float:
        return self._traces_s + self._duration_s + 2 * _REST_S

    def _target(self, dt_s: float) -> list[float] | None:
        """Where the hand wants the arm next, radians; None when it is done."""
        assert self._reach is not None
        self._time_s += dt_s
        since_s = self._time_s - self._traces_s
        if since_s < 0:
            # The foot goes down a little before the motion begins, and comes up a little after its end.
            self.wants_pedal = self._with_pedal and since_s > -_REST_S / 3
            return [math.radians(angle) for angle in self._reach.at(self._time_s).tolist()]
        if since_s <= self._duration_s:
            self.phase = "tracing"
            self.wants_pedal = self._with_pedal
            return self._along(self._times_s[0] + since_s)
        self.phase = "leaving"
        self.wants_pedal = self._with_pedal and since_s < self._duration_s + _REST_S / 3
        return self._angles[-1] if self._time_s < self._ends_s else None

    def _along(self, time_s: float) -> list[float]:
        while self._row < len(self._times_s) - 2 and self._times_s[self._row + 1] <= time_s:
            self._row += 1
        begins, ends = self._times_s[self._row], self._times_s[self._row + 1]
        share = min(max((time_s - begins) / (ends - begins), 0.0), 1.0)
        return [a + (b - a) * share for a, b in zip(self._angles[self._row], self._angles[self._row + 1], strict=True)]
