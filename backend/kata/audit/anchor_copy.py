"""The anchor's copy: a second file on another disk or computer (``KATA_AUDIT_ANCHOR_COPY``) that also gets every line of the anchor.

A user of this computer can cut database and anchor together. The copy reveals this, provided that the user cannot change the copy.
"""

import logging
import os
import threading
from collections import deque
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Final

from kata.audit import anchor
from kata.audit.anchor import AnchorLine
from kata.database.base import utc_now

log = logging.getLogger(__name__)

_RETRY_S: Final = 5.0
_CLOSE_LIMIT_S: Final = 5.0
"""Seconds that the service's shutdown waits for the copy."""
_MAX_PENDING: Final = 1000
"""Maximum number of lines in memory. If more are missing, for example after an outage, the anchor is read again."""


class AnchorCopy:
    """Appends lines to the copy in its own thread, because another computer's disk may answer late or never."""

    def __init__(
        self,
        file: Path,
        of: Path,
        data: Path,
        on_ahead: Callable[[AnchorLine], None] = lambda line: None,
        *,
        retry_s: float = _RETRY_S,
    ) -> None:
        """Start to append to ``file`` the lines of the anchor ``of`` that ``file`` lacks.

        :param data: the data folder.
        :param on_ahead: called once, from the copy's thread, with the copy's last line if the copy is ahead of the anchor.
        """
        self.file, self._anchor_file, self._data, self._on_ahead, self._retry_s = file, of, data, on_ahead, retry_s
        self.is_elsewhere = False
        """True if the copy is on another disk or computer."""
        self._pending: deque[AnchorLine] = deque(maxlen=_MAX_PENDING)
        self._changed = threading.Condition()
        self._closing = False
        lines = anchor.read(of) if of.exists() else []
        self._newest = self._last_line_at_start = max((line.line for line in lines), default=0)
        self._written: int | None = None
        self.failing_since: datetime | None = None
        """Time since which lines cannot be appended; None if they can."""
        self._thread = threading.Thread(target=self._run, name="audit anchor copy", daemon=True)
        self._thread.start()

    def add(self, line: AnchorLine) -> None:
        """Append a line of the anchor. Return at once."""
        with self._changed:
            self._newest = line.line
            self._pending.append(line)
            self._changed.notify_all()

    def until_written(self, limit_s: float) -> bool:
        """Wait at most ``limit_s`` seconds. Return whether the copy then has all lines."""
        with self._changed:
            return self._changed.wait_for(lambda: self._written == self._newest, limit_s)

    def close(self) -> None:
        """Wait for the last lines if the copy can be written, then end the thread."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(_CLOSE_LIMIT_S)

    def _run(self) -> None:
        while True:
            try:
                self._append()
            except OSError as error:
                if self.failing_since is None:
                    log.error("the audit trail's copy %s cannot be written: %s; trying again", self.file, error)
                    self.failing_since = utc_now()
            else:
                if self.failing_since:
                    log.warning("the audit trail's copy %s can be written again and has all heads", self.file)
                    self.failing_since = None
            with self._changed:
                self._changed.notify_all()
                if self.failing_since:
                    self._changed.wait_for(lambda: self._closing, self._retry_s)
                else:
                    self._changed.wait_for(lambda: self._closing or self._written != self._newest)
                if self._closing and (self.failing_since or self._written == self._newest):
                    return

    def _append(self) -> None:
        """Append the missing lines. The file is opened each time, because its disk may have been unmounted and mounted again."""
        if self._written is None:
            # A copy ahead of the anchor shows that the anchor was cut. The copy keeps its lines and gets only new ones.
            lines = anchor.read(self.file) if self.file.exists() else []
            last = max(lines, key=lambda line: line.line, default=None)
            self._written = min(last.line, self._last_line_at_start) if last else 0
            if last and last.line > self._last_line_at_start:
                self._on_ahead(last)
        with self._changed:
            missing = [line for line in self._pending if line.line > self._written]
            self._pending.clear()
            newest = self._newest
        if newest > self._written and (not missing or missing[0].line != self._written + 1):
            missing = [line for line in anchor.read(self._anchor_file) if self._written < line.line <= newest]
        # The folder is not created, because the copy would be on this computer's disk if the other disk is not mounted.
        descriptor = os.open(self.file, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o600)
        try:
            size = os.fstat(descriptor).st_size
            unfinished = b"\n" if size and os.pread(descriptor, 1, size - 1) != b"\n" else b""
            if missing:
                os.write(descriptor, unfinished + b"".join(anchor.encode(line) for line in missing))
                os.fsync(descriptor)
        finally:
            os.close(descriptor)
        self.is_elsewhere = is_elsewhere(self.file, self._data)
        self._written = newest


def is_elsewhere(file: Path, data: Path) -> bool:
    """Return whether a file is on another disk than the data folder, or on another computer.

    Also return False if the file's folder does not exist, for example because its disk is not mounted.
    """
    existing = next(path for path in (data, *data.parents) if path.exists())
    try:
        return file.absolute().parent.stat().st_dev != existing.stat().st_dev
    except OSError:
        return False
