"""Routes of backups, and the task that makes them. A separate process makes a backup every day. The list shows each backup with its last restore test.

That process only reads the database (:mod:`kata.backups.create`). The service imports the process's record.
"""

import asyncio
import logging
import os
import sys
import threading
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from datetime import datetime, tzinfo
from pathlib import Path
from typing import Annotated, Final, Literal, Protocol
from uuid import UUID, uuid4

from fastapi import APIRouter, Depends, Request
from pydantic import Field
from sqlalchemy import func, select

from kata.backups import texts
from kata.backups.catalogue import (
    DEFAULT_PAGE,
    BackupRecord,
    Kind,
    import_records,
    last_good,
    last_made,
    newest,
    write_record,
)
from kata.backups.key import key_location
from kata.backups.schedule import RETRY_AFTER, daily_backup_lock, is_due, next_at
from kata.backups.tables import BackupRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.dependencies import PROBLEMS
from kata.errors import ProblemError
from kata.pagination import After, Limit, Page
from kata.settings import Settings
from kata.types import Moment, Schema

log = logging.getLogger(__name__)

_FIRST_CHECK_S: Final = 300.0
"""Seconds after the start without a backup, because users want to work then."""
_CHECK_PERIOD_S: Final = 60.0
router = APIRouter(prefix="/api/backups", tags=["backups"])


class Backup(Schema):
    """A backup, or a failed attempt to make one."""

    id: UUID
    at: Moment
    kind: Kind = Field(description="nightly: automatic; asked: requested by a user.")
    file: str
    bytes: int = Field(ge=0, description="0 if the backup failed.")
    problem: str = Field(description="Why the backup failed; empty if it was made.")
    tested_at: Moment | None = Field(description="Time of the last restore test.")
    test_problem: str = Field(
        description="Why the backup may not be restorable; empty if the restored copy was complete and equal."
    )
    failure: str = Field(description="Why the backup was not made, or why its restore test failed; empty otherwise.")
    audit_rows: int | None = Field(
        ge=0, description="Rows of the audit trail that the restore test verified; null: it verified none."
    )
    audit_problem: str = Field(
        description="Where the backup's audit trail is damaged; empty if it is intact. The backup can be restored in either case."
    )
    there: bool = Field(
        description="True if the file is on this computer; another service may store its backups elsewhere."
    )


class BackupList(Page[Backup]):
    """Backups, newest first, and how they are made."""

    last_good: Backup | None = Field(description="The newest backup whose restore test succeeded.")
    running: bool = Field(description="True while a backup is being made.")
    next_at: Moment | None = Field(description="Time of the next automatic backup; null: never.")
    folder: str = Field(examples=["/var/lib/kata/backups"])
    same_disk: bool = Field(
        description="True if the folder is on the database's disk, so that a failure of this disk loses both."
    )
    key: Literal["here", "elsewhere", "nowhere"] = Field(
        description="Location of the secret key: on this computer, removed from it, or not created yet."
    )
    key_file: str = Field(examples=["/var/lib/kata/backup-key.txt"])


