"""The real control loop with its own deadlines, and the real driver, on simulated drives. Time is stepped."""

import copy
import copyreg
import struct
from pathlib import Path
from typing import Any, Self

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from kata.device.bus.factory import make_bus
from kata.device.config import StationConfig
from kata.device.ipc_messages import Approach, Command, Load, Play, Refusal, Snapshot, stamped
from kata.device.loop import ControlLoop
from kata.motion.linkage import Floats
from kata.system.realtime import Granted
from kata.testing.world import RecordingWorld
from tests.support.stepped import NEVER_NS, WITHOUT_COLLECTION, SteppedServiceLink

START_DEG = np.array([17.0, 107.0, 12.0, 2.0, -2.0])
"""Close to the arm's rest pose."""
_REACH_DEG = np.array([-10.0, 8.0, 30.0, 40.0, -30.0])


def load_of(times_s: ArrayLike, angles_deg: Floats, **changes: Any) -> Load:
    """Return the Load of a recording. ``changes``: its other fields."""
    load = Load(
        run_id="run",
        recording_id="recording",
        times_s=np.asarray(times_s).astype("<f8").tobytes(),
        angles_deg=angles_deg.astype("<f8").tobytes(),
    )
    return msgspec.structs.replace(load, **changes)


def wave(duration_s: float = 6.0) -> Load:
    """Return the Load of a motion of all motors out and back."""
    times = np.linspace(0.0, duration_s, int(100 * duration_s) + 1)
    return load_of(times, START_DEG + _REACH_DEG * (1 - np.cos(2 * np.pi * times / duration_s))[:, None] / 2)


# A driver has one; without this, copy.deepcopy refuses it.
copyreg.pickle(struct.Struct, lambda packer: (struct.Struct, (packer.format,)))


class SimulatedLoop:
    """One apparatus and its control loop."""

    def __init__(self, folder: Path, config: StationConfig) -> None:
        self.config = config
        self.world = RecordingWorld.of(config, seed=1)
        self.link = SteppedServiceLink(folder)
        self.loop = ControlLoop(
            config,
            make_bus(config, self.world.open_transport),
            self.link,
            Granted(scheduling=False, memory_lock=False),
            now_ns=self._now_ns,
            sleep=self.world.wait,
        )
        self.until("idle")

    def copied(self, folder: Path) -> Self:
        """Return a copy that writes its journals to another folder. To copy takes less time than to reach the mode again."""
        made = copy.deepcopy(self)
        made.link.folder = folder
        for writer in made.link.journals:
            writer.path = folder / writer.path.name
        return made

    def _now_ns(self) -> int:
        return self.world.t_ns

    def tick(self) -> None:
        """Run a cycle at its deadline and sleep until the next."""
        with WITHOUT_COLLECTION:
            assert self.loop.tick()

    def run(self, seconds: float) -> None:
        until_ns = self.world.t_ns + int(seconds * 1e9)
        while self.world.t_ns < until_ns:
            self.tick()

    def until(self, mode: str, within_s: float = 60.0) -> None:
        until_ns = self.world.t_ns + int(within_s * 1e9)
        while not self.link.snapshots or self.snapshot.mode != mode:
            assert self.world.t_ns < until_ns, f"{mode} was not reached"
            self.tick()

    @property
    def snapshot(self) -> Snapshot:
        return self.link.snapshots[-1]

    def causes(self) -> list[str]:
        return [cause.code for cause in self.snapshot.stop.causes] if self.snapshot.stop else []

    def place(self, angles_deg: ArrayLike) -> None:
        """Lead the arm by hand to a pose."""
        for motor, angle in enumerate(np.asarray(angles_deg), start=1):
            self.world.place(motor, angle)

    def send(self, command: Command) -> Refusal | None:
        """Send a command with the present stop counter, and run cycles until it is answered."""
        number = len(self.link.replies)
        self.link.request(number, stamped(command, self.snapshot.stops, NEVER_NS), self.config)
        self.tick()
        while not (answers := [reply for reply in self.link.replies if reply.id == number]):
            self.tick()
        return answers[0].refusal

    def approach(self, load: Load) -> None:
        """Load a recording and move to its start."""
        assert self.send(load) is None
        assert self.send(Approach()) is None
        self.until("paused")

    def play(self, load: Load, seconds: float) -> None:
        """Load a recording, move to its start and play it for some seconds."""
        self.approach(load)
        assert self.send(Play()) is None
        self.run(seconds)
