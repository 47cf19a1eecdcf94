"""Import each journal into the database exactly once.

Ids are generated where an event occurs. If a journal is found again that was imported before a crash, the import changes nothing. A file
leaves the folder only after its rows are committed.
"""

import logging
import threading
from collections.abc import Callable
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final, Literal
from uuid import UUID

from sqlalchemy.exc import OperationalError
from sqlalchemy.exc import TimeoutError as NoConnectionError
from sqlalchemy.orm import Session

from kata.actor import by_program
from kata.clinic.recordings import service as recordings
from kata.clinic.sessions import runs
from kata.clinic.sessions.run_results import PlaybackResults, calculate
from kata.database.availability import DatabaseUnavailableError
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.device import journal
from kata.device.config import StationConfig
from kata.plotting.figures import FigureWorker

log = logging.getLogger(__name__)

_IMPORTED: Final = "imported"
_UNREADABLE: Final = "unreadable"
_JOURNAL_LOCK_LIMIT_S: Final = 10.0
"""Wait for the previous device process. If its service is killed, it ramps down, writes its journal and ends in much less time."""


@dataclass(frozen=True)
class Saved:
    """A record that was imported from a journal."""

    what: Literal["recording", "run"]
    id: UUID
    patient_id: UUID
    session_id: UUID | None


class _NotYetError(Exception):
    """The database does not have the journal's run or teaching yet."""


class Importer:
    """Imports finished journals from a folder."""

    def __init__(
        self,
        database: Database,
        folder: Path,
        config: StationConfig,
        on_saved: Callable[[Saved], None],
        has_undelivered: Callable[[], bool] = lambda: False,
        on_waiting: Callable[[journal.Journal], None] = lambda recorded: None,
    ) -> None:
        """``on_saved`` is called from the importing thread after the commit.

        ``has_undelivered`` returns True if the spool contains events that the database does not have yet; the journal's run or teaching may
        be among them. ``on_waiting`` is called with a journal that waits for the database, at every attempt.
        """
        self._database = database
        self._folder = folder
        self._config = config
        self._on_saved = on_saved
        self._has_undelivered = has_undelivered
        self._on_waiting = on_waiting
        self.worker: FigureWorker | None = None
        """Calculates the results of playbacks. Without a worker, this process calculates them and imports scipy."""
        self._one_at_a_time = threading.Lock()
        self._due: dict[Path, None] = {}
        self._ended_at: datetime | None = None

    def use(self, config: StationConfig) -> None:
        """Use another configuration of the station from now on."""
        self._config = config

    def run(self, finished: Path | None = None) -> None:
        """Import one finished journal. Without an argument, import all journals; no device process may then be writing one.

        This blocks on the disk, so call it from a worker thread.
        """
        with by_program("import_journal", self._config.name), self._one_at_a_time:
            for path in [finished] if finished else sorted(self._folder.glob(f"*{journal.SUFFIX}")):
                try:
                    self._import(path)
                    self._due.pop(path, None)
                except (OperationalError, NoConnectionError, DatabaseUnavailableError, _NotYetError) as error:
                    log.warning("%s waits for the database: %s", path.name, error)
                    self._due[path] = None
                except BrokenProcessPool as error:
                    log.warning("%s waits for the figure worker: %s", path.name, error)
                    self._due[path] = None
                except Exception:
                    # A journal that cannot be imported must not block the others. It stays in the folder for the next attempt.
                    self._due.pop(path, None)
                    log.exception("%s could not be imported; the file was not changed", path.name)

    @property
    def waiting(self) -> int:
        """Return the number of journals that wait for the database."""
        return len(self._due)

    def run_due(self) -> None:
        """Import the waiting journals again, in the order in which the importer met them."""
        for path in list(self._due):
            self.run(path)
        self._close_lost()

    def run_ended(self, at: datetime) -> None:
        """Import the journals of a device process that has ended. The next process may already be running.

        A run that was loaded but left no journal is also ended, so that its session can be ended.
        """
        self.run()
        self._ended_at = at
        self._close_lost()

    def run_at_start(self) -> None:
        """Import all journals after the previous device process has ended, and close runs whose journal is lost.

        :raises FolderInUseError: when a device process runs; another service must then have started it.
        """
        with journal.claimed(self._folder, _JOURNAL_LOCK_LIMIT_S):
            self.run()
            self._give_up_unended(utc_now())

    def _close_lost(self) -> None:
        before = self._ended_at
        if before is None or self._due or self._has_undelivered():
            return
        try:
            self._give_up_unended(before)
        except (OperationalError, NoConnectionError, DatabaseUnavailableError) as error:
            log.warning("The runs of the ended device process wait for the database: %s", error)
        else:
            self._ended_at = None

    def _give_up_unended(self, before: datetime) -> None:
        with by_program("give_up_unended", self._config.name), self._database.write() as session:
            count = runs.mark_unended_interrupted(session, self._config.name, before)
        if count:
            log.warning("%d runs lost their journal when their device process ended", count)

    def _import(self, path: Path) -> None:
        try:
            recorded = journal.read(path)
            identity = UUID(recorded.id)
        except ValueError as error:
            log.error("%s; it is stored in %s", error, _UNREADABLE)
            self._mark_interrupted(path)
            _move(path, _UNREADABLE)
            return
        if recorded.truncated:
            log.warning("%s ends with a damaged record; the earlier records are imported", path.name)
        # Read this before the import, because an event that is spooled during the import has not been looked for.
        has_undelivered = self._has_undelivered()
        if self._database.unavailable_since:
            self._on_waiting(recorded)
        results = self._results(recorded)
        with self._database.write() as session:
            saved = self._store(session, recorded, identity, results)
        if saved is None and has_undelivered:
            raise _NotYetError(f"what {path.name} belongs to is not in the database yet")
        if saved is None:
            log.error(
                "%s does not belong to a playback or teaching of this database; it is stored in %s",
                path.name,
                _UNREADABLE,
            )
            _move(path, _UNREADABLE)
            return
        _move(path, _IMPORTED)
        for record in saved:
            self._on_saved(record)

    def _mark_interrupted(self, path: Path) -> None:
        """Close a run whose journal is unreadable, by the id in the file's name. Its session can then be ended."""
        kind, _, name = path.stem.partition("-")
        with suppress(ValueError):
            run_id = UUID(name)
            if kind == "run":
                with self._database.write() as session:
                    runs.mark_interrupted(session, run_id)

    def _results(self, recorded: journal.Journal) -> PlaybackResults | None:
        """Return the results of a playback, calculated without a session, so that no other writer waits. None: there are none."""
        if self.worker is None or recorded.kind != "run":
            return None
        with self._database.read() as session:
            playback = runs.ended_playback(session, recorded, self._config)
        return self.worker.build(calculate, playback) if playback else None

    def _store(
        self, session: Session, recorded: journal.Journal, identity: UUID, results: PlaybackResults | None
    ) -> list[Saved] | None:
        if recorded.kind == "teaching":
            rows = recordings.store_teaching(session, recorded)
            return None if rows is None else [Saved("recording", row.id, row.patient_id, None) for row in rows]
        run = runs.complete(session, recorded, self._config, results)
        if run is None:
            return None
        return [Saved("run", identity, run.recording.patient_id, run.session_id)]


def _move(path: Path, folder: str) -> None:
    target = path.parent / folder
    target.mkdir(exist_ok=True)
    path.replace(target / path.name)