class Backups:
    """Makes backups every day and on request, one at a time."""

    def __init__(
        self,
        settings: Settings,
        database: Database,
        occupied: Callable[[], bool],
        time_zone: Callable[[], tzinfo],
    ) -> None:
        """Prepare the backups.

        :param occupied: returns True while motors have torque. A daily backup waits until it returns False.
        :param time_zone: returns the clinic's time zone.
        """
        self._time_zone = time_zone
        self._settings = settings
        self._database = database
        self._occupied = occupied
        self._running: asyncio.Task[None] | None = None
        self._begun_at: datetime | None = None
        self._importing = threading.Lock()
        """Prevents a request for the list and the end of a backup from importing the same record twice."""

    @asynccontextmanager
    async def running_schedule(
        self, first_check_s: float = _FIRST_CHECK_S, check_period_s: float = _CHECK_PERIOD_S
    ) -> AsyncIterator[None]:
        """Make daily backups while the context lasts."""
        watching = asyncio.create_task(self._run_schedule(first_check_s, check_period_s), name="backups")
        try:
            yield
        finally:
            tasks = [task for task in (watching, self._running) if task]
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    def begin(self, kind: Kind) -> None:
        """Begin a backup.

        :raises ProblemError: 409 while a backup is being made.
        """
        if self._running and not self._running.done():
            raise ProblemError(
                409,
                "backup_running",
                texts.BACKUP_RUNNING(),
                texts.WAIT_FOR_BACKUP(),
            )
        self._begun_at = utc_now()
        self._running = asyncio.create_task(self._make_backup(kind), name="backup")
        self._running.add_done_callback(_log_error)

    async def state(self, limit: int = DEFAULT_PAGE, after: str | None = None) -> BackupList:
        """Return a page of backups and the time of the next backup."""
        rows, further, good = await asyncio.to_thread(self._read_page, limit, after)
        zone = await asyncio.to_thread(self._time_zone)
        settings = self._settings
        return BackupList(
            items=rows,
            next=further,
            last_good=good,
            running=bool(self._running and not self._running.done()),
            next_at=next_at(utc_now(), settings.backup_time, zone),
            folder=str(settings.backup_folder),
            same_disk=same_disk(settings),
            key=key_location(settings),
            key_file=str(settings.backup_key_file),
        )

    async def _run_schedule(self, first_check_s: float, check_period_s: float) -> None:
        wait_s = first_check_s
        while True:
            await asyncio.sleep(wait_s)
            wait_s = check_period_s
            try:
                await asyncio.to_thread(self._import_records)
                if await asyncio.to_thread(self._is_due) and not self._occupied():
                    self.begin("nightly")
            except ProblemError:
                # A backup that a user requested is running. The next check comes after it.
                continue
            except Exception:
                # The next check may succeed.
                log.exception("the schedule of backups could not be checked")

    def _is_due(self) -> bool:
        begun_at = self._begun_at
        return (begun_at is None or begun_at <= utc_now() - RETRY_AFTER) and self._is_due_by_catalogue()

    def _is_due_by_catalogue(self) -> bool:
        """Return whether a backup is due, counting backups of all services on this database."""
        with self._database.read() as session:
            newest_backup = last_made(session)
            attempts = [row.at for row in newest(session, 1)[0]]
        made_at = newest_backup.at if newest_backup else None
        return is_due(utc_now(), self._settings.backup_time, self._time_zone(), made_at, max(attempts, default=None))

    async def _make_backup(self, kind: Kind) -> None:
        if kind == "asked":
            await self._run_process(kind)
            return
        lock = await asyncio.to_thread(daily_backup_lock, self._database)
        if lock is None:
            return
        try:
            # Another service may have made the backup before this service got the lock.
            if await asyncio.to_thread(self._is_due_by_catalogue):
                await self._run_process(kind)
        finally:
            await asyncio.to_thread(lock.close)

    async def _run_process(self, kind: Kind) -> None:
        before = await asyncio.to_thread(self._count_backups)
        command = [sys.executable, "-m", "kata.backups", *(["--nightly"] if kind == "nightly" else [])]
        process = await asyncio.create_subprocess_exec(
            *command,
            env=_environment(self._settings),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
        )
        try:
            _, stderr = await process.communicate()
        except asyncio.CancelledError:
            process.terminate()
            await process.wait()
            raise
        if process.returncode:
            log.error("the backup failed: %s", stderr.decode(errors="replace").strip())
        await asyncio.to_thread(self._import_result, kind, process.returncode or 0, before)

    def _import_result(self, kind: Kind, status: int, before: int) -> None:
        """Import the record of a finished process. Write a record if the process wrote none. ``before``: number of known backups when
        the process began.
        """
        self._import_records()
        if status and self._count_backups() == before:
            write_record(
                self._settings,
                BackupRecord(
                    id=uuid4(),
                    at=utc_now(),
                    kind=kind,
                    file="",
                    problem=f"The backup process ended with status {status}; see the log.",
                ),
            )
            self._import_records()

    def _import_records(self) -> None:
        with self._importing:
            import_records(self._settings, self._database)

    def _count_backups(self) -> int:
        with self._database.read() as session:
            return session.scalars(select(func.count()).select_from(BackupRow)).one()

    def _read_page(self, limit: int, after: str | None) -> tuple[list[Backup], str | None, Backup | None]:
        self._import_records()
        with self._database.read() as session:
            good = last_good(session)
            rows, further = newest(session, limit, after)
            return [_to_backup(row) for row in rows], further, _to_backup(good) if good else None


def _log_error(task: asyncio.Task[None]) -> None:
    if not task.cancelled() and (error := task.exception()):
        log.error("a backup failed", exc_info=error)


def same_disk(settings: Settings) -> bool:
    """Return whether the backup folder is on the disk of the data folder."""
    existing = next(path for path in (settings.backup_folder, *settings.backup_folder.parents) if path.exists())
    return settings.data.exists() and existing.stat().st_dev == settings.data.stat().st_dev


def _environment(settings: Settings) -> Mapping[str, str]:
    """Return the settings as environment variables, because process lists would show arguments and so a password in the database URL."""
    values = {
        "data": settings.data,
        "database_url": settings.database_url,
        "backup_dir": settings.backup_folder,
        "backup_key": settings.backup_key_file,
        "backup_recipients": settings.backup_recipients,
        "audit_anchor": settings.effective_audit_anchor,
    }
    return os.environ | {f"KATA_{name.upper()}": str(value) for name, value in values.items()}


def _to_backup(row: BackupRow) -> Backup:
    fields = {name: getattr(row, name) for name in Backup.model_fields if name != "there"}
    return Backup(**fields, there=bool(row.file) and Path(row.file).exists())


class BackupServices(Protocol):
    """The service that this module uses. ``kata.api.services.Services`` provides it."""

    @property
    def backups(self) -> Backups:
        """Return the backups."""


def _service_backups(request: Request) -> Backups:
    services: BackupServices = request.app.state.services
    return services.backups


TheBackups = Annotated[Backups, Depends(_service_backups)]


@router.get("", summary="List backups", responses=PROBLEMS.of(422))
async def list_backups(backups: TheBackups, limit: Limit = DEFAULT_PAGE, after: After = None) -> BackupList:
    """Return backups with their last restore test, newest first, and the time of the next backup."""
    return await backups.state(limit, after)


@router.post("", status_code=202, responses=PROBLEMS.of(409), summary="Start a backup")
async def make_backup(backups: TheBackups) -> BackupList:
    """Start a backup. The list contains it after its restore test."""
    backups.begin("asked")
    return await backups.state()
