"""Playback of one moving motor under a stepped clock."""

import msgspec
import numpy as np

from kata.device.config import StationConfig
from kata.device.ipc_messages import Load
from kata.motion.linkage import Floats
from kata.motion.method import Method
from tests.support.stepped import Stepped
from tests.support.trajectories import LOAD

MOVING = 3
"""The axis that goes from 0 to 60 deg and back in these recordings."""


METHODS: tuple[Method, ...] = ("paper", "smooth", "learned")


def load(method: Method, **changes: object) -> Load:
    return msgspec.structs.replace(LOAD, method=method, **changes)


def station(lag_s: float = 0.0, lag2_s2: float = 0.0, friction_deg: float = 0.0, **settings: object) -> StationConfig:
    """The fastest configuration of a station."""
    config = StationConfig()
    axes = tuple(
        msgspec.structs.replace(
            axis,
            lag_s=lag_s,
            lag2_s2=lag2_s2,
            friction_deg=friction_deg,
            max_speed_deg_s=150.0,
            max_acceleration_deg_s2=6_000.0,
        )
        for axis in config.axes
    )
    return msgspec.structs.replace(config, axes=axes, **settings)


def place_s(stepped: Stepped) -> float:
    run = stepped.loop._machine._run
    assert run is not None
    return run.position_s


def until_place(stepped: Stepped, at_s: float) -> None:
    while place_s(stepped) < at_s - 1e-9:
        stepped.cycle()


def sent(stepped: Stepped) -> Floats:
    """Return the setpoints of the moving axis."""
    return np.array(stepped.apparatus.written)[:, MOVING]
