"""Backups as the administrator has them: made each night by a process of their own, listed with their last restore test.

That process only reads the database (:mod:`kata.backups.making`); what became of it is taken in here.
"""

import asyncio
import logging
import os
import sys
import threading
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import ExitStack, asynccontextmanager
from datetime import datetime, time, timedelta
from pathlib import Path
from typing import Annotated, Final, Literal, Protocol
from uuid import UUID, uuid4
from zoneinfo import ZoneInfo

from fastapi import APIRouter, Depends, Request
from pydantic import Field
from sqlalchemy import func, select

from kata.backups import texts
from kata.backups.book import DEFAULT_PAGE, Kind, Note, last_good, last_made, leave_note, newest, take_notes_in
from kata.backups.key import whereabouts
from kata.backups.tables import BackupRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.dependencies import PROBLEMS
from kata.errors import ProblemError
from kata.pagination import After, Limit, Page
from kata.settings import Settings
from kata.types import Moment, Schema

log = logging.getLogger(__name__)

_FIRST_LOOK_S: Final = 300.0
"""Whoever has just switched the computer on wants to work with it."""
_LOOK_S: Final = 60.0
_AGAIN: Final = timedelta(hours=1)
"""After one that failed."""
_NIGHTLY: Final = 0x6B_61_74_61_62_6B_75_70
"""The advisory lock that a service holds while it makes the night's backup: any number that nobody else takes."""

router = APIRouter(prefix="/api/backups", tags=["backups"])


class Backup(Schema):
    """A backup that was made, or tried to be."""

    id: UUID
    at: Moment
    kind: Kind = Field(description="nightly: by itself; asked: by somebody.")
    file: str
    bytes: int = Field(ge=0, description="0 where there is none.")
    problem: str = Field(description="Why there is none; empty when it was made.")
    tested_at: Moment | None = Field(description="When it was restored to see whether it can be.")
    test_problem: str = Field(
        description="Why it is not known to be restorable; empty where it came back whole and equal."
    )
    audit_rows: int | None = Field(
        ge=0, description="Rows of the audit trail that were verified when it was tried; null: none were."
    )
    audit_problem: str = Field(
        description="Where the audit trail in it is not whole; empty where it is. It can be restored all the same."
    )
    there: bool = Field(description="The file is on this computer; another service may have made it on its own.")


class BackupList(Page[Backup]):
    """Backups, newest first, and how they are made."""

    last_good: Backup | None = Field(description="The newest that came back whole and equal when it was tried.")
    running: bool = Field(description="One is being made just now.")
    next_at: Moment | None = Field(description="When the next one is made by itself; null: never.")
    folder: str = Field(examples=["/var/lib/kata/backups"])
    same_disk: bool = Field(description="The folder is on the database's own disk, and is lost with it.")
    key: Literal["here", "elsewhere", "nowhere"] = Field(
        description="Where the key that opens them is: on this computer, taken away from it, or not made yet."
    )
    key_file: str = Field(examples=["/var/lib/kata/backup-key.txt"])


