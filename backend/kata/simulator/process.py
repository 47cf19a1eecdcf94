"""Runs the simulator's process, whose loop serves the wire and the control socket, and starts it from the parent."""

import argparse
import contextlib
import gc
import json
import logging
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final, Literal, get_args

from kata.simulator.adapter import AdapterLatency
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.client import SimulatorClient
from kata.simulator.control import ControlServer
from kata.simulator.drives import SIMULATED_DRIVES
from kata.simulator.mechanics import mechanics_named
from kata.simulator.ports import SocketPort, TerminalPort
from kata.simulator.wire import Wire
from kata.system import scheduling

log = logging.getLogger(__name__)

_TICK_NS: Final = 20_000_000
_PRIORITY: Final = 50
_START_LIMIT_S: Final = 20.0
_SPIN_NS: Final = 300_000
_BAUD: Final = 1_000_000
_MODULE: Final = ("-m", "kata.simulator")

PortKind = Literal["terminal", "socket"]
ServoProtocol = Literal["dynamixel", "modbus"]
ServedPlant = Literal["simple", "mujoco", "none"]
"""As :data:`~kata.simulator.mechanics.PlantName`, and "none": without mechanics."""


def main() -> int:
    """Run ``python -m kata.simulator``. Return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m kata.simulator", description=__doc__)
    parser.add_argument("--control", type=Path, required=True, help="path of the control socket")
    parser.add_argument("--seed", type=int, default=None, help="vary patient, gears and hand by up to 30 %%")
    parser.add_argument(
        "--protocol", choices=get_args(ServoProtocol), default="dynamixel", help="protocol of the drives"
    )
    parser.add_argument("--baud", type=int, default=_BAUD, help="baud rate of the drives")
    parser.add_argument(
        "--spin", action="store_true", help="keep transmission times to some microseconds; uses a whole core"
    )
    parser.add_argument(
        "--plant",
        choices=get_args(ServedPlant),
        default="simple",
        help="simulated mechanics; none: nothing moves, and the simulation needs little time",
    )
    parser.add_argument(
        "--latency",
        type=float,
        nargs=2,
        default=(0.0, 0.0),
        metavar="MS",
        help="of the adapter: fixed, and at most more",
    )
    parser.add_argument(
        "--port",
        choices=get_args(PortKind),
        default="terminal",
        help="kind of the drives' port: a pseudo-terminal, or a socket for Kata's own device process",
    )
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s simulator %(levelname)s %(message)s")
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        apparatus = _apparatus(arguments.plant, arguments.seed)
        line, faults, _ = SIMULATED_DRIVES[arguments.protocol](apparatus, arguments.baud)
    except (ImportError, ValueError) as error:
        parser.error(str(error))
    port: Path = arguments.control.with_suffix(".port")
    open_port = partial(SocketPort if arguments.port == "socket" else TerminalPort, port)
    wire = Wire(line, faults, open_port, AdapterLatency(*arguments.latency))
    control = ControlServer(arguments.control, apparatus, faults)
    scheduling.set_time_slice(scheduling.SHORT_NS)
    with contextlib.suppress(OSError):  # if granted; without it the drives would answer late on a busy computer
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    gc.collect()
    gc.freeze()
    sys.stdout.write(json.dumps({"port": str(port)}) + "\n")
    sys.stdout.flush()
    try:
        _serve(apparatus, wire, control, spin=arguments.spin)
    finally:
        control.close()
        wire.close()
    return 0


def _apparatus(plant: ServedPlant, seed: int | None) -> SimulatedApparatus:
    """Create the apparatus. :raises ImportError: when MuJoCo is needed and not installed."""
    if plant == "none":
        return SimulatedApparatus(seed, still=True)
    return SimulatedApparatus(seed, make_mechanics=mechanics_named(plant))


def _serve(apparatus: SimulatedApparatus, wire: Wire, control: ControlServer, *, spin: bool) -> None:
    """Serve until the parent closes this process's standard input."""
    stdin = sys.stdin.fileno()
    while True:
        sources = [*wire.sources, stdin, *control.sockets]
        readable, _, _ = select.select(sources, [], [], _sleep_s(wire, time.monotonic_ns(), spin=spin))
        if not set(wire.sources).isdisjoint(readable):
            wire.receive()
        now_ns = time.monotonic_ns()
        wire.serve(now_ns)
        apparatus.advance(now_ns)
        control.serve(readable)
        if stdin in readable and not os.read(stdin, 4096):
            return


