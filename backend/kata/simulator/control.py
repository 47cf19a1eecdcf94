"""The control socket: where hand, pedal and switch are moved from. JSON lines, one reply to each request."""

import contextlib
import socket
from pathlib import Path
from typing import Final

import msgspec

from kata.simulator.apparatus import Apparatus, HandRefusedError, State

_LONGEST: Final = 64 * 1024 * 1024


class Pedal(msgspec.Struct, frozen=True, tag_field="do", tag="pedal"):
    """Put the foot down or lift it."""

    down: bool


class Estop(msgspec.Struct, frozen=True, tag_field="do", tag="estop"):
    """Press the emergency stop or release it."""

    pressed: bool


class Guide(msgspec.Struct, frozen=True, tag_field="do", tag="guide"):
    """Take the arm along a motion: times (n,) in s, poses (n, 5) in degrees; with the pedal, if wanted."""

    name: str
    times_s: list[float]
    poses_deg: list[list[float]]
    pedal: bool = True


class Release(msgspec.Struct, frozen=True, tag_field="do", tag="release"):
    """Let go of arm and pedal."""


class Look(msgspec.Struct, frozen=True, tag_field="do", tag="state"):
    """Change nothing."""


Wish = Pedal | Estop | Guide | Release | Look


class Outcome(msgspec.Struct, frozen=True):
    """The state after the request, or why it was refused."""

    ok: bool
    state: State | None = None
    error: str | None = None


class ControlServer:
    """Serves any number of clients from the simulator's one loop."""

    def __init__(self, path: Path, apparatus: Apparatus) -> None:
        self._apparatus = apparatus
        self._path = path
        path.unlink(missing_ok=True)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind(str(path))
        self._listener.listen()
        self._clients: dict[socket.socket, bytearray] = {}
        self._decoder = msgspec.json.Decoder(Wish)

    @property
    def sockets(self) -> list[socket.socket]:
        """What to wait for."""
        return [self._listener, *self._clients]

    def serve(self, readable: list[object]) -> None:
        """Take what has come."""
        if self._listener in readable:
            client, _ = self._listener.accept()
            self._clients[client] = bytearray()
        for client in [client for client in self._clients if client in readable]:
            self._receive(client)

    def close(self) -> None:
        """Leave no socket behind."""
        for open_socket in self.sockets:
            open_socket.close()
        self._path.unlink(missing_ok=True)

    def _receive(self, client: socket.socket) -> None:
        heard = self._clients[client]
        try:
            data = client.recv(1 << 20)
            if not data or len(heard) > _LONGEST:
                raise ConnectionError
            heard += data
            while (end := heard.find(b"\n")) >= 0:
                line = bytes(heard[:end])
                del heard[: end + 1]
                client.sendall(msgspec.json.encode(self._outcome(line)) + b"\n")
        except OSError:
            del self._clients[client]
            with contextlib.suppress(OSError):
                client.close()

    def _outcome(self, line: bytes) -> Outcome:
        try:
            self._do(self._decoder.decode(line))
        except (HandRefusedError, msgspec.MsgspecError) as error:
            return Outcome(ok=False, error=str(error))
        return Outcome(ok=True, state=self._apparatus.state())

    def _do(self, wish: Wish) -> None:
        match wish:
            case Pedal(down=down):
                self._apparatus.step_on_pedal(down)
            case Estop(pressed=pressed):
                self._apparatus.press_estop(pressed)
            case Guide():
                self._apparatus.guide(wish.name, wish.times_s, wish.poses_deg, wish.pedal)
            case Release():
                self._apparatus.let_go()
            case Look():
                pass