class Backups:
    """Makes them when it is time, and when somebody asks. One at a time."""

    def __init__(self, settings: Settings, database: Database, occupied: Callable[[], bool]) -> None:
        """``occupied``: the arm is under torque; a nightly backup waits for that to be over."""
        self._settings = settings
        self._database = database
        self._occupied = occupied
        self._running: asyncio.Task[None] | None = None
        self._tried_at: datetime | None = None
        self._taking_in = threading.Lock()
        """The page asks for the list while one comes to its end: no note is taken in twice."""

    @asynccontextmanager
    async def each_night(self, first_look_s: float = _FIRST_LOOK_S, look_s: float = _LOOK_S) -> AsyncIterator[None]:
        """While the context lasts."""
        watching = asyncio.create_task(self._watch(first_look_s, look_s), name="backups")
        try:
            yield
        finally:
            tasks = [task for task in (watching, self._running) if task]
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    def begin(self, kind: Kind) -> None:
        """Have one made.

        :raises ProblemError: when one is being made.
        """
        if self._running and not self._running.done():
            raise ProblemError(
                409,
                "backup_running",
                texts.BACKUP_RUNNING(),
                texts.WAIT_FOR_BACKUP(),
            )
        self._tried_at = utc_now()
        self._running = asyncio.create_task(self._make(kind), name="backup")
        self._running.add_done_callback(_say_why)

    async def state(self, limit: int = DEFAULT_PAGE, after: str | None = None) -> BackupList:
        """What there is, and what comes next."""
        rows, further, good = await asyncio.to_thread(self._rows, limit, after)
        settings = self._settings
        return BackupList(
            items=rows,
            next=further,
            last_good=good,
            running=bool(self._running and not self._running.done()),
            next_at=next_at(utc_now(), settings.backup_time, _zone(settings)),
            folder=str(settings.backup_folder),
            same_disk=same_disk(settings),
            key=whereabouts(settings),
            key_file=str(settings.backup_key_file),
        )

    async def _watch(self, first_look_s: float, look_s: float) -> None:
        wait_s = first_look_s
        while True:
            await asyncio.sleep(wait_s)
            wait_s = look_s
            try:
                await asyncio.to_thread(self._take_notes_in)
                if await asyncio.to_thread(self._due) and not self._occupied():
                    self.begin("nightly")
            except ProblemError:
                # One that somebody asked for; it is looked at again when that is done.
                continue
            except Exception:
                # Whatever a look comes to, the next one may go well.
                log.exception("whether it is time for a backup could not be told")

    def _due(self) -> bool:
        tried_at = self._tried_at
        return (tried_at is None or tried_at <= utc_now() - _AGAIN) and self._wanted()

    def _wanted(self) -> bool:
        """As far as the database tells, whoever on it has made or tried one."""
        with self._database.read() as session:
            made = last_made(session)
            tried = [row.at for row in newest(session, 1)[0]]
        made_at = made.at if made else None
        return due(utc_now(), self._settings.backup_time, _zone(self._settings), made_at, max(tried, default=None))

    async def _make(self, kind: Kind) -> None:
        if kind == "asked":
            await self._made(kind)
            return
        lock = await asyncio.to_thread(night_lock, self._database)
        if lock is None:
            return
        try:
            # Another service may have made it between our look and the lock.
            if await asyncio.to_thread(self._wanted):
                await self._made(kind)
        finally:
            await asyncio.to_thread(lock.close)

    async def _made(self, kind: Kind) -> None:
        before = await asyncio.to_thread(self._count)
        command = [sys.executable, "-m", "kata.backups", *(["--nightly"] if kind == "nightly" else [])]
        process = await asyncio.create_subprocess_exec(
            *command,
            env=_environment(self._settings),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
        )
        try:
            _, told = await process.communicate()
        except asyncio.CancelledError:
            process.terminate()
            await process.wait()
            raise
        if process.returncode:
            log.error("the backup: %s", told.decode(errors="replace").strip())
        await asyncio.to_thread(self._take_in, kind, process.returncode or 0, before)

    def _take_in(self, kind: Kind, code: int, before: int) -> None:
        """``before``: how many were known when it began; one at a time is made, so what has come since is of this one."""
        self._take_notes_in()
        if code and self._count() == before:
            # It came to so little that it could not even say so.
            leave_note(
                self._settings,
                Note(
                    id=uuid4(),
                    at=utc_now(),
                    kind=kind,
                    file="",
                    problem=f"It ended with status {code}; the log says more.",
                ),
            )
            self._take_notes_in()

    def _take_notes_in(self) -> None:
        with self._taking_in:
            take_notes_in(self._settings, self._database)

    def _count(self) -> int:
        with self._database.read() as session:
            return session.scalars(select(func.count()).select_from(BackupRow)).one()

    def _rows(self, limit: int, after: str | None) -> tuple[list[Backup], str | None, Backup | None]:
        self._take_notes_in()
        with self._database.read() as session:
            good = last_good(session)
            rows, further = newest(session, limit, after)
            return [_shown(row) for row in rows], further, _shown(good) if good else None


