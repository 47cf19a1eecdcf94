"""Implements ``python -m benchmarks start``: measures the time from the command ``kata serve`` until its first answers, and its
processor time.
"""

import os
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Final
from urllib.error import HTTPError
from urllib.request import urlopen

from kata.bench.report import Report
from kata.bench.running_service import BenchError

_LIMIT_S: Final = 120.0
_POLL_S: Final = 0.01


@dataclass(frozen=True)
class Start:
    """Times in s from the start of the process until the answer 200."""

    page_s: float
    ready_s: float
    processor_s: float
    """Processor time of the service and its child processes until they have ended."""


def run(rounds: int, against: Path | None, progress: Callable[[str], None]) -> Report:
    """Start the service of this checkout ``rounds`` times, alternating with that of another checkout.

    Each checkout has its own data folder. The first start, which creates the database, is additional and reported separately.

    :param against: the other checkout, or None.
    :raises BenchError: when a service does not become ready.
    """
    report = Report(
        f"Start of the service, {rounds} times",
        (
            "Checkout",
            "first start: ready, s",
            "page, s (median)",
            "ready, s (median)",
            "ready, s (slowest)",
            "processor, s (median)",
        ),
    )
    checkouts = {"this": Path(__file__).parents[2]} | ({"other": against} if against else {})
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        starts: dict[str, list[Start]] = {name: [] for name in checkouts}
        for n in range(rounds + 1):
            for name, checkout in checkouts.items():
                progress(f"Start {n} of {rounds}, {name}")
                starts[name].append(_start(checkout, Path(folder) / name))
    for name, (first, *later) in starts.items():
        figures = {
            "first_ready": first.ready_s,
            "page": median(start.page_s for start in later),
            "ready": median(start.ready_s for start in later),
            "ready_max": max(start.ready_s for start in later),
            "processor": median(start.processor_s for start in later),
        }
        report.figures |= {f"start_{name}_{figure}_s": seconds for figure, seconds in figures.items()}
        report.rows.append((name, *(f"{seconds:.2f}" for seconds in figures.values())))
    report.notes.append(
        "page: GET / answers 200. ready: GET /health/ready answers 200, with the device process. Simulated apparatus. "
        "processor: service, device process, reference builder and simulator, which end as soon as the service is ready."
    )
    return report


def _start(checkout: Path, data: Path) -> Start:
    """Start the service, wait for its answers, and end it. Return the times."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("KATA_")}
    environment["PYTHONPATH"] = str(checkout / "backend")
    data.mkdir(exist_ok=True)
    log = data.with_suffix(".log")
    command = [sys.executable, "-m", "kata", "serve", "--simulate", "--port", str(port), "--data", str(data)]
    began, used_s = time.monotonic(), _used_by_children_s()
    with log.open("wb") as output:
        service = subprocess.Popen(command, env=environment, stdout=output, stderr=output, cwd=data)
    try:
        page_s, ready_s = (
            _until_answered(f"http://127.0.0.1:{port}{path}", service, began, log) for path in ("/", "/health/ready")
        )
    finally:
        service.send_signal(signal.SIGINT)
        service.wait(30.0)
    return Start(page_s, ready_s, _used_by_children_s() - used_s)


def _used_by_children_s() -> float:
    """Return the processor time of all ended child processes, and of the children that these have waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _until_answered(url: str, service: "subprocess.Popen[bytes]", began: float, log: Path) -> float:
    while True:
        try:
            with urlopen(url, timeout=5.0) as answer:
                answer.read()
                return time.monotonic() - began
        except HTTPError as error:
            error.close()
        except OSError:
            pass
        if service.poll() is not None or time.monotonic() - began > _LIMIT_S:
            raise BenchError(f"{url} did not answer: {log.read_text()[-500:].strip()}")
        time.sleep(_POLL_S)
