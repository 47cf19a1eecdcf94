"""The plan of decision 0040: the largest table, run_sample_blocks, partitioned by month on a real PostgreSQL.

`--log-cli-level info` logs bytes of each table per session, and reading times before and after.
"""

import logging
import shutil
import statistics
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, date, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final
from uuid import UUID

import pytest
from sqlalchemy import delete, select, text
from sqlalchemy.engine import make_url
from sqlalchemy.exc import IntegrityError

from benchmarks import postgresql, synthetic
from kata.clinic.sessions.tables import RUN_SAMPLES, RunRow, RunSamplesRow
from kata.database.database_copy import copy, scratch
from kata.database.engine import Database
from kata.database.postgresql_programs import postgresql_program
from kata.database.series import Series
from kata.database.table_checksums import checksums, differences
from kata.database.upgrade import upgrade
from tests.support.paths import ROOT

pytestmark = [pytest.mark.campaign, pytest.mark.timeout(1200)]

log = logging.getLogger(__name__)

SCRIPT: Final = ROOT / "deploy/postgresql/partition-samples.sql"
PATIENTS: Final = 20
SESSIONS: Final = 2000
RUNS: Final = 40
RUN_S: Final = 600.0
PLAYED_S: Final = 1800.0
"""Playing time of a session, from which the growth is calculated."""
READINGS: Final = 200
STATIONS: Final = 20
SESSIONS_A_STATION_AND_YEAR: Final = 8 * 250
MB: Final = 1e6


