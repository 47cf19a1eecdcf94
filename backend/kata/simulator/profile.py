"""Calculates how a servo's goal moves (ROBOTIS e-Manual, X series, "What is the Profile" and "Velocity Control Mode").

Units are radians and seconds. Without a limit of the speed, the trajectory jumps to its goal.
"""

import math
from typing import Final, Literal

ProfileShape = Literal["step", "rectangular", "triangular", "trapezoidal"]
_ARRIVED_RAD: Final = 1e-6


class Profile:
    """The trajectory between two goals. A limit of 0 means "no limit", as in the registers."""

    def __init__(self) -> None:
        self.angle = 0.0
        """Present angle of the trajectory."""
        self.speed = 0.0
        self.acceleration = 0.0
        """Present acceleration of the trajectory; 0 where the speed jumps, because its acceleration is not limited."""
        self.shape: ProfileShape = "step"
        self._goal = 0.0
        self._highest = 0.0
        self._acceleration = 0.0
        self._keeps_speed = False

    @property
    def moves(self) -> bool:
        """True while the trajectory has not reached its goal."""
        return self._keeps_speed or self.shape != "step"

    def stop(self, angle: float) -> None:
        """Put the trajectory at an angle, at rest."""
        self.angle = self._goal = angle
        self.speed = self.acceleration = 0.0
        self.shape, self._keeps_speed = "step", False

    def follow(self, goal: float, highest: float, acceleration: float) -> None:
        """Begin a trajectory to a goal with these limits of speed and acceleration."""
        self._goal, self._highest, self._acceleration = goal, highest, acceleration
        self._keeps_speed = False
        self.shape = self._planned(abs(goal - self.angle))
        if self.shape == "step":
            self.stop(goal)

    def follow_in_time(self, goal: float, total_s: float, acceleration_s: float) -> None:
        """Begin a trajectory that takes ``total_s``, of which it accelerates for ``acceleration_s``."""
        if not total_s:
            self.stop(goal)
            return
        accelerates_s = min(acceleration_s, total_s / 2)
        highest = abs(goal - self.angle) / (total_s - accelerates_s)
        self.follow(goal, highest, highest / accelerates_s if accelerates_s else 0.0)

    def keep_speed(self, speed: float, acceleration: float) -> None:
        """Move with this speed until another command."""
        self._goal, self._highest, self._acceleration = 0.0, speed, acceleration
        self._keeps_speed = True

    def advance(self, dt_s: float) -> None:
        """Advance the trajectory."""
        if self._keeps_speed:
            self._approach_speed(self._highest, dt_s)
            self.angle += self.speed * dt_s
            return
        left = self._goal - self.angle
        highest = self._highest
        if self._acceleration:
            # With the square root alone, the last step would pass the goal.
            brakes = math.sqrt(2 * self._acceleration * abs(left)) - self._acceleration * dt_s / 2
            highest = min(highest, max(brakes, self._acceleration * dt_s))
        self._approach_speed(math.copysign(highest, left), dt_s)
        step = self.speed * dt_s
        if abs(left) <= max(abs(step), _ARRIVED_RAD) and step * left >= 0.0:
            self.stop(self._goal)
        else:
            self.angle += step

    def _approach_speed(self, wanted: float, dt_s: float) -> None:
        change = wanted - self.speed
        most = self._acceleration * dt_s
        if most and abs(change) > most:
            change = math.copysign(most, change)
        self.speed += change
        self.acceleration = change / dt_s if most else 0.0

    def _planned(self, distance: float) -> ProfileShape:
        if distance <= _ARRIVED_RAD or not self._highest:
            return "step"
        if not self._acceleration:
            return "rectangular"
        return "triangular" if distance * self._acceleration < self._highest**2 else "trapezoidal"
