"""A shoulder whose torque is known in the stepped apparatus, and the way out along which it is tested and stretched."""

import msgspec
import numpy as np

from kata.device.ipc_messages import Approach, EndFeel, Play
from kata.motion.linkage import Floats
from kata.motion.trajectory import Trajectory
from tests.support.stepped import REST_DEG, Stepped
from tests.support.trajectories import LOAD

AXIS = 3
SPEED_DEG_S = 5.0
END_DEG = 60.0
TIMES_S = np.arange(0.0, END_DEG / SPEED_DEG_S + 0.001, 0.02)
CHOSEN_NM = 2.0
FRICTION_NM = 0.5
TEST = EndFeel(motor=AXIS + 1, torque_nm=CHOSEN_NM, expected_nm=(FRICTION_NM, FRICTION_NM))


def way(speed_deg_s: float = SPEED_DEG_S, start_deg: float = 0.0) -> Floats:
    angles = np.tile(np.array(REST_DEG), (len(TIMES_S), 1))
    angles[:, AXIS] = start_deg + speed_deg_s * TIMES_S
    return angles


class Shoulder:
    """A capsule that resists from an angle on, and an arm that is heavier than the baseline's by ``heavier_nm`` at 90 deg."""

    def __init__(self, stepped: Stepped, onset_deg: float = 30.0, nm_deg: float = 0.3, heavier_nm: float = 0.0) -> None:
        self._stepped = stepped
        self._onset_deg, self._nm_deg, self._heavier_nm = onset_deg, nm_deg, heavier_nm
        self.largest_nm = 0.0
        self.farthest_deg = 0.0
        self.guarding_nm = 0.0

    def cycle(self) -> None:
        apparatus = self._stepped.apparatus
        before_deg = apparatus.angles_deg[AXIS]
        self._stepped.cycle()
        angle_deg = apparatus.angles_deg[AXIS]
        capsule_nm = max(0.0, angle_deg - self._onset_deg) * self._nm_deg + self.guarding_nm
        weight_nm = self._heavier_nm * np.sin(np.radians(angle_deg))
        apparatus.torques_nm[AXIS] = capsule_nm + weight_nm + FRICTION_NM * np.sign(angle_deg - before_deg)
        self.largest_nm = max(self.largest_nm, capsule_nm)
        self.farthest_deg = max(self.farthest_deg, angle_deg)

    def until(self, mode: str, within_s: float = 120.0) -> None:
        for n in range(round(within_s * 100)):
            if self._stepped.mode == mode:
                return
            self.cycle()
            if n % 1000 == 0:
                self._stepped.link.journals[-1].write()
        raise AssertionError(f"{mode} was not reached; the mode is {self._stepped.mode}")

    def forward(self, seconds: float) -> None:
        for _ in range(round(seconds * 100)):
            self.cycle()


def started(stepped: Stepped, test: EndFeel = TEST, start_deg: float = 0.0) -> None:
    trajectory = Trajectory(TIMES_S, way(start_deg=start_deg))
    assert stepped.send(msgspec.structs.replace(LOAD, end_feel=test), trajectory) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    assert stepped.send(Play()) is None


def growth(places: int = 100) -> tuple[float, ...]:
    return tuple(np.sin(np.radians(np.linspace(0.0, END_DEG, places))).tolist())
