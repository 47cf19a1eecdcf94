"""Backups through the service: requested, made by a separate process, listed with their restore test; and when one is due."""

import asyncio
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

import pytest
from fastapi.testclient import TestClient

from kata.auth.login_session import COOKIE
from kata.backups.router import Backups
from kata.backups.schedule import daily_backup_lock, is_due, next_at
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from kata.errors import ProblemError
from kata.settings import Settings
from tests.support.databases import upgraded_file
from tests.support.login import signed_in

pytestmark = pytest.mark.no_apparatus

TOKYO = ZoneInfo("Asia/Tokyo")
LIMIT_S = 150.0


def until(condition: Callable[[], Any]) -> None:
    limit = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < limit
        time.sleep(0.1)


def test_administrator_makes_a_backup_and_sees_that_it_restores(client: TestClient) -> None:
    before = client.get("/api/backups").json()
    assert (before["items"], before["last_good"], before["running"], before["key"]) == ([], None, False, "here")
    assert before["next_at"] is not None
    assert before["same_disk"] is True
    begun = client.post("/api/backups")
    assert begun.status_code == 202
    assert begun.json()["running"] is True
    again = client.post("/api/backups")
    assert (again.status_code, again.json()["code"]) == (409, "backup_running")
    until(lambda: not client.get("/api/backups").json()["running"])
    after = client.get("/api/backups").json()
    (made,) = after["items"]
    assert (made["kind"], made["problem"], made["test_problem"], made["there"]) == ("asked", "", "", True)
    assert made["tested_at"] is not None
    assert after["last_good"] == made
    assert Path(made["file"]).stat().st_size == made["bytes"] > 0
    Path(made["file"]).unlink()
    assert client.get("/api/backups").json()["items"][0]["there"] is False


@pytest.mark.parametrize("role", ["viewer", "therapist", "technician"])
def test_only_administrators_see_backups(client: TestClient, role: Any) -> None:
    mine = client.cookies.get(COOKIE)
    client.cookies.set(COOKIE, signed_in(client.app.state.services.database, role))  # type: ignore[attr-defined]
    try:
        assert client.get("/api/backups").status_code == 403
        assert client.post("/api/backups").status_code == 403
    finally:
        client.cookies.set(COOKIE, mine or "")


@pytest.fixture
def clinic(tmp_path: Path) -> tuple[Settings, Database]:
    database = Database(upgraded_file(tmp_path / "kata.db"))
    return Settings(data=tmp_path, database_url=""), database


@pytest.mark.campaign
def test_due_backup_is_made_once_the_arm_is_free(clinic: tuple[Settings, Database]) -> None:
    settings, database = clinic
    asked: list[bool] = []

    def occupied() -> bool:
        asked.append(len(asked) < 2)
        return asked[-1]

    async def night() -> None:
        backups = Backups(settings, database, occupied, lambda: UTC)
        async with backups.running_schedule(first_check_s=0.0, check_period_s=0.01), asyncio.timeout(LIMIT_S):
            while not (state := await backups.state()).items:  # noqa: ASYNC110
                await asyncio.sleep(0.05)
        (made,) = state.items
        assert (made.kind, made.problem, made.test_problem) == ("nightly", "", "")

    asyncio.run(night())
    # The arm was in use at two checks, free at the third; afterwards no backup is due.
    assert asked == [True, True, False]
    database.close()


@pytest.mark.campaign
def test_one_of_several_services_makes_the_nightly_backup(tmp_path: Path, services_url: str) -> None:
    """All services find the backup due at the same moment."""
    databases = [Database(services_url) for _ in range(3)]
    for n in range(3):
        (tmp_path / str(n)).mkdir()
    upgrade(databases[0])
    services = [
        Backups(Settings(data=tmp_path / str(n), database_url=services_url), database, lambda: False, lambda: UTC)
        for n, database in enumerate(databases)
    ]

    async def night() -> None:
        for service in services:
            service.begin("nightly")
        made = [service._running for service in services if service._running]
        assert len(made) == 3
        await asyncio.gather(*made)
        for service in services:
            (backup,) = (await service.state()).items
            assert (backup.kind, backup.problem, backup.test_problem) == ("nightly", "", "")

    asyncio.run(night())
    assert len(list(tmp_path.glob("*/backups/*"))) == 1
    # The lock is released: another service may make the next daily backup.
    lock = daily_backup_lock(databases[1])
    assert lock is not None
    assert daily_backup_lock(databases[2]) is None
    lock.close()
    for database in databases:
        database.close()


@pytest.mark.campaign
def test_a_service_that_ends_takes_its_backup_along(clinic: tuple[Settings, Database]) -> None:
    settings, database = clinic

    async def short() -> None:
        backups = Backups(settings, database, lambda: False, lambda: UTC)
        async with backups.running_schedule(), asyncio.timeout(LIMIT_S):
            backups.begin("asked")
            with pytest.raises(ProblemError):
                backups.begin("asked")
            while not list(settings.data.glob("backup-notes")):  # noqa: ASYNC110
                await asyncio.sleep(0.01)

    asyncio.run(short())
    assert list(settings.data.glob(".backup-*")) == []
    assert list(settings.data.glob("backups/*.part")) == []
    database.close()


def test_backup_is_due_after_its_hour_in_clinic_time() -> None:
    def at(hour: int, minute: int = 0, day: int = 22) -> datetime:
        return datetime(2026, 11, day, hour, minute, tzinfo=TOKYO).astimezone(UTC)

    last_night = at(2, 31, day=21)
    assert not is_due(at(2, 29), "02:30", TOKYO, last_night, last_night)
    assert is_due(at(2, 30), "02:30", TOKYO, last_night, last_night)
    assert is_due(at(9), "02:30", TOKYO, last_night, last_night), (
        "a computer that was off at night makes the backup later"
    )
    assert not is_due(at(9), "02:30", TOKYO, at(2, 31), at(2, 31))
    assert is_due(at(9), "02:30", TOKYO, None, None)
    assert not is_due(at(9), "never", TOKYO, None, None)
    # A failed backup is repeated after a pause.
    assert not is_due(at(9), "02:30", TOKYO, last_night, at(8, 30))
    assert is_due(at(9), "02:30", TOKYO, last_night, at(7, 59))


def test_next_backup_is_shown_in_clinic_time() -> None:
    now = datetime(2026, 11, 22, 3, tzinfo=UTC)
    assert next_at(now, "02:30", TOKYO) == datetime(2026, 11, 22, 17, 30, tzinfo=UTC)
    assert next_at(now, "13:00", TOKYO) == datetime(2026, 11, 22, 4, tzinfo=UTC)
    assert next_at(now, "never", TOKYO) is None
    # In this night the clock skips half past two. One backup is made.
    berlin = ZoneInfo("Europe/Berlin")
    spring = datetime(2026, 3, 29, 0, tzinfo=UTC)
    answer = next_at(spring, "02:30", berlin)
    assert answer is not None
    assert timedelta() < answer - spring < timedelta(hours=2)


@pytest.mark.parametrize("at", ["25:00", "at night", "2"])
def test_invalid_time_of_day_is_refused(at: str) -> None:
    with pytest.raises(ValueError, match="must be a time of day such as 02:30, or never"):
        Settings(backup_time=at)
