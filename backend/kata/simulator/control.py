"""Serves the control socket for hand, pedal, switch and faults: JSON lines with one reply to each request."""

import socket
from pathlib import Path
from typing import Final

import msgspec

from kata.messages import MessageKey, key_of, text_of
from kata.simulator.apparatus import SimulatedApparatus, State
from kata.simulator.effort import MOST_NM
from kata.simulator.fault_injector import FaultInjector, SimulatedFault
from kata.simulator.hand import GuidedMotion, HandRefusedError

_LONGEST: Final = 4 * 1024 * 1024
"""Longest line in bytes. A longer line closes the connection."""


class Pedal(msgspec.Struct, frozen=True, tag_field="do", tag="pedal"):
    """Press the pedal or release it."""

    down: bool


class Estop(msgspec.Struct, frozen=True, tag_field="do", tag="estop"):
    """Press the emergency stop or release it."""

    pressed: bool


class Rows(msgspec.Struct, frozen=True, tag_field="do", tag="rows"):
    """The first rows of a motion that is too long for one line: times (n,) in s, poses (n, 5) in degrees. :class:`Guide` ends
    the motion.
    """

    times_s: list[float]
    poses_deg: list[list[float]]


class Guide(msgspec.Struct, frozen=True, tag_field="do", tag="guide"):
    """Guide the arm along a motion, with or without the pedal. It has the last rows of the motion."""

    name: str
    times_s: list[float]
    poses_deg: list[list[float]]
    pedal: bool = True


class Release(msgspec.Struct, frozen=True, tag_field="do", tag="release"):
    """Let go of arm and pedal."""


class Effort(msgspec.Struct, frozen=True, tag_field="do", tag="effort"):
    """Let the patient help with a torque along the path, or resist with one below 0."""

    effort_nm: float


class Turn(msgspec.Struct, frozen=True, tag_field="do", tag="turn"):
    """Turn the apparatus for the other shoulder, or back."""

    turned: bool


class SetFault(msgspec.Struct, frozen=True, tag_field="do", tag="fault"):
    """Set a fault."""

    fault: SimulatedFault


class ClearFaults(msgspec.Struct, frozen=True, tag_field="do", tag="clear_faults"):
    """Clear all faults."""


class ReadState(msgspec.Struct, frozen=True, tag_field="do", tag="state"):
    """Return the state without a change."""


ControlRequest = Pedal | Estop | Rows | Guide | Release | Effort | Turn | SetFault | ClearFaults | ReadState


class ControlReply(msgspec.Struct, frozen=True):
    """The state after the request, or the reason of its refusal."""

    ok: bool
    state: State | None = None
    error: str | None = None
    error_key: MessageKey | None = None


class _Client:
    """The incomplete input of one connection."""

    def __init__(self) -> None:
        self.received = bytearray()
        self.motion = GuidedMotion()


class ControlServer:
    """Serves any number of clients in the simulator's loop."""

    def __init__(self, path: Path, apparatus: SimulatedApparatus, faults: FaultInjector) -> None:
        self._apparatus = apparatus
        self._faults = faults
        self._path = path
        path.unlink(missing_ok=True)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind(str(path))
        self._listener.listen()
        self._clients: dict[socket.socket, _Client] = {}
        self._decoder = msgspec.json.Decoder(ControlRequest)

    @property
    def sockets(self) -> list[socket.socket]:
        """The sockets to wait for."""
        return [self._listener, *self._clients]

    def serve(self, readable: list[object]) -> None:
        """Accept connections and handle requests."""
        if self._listener in readable:
            connection, _ = self._listener.accept()
            # Sending must not block, because the servos must not wait. A connection that does not read its replies is closed.
            connection.setblocking(False)
            self._clients[connection] = _Client()
        for connection in [client for client in self._clients if client in readable]:
            self._receive(connection)

    def close(self) -> None:
        """Close all sockets and remove the path."""
        for open_socket in self.sockets:
            open_socket.close()
        self._path.unlink(missing_ok=True)

    def _receive(self, connection: socket.socket) -> None:
        client = self._clients[connection]
        received = client.received
        try:
            data = connection.recv(1 << 16)
            if not data or len(received) > _LONGEST:
                raise ConnectionError
            received += data
            while (end := received.find(b"\n")) >= 0:
                line = bytes(received[:end])
                del received[: end + 1]
                connection.sendall(msgspec.json.encode(self._reply_to(client, line)) + b"\n")
        except OSError:
            del self._clients[connection]
            connection.close()

    def _reply_to(self, client: _Client, line: bytes) -> ControlReply:
        try:
            self._execute(client, self._decoder.decode(line))
        except (HandRefusedError, msgspec.MsgspecError) as error:
            client.motion = GuidedMotion()
            return ControlReply(ok=False, error=str(error), error_key=key_of(text_of(error)))
        return ControlReply(ok=True, state=self._apparatus.state())

    def _execute(self, client: _Client, request: ControlRequest) -> None:
        match request:
            case Pedal(down=down):
                self._apparatus.step_on_pedal(down)
            case Estop(pressed=pressed):
                self._apparatus.press_estop(pressed)
            case Rows():
                client.motion.add(request.times_s, request.poses_deg)
            case Guide():
                motion, client.motion = client.motion, GuidedMotion()
                motion.add(request.times_s, request.poses_deg)
                self._apparatus.guide(request.name, motion, request.pedal)
            case Release():
                self._apparatus.let_go()
            case Effort(effort_nm=effort_nm):
                self._apparatus.set_effort(max(-MOST_NM, min(MOST_NM, effort_nm)))
            case Turn(turned=turned):
                self._apparatus.turn(turned=turned)
            case SetFault(fault=fault):
                self._faults.fault(fault)
            case ClearFaults():
                self._faults.clear()
            case ReadState():
                pass
