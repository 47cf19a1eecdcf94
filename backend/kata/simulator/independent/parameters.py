"""Loads the numbers of the independent plant. Every number, its unit and its source are in ``parameters.toml``."""

import tomllib
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any, Final

from kata.simulator.parameters import random_stream

FILE: Final = Path(__file__).with_suffix(".toml")
Five = tuple[float, float, float, float, float]


@dataclass(frozen=True)
class IndependentParameters:
    """Values of ``parameters.toml`` by name. The file states their units and sources."""

    shoulder_m: tuple[float, float, float]
    upper_arm_m: float
    forearm_m: float
    elbow_flexion_deg: float
    balancer_height_m: float
    upper_arm_kg: float
    forearm_kg: float
    upper_arm_centre: float
    forearm_centre: float
    upper_arm_gyration: float
    forearm_gyration: float
    upper_arm_radius_m: float
    forearm_radius_m: float
    board_kg: float
    rod_kg: float
    crank_kg: float
    link_kg: tuple[float, float]
    link_centre_m: float
    balancer_kg: float
    balancer_share: float
    rotor_kg_m2: Five
    backlash_deg: Five
    gear_nm_rad: float
    rotor_coulomb_nm: Five
    rotor_viscous_nm_s: Five
    arm_coulomb_nm: Five
    arm_viscous_nm_s: Five
    tissue_nm_rad: tuple[float, float, float]
    tissue_nm_s: tuple[float, float, float]
    cuff_slip_nm: float
    supply_v: float
    output_share: Five
    goal_delay_ms: Five
    peak_torque_nm: float
    guarding_s: float
    guarding_speed_deg_s: float
    tone_speed_deg_s: float
    girdle_nm_rad: tuple[float, float]
    girdle_nm_s: tuple[float, float]


@cache
def entries() -> dict[str, dict[str, Any]]:
    """Return every entry of the file by name. An entry has ``value``, ``unit``, ``source`` and, if a seed varies the value, ``vary``."""
    return tomllib.loads(FILE.read_text())


def independent_parameters(
    seed: int | None = None, arm_scale: float = 1.0, balancer_kg: float | None = None
) -> IndependentParameters:
    """Return the parameters of a seed; without a seed, the nominal parameters.

    :param arm_scale: size of the patient's arm. Lengths are multiplied by this factor, masses by its cube.
    :param balancer_kg: replaces the balancer's weight.
    """
    vary = random_stream("independent plant", seed).uniform
    values: dict[str, Any] = {}
    for field in fields(IndependentParameters):
        entry = entries()[field.name]
        value, share = entry["value"], 0.0 if seed is None else entry.get("vary", 0.0)
        if isinstance(value, list):
            values[field.name] = tuple(element * vary(1 - share, 1 + share) for element in value)
        else:
            values[field.name] = value * vary(1 - share, 1 + share)
    nominal = IndependentParameters(**values)
    return replace(
        nominal,
        upper_arm_m=nominal.upper_arm_m * arm_scale,
        forearm_m=nominal.forearm_m * arm_scale,
        upper_arm_kg=nominal.upper_arm_kg * arm_scale**3,
        forearm_kg=nominal.forearm_kg * arm_scale**3,
        balancer_kg=nominal.balancer_kg if balancer_kg is None else balancer_kg,
    )


def with_nominal_arm(values: IndependentParameters) -> IndependentParameters:
    """Return the parameters with an arm of the nominal masses: a test weight is the same on every apparatus."""
    nominal = independent_parameters()
    return replace(values, upper_arm_kg=nominal.upper_arm_kg, forearm_kg=nominal.forearm_kg)
