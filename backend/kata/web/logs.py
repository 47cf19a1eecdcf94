"""The service's log: lines for people, or JSON for a program that collects them."""

import json
import logging
from datetime import UTC, datetime
from typing import Final, Literal

_PLAIN: Final = logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s", "%Y-%m-%dT%H:%M:%S%z")


class JsonLines(logging.Formatter):
    """An object a line: when (UTC), how bad, which part of the program, what; and the traceback, where there is one."""

    def format(self, record: logging.LogRecord) -> str:
        """As one line, whatever stands in it."""
        told = {
            "at": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        if record.exc_info:
            told["traceback"] = self.formatException(record.exc_info)
        return json.dumps(told, ensure_ascii=False)


def begin(log_format: Literal["plain", "json"]) -> None:
    """From now on the log goes to standard error, from INFO upwards."""
    handler = logging.StreamHandler()
    handler.setFormatter(JsonLines() if log_format == "json" else _PLAIN)
    logging.basicConfig(level=logging.INFO, handlers=[handler])
    logging.getLogger("alembic").setLevel(logging.WARNING)
