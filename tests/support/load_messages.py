"""Load commands with their recording and correction."""

import msgspec
import numpy as np

from kata.device.ipc_messages import Load
from kata.motion.ilc import rows
from kata.motion.linkage import Floats
from tests.support.stepped import REST_DEG

SECONDS = 3.0


TIMES_S = np.arange(0.0, SECONDS + 0.001, 0.01)


def angles(**motors: Floats) -> Floats:
    """Return a recording at rest, except for the given motors."""
    found = np.tile(np.array(REST_DEG), (len(TIMES_S), 1))
    for name, values in motors.items():
        found[:, int(name.removeprefix("motor")) - 1] = values
    return found


def correction(deg: float = 1.0, count: int = rows(SECONDS)) -> bytes:
    return np.full((count, 5), deg, dtype="<f8").tobytes()


def message(angles_deg: Floats | None = None, **changes: object) -> Load:
    there = angles() if angles_deg is None else angles_deg
    load = Load(run_id="r", recording_id="a", times_s=TIMES_S.astype("<f8").tobytes(), angles_deg=there.tobytes())
    return msgspec.structs.replace(load, **changes)
