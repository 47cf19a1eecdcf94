"""The boundary between drives and mechanics: one small protocol that every plant implements."""

from collections.abc import Sequence
from functools import partial
from typing import Final, Literal, Protocol

from kata.simulator.drive import Drive
from kata.simulator.independent.patients import PatientName

PlantName = Literal["simple", "mujoco"]
NO_MUJOCO: Final = "MuJoCo is not installed: pip install kata[evaluate]"

Hand = tuple[float, float, float, float, float]
"""A hand on one axis: target angle, its change in each step of 1 ms, stiffness, damping and maximum torque; rad and Nm."""


class MechanicalAxis(Protocol):
    """One axis as the simulated apparatus sees it. Radians and seconds."""

    angle: float
    """Of the drive's shaft, where the encoder is."""
    speed: float
    arm_angle: float
    """Of the patient's arm, behind the gear's play and everything soft."""
    hand: Hand | None


class Mechanics(Protocol):
    """Five axes, the arm and the patient. The drives' control belongs to it: both advance together."""

    @property
    def joints(self) -> Sequence[MechanicalAxis]:
        """The five axes."""

    def advance(self, drives: Sequence[Drive], steps: int) -> None:
        """Advance drives and mechanics by milliseconds; set angle, speed and torque of the drives."""

    def update_slow_loads(self) -> None:
        """Update slow loads, every :data:`~kata.simulator.parameters.SLOW_STEPS`."""

    def place(self, axis: int, angle: float) -> None:
        """Put an axis (from 0) at an angle, at rest."""

    def jam(self, axis: int, *, jammed: bool) -> None:
        """Jam a shaft (axis from 0), or free it."""


class MakeMechanics(Protocol):
    """Makes the mechanics of a seed for one side."""

    def __call__(self, seed: int | None = None, *, turned: bool = False) -> Mechanics:
        """``seed``: another patient and other gears. ``turned``: set up for the other side."""


def mechanics_named(
    name: PlantName, patient: PatientName = "healthy", balancer_kg: float | None = None
) -> MakeMechanics:
    """Return the maker of a plant. ``patient`` and ``balancer_kg``: of the independent plant; the simple plant has only a healthy
    patient and one balancer.

    MuJoCo is imported by this function alone, when the independent plant is asked for.

    :raises ImportError: when MuJoCo is not installed, with what to install.
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
