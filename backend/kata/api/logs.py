"""The service's log: lines for people, or JSON for a program that collects them."""

import json
import logging
from datetime import UTC, datetime
from typing import Any, Literal

from kata.audit.audit_log import ROWS


class Lines(logging.Formatter):
    """A line each, with its time and offset; a traceback below. Nobody's text begins a line of its own."""

    def __init__(self) -> None:
        """As people read it."""
        super().__init__("%(asctime)s %(levelname)s %(name)s: %(message)s", "%Y-%m-%dT%H:%M:%S%z")

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802
        """Without the traceback, which is put behind it."""
        return super().formatMessage(record).replace("\r", "\\r").replace("\n", "\\n")


class JsonLines(logging.Formatter):
    """An object a line: when (UTC), how bad, which part of the program, what; and the traceback, or the row of the audit trail, where there is one."""

    def format(self, record: logging.LogRecord) -> str:
        """As one line, whatever stands in it."""
        told: dict[str, Any] = {
            "at": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        if record.exc_info:
            told["traceback"] = self.formatException(record.exc_info)
        if row := getattr(record, "audit", None):
            told["audit"] = row
        return json.dumps(told, ensure_ascii=False, default=str)


def begin(log_format: Literal["plain", "json"]) -> None:
    """From now on the log goes to standard error, from INFO upwards; as JSON, every row of the audit trail with it."""
    handler = logging.StreamHandler()
    handler.setFormatter(JsonLines() if log_format == "json" else Lines())
    logging.basicConfig(level=logging.INFO, handlers=[handler])
    logging.getLogger("alembic").setLevel(logging.WARNING)
    # Rows of the audit trail are for a program that takes them elsewhere, not for whoever reads a terminal.
    logging.getLogger(ROWS).setLevel(logging.INFO if log_format == "json" else logging.WARNING)
