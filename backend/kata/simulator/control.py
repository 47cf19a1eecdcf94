"""The control socket: where hand, pedal and switch are moved from, and faults are set. JSON lines, one reply to each request."""

import socket
from pathlib import Path
from typing import Final

import msgspec

from kata.messages import MessageKey, key_of, text_of
from kata.simulator.apparatus import Apparatus, State
from kata.simulator.hand import HandRefusedError, Motion
from kata.simulator.script import Fault, Script

_LONGEST: Final = 4 * 1024 * 1024
"""A line's length in bytes; whoever sends more is hung up on."""


class Pedal(msgspec.Struct, frozen=True, tag_field="do", tag="pedal"):
    """Put the foot down or lift it."""

    down: bool


class Estop(msgspec.Struct, frozen=True, tag_field="do", tag="estop"):
    """Press the emergency stop or release it."""

    pressed: bool


class Rows(msgspec.Struct, frozen=True, tag_field="do", tag="rows"):
    """The first rows of a motion too long for one line: times (n,) in s, poses (n, 5) in degrees. ``guide`` ends it."""

    times_s: list[float]
    poses_deg: list[list[float]]


class Guide(msgspec.Struct, frozen=True, tag_field="do", tag="guide"):
    """Take the arm along a motion, whose last rows these are; with the pedal, if wanted."""

    name: str
    times_s: list[float]
    poses_deg: list[list[float]]
    pedal: bool = True


class Release(msgspec.Struct, frozen=True, tag_field="do", tag="release"):
    """Let go of arm and pedal."""


class Turn(msgspec.Struct, frozen=True, tag_field="do", tag="turn"):
    """Turn the apparatus for the other shoulder, or back."""

    turned: bool


class Break(msgspec.Struct, frozen=True, tag_field="do", tag="fault"):
    """Let something be broken from now on."""

    fault: Fault


class Mend(msgspec.Struct, frozen=True, tag_field="do", tag="clear_faults"):
    """Let nothing be broken any more."""


class Look(msgspec.Struct, frozen=True, tag_field="do", tag="state"):
    """Change nothing."""


Wish = Pedal | Estop | Rows | Guide | Release | Turn | Break | Mend | Look


class Outcome(msgspec.Struct, frozen=True):
    """The state after the request, or why it was refused."""

    ok: bool
    state: State | None = None
    error: str | None = None
    error_key: MessageKey | None = None


class _Client:
    """What one connection has sent so far."""

    def __init__(self) -> None:
        self.heard = bytearray()
        self.motion = Motion()


class ControlServer:
    """Serves any number of clients from the simulator's one loop."""

    def __init__(self, path: Path, apparatus: Apparatus, script: Script) -> None:
        self._apparatus = apparatus
        self._script = script
        self._path = path
        path.unlink(missing_ok=True)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind(str(path))
        self._listener.listen()
        self._clients: dict[socket.socket, _Client] = {}
        self._decoder = msgspec.json.Decoder(Wish)

    @property
    def sockets(self) -> list[socket.socket]:
        """What to wait for."""
        return [self._listener, *self._clients]

    def serve(self, readable: list[object]) -> None:
        """Take what has come."""
        if self._listener in readable:
            connection, _ = self._listener.accept()
            # Whoever does not read the replies is hung up on: the servos must not wait for anybody.
            connection.setblocking(False)
            self._clients[connection] = _Client()
        for connection in [one for one in self._clients if one in readable]:
            self._receive(connection)

    def close(self) -> None:
        """Leave no socket behind."""
        for open_socket in self.sockets:
            open_socket.close()
        self._path.unlink(missing_ok=True)

    def _receive(self, connection: socket.socket) -> None:
        client = self._clients[connection]
        heard = client.heard
        try:
            data = connection.recv(1 << 16)
            if not data or len(heard) > _LONGEST:
                raise ConnectionError
            heard += data
            while (end := heard.find(b"\n")) >= 0:
                line = bytes(heard[:end])
                del heard[: end + 1]
                connection.sendall(msgspec.json.encode(self._outcome(client, line)) + b"\n")
        except OSError:
            del self._clients[connection]
            connection.close()

    def _outcome(self, client: _Client, line: bytes) -> Outcome:
        try:
            self._do(client, self._decoder.decode(line))
        except (HandRefusedError, msgspec.MsgspecError) as error:
            client.motion = Motion()
            return Outcome(ok=False, error=str(error), error_key=key_of(text_of(error)))
        return Outcome(ok=True, state=self._apparatus.state())

    def _do(self, client: _Client, wish: Wish) -> None:
        match wish:
            case Pedal(down=down):
                self._apparatus.step_on_pedal(down)
            case Estop(pressed=pressed):
                self._apparatus.press_estop(pressed)
            case Rows():
                client.motion.add(wish.times_s, wish.poses_deg)
            case Guide():
                motion, client.motion = client.motion, Motion()
                motion.add(wish.times_s, wish.poses_deg)
                self._apparatus.guide(wish.name, motion, wish.pedal)
            case Release():
                self._apparatus.let_go()
            case Turn(turned=turned):
                self._apparatus.turn(turned=turned)
            case Break(fault=fault):
                self._script.fault(fault)
            case Mend():
                self._script.clear()
            case Look():
                pass
