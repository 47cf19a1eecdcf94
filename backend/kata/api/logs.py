"""The service's log: lines for people, or JSON for a log collector."""

import json
import logging
from datetime import UTC, datetime
from typing import Any, Literal

from kata.audit.audit_log import ROWS


class Lines(logging.Formatter):
    """Formats a record as one line with time and offset, followed by the traceback. A text cannot begin a new line."""

    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)s %(name)s: %(message)s", "%Y-%m-%dT%H:%M:%S%z")

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802
        """Return the line without the traceback."""
        return super().formatMessage(record).replace("\r", "\\r").replace("\n", "\\n")


class JsonLines(logging.Formatter):
    """Formats a record as a JSON object in one line: time (UTC), level, logger and message, and a traceback or an audit row if there is one."""

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


def begin(log_format: Literal["plain", "json"]) -> None:
    """Send the log from INFO upwards to standard error. The JSON format also contains every row of the audit trail."""
    handler = logging.StreamHandler()
    handler.setFormatter(JsonLines() if log_format == "json" else Lines())
    logging.basicConfig(level=logging.INFO, handlers=[handler])
    logging.getLogger("alembic").setLevel(logging.WARNING)
    # Only a log collector needs the rows of the audit trail.
    logging.getLogger(ROWS).setLevel(logging.INFO if log_format == "json" else logging.WARNING)
