"""Calculates speed and distance of the arm's fall after a category 0 stop on the independent plant: ``python -m kata.evaluation.falls``.

The arm is at rest in a posture of one of the six motions. All torque is switched off at once, and no person supports the arm.
"""

import math
from dataclasses import dataclass
from typing import Final

from rich.console import Console
from rich.table import Table

from kata.motion.axes import N_AXES
from kata.motion.linkage import motor_angles_deg
from kata.simulator.independent.plant import IndependentPlant
from kata.simulator.parameters import SLOW_STEPS, STEP_S

POSTURES: Final = (
    ("1, scapula abducted", (16.0, 0.0, 10.0, 0.0, 0.0)),
    ("2, scapula rotated upward", (0.0, 16.0, 10.0, 0.0, 0.0)),
    ("3, raised sideways", (0.0, 0.0, 90.0, 0.0, 0.0)),
    ("3, raised sideways, flexed horizontally", (0.0, 0.0, 90.0, 60.0, 0.0)),
    ("4, abducted", (0.0, 0.0, 100.0, 0.0, 0.0)),
    ("5, raised forward", (0.0, 0.0, 10.0, 90.0, 0.0)),
    ("5, raised overhead", (0.0, 0.0, 10.0, 150.0, 0.0)),
    ("6, raised forward, rotated inward", (0.0, 0.0, 10.0, 90.0, -70.0)),
    ("6, raised forward, rotated outward", (0.0, 0.0, 10.0, 90.0, 30.0)),
)
"""Ends of the built-in motions, with the motion's number."""
REACTION_S: Final = 0.3
"""Shortest time (assumed) in which a therapist whose hands are near the arm takes hold of it."""
_LASTS_S: Final = 1.5


@dataclass(frozen=True)
class Fall:
    """The fall of the axis (motors 3 to 5) that moves most: highest speed, angle after :data:`REACTION_S` and largest angle."""

    motor: int
    fastest_deg_s: float
    after_reaction_deg: float
    largest_deg: float


def fall(posture_deg: tuple[float, ...], balancer_kg: float) -> Fall:
    """Let the right arm of a healthy patient fall from a posture (five angles of the body in degrees). Return the fall."""
    plant = IndependentPlant(balancer_kg=balancer_kg)
    for axis, angle in enumerate(motor_angles_deg(posture_deg).tolist()):
        plant.place(axis, math.radians(angle))
    begin = [math.degrees(axis.arm_angle) for axis in plant.axes]
    rows: list[list[float]] = []
    fastest = [0.0] * N_AXES
    for n in range(round(_LASTS_S / STEP_S)):
        if n % SLOW_STEPS == 0:
            plant.update_slow_loads()
        plant.step((0.0,) * N_AXES)
        fastest = [max(before, abs(axis.arm_speed)) for before, axis in zip(fastest, plant.axes, strict=True)]
        rows.append([abs(math.degrees(axis.arm_angle) - start) for axis, start in zip(plant.axes, begin, strict=True)])
    largest = [max(column) for column in zip(*rows, strict=True)]
    worst = max(range(2, N_AXES), key=lambda axis: largest[axis])
    soon = rows[round(REACTION_S / STEP_S) - 1]
    return Fall(worst + 1, math.degrees(fastest[worst]), soon[worst], largest[worst])


def main() -> None:
    """Print the table of the safety documentation."""
    table = Table("Posture", "Balancer, kg", "Motor", "Fastest, deg/s", f"After {REACTION_S} s, deg", "In 1.5 s, deg")
    for name, posture in POSTURES:
        for balancer_kg in (2.0, 1.5, 0.0):
            result = fall(posture, balancer_kg)
            figures = (result.fastest_deg_s, result.after_reaction_deg, result.largest_deg)
            table.add_row(name, f"{balancer_kg}", f"{result.motor}", *(f"{figure:.0f}" for figure in figures))
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
