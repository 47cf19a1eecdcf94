"""The simulator's process: one loop that serves the wire and the control socket; and its parent's side."""

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
from pathlib import Path
from typing import Final, Literal, get_args

from kata.simulator.apparatus import Apparatus
from kata.simulator.bus import ServoBus
from kata.simulator.client import SimulatorClient
from kata.simulator.control import ControlServer
from kata.simulator.lines import DynamixelLine, Line, ModbusLine
from kata.simulator.modbus_bus import ModbusBus
from kata.simulator.script import Script
from kata.simulator.wire import Wire
from kata.system import scheduling

log = logging.getLogger(__name__)

_TICK_NS: Final = 20_000_000
_PRIORITY: Final = 50
_START_LIMIT_S: Final = 20.0
_SOON_NS: Final = 300_000
_BAUD: Final = 1_000_000

ServoProtocol = Literal["dynamixel", "modbus"]


def main() -> int:
    """Entry of ``python -m kata.simulator``."""
    parser = argparse.ArgumentParser(prog="python -m kata.simulator", description=__doc__)
    parser.add_argument("--control", type=Path, required=True, help="path of the control socket")
    parser.add_argument(
        "--seed", type=int, default=None, help="another patient, other gears, another hand: up to 30 %% off"
    )
    parser.add_argument(
        "--protocol", choices=get_args(ServoProtocol), default="dynamixel", help="what the drives speak"
    )
    parser.add_argument("--baud", type=int, default=_BAUD, help="what the drives listen at")
    parser.add_argument("--spin", action="store_true", help="keep the bytes' time to some microseconds; costs a core")
    parser.add_argument(
        "--still", action="store_true", help="without mechanics: nothing moves, and the wire costs little"
    )
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s simulator %(levelname)s %(message)s")
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    apparatus = Apparatus(arguments.seed, still=arguments.still)
    try:
        line, script = _bus(apparatus, arguments.protocol, arguments.baud)
    except ValueError as error:
        parser.error(str(error))
    port: Path = arguments.control.with_suffix(".port")
    wire = Wire(line, script, port)
    control = ControlServer(arguments.control, apparatus, script)
    scheduling.ask_for(scheduling.SHORT_NS)
    with contextlib.suppress(OSError):  # best effort: on a busy computer the drives would else seem to stutter
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


def _bus(apparatus: Apparatus, protocol: ServoProtocol, baud: int) -> tuple[Line, Script]:
    if protocol == "modbus":
        modbus = ModbusBus(apparatus, baud)
        return ModbusLine(modbus), modbus.script
    servos = ServoBus(apparatus, baud)
    return DynamixelLine(servos), servos.script


def _serve(apparatus: Apparatus, wire: Wire, control: ControlServer, *, spin: bool) -> None:
    """Until the parent's end of our standard input is gone."""
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
    """How long nothing is due; not longer than a tick.

    Waking up takes its time: who spins stays awake when it is near. Not for longer, though: a spinning process of high
    priority keeps the kernel's own worker, which moves the bytes through the pseudo-terminal, from its core.
    """
    due_ns = wire.due_ns
    left_ns = _TICK_NS if due_ns is None else min(_TICK_NS, max(0, due_ns - now_ns))
    return max(0, left_ns - _SOON_NS if spin else left_ns) / 1e9


class SimulatorError(Exception):
    """The simulator could not be started; the message says why."""


class SimulatorProcess:
    """A simulator running as a child process; ends when it is closed, or with us."""

    def __init__(
        self,
        folder: Path,
        seed: int | None = None,
        protocol: ServoProtocol = "dynamixel",
        baud: int = _BAUD,
        *,
        spin: bool = False,
        still: bool = False,
    ) -> None:
        """Start it and wait until it is ready; its log goes to ``folder``.

        ``spin`` keeps the bytes' time to some microseconds and costs a core; ``still`` leaves the mechanics out.

        :raises SimulatorError: when it does not come up, as with a baud rate that the drives do not know.
        """
        # A path of its own for each start, and short: a socket's path may have 107 bytes.
        self._socket_folder = tempfile.TemporaryDirectory(prefix="kata-", ignore_cleanup_errors=True)
        self._control = Path(self._socket_folder.name) / "simulator.sock"
        command = [sys.executable, "-m", "kata.simulator", "--control", str(self._control)]
        command += ["--protocol", protocol, "--baud", str(baud)]
        command += [option for option, wanted in (("--spin", spin), ("--still", still)) if wanted]
        if seed is not None:
            command += ["--seed", str(seed)]
        self._log = (folder / "simulator.log").open("ab")
        self._child = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log, start_new_session=True
        )
        self.port = self._wait_until_ready(folder)

    def client(self) -> SimulatorClient:
        """A connection to hand, pedal and switch."""
        return SimulatorClient(self._control)

    @property
    def pid(self) -> int:
        """Its process."""
        return self._child.pid

    def close(self) -> None:
        """End it."""
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
