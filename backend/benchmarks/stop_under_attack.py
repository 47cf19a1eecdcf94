"""Implements ``python -m benchmarks stop-under-attack``: measures the time from a Stop to its answer while the service is attacked."""

import http.client
import json
import random
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final
from urllib.parse import urlsplit

import numpy as np

from benchmarks import postgresql
from benchmarks.attacks import ATTACKS
from kata.bench.account import sign_in_cookie
from kata.bench.helper_process import HelperOutput, helper_process
from kata.bench.records import BenchRecords
from kata.bench.report import Report
from kata.bench.running_service import BenchError, RunningService, prepare_records
from kata.database.engine import Database
from kata.settings import Settings

GOAL_MS: Final = 100.0
_CONNECTIONS: Final = str(Settings.model_fields["connections_per_address"].default)
"""Allowed connections of one address, as in a clinic."""
_RATE_HZ: Final = 100
_PLOT_S: Final = 600.0
_BEFORE_S: Final = 2.0
"""Duration of the attack before the first Stop."""
_BETWEEN_S: Final = (0.02, 0.08)
_ANSWER_LIMIT_S: Final = 30.0
QUIET: Final = "none"


@dataclass(frozen=True)
class StopsUnderAttack:
    """The figures of one attack."""

    took_ms: list[float]
    refused: int
    """Number of Stops without an answer, or with a status other than 200."""
    begun: int
    """Number of times that an attacker began."""
    grown_mb: float
    """Largest growth of the service's resident memory during the attack."""


def run(stops: int, attacks: tuple[str, ...], stations: int, progress: Callable[[str], None]) -> Report:
    """Send ``stops`` Stops during each of the named :data:`~benchmarks.attacks.ATTACKS`, and without an attack.

    A single station uses SQLite. Several stations share one PostgreSQL. The first is attacked, and each gets ``stops`` Stops.

    :raises BenchError: when a service does not start, or PostgreSQL is missing.
    """
    report = Report(
        f"Stop by HTTP to its answer under attack, {stops} each, {f'{stations} stations' if stations > 1 else 'one station'}",
        ("Attack", "Stops", "p50, ms", "p99.9, ms", "goal, ms", "max, ms", "failed", "memory, MB", "attackers begun"),
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        for name in (QUIET, *attacks):
            progress(name)
            for n, measured in enumerate(measure(Path(folder) / name, name, stops, stations)):
                _add_row(report, name if n == 0 else f"{name}_station_{n + 1}", measured)
    report.notes += [
        "Each Stop has a new connection, as from a page whose WebSocket is lost. The apparatus is idle and simulated. Attackers, service "
        "and simulator share this computer's processors.",
        "memory: the most that the service's process grew during the attack.",
    ]
    return report


def measure(folder: Path, name: str, stops: int, stations: int) -> list[StopsUnderAttack]:
    """Return the figures of every station. The first station is attacked with the attack ``name``.

    :raises BenchError: when a service does not start, or PostgreSQL is missing.
    """
    with ExitStack() as stack:
        url = stack.enter_context(postgresql.serving()) if stations > 1 else None
        records = [
            prepare_records(folder / f"{n}", play_s=1.0, plot_s=_PLOT_S if n == 1 else 1.0, database_url=url)
            for n in range(1, stations + 1)
        ]
        database = Database(url or f"sqlite:///{folder / '1/kata.db'}")
        attacker = sign_in_cookie(database)
        database.close()
        targets = [
            _Target(stack.enter_context(_service(folder, n, one)), one.cookie) for n, one in enumerate(records, start=1)
        ]
        with _attacking(name, targets[0].service, records[0], attacker) as output:
            time.sleep(_BEFORE_S)
            for _ in range(stops):
                for target in targets:
                    target.stop()
                    time.sleep(random.uniform(*_BETWEEN_S))
        begun = int(output.text or 0)
        return [target.figures(begun if n == 0 else 0) for n, target in enumerate(targets)]


def _service(folder: Path, n: int, records: BenchRecords) -> RunningService:
    return RunningService(
        folder / f"{n}",
        records,
        cycle_hz=_RATE_HZ,
        rate_hz=_RATE_HZ,
        settings={"KATA_CONNECTIONS_PER_ADDRESS": _CONNECTIONS},
        name=f"Station {n}",
    )


class _Target:
    """A station's service that gets Stops, and its measured figures."""

    def __init__(self, service: RunningService, cookie: str) -> None:
        self.service, self._cookie = service, cookie
        self._took_ms: list[float] = []
        self._refused = 0
        self._before_mb = self._largest_mb = service.service_mb

    def stop(self) -> None:
        began = time.perf_counter()
        if _stop(self.service.url, self._cookie):
            self._took_ms.append((time.perf_counter() - began) * 1000)
        else:
            self._refused += 1
        self._largest_mb = max(self._largest_mb, self.service.service_mb)

    def figures(self, begun: int) -> StopsUnderAttack:
        return StopsUnderAttack(self._took_ms, self._refused, begun, self._largest_mb - self._before_mb)


def _attacking(
    name: str, service: RunningService, records: BenchRecords, cookie: str
) -> AbstractContextManager[HelperOutput]:
    if name == QUIET:
        return nullcontext(HelperOutput())
    arguments = ["--name", name, "--url", service.url, "--cookie", cookie]
    arguments += ["--patient", str(records.patient_id), "--session", str(records.session_id)]
    return helper_process("benchmarks.attacks", *arguments, failure=f"the attack {name} could not begin")


def _stop(url: str, cookie: str) -> bool:
    where = urlsplit(url)
    # Use another address than the attackers, because connections are limited by address.
    connection = http.client.HTTPConnection(
        where.hostname or "", where.port, timeout=_ANSWER_LIMIT_S, source_address=("127.0.0.2", 0)
    )
    try:
        headers = {"Cookie": cookie, "Content-Type": "application/json"}
        connection.request("POST", "/api/station/stop", json.dumps({}), headers)
        answer = connection.getresponse()
        answer.read()
        return answer.status == http.client.OK
    except (OSError, http.client.HTTPException):
        return False
    finally:
        connection.close()


def _add_row(report: Report, name: str, measured: StopsUnderAttack) -> None:
    if not measured.took_ms:
        raise BenchError(f"no Stop was answered under the attack {name}")
    p50, p999 = np.percentile(measured.took_ms, (50, 99.9), method="inverted_cdf").tolist()
    longest = max(measured.took_ms)
    report.figures |= {
        f"p50_ms_{name}": p50,
        f"p999_ms_{name}": p999,
        f"max_ms_{name}": longest,
        f"failed_{name}": measured.refused,
        f"memory_mb_{name}": measured.grown_mb,
    }
    report.rows.append(
        (
            name,
            str(len(measured.took_ms)),
            f"{p50:.1f}",
            f"{p999:.1f}",
            f"{GOAL_MS:g}",
            f"{longest:.1f}",
            str(measured.refused),
            f"{measured.grown_mb:.0f}",
            str(measured.begun),
        )
    )


ALL: Final = tuple(ATTACKS)
"""Names of the attacks."""
