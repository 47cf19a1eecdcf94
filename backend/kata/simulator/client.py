"""The other end of the control socket: move the simulated hand, pedal and switch."""

import socket
from pathlib import Path

import msgspec

from kata.motion.taught import Taught
from kata.simulator.apparatus import HandRefusedError, State
from kata.simulator.control import Estop, Guide, Look, Outcome, Pedal, Release, Wish


class SimulatorClient:
    """One connection, to be closed; every method returns the apparatus' state after it, and blocks for a moment at most."""

    def __init__(self, path: Path) -> None:
        """:raises OSError: when no simulator listens there."""
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(5.0)
        self._socket.connect(str(path))
        self._stream = self._socket.makefile("rb")

    def pedal(self, down: bool) -> State:
        """Put the foot down or lift it."""
        return self._ask(Pedal(down=down))

    def estop(self, pressed: bool) -> State:
        """Press the emergency stop or release it."""
        return self._ask(Estop(pressed=pressed))

    def guide(self, motion: Taught, *, pedal: bool = True) -> State:
        """Let the hand take the arm along a motion.

        :raises HandRefusedError: while torque is on or the hand is busy.
        """
        wish = Guide(motion.name, motion.times_s.tolist(), motion.poses_deg.tolist(), pedal)
        return self._ask(wish)

    def release(self) -> State:
        """Let go of arm and pedal."""
        return self._ask(Release())

    def state(self) -> State:
        """Look."""
        return self._ask(Look())

    def close(self) -> None:
        """Hang up."""
        self._stream.close()
        self._socket.close()

    def _ask(self, wish: Wish) -> State:
        self._socket.sendall(msgspec.json.encode(wish) + b"\n")
        outcome = msgspec.json.decode(self._stream.readline(), type=Outcome)
        if outcome.state is None:
            raise HandRefusedError(outcome.error or "the simulator gave no reason")
        return outcome.state
