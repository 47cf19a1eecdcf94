"""``kata update`` on a simulated station: finished, refused, undone, and killed at its steps."""

import itertools
import logging
import random
import subprocess
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final, Literal

import pytest

from tests.support.update_clinic import FIRST, UpdateClinic

pytestmark = pytest.mark.timeout(900)
log = logging.getLogger(__name__)

KILLS: Final = 50
PARTS: Final = 5
"""The kills are spread over so many tests, each with every fifth of the points."""
_BEYOND_THE_LAST: Final = 10_000


@contextmanager
def installed(folder: Path) -> Iterator[UpdateClinic]:
    """Yield an installation of version 1.0.0 whose service is ready and has a patient."""
    with closing(UpdateClinic(folder)) as made:
        made.seed()
        made.systemctl("start")
        made.is_ready()
        yield made


@pytest.fixture
def clinic(tmp_path: Path) -> Iterator[UpdateClinic]:
    """Return an installation for one test."""
    with installed(tmp_path) as made:
        yield made


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[UpdateClinic]:
    """Return an installation for several tests. Each leaves version 1.0.0 in use and no session open."""
    with installed(tmp_path_factory.mktemp("shared")) as made:
        yield made


def versions(clinic: UpdateClinic) -> set[str]:
    return {folder.name for folder in (clinic.root / "versions").iterdir()}


def test_an_update_stops_nothing_while_a_session_is_open(shared: UpdateClinic) -> None:
    shared.open_session()
    done = shared.update("--from", str(shared.bundle("1.0.1")))
    assert done.returncode == 1
    assert "A session of this station is open" in done.stderr
    assert (shared.in_use, shared.is_ready()) == (FIRST, FIRST)
    assert versions(shared) == {FIRST}
    shared.end_session()


@pytest.mark.campaign
def test_stations_of_one_computer_migrate_and_start_together(tmp_path: Path) -> None:
    with closing(UpdateClinic(tmp_path, stations=2)) as clinic:
        for unit in clinic.units:
            clinic.seed(unit)
            clinic.systemctl("start", unit)
            clinic.is_ready(unit)
        patients = [clinic.patients(unit) for unit in clinic.units]
        done = clinic.update("--from", str(clinic.bundle("1.0.1")))
        assert done.returncode == 0, done.stderr
        started = [line for line in done.stdout.splitlines() if line.startswith("Starting")]
        assert started == [f"Starting {unit} with 1.0.1 ..." for unit in clinic.units]
        assert clinic.in_use == "1.0.1"
        assert {clinic.is_ready(unit) for unit in clinic.units} == {"1.0.1"}
        assert {clinic.schema(unit) for unit in clinic.units} == {"test0001"}
        assert [clinic.patients(unit) for unit in clinic.units] == patients
        assert all(list((clinic.data(unit) / "backups").iterdir()) for unit in clinic.units)
        assert versions(clinic) == {FIRST, "1.0.1"}
        program = clinic.root / "versions/1.0.1/bin/kata"
        assert program.stat().st_mode & 0o777 == 0o755, "the service's user runs what root has installed"
        again = clinic.update("--from", str(clinic.bundle("1.0.1")))
        assert again.returncode == 1
        assert "Only a newer version" in again.stderr


def killed_and_resumed(
    clinic: UpdateClinic, version: str, kind: Literal["good", "broken"], number: int, delay_s: float = 0.0
) -> tuple[int, subprocess.CompletedProcess[str]]:
    """Kill an update, check that the clinic is whole, resume, and check again. Return the number of changes before the kill, and the
    resumed command.
    """
    before, patients = clinic.in_use, clinic.patients()
    changes = clinic.update_killed(number, delay_s, "--from", str(clinic.bundle(version, kind)))
    assert clinic.in_use in (before, version)
    assert clinic.patients() == patients
    if not (kind == "broken" and clinic.in_use == version):
        # The computer starts again.
        clinic.systemctl("start")
        assert clinic.is_ready() == clinic.in_use
    done = clinic.kata(before, "update", "--resume", "--unit", "kata", check=False)
    assert not (clinic.root / "update" / "state.json").exists(), done.stderr
    if kind == "broken":
        assert clinic.in_use == before
    else:
        assert done.returncode == 0 or "was undone" in done.stderr, done.stderr
    assert clinic.is_ready() == clinic.in_use
    assert clinic.patients() == patients
    return changes, done


def test_a_killed_update_that_does_not_start_is_undone(shared: UpdateClinic) -> None:
    """Resumed, the update starts the new version again, which fails as in an update that is not killed."""
    schema = shared.schema()
    changes, resumed = killed_and_resumed(shared, "1.0.1", "broken", 26)
    assert changes >= 26, "the update ended before the kill"
    assert resumed.returncode == 1
    assert "was undone; 1.0.0 is in use" in resumed.stderr
    assert (shared.in_use, shared.is_ready(), shared.schema()) == (FIRST, FIRST, schema)
    assert versions(shared) == {FIRST}
    assert "INTACT" not in shared.kata(FIRST, "audit", "verify", "--data", str(shared.data())).stderr


@pytest.mark.campaign
@pytest.mark.parametrize(("number", "delay_s"), [(4, 0.5), (14, 0.0)])
def test_a_killed_update_leaves_a_whole_clinic(clinic: UpdateClinic, number: int, delay_s: float) -> None:
    changes, _ = killed_and_resumed(clinic, "1.0.1", "good", number, delay_s)
    assert changes >= number, "the update ended before the kill"


@pytest.mark.campaign
def test_a_version_that_does_not_start_is_undone(clinic: UpdateClinic) -> None:
    """Without a kill."""
    patients, schema = clinic.patients(), clinic.schema()
    done = clinic.update("--from", str(clinic.bundle("1.0.1", "broken")))
    assert done.returncode == 1
    assert "was undone; 1.0.0 is in use" in done.stderr
    assert (clinic.in_use, clinic.is_ready(), clinic.schema()) == (FIRST, FIRST, schema)
    assert clinic.patients() == patients
    assert versions(clinic) == {FIRST}


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("part", range(PARTS))
def test_fifty_kills_leave_a_whole_clinic(clinic: UpdateClinic, part: int) -> None:
    chance, version = random.Random(part), itertools.count(1)
    kinds: tuple[Literal["good", "broken"], ...] = ("good", "broken")
    changes = {
        kind: clinic.update_killed(_BEYOND_THE_LAST, 0.0, "--from", str(clinic.bundle(f"1.0.{next(version)}", kind)))
        for kind in kinds
    }
    log.info("changes without a kill: %s", changes)
    for n in range(part, KILLS, PARTS):
        kind = kinds[n % 2]
        number = 1 + n * changes[kind] // KILLS
        delay_s = chance.choice([0.0, chance.uniform(0.0, 3.0)])
        killed_and_resumed(clinic, f"1.0.{next(version)}", kind, number, delay_s)
        log.info("%d: %s, killed at change %d + %.2f s; in use: %s", n, kind, number, delay_s, clinic.in_use)