class Clinic:
    """A clinic on PostgreSQL with ``RUNS`` runs of ten minutes in the single table, and what a service read from it."""

    def __init__(self, url: str) -> None:
        self.url = url
        with closing(Database(url)) as unlimited:
            upgrade(unlimited)
            self.first = synthetic.fill(unlimited, PATIENTS, SESSIONS, RUN_S, date(2026, 11, 1)).hour
        self.database = Database(url, answer_s=60.0)
        with self.database.read() as session:
            self.series = RUN_SAMPLES.read(session, self.first)
            others = session.scalars(
                select(RunRow.id).where(RunRow.id != self.first).order_by(RunRow.id).limit(RUNS)
            ).all()
        self.runs, self.later = list(others[:-1]), others[-1]
        for run in self.runs:
            with self.database.write() as session:
                RUN_SAMPLES.store(session, run, self.series, None)
        self.runs.append(self.first)

    def partition(self) -> None:
        """Run the script as an administrator does."""
        url = make_url(self.url)
        program = postgresql_program("psql")
        assert program
        done = subprocess.run(
            [program, "--host", str(url.query["host"]), "--username", "kata", "--single-transaction", "--set",
             "ON_ERROR_STOP=1", "--file", SCRIPT, "postgres"],
            capture_output=True, text=True,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr

    def ask(self, statement: str, **values: Any) -> Any:
        with self.database.direct.connect() as connection:
            return connection.scalar(text(statement), values)

    def read(self) -> tuple[dict[UUID, Series], dict[str, float]]:
        """Read every run and a window of it, as the service does. Return the runs and the median times in milliseconds."""
        read: dict[UUID, Series] = {}
        took_s: dict[str, list[float]] = {"run": [], "window": []}
        for number in range(READINGS):
            run = self.runs[number % len(self.runs)]
            with self.database.read() as session:
                began_s = time.perf_counter()
                read[run] = RUN_SAMPLES.read(session, run)
                took_s["run"].append(time.perf_counter() - began_s)
                began_s = time.perf_counter()
                RUN_SAMPLES.read_within(session, run, "path_s", 200.0, 300.0)
                took_s["window"].append(time.perf_counter() - began_s)
        return read, {name: 1000 * statistics.median(some) for name, some in took_s.items()}


@pytest.fixture(scope="module")
def clinic() -> Iterator[Clinic]:
    """Return a clinic whose samples are partitioned, after comparing it with the same clinic before."""
    try:
        with postgresql.serving() as url:
            made = Clinic(url)
            log_growth(made)
            before, before_ms = made.read()
            began_s = time.perf_counter()
            made.partition()
            took_s = time.perf_counter() - began_s
            after, after_ms = made.read()
            assert before == after
            assert set(before) == set(made.runs)
            log.info("partitioned in %.2f s; median before %s, after %s ms", took_s, before_ms, after_ms)
            yield made
            made.database.close()
    except postgresql.MissingError as error:
        pytest.skip(str(error))


def log_growth(clinic: Clinic) -> None:
    sizes = text(
        "SELECT relname, pg_total_relation_size(oid) FROM pg_class WHERE relkind = 'r' AND relnamespace = 'public'::regnamespace"
    )
    with clinic.database.direct.connect() as connection:
        found = {str(name): int(size) for name, size in connection.execute(sizes)}
    per_session = {name: size / SESSIONS for name, size in found.items()}
    share = PLAYED_S / RUN_S
    per_session |= {
        "run_samples": found["run_samples"] / RUNS,
        "run_sample_blocks": share * found["run_sample_blocks"] / RUNS,
    }
    year = STATIONS * SESSIONS_A_STATION_AND_YEAR
    for name, size in sorted(per_session.items(), key=lambda pair: -pair[1])[:12]:
        log.info("%-22s %9.0f bytes a session, %8.1f MB a year of %d stations", name, size, size * year / MB, STATIONS)
    rest = sum(size for name, size in per_session.items() if name != "run_sample_blocks")
    log.info("all other tables together: %.0f bytes a session, %.0f MB a year", rest, rest * year / MB)


def blocks_of(clinic: Clinic, run: UUID) -> int:
    return int(clinic.ask("SELECT count(*) FROM run_sample_blocks WHERE run_id = :run", run=run))


def test_past_is_one_partition_and_coming_months_are_others(clinic: Clinic) -> None:
    parts = int(clinic.ask("SELECT count(*) FROM pg_inherits WHERE inhparent = 'run_sample_blocks'::regclass"))
    assert parts == 1 + 24 + 1
    all_rows = clinic.ask("SELECT count(*) FROM run_sample_blocks")
    assert all_rows == clinic.ask("SELECT count(*) FROM run_sample_blocks_past") == RUNS * len(clinic.series.blocks)


def test_service_stores_reads_and_deletes_a_run_in_the_partitions(clinic: Clinic) -> None:
    with clinic.database.write() as session:
        RUN_SAMPLES.store(session, clinic.later, clinic.series, None)
    with clinic.database.read() as session:
        assert RUN_SAMPLES.read(session, clinic.later) == clinic.series
    months = "SELECT string_agg(DISTINCT month::text, ' ') FROM run_sample_blocks WHERE run_id = :run"
    assert clinic.ask(months, run=clinic.later) == f"{datetime.now(UTC):%Y-%m}-01"
    # The erasure of a patient deletes the head; the blocks follow by the foreign key.
    with clinic.database.write() as session:
        session.execute(delete(RunSamplesRow).where(RunSamplesRow.run_id == clinic.later))
    assert blocks_of(clinic, clinic.later) == 0


def test_a_run_cannot_be_stored_twice_even_in_two_months(clinic: Clinic) -> None:
    with pytest.raises(IntegrityError, match="pk_run_samples"), clinic.database.write() as session:
        RUN_SAMPLES.store(session, clinic.first, clinic.series, None)
    assert blocks_of(clinic, clinic.first) == len(clinic.series.blocks)


def test_block_of_an_unknown_run_is_refused_in_every_partition(clinic: Clinic) -> None:
    insert = "INSERT INTO run_sample_blocks (run_id, number, data, month) VALUES (:run, 1, '', CAST(:month AS date))"
    for month in ("2020-01-01", clinic.ask("SELECT (now() + interval '3 months')::date::text"), "2100-01-01"):
        with pytest.raises(IntegrityError, match="run_samples"), clinic.database.direct.begin() as connection:
            connection.execute(text(insert), {"run": UUID(int=1), "month": month})


def test_month_without_partition_is_stored_and_moved_later(clinic: Clinic) -> None:
    month = clinic.ask("SELECT date_trunc('month', now() AT TIME ZONE 'UTC' + interval '2 months')::date::text")
    part = f"run_sample_blocks_{month[:7].replace('-', '_')}"
    insert = "INSERT INTO run_sample_blocks (run_id, number, data, month) VALUES (:run, 9999, '', CAST(:month AS date))"
    with clinic.database.direct.begin() as connection:
        connection.execute(text(f"DROP TABLE {part}"))
        connection.execute(text(insert), {"run": clinic.first, "month": month})
    assert clinic.ask("SELECT count(*) FROM run_sample_blocks_default") == 1
    clinic.partition()
    assert clinic.ask("SELECT count(*) FROM run_sample_blocks_default") == 0
    assert clinic.ask(f"SELECT count(*) FROM {part}") == 1
    with clinic.database.direct.begin() as connection:
        connection.execute(text(f"DELETE FROM {part}"))


def test_past_moves_to_another_disk_while_the_months_stay(clinic: Clinic) -> None:
    with TemporaryDirectory(prefix="kata-disk-") as folder:
        shutil.chown(folder, "postgres")
        autocommit = clinic.database.direct.execution_options(isolation_level="AUTOCOMMIT")
        with autocommit.connect() as connection:
            connection.execute(text(f"CREATE TABLESPACE slow LOCATION '{folder}'"))
            connection.execute(text("ALTER TABLE run_sample_blocks_past SET TABLESPACE slow"))
        assert clinic.read()[0][clinic.first] == clinic.series
        with autocommit.connect() as connection:
            connection.execute(text("ALTER TABLE run_sample_blocks_past SET TABLESPACE pg_default"))
            connection.execute(text("DROP TABLESPACE slow"))


def test_backup_of_the_partitioned_database_can_be_restored(clinic: Clinic, tmp_path: Path) -> None:
    with closing(Database(clinic.url)) as direct:
        _, expected = copy(direct, tmp_path / "copy")
        assert expected["run_sample_blocks"].rows == RUNS * len(clinic.series.blocks)
        with scratch(direct, tmp_path / "copy") as restored, restored.reader.connect() as connection:
            assert differences(expected, checksums(connection)) == []


def test_service_starts_on_the_partitioned_database(clinic: Clinic) -> None:
    """The schema's revision is unchanged, so the start upgrades nothing."""
    revision = clinic.ask("SELECT version_num FROM alembic_version")
    upgrade(clinic.database)
    assert clinic.ask("SELECT version_num FROM alembic_version") == revision
