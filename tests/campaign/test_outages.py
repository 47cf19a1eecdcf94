"""Five stations on one PostgreSQL that is killed or hangs fifty times, and on two servers of which the first is killed ten times: nothing
is lost or stored twice. It takes an hour.

`--log-cli-level info` logs each outage, and the figures at the end.
"""

import logging
import os
import random
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from threading import Event
from typing import Final

import pytest

from benchmarks import postgresql
from tests.support.failover import pair
from tests.support.outages import TreatingStation, judge

STATIONS: Final = int(os.environ.get("KATA_OUTAGES_STATIONS", "5"))
OUTAGES: Final = int(os.environ.get("KATA_OUTAGES", "50"))
HANGS_S: Final = float(os.environ.get("KATA_OUTAGES_LONGEST_S", "600"))
"""Duration of the longest outage, which occurs once."""
FAILOVERS: Final = int(os.environ.get("KATA_FAILOVERS", "10"))

log = logging.getLogger(__name__)


@pytest.mark.campaign
@pytest.mark.timeout(10_800)
def test_fifty_outages_under_five_stations(tmp_path: Path) -> None:
    chance, over = random.Random(8), Event()
    with postgresql.serving() as url, ExitStack() as stack:
        server = postgresql.Server(url)
        stations = [TreatingStation(stack, tmp_path, f"Station {n}", url, over) for n in range(1, STATIONS + 1)]
        stack.callback(over.set)
        for station in stations:
            station.begin()
        for station in stations:
            station.wait_for_a_run()
        settled_mb = [station.clinic.service_mb for station in stations]
        for number in range(OUTAGES):
            over.wait(chance.uniform(1.0, 6.0))
            with server.hanging() if chance.random() < 0.5 else server.killed():
                over.wait(HANGS_S if number == OUTAGES // 2 else chance.uniform(0.0, 10.0))
            if number == OUTAGES // 10:
                settled_mb = [station.clinic.service_mb for station in stations]
            log.info(
                "outage %d of %d; services hold %s MB",
                number + 1,
                OUTAGES,
                _report(station.clinic.service_mb for station in stations),
            )
        over.set()
        for station in stations:
            station.end()
        growth_mb = [station.clinic.service_mb - mb for station, mb in zip(stations, settled_mb, strict=True)]
        log.info(
            "%s; services grew by %s MB; missed: %s",
            judge(stations, url), _report(growth_mb), ", ".join(station.missed for station in stations),
        )  # fmt: skip
        assert max(growth_mb) <= 10.0


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_ten_failovers_under_five_stations(tmp_path: Path) -> None:
    chance, over = random.Random(10), Event()
    with pair() as servers, ExitStack() as stack:
        stations = [TreatingStation(stack, tmp_path, f"Station {n}", servers.url, over) for n in range(1, STATIONS + 1)]
        stack.callback(over.set)
        for station in stations:
            station.begin()
        for number in range(FAILOVERS):
            over.wait(chance.uniform(5.0, 10.0))
            servers.fail_over(chance.uniform(0.0, 3.0))
            log.info("failover %d of %d", number + 1, FAILOVERS)
        over.set()
        for station in stations:
            station.end()
        log.info("%s; missed: %s", judge(stations, servers.url), ", ".join(station.missed for station in stations))


def _report(held_mb: Iterable[float]) -> str:
    return ", ".join(f"{mb:.1f}" for mb in held_mb)
