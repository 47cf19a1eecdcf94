"""Every change to an audit trail of a hundred thousand rows is detected."""

import logging
import time
from pathlib import Path
from random import Random

import pytest

from kata.audit.verify import verify
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from tests.support.audit_tampering import filled, judged, tricks

log = logging.getLogger(__name__)

ROWS = 100_000
EVERY = 250
"""Rows between two lines of the anchor."""


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("backend", ["sqlite", "postgresql"])
def test_every_change_to_a_long_trail_is_detected(backend: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'kata.db'}" if backend == "sqlite" else request.getfixturevalue("postgresql_url")
    database, file = Database(url), tmp_path / "audit.anchor"
    upgrade(database)
    filled(database, file, ROWS, EVERY)
    began_s, worked_s = time.perf_counter(), time.process_time()
    with database.read() as session:
        assert verify(session, [file]).findings == []
    took_s, worked_s = time.perf_counter() - began_s, time.process_time() - worked_s
    log.info("%s: %d rows verified in %.1f s, %.1f s of work", backend, ROWS, took_s, worked_s)

    chance = Random()
    unseen, misplaced, played = [], [], 0
    for name, trick in tricks(ROWS, chance, EVERY):
        done, verdict = judged(database, file, trick)
        played += 1
        if not verdict.findings:
            unseen.append((name, done))
        elif done.last and not any(
            finding.first <= done.last and done.first <= finding.last for finding in verdict.findings
        ):
            misplaced.append((name, done, verdict.findings[:3]))
        log.info("%s: %s: %s", backend, name, verdict.findings[0].message if verdict.findings else "nothing")
    log.info("%s: %d tricks, %d unseen, %d said to be elsewhere", backend, played, len(unseen), len(misplaced))
    if backend == "postgresql":
        with database.writer.begin() as connection:
            connection.exec_driver_sql("DROP SCHEMA public CASCADE")
            connection.exec_driver_sql("CREATE SCHEMA public")
    database.close()
    assert (unseen, misplaced) == ([], [])
