"""The other end of the control socket: move the simulated hand, pedal and switch, and break things."""

import socket
from pathlib import Path
from typing import Final

import msgspec

from kata.messages import Text, with_key
from kata.motion.taught import Taught
from kata.simulator import texts
from kata.simulator.apparatus import State
from kata.simulator.control import Break, Estop, Guide, Look, Mend, Outcome, Pedal, Release, Rows, Turn, Wish
from kata.simulator.hand import HandRefusedError
from kata.simulator.script import Fault, Kind

_ROWS_A_LINE: Final = 100
"""Of a long motion: the simulator works out so many in a fraction of a millisecond, and serves the servos' wire in between."""


class SimulatorClient:
    """One connection, to be closed; every method returns the apparatus' state after it, and blocks for a moment at most.

    A simulator that has ended makes each of them raise a ConnectionError.
    """

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
        times, poses = motion.times_s.tolist(), motion.poses_deg.tolist()
        last = (len(times) - 1) // _ROWS_A_LINE * _ROWS_A_LINE
        for n in range(0, last, _ROWS_A_LINE):
            self._ask(Rows(times[n : n + _ROWS_A_LINE], poses[n : n + _ROWS_A_LINE]))
        return self._ask(Guide(str(motion.name), times[last:], poses[last:], pedal))

    def release(self) -> State:
        """Let go of arm and pedal."""
        return self._ask(Release())

    def turn(self, *, turned: bool) -> State:
        """Turn the apparatus for the other shoulder, or back.

        :raises HandRefusedError: while torque is on or the hand is busy.
        """
        return self._ask(Turn(turned))

    def fault(self, kind: Kind, motor: int | None = None, value: float | None = None) -> State:
        """Let something be broken from now on: see :class:`~kata.simulator.script.Fault`.

        :raises ValueError: when motor or value do not go with the kind.
        """
        return self._ask(Break(Fault(kind, motor, value)))

    def clear_faults(self) -> State:
        """Let nothing be broken any more."""
        return self._ask(Mend())

    def state(self) -> State:
        """Look."""
        return self._ask(Look())

    def close(self) -> None:
        """Hang up."""
        self._stream.close()
        self._socket.close()

    def _ask(self, wish: Wish) -> State:
        try:
            self._socket.sendall(msgspec.json.encode(wish) + b"\n")
            line = self._stream.readline()
        except OSError as error:
            raise ConnectionError(f"the simulated apparatus does not answer: {error}") from error
        if not line.endswith(b"\n"):
            raise ConnectionError("the simulated apparatus has ended")
        outcome = msgspec.json.decode(line, type=Outcome)
        if outcome.state is None:
            raise HandRefusedError(_reason(outcome))
        return outcome.state


def _reason(outcome: Outcome) -> Text:
    return with_key(outcome.error, outcome.error_key) if outcome.error else texts.SIMULATOR_GAVE_NO_REASON()
