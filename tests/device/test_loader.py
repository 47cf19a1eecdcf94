"""The reference builder as a process: its input, its results, and its failures."""

import os
import queue
import select
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from kata.device.config import StationConfig
from kata.device.ipc_messages import Load, Refusal, parts_of
from kata.device.loader import ReferenceLoader, Result
from kata.device.references import Reference, build
from kata.motion.ilc import rows
from kata.motion.trajectory import Trajectory, ZeroOrderHold
from tests.support.load_messages import SECONDS, TIMES_S, angles, correction, message
from tests.support.paths import ROOT

LIMIT_S = 30.0


class Loading:
    """A loader and its results."""

    def __init__(self, loader: ReferenceLoader) -> None:
        self.loader = loader
        self._results: queue.Queue[tuple[int, Result]] = queue.Queue()
        loader.start(self._notified)

    def _notified(self) -> None:
        for result in self.loader.results():
            self._results.put(result)

    def send(self, load: Load, number: int = 1) -> None:
        for part in parts_of(number, load):
            self.loader.send(part)

    def result(self, number: int = 1) -> Result:
        found, result = self._results.get(timeout=LIMIT_S)
        assert found == number
        return result

    def load(self, load: Load) -> Result:
        self.send(load)
        return self.result()

    @property
    def builder(self) -> int:
        """Return the builder's process id."""
        assert self.loader._builder
        return self.loader._builder._process.pid


@contextmanager
def loader(**options: object) -> Iterator[Loading]:
    made = ReferenceLoader(StationConfig(), **options)  # type: ignore[arg-type]
    loading = Loading(made)
    try:
        yield loading
    finally:
        made.finish()


@pytest.fixture(scope="module")
def loading() -> Iterator[Loading]:
    with loader() as made:
        yield made


@pytest.mark.parametrize("method", ["paper", "smooth", "learned"])
def test_builder_process_gives_the_same_reference(loading: Loading, method: str) -> None:
    wave = angles(motor3=10 + 30 * np.sin(np.pi * TIMES_S / SECONDS))
    learned = {"correction_deg": correction(), "correction_step_s": 0.02} if method == "learned" else {}
    load = message(wave, method=method, **learned)
    here, there = build(load, StationConfig()), loading.load(load)
    assert isinstance(here, Reference) and isinstance(there, Reference)
    assert type(there.trajectory) is (ZeroOrderHold if method == "paper" else Trajectory)
    assert here.trajectory.parts().keys() == there.trajectory.parts().keys()
    for name, numbers in here.trajectory.parts().items():
        assert np.array_equal(numbers, there.trajectory.parts()[name])
    for time_s in np.linspace(-0.1, SECONDS + 0.1, 77):
        assert np.array_equal(here.trajectory.at(time_s), there.trajectory.at(time_s))
    if method == "learned":
        assert there.correction and here.correction
        assert there.correction.step_s == 0.02
        assert there.correction.angles_deg.shape == (rows(SECONDS), 5)
        assert np.array_equal(there.correction.angles_deg, here.correction.angles_deg)
    else:
        assert there.correction is None


def test_angles_near_the_end_of_the_float_range_are_refused(loading: Loading) -> None:
    for extreme in (1e308, -1e308):
        refusal = loading.load(message(angles(motor2=np.where(TIMES_S == 1.0, extreme, 109.0))))
        assert isinstance(refusal, Refusal)
        assert refusal.code == "unplayable"
        assert "no motor goes beyond 3600°" in refusal.message
    assert isinstance(loading.load(message()), Reference)


def test_an_error_of_the_builder_is_a_refusal(loading: Loading) -> None:
    """A gap between two samples that overflows: numpy warns, and the result is undefined."""
    times = np.array([-1.7e308, 1.7e308, *TIMES_S[2:]])
    refusal = loading.load(message(times_s=times.tobytes()))
    assert isinstance(refusal, Refusal)
    assert refusal.code == "unplayable"
    assert isinstance(loading.load(message()), Reference)


def test_killed_builder_refuses_its_load_and_the_next_succeeds(tmp_path: Path) -> None:
    """The first builder is killed between a Load and its parts."""
    program = """
import os, signal, socket, sys
from pathlib import Path
been = Path(sys.argv.pop(1))
if not been.exists():
    been.touch()
    connection = socket.socket(fileno=int(sys.argv[1]))
    connection.recv(1 << 18), connection.recv(1 << 18)
    os.kill(os.getpid(), signal.SIGKILL)
from kata.device.reference_builder import main
sys.exit(main())
"""
    with loader(command=(sys.executable, "-c", program, str(tmp_path / "been"))) as loading:
        refusal = loading.load(message())
        assert isinstance(refusal, Refusal)
        assert (refusal.code, refusal.next_step) == ("unplayable", "Load the recording again.")
        assert isinstance(loading.load(message()), Reference)


def test_a_builder_that_died_while_idle_is_replaced() -> None:
    with loader() as loading:
        assert isinstance(loading.load(message()), Reference)
        before = loading.builder
        os.kill(before, signal.SIGKILL)
        os.waitid(os.P_PID, before, os.WEXITED | os.WNOWAIT)
        assert isinstance(loading.load(message()), Reference)
        assert loading.builder != before


def test_a_builder_that_hangs_is_a_refusal() -> None:
    silent = (sys.executable, "-c", "import sys; sys.stdin.close(); import signal; signal.pause()")
    with loader(command=silent, limit_s=0.01) as loading:
        refusal = loading.load(message())
        assert isinstance(refusal, Refusal)
        assert refusal.code == "unplayable"


def test_rest_of_a_discarded_load_is_not_added_to_another(loading: Loading) -> None:
    *parts, _ = parts_of(7, message(angles(motor3=20.0 + 0 * TIMES_S)))
    for part in parts:
        loading.loader.send(part)
    built = loading.load(message())
    assert isinstance(built, Reference)
    assert built.trajectory.start_deg[2] == 10.0


def test_the_builder_ends_with_the_device_process() -> None:
    """The kernel closes the socket, however the device process ends."""
    program = """
import sys, time
from kata.device.config import StationConfig
from kata.device.loader import ReferenceLoader
print(ReferenceLoader(StationConfig())._builder._process.pid, flush=True)
time.sleep(60)
"""
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, cwd=ROOT) as device:
        assert device.stdout
        builder = os.pidfd_open(int(device.stdout.readline()))
        device.kill()
    try:
        assert select.select([builder], [], [], LIMIT_S)[0]
    finally:
        os.close(builder)


def test_the_builder_has_no_privileged_scheduling(loading: Loading) -> None:
    assert isinstance(loading.load(message()), Reference)
    assert os.sched_getscheduler(loading.builder) == os.SCHED_OTHER
    assert os.getpriority(os.PRIO_PROCESS, loading.builder) > os.getpriority(os.PRIO_PROCESS, 0)


def test_the_device_process_does_without_scipy() -> None:
    program = "import sys, kata.device.process; print([name for name in sys.modules if name.startswith('scipy')])"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    assert found.stdout == "[]\n"
