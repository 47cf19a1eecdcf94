"""``python -m benchmarks stop-under-attack``: the time from a user's Stop to its answer while others attack the service."""

import http.client
import json
import random
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final
from urllib.parse import urlsplit

import numpy as np

from benchmarks.attacks import ATTACKS
from kata.bench.account import sign_in_cookie
from kata.bench.helper_process import HelperOutput, helper_process
from kata.bench.records import BenchRecords
from kata.bench.report import Report
from kata.bench.running_service import BenchError, RunningService, prepare_records
from kata.database.engine import Database

GOAL_MS: Final = 100.0
_RATE_HZ: Final = 100
_PLOT_S: Final = 600.0
_BEFORE_S: Final = 2.0
"""The attack runs for this long before the first Stop."""
_BETWEEN_S: Final = (0.02, 0.08)
_ANSWER_LIMIT_S: Final = 30.0
QUIET: Final = "none"


@dataclass(frozen=True)
class StopsUnderAttack:
    """The figures of one attack."""

    took_ms: list[float]
    refused: int
    """Stops without an answer, or with another than 200."""
    begun: int
    """How often an attacker began."""
    grown_mb: float
    """Most growth of the service's resident memory during the attack."""


def run(stops: int, attacks: tuple[str, ...], progress: Callable[[str], None]) -> Report:
    """Send ``stops`` Stops during each of the named :data:`~benchmarks.attacks.ATTACKS`, and without one.

    :raises BenchError: when the service does not start.
    """
    report = Report(
        f"Stop by HTTP to its answer under attack, {stops} each",
        ("Attack", "Stops", "p50, ms", "p99.9, ms", "goal, ms", "max, ms", "failed", "memory, MB", "attackers begun"),
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        for name in (QUIET, *attacks):
            progress(name)
            _add_row(report, name, _measure(Path(folder) / name, name, stops))
    report.notes += [
        "Each Stop has a new connection, as from a page whose WebSocket is lost. The apparatus is idle and simulated. Attackers, service "
        "and simulator share this computer's processors.",
        "memory: the most that the service's process grew during the attack.",
    ]
    return report


def _measure(data: Path, name: str, stops: int) -> StopsUnderAttack:
    records = prepare_records(data, play_s=1.0, plot_s=_PLOT_S)
    database = Database(f"sqlite:///{data / 'kata.db'}")
    attacker = sign_in_cookie(database)
    database.close()
    with RunningService(data, records, cycle_hz=_RATE_HZ, rate_hz=_RATE_HZ) as service:
        took_ms: list[float] = []
        refused = 0
        before_mb = largest_mb = service.service_mb
        with _attacking(name, service, records, attacker) as output:
            time.sleep(_BEFORE_S)
            while len(took_ms) + refused < stops:
                began = time.perf_counter()
                if _stop(service.url, records.cookie):
                    took_ms.append((time.perf_counter() - began) * 1000)
                else:
                    refused += 1
                largest_mb = max(largest_mb, service.service_mb)
                time.sleep(random.uniform(*_BETWEEN_S))
        return StopsUnderAttack(took_ms, refused, int(output.text or 0), largest_mb - before_mb)


def _attacking(
    name: str, service: RunningService, records: BenchRecords, cookie: str
) -> AbstractContextManager[HelperOutput]:
    if name == QUIET:
        return nullcontext(HelperOutput())
    arguments = ["--name", name, "--url", service.url, "--cookie", cookie]
    arguments += ["--run", str(records.run_id), "--session", str(records.session_id)]
    return helper_process("benchmarks.attacks", *arguments, failure=f"the attack {name} could not begin")


def _stop(url: str, cookie: str) -> bool:
    where = urlsplit(url)
    # Another address than the attackers': connections are limited by address.
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
