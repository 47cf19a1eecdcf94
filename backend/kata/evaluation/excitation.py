"""Identifies a simulated station: plays an excitation without compensation and fits drives and load."""

from typing import Final

import numpy as np
from msgspec import structs

from kata.commissioning.direct_station import PlaybackError
from kata.device.config import StationConfig
from kata.device.ipc_messages import Load
from kata.device.journal import PHASE_PLAYING
from kata.evaluation.station import VirtualStation
from kata.motion.approach import MinimumJerkMove
from kata.motion.arm_load import ArmLoad
from kata.motion.builtin import built_in_motions
from kata.motion.identify import excitation
from kata.motion.identify_load import IdentifiedLoad, identify_load
from kata.motion.linkage import Floats, motor_angles_deg
from kata.motion.trajectory import Trajectory
from kata.simulator.mechanics import MakeMechanics
from kata.simulator.parameters import REST_DEG
from kata.simulator.plant import Plant

STEP_S: Final = 0.01
_APPROACH_DEG_S: Final = 20.0
_SECONDS: Final = 20.0
_MOVEMENTS: Final = ((1.0, 1), (1.0, 2), (0.5, 2), (0.25, 2), (0.12, 2))
"""Share and slope of the movements that are tried. The drives can move a heavy arm only gently, and a very heavy arm only near its rest."""
_IDENTIFIED: Final = (
    "lag_s",
    "lag2_s2",
    "friction_deg",
    "integral_s",
    "droop_deg_nm",
    "damping_nm_s_deg",
    "inertia_nm_s2_deg",
    "coulomb_nm",
)
"""Fields of an axis that are 0 until they are identified."""


def exercise(seconds: float, *motions: int) -> Floats:
    """Return movements at all speeds of a guided arm, followed by built-in motions with these numbers: (n, 5) in degrees at 100 Hz.

    Friction cannot be separated from lag without slow movements, nor inertia without fast ones.
    """
    rows = [excitation(REST_DEG, seconds, STEP_S)]
    for number in motions:
        angles = motor_angles_deg(built_in_motions()[number - 1].poses_deg)
        approach = MinimumJerkMove(rows[-1][-1], angles[0], _APPROACH_DEG_S)
        rows += [np.array([approach.at(time) for time in np.arange(0.0, approach.duration_s, STEP_S)]), angles]
    return np.concatenate(rows)


def identify_station(
    config: StationConfig, setpoint_deg: Floats, seed: int | None, make_mechanics: MakeMechanics = Plant
) -> IdentifiedLoad:
    """Play setpoints (n, 5) at 100 Hz without compensation, and return drive and load of each axis.

    The first and the last second are omitted, because the speed override makes their samples uneven.

    :raises PlaybackError: when the drives cannot carry the movement.
    """
    unknown = tuple(structs.replace(axis, torque_share=1.0, **dict.fromkeys(_IDENTIFIED, 0.0)) for axis in config.axes)
    times = np.arange(len(setpoint_deg)) * STEP_S
    load = Load(
        run_id="run",
        recording_id="recording",
        times_s=times.astype("<f8").tobytes(),
        angles_deg=setpoint_deg.astype("<f8").tobytes(),
        method="smooth",
    )
    station = VirtualStation(structs.replace(config, axes=unknown, arm=ArmLoad()), seed, make_mechanics=make_mechanics)
    run = station.play(load, float(times[-1]))
    even = (run.phase == PHASE_PLAYING) & (run.path_s > 1.0) & (run.path_s < times[-1] - 1.0)
    path_s = run.path_s[even]
    measured, torque = run.measured_deg[even].astype(np.float64), run.torque_nm[even].astype(np.float64)
    return identify_load(path_s, Trajectory(times, setpoint_deg).along(path_s), measured, torque)


def identified(config: StationConfig, seed: int | None, make_mechanics: MakeMechanics) -> StationConfig:
    """Return the configuration with drives and load as identified on this seed's apparatus, as after commissioning.

    A movement that the drives cannot carry is repeated more gently, and then with a smaller range.

    :raises PlaybackError: when the drives cannot carry the smallest movement either.
    """
    for share, slope in _MOVEMENTS:
        try:
            movement = excitation(REST_DEG, _SECONDS, STEP_S, share=share, slope=slope)
            load = identify_station(config, movement, seed, make_mechanics)
            break
        except PlaybackError:
            if (share, slope) == _MOVEMENTS[-1]:
                raise
    return with_identified(config, load)


def with_identified(config: StationConfig, load: IdentifiedLoad) -> StationConfig:
    """Return the configuration with identified axes. A negative lag becomes 0."""
    axes = tuple(
        structs.replace(
            axis,
            torque_share=axis_fit.torque_share,
            **{name: max(0.0, getattr(axis_fit, name)) for name in _IDENTIFIED},
        )
        for axis, axis_fit in zip(config.axes, load.axes, strict=True)
    )
    return structs.replace(config, axes=axes, arm=load.arm)
