"""The service's log: lines for people, or JSON for a log collector."""

import json
import logging
from collections import deque
from datetime import UTC, datetime
from typing import Any, Final, Literal

from kata.audit.audit_log import AUDIT_ROW_LOGGER


class Lines(logging.Formatter):
    """Formats a record as one line with time and offset, followed by the traceback. Line breaks within a message are escaped."""

    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)s %(name)s: %(message)s", "%Y-%m-%dT%H:%M:%S%z")

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802
        """Return the line without the traceback."""
        return super().formatMessage(record).replace("\r", "\\r").replace("\n", "\\n")


class JsonLines(logging.Formatter):
    """Formats a record as a JSON object in one line with time (UTC), level, logger and message, and with the traceback or audit row if
    there is one.
    """

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        fields: dict[str, Any] = {
            "at": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        if record.exc_info:
            fields["traceback"] = self.formatException(record.exc_info)
        if row := getattr(record, "audit", None):
            fields["audit"] = row
        return json.dumps(fields, ensure_ascii=False, default=str)


class RecentLines(logging.Handler):
    """Keeps the newest lines in memory, for the support bundle."""

    def __init__(self, number: int) -> None:
        """``number``: lines to keep. Each is cut to ``LONGEST_KEPT_LINE`` characters."""
        super().__init__()
        self.setFormatter(Lines())
        self._lines: deque[str] = deque(maxlen=number)

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a record, except rows of the audit trail, because they name patients' records."""
        if record.name == AUDIT_ROW_LOGGER:
            return
        try:
            self._lines.append(self.format(record)[:LONGEST_KEPT_LINE])
        except Exception:
            # Like logging's own handlers: a wrong log call must not fail its caller.
            self.handleError(record)

    def text(self) -> str:
        """Return the lines, oldest first."""
        return "".join(f"{line}\n" for line in tuple(self._lines))


LONGEST_KEPT_LINE: Final = 4000
RECENT: Final = RecentLines(2000)
"""The newest lines of this process."""


def begin(log_format: Literal["plain", "json"]) -> None:
    """Send the log from INFO upwards to standard error, and keep its newest lines. The JSON format also contains every row of the audit trail."""
    handler = logging.StreamHandler()
    handler.setFormatter(JsonLines() if log_format == "json" else Lines())
    logging.basicConfig(level=logging.INFO, handlers=[handler, RECENT])
    logging.getLogger("alembic").setLevel(logging.WARNING)
    # Only a log collector needs the rows of the audit trail.
    logging.getLogger(AUDIT_ROW_LOGGER).setLevel(logging.INFO if log_format == "json" else logging.WARNING)