def _say_why(made: asyncio.Task[None]) -> None:
    if not made.cancelled() and (error := made.exception()):
        log.error("a backup came to nothing", exc_info=error)


def night_lock(database: Database) -> ExitStack | None:
    """To be closed when the night's backup is made; None where another service on this database makes it.

    PostgreSQL takes the lock back by itself when a service is killed. On SQLite there is one service, which needs none.
    """
    with ExitStack() as stack:
        if not database.file:
            connection = stack.enter_context(database.writer.connect())
            # It goes with its connection, which is not one of the pool's any more.
            connection.detach()
            if not connection.execute(select(func.pg_try_advisory_lock(_NIGHTLY))).scalar_one():
                return None
            connection.commit()
        return stack.pop_all()
    return None


def due(now: datetime, at: str, zone: ZoneInfo | None, made_at: datetime | None, tried_at: datetime | None) -> bool:
    """Whether a backup is to be made: no sound one is newer than the last time of day ``at``, and the last try
    was not just now. ``zone``: of the clinic; None: this computer's.
    """
    if at == "never" or (tried_at is not None and tried_at > now - _AGAIN):
        return False
    return made_at is None or made_at < _moments(now, at, zone)[0]


def next_at(now: datetime, at: str, zone: ZoneInfo | None) -> datetime | None:
    """When the time of day ``at`` comes next; None: never."""
    return None if at == "never" else _moments(now, at, zone)[1]


def same_disk(settings: Settings) -> bool:
    """Whether backups are lost with the disk that the data is on."""
    there = next(path for path in (settings.backup_folder, *settings.backup_folder.parents) if path.exists())
    return settings.data.exists() and there.stat().st_dev == settings.data.stat().st_dev


def _moments(now: datetime, at: str, zone: ZoneInfo | None) -> tuple[datetime, datetime]:
    """The last time it was ``at`` on the clinic's clock, and the next."""
    local = now.astimezone(zone)
    days = [local.date() + timedelta(days=days) for days in (-1, 0, 1)]
    moments = [datetime.combine(day, time.fromisoformat(at), tzinfo=zone).astimezone(now.tzinfo) for day in days]
    return max(one for one in moments if one <= now), min(one for one in moments if one > now)


def _zone(settings: Settings) -> ZoneInfo | None:
    return ZoneInfo(settings.clinic_time_zone) if settings.clinic_time_zone else None


def _environment(settings: Settings) -> Mapping[str, str]:
    """A password in the database's address is not for everybody who lists processes."""
    given = {
        "data": settings.data,
        "database_url": settings.database_url,
        "backup_dir": settings.backup_folder,
        "backup_key": settings.backup_key_file,
        "backup_recipients": settings.backup_recipients,
        "audit_anchor": settings.effective_audit_anchor,
    }
    return os.environ | {f"KATA_{name.upper()}": str(value) for name, value in given.items()}


def _shown(row: BackupRow) -> Backup:
    told = {name: getattr(row, name) for name in Backup.model_fields if name != "there"}
    return Backup(**told, there=bool(row.file) and Path(row.file).exists())


class BackupServices(Protocol):
    """The service that this module uses. ``kata.api.services.Services`` provides it."""

    @property
    def backups(self) -> Backups:
        """Return the backups."""


def _backups(request: Request) -> Backups:
    services: BackupServices = request.app.state.services
    return services.backups


TheBackups = Annotated[Backups, Depends(_backups)]


@router.get("", summary="List backups", responses=PROBLEMS.of(422))
async def list_backups(backups: TheBackups, limit: Limit = DEFAULT_PAGE, after: After = None) -> BackupList:
    """Return backups with their last restore test, newest first, and the time of the next backup."""
    return await backups.state(limit, after)


@router.post("", status_code=202, responses=PROBLEMS.of(409), summary="Start a backup")
async def make_backup(backups: TheBackups) -> BackupList:
    """Start a backup. It appears in the list after its restore test."""
    backups.begin("asked")
    return await backups.state()