def _sleep_s(wire: Wire, now_ns: int, *, spin: bool) -> float:
    """Return the time in s until the next work, at most one tick.

    With ``spin`` the process busy-waits shortly before the work is due, because waking up takes time. It does not busy-wait longer,
    because it would then keep the kernel worker that moves the pseudo-terminal's bytes from running on its core.
    """
    due_ns = wire.due_ns
    remaining_ns = _TICK_NS if due_ns is None else min(_TICK_NS, max(0, due_ns - now_ns))
    return max(0, remaining_ns - _SPIN_NS if spin else remaining_ns) / 1e9


class SimulatorError(Exception):
    """The simulator could not be started. The exception's message states the reason."""


@dataclass(frozen=True)
class Adapter:
    """The adapter between the computer and the simulated drives."""

    port: PortKind = "terminal"
    """Other programs need a terminal; Kata's own device process also connects to a socket."""
    latency_ms: tuple[float, float] = (0.0, 0.0)
    """A fixed time and the maximum of an additional random time."""


_ADAPTER: Final = Adapter()


class SimulatorProcess:
    """A simulator as a child process. It ends when it is closed or when its parent ends."""

    def __init__(
        self,
        folder: Path,
        seed: int | None = None,
        protocol: ServoProtocol = "dynamixel",
        baud: int = _BAUD,
        *,
        plant: ServedPlant = "simple",
        adapter: Adapter = _ADAPTER,
    ) -> None:
        """Start the simulator and wait until it is ready. Its log is in ``folder``.

        Without mechanics (``plant`` "none") it keeps transmission times accurate to some microseconds, which uses a whole core.

        :raises SimulatorError: when the simulator does not start, for example with an unsupported baud rate.
        """
        # Use a new short path for each start, because a socket's path may have at most 107 bytes.
        self._socket_folder = tempfile.TemporaryDirectory(prefix="kata-", ignore_cleanup_errors=True)
        self._control = Path(self._socket_folder.name) / "simulator.sock"
        command = [sys.executable, *_MODULE, "--control", str(self._control)]
        command += ["--protocol", protocol, "--baud", str(baud)]
        command += ["--plant", plant, *(["--spin"] if plant == "none" else [])]
        command += ["--latency", *map(str, adapter.latency_ms), "--port", adapter.port]
        if seed is not None:
            command += ["--seed", str(seed)]
        self._log = (folder / "simulator.log").open("ab")
        self._child = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log, start_new_session=True
        )
        self.port = self._wait_until_ready(folder)

    @property
    def control(self) -> Path:
        """Path of the control socket."""
        return self._control

    def wait(self) -> int:
        """Wait until the simulator has ended. Return its exit status."""
        return self._child.wait()

    def client(self) -> SimulatorClient:
        """Return a connection to hand, pedal and switch."""
        return SimulatorClient(self._control)

    @property
    def pid(self) -> int:
        """Process id of the simulator."""
        return self._child.pid

    def close(self) -> None:
        """End the simulator."""
        assert self._child.stdin is not None and self._child.stdout is not None
        self._child.stdin.close()
        try:
            self._child.wait(2.0)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        self._child.stdout.close()
        self._log.close()
        self._socket_folder.cleanup()

    def _wait_until_ready(self, folder: Path) -> str:
        assert self._child.stdout is not None
        readable, _, _ = select.select([self._child.stdout], [], [], _START_LIMIT_S)
        line = self._child.stdout.readline() if readable else b""
        try:
            return str(json.loads(line)["port"])
        except (ValueError, KeyError) as error:
            self._child.kill()
            self.close()
            tail = (folder / "simulator.log").read_text(errors="replace")[-500:].strip()
            raise SimulatorError(f"the simulated apparatus did not start: {tail or 'no answer'}") from error
