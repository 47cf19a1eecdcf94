"""The client of the control socket. It moves the simulated hand, pedal and switch, and sets faults."""

import socket
from pathlib import Path
from typing import Final

import msgspec

from kata.messages import Text, with_key
from kata.motion.taught import Taught
from kata.simulator import texts
from kata.simulator.apparatus import State
from kata.simulator.control import (
    ClearFaults,
    ControlReply,
    ControlRequest,
    Effort,
    Estop,
    Guide,
    Pedal,
    ReadState,
    Release,
    Rows,
    SetFault,
    Turn,
)
from kata.simulator.fault_injector import FaultKind, SimulatedFault
from kata.simulator.hand import HandRefusedError

_ROWS_A_LINE: Final = 100
"""Rows of a long motion in one line. The simulator processes them in less than 1 ms and then serves the servos' bus again."""


class SimulatorClient:
    """One connection, which the caller closes. Every method waits for the reply and returns the apparatus' state after the request.

    If the simulator has ended, each method raises a ConnectionError.
    """

    def __init__(self, path: Path) -> None:
        """Connect.

        :raises OSError: when no simulator listens at this path.
        """
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(5.0)
        self._socket.connect(str(path))
        self._stream = self._socket.makefile("rb")

    def pedal(self, down: bool) -> State:
        """Press the pedal or release it."""
        return self._send(Pedal(down=down))

    def estop(self, pressed: bool) -> State:
        """Press the emergency stop or release it."""
        return self._send(Estop(pressed=pressed))

    def guide(self, motion: Taught, *, pedal: bool = True) -> State:
        """Let the hand guide the arm along a motion.

        :raises HandRefusedError: while torque is on or the hand is busy.
        """
        times, poses = motion.times_s.tolist(), motion.poses_deg.tolist()
        last = (len(times) - 1) // _ROWS_A_LINE * _ROWS_A_LINE
        for n in range(0, last, _ROWS_A_LINE):
            self._send(Rows(times[n : n + _ROWS_A_LINE], poses[n : n + _ROWS_A_LINE]))
        return self._send(Guide(str(motion.name), times[last:], poses[last:], pedal))

    def release(self) -> State:
        """Let go of arm and pedal."""
        return self._send(Release())

    def effort(self, effort_nm: float) -> State:
        """Let the patient help with a torque along the path, or resist with one below 0."""
        return self._send(Effort(effort_nm))

    def turn(self, *, turned: bool) -> State:
        """Turn the apparatus for the other shoulder, or back.

        :raises HandRefusedError: while torque is on or the hand is busy.
        """
        return self._send(Turn(turned))

    def fault(self, kind: FaultKind, motor: int | None = None, value: float | None = None) -> State:
        """Set a fault: see :class:`~kata.simulator.fault_injector.SimulatedFault`.

        :raises ValueError: when motor or value do not fit the kind.
        """
        return self._send(SetFault(SimulatedFault(kind, motor, value)))

    def clear_faults(self) -> State:
        """Clear all faults."""
        return self._send(ClearFaults())

    def state(self) -> State:
        """Return the present state."""
        return self._send(ReadState())

    def close(self) -> None:
        """Close the connection."""
        self._stream.close()
        self._socket.close()

    def _send(self, request: ControlRequest) -> State:
        try:
            self._socket.sendall(msgspec.json.encode(request) + b"\n")
            line = self._stream.readline()
        except OSError as error:
            raise ConnectionError(f"the simulated apparatus does not answer: {error}") from error
        if not line.endswith(b"\n"):
            raise ConnectionError("the simulated apparatus has ended")
        outcome = msgspec.json.decode(line, type=ControlReply)
        if outcome.state is None:
            raise HandRefusedError(_reason(outcome))
        return outcome.state


def _reason(outcome: ControlReply) -> Text:
    return with_key(outcome.error, outcome.error_key) if outcome.error else texts.SIMULATOR_GAVE_NO_REASON()
