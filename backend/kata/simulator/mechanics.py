"""Defines the boundary between drives and mechanics: one small protocol that every plant implements."""

from collections.abc import Sequence
from functools import partial
from typing import Final, Literal, Protocol

from kata.simulator.drive import Drive
from kata.simulator.independent.patients import PatientName

PlantName = Literal["simple", "mujoco"]
NO_MUJOCO: Final = "MuJoCo is not installed: pip install kata[evaluate]"

Hand = tuple[float, float, float, float, float]
"""A hand on one axis: target angle, change of the target in each step of 1 ms, stiffness, damping and maximum torque, in rad and Nm."""


class MechanicalAxis(Protocol):
    """One axis as the simulated apparatus uses it. Units are radians and seconds."""

    angle: float
    """Angle of the drive's shaft, which has the encoder."""
    speed: float
    arm_angle: float
    """Angle of the patient's arm, after the gear's play and soft parts."""
    hand: Hand | None


class Mechanics(Protocol):
    """Five axes, the arm and the patient. The drives' control is included, because both advance together."""

    @property
    def joints(self) -> Sequence[MechanicalAxis]:
        """The five axes."""

    def advance(self, drives: Sequence[Drive], steps: int) -> None:
        """Advance drives and mechanics by ``steps`` ms. Set angle, speed and torque of the drives."""

    def update_slow_loads(self) -> None:
        """Update slow loads, every :data:`~kata.simulator.parameters.SLOW_STEPS`."""

    def place(self, axis: int, angle: float) -> None:
        """Put an axis (counted from 0) at an angle in rad, at rest."""

    def jam(self, axis: int, *, jammed: bool) -> None:
        """Jam a shaft (axis counted from 0), or free it."""


class MakeMechanics(Protocol):
    """A function that makes the mechanics of a seed for one side."""

    def __call__(self, seed: int | None = None, *, turned: bool = False) -> Mechanics:
        """Make the mechanics. ``seed``: chooses another patient and other gears. ``turned``: True if set up for the other side."""


def mechanics_named(
    name: PlantName, patient: PatientName = "healthy", balancer_kg: float | None = None
) -> MakeMechanics:
    """Return the function that makes a plant. ``patient`` and ``balancer_kg`` apply only to the independent plant; the simple plant has
    one healthy patient and one balancer.

    Only this function imports MuJoCo, and only for the independent plant.

    :raises ImportError: when MuJoCo is not installed. The message says what to install.
    """
    if name == "simple":
        from kata.simulator.plant import Plant

        return Plant
    try:
        from kata.simulator.independent.plant import IndependentPlant
    except ModuleNotFoundError as error:
        if error.name != "mujoco":
            raise
        raise ImportError(NO_MUJOCO) from error

    return partial(IndependentPlant, patient=patient, balancer_kg=balancer_kg)
