"""``kata support-bundle``: one ZIP file that describes an installation to its maintainers. It contains no patient data and no secrets.

The content is chosen instead of filtered: settings by a list, tables by their counts, events by their codes. A part that cannot be read
contains the reason, because most bundles are made when something does not work.
"""

import json
import os
import platform
import re
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from datetime import UTC, datetime
from importlib.metadata import distributions
from pathlib import Path
from typing import Any, Final

from alembic.migration import MigrationContext
from sqlalchemy import func, inspect, select, table
from sqlalchemy.orm import Session

from kata import __version__
from kata.audit.audit_log import AUDIT_ROW_LOGGER
from kata.cli.doctor import as_json, examine
from kata.clinic.events.tables import DeviceEventRow
from kata.database.engine import Database
from kata.settings import Settings

EVENTS: Final = 1000
"""Number of device events in the bundle, newest first."""
LOG_LINES: Final = 5000
"""Number of newest lines of the systemd unit's log in the bundle."""
DISCLOSED_SETTINGS: Final = frozenset(
    {
        "simulate", "seed", "rate_hz", "real_time", "clinic_time_zone", "backup_time", "host", "port", "log_format", "plain_http",
        "connections_per_address", "trusted_proxies", "idle_minutes", "login_session_hours", "second_factor", "data", "station",
    }
)  # fmt: skip
"""Settings whose values the bundle contains. For all others it says only whether they differ from the default."""
_CODE: Final = re.compile("[a-z0-9_]+")
"""Pattern of the device's codes."""
_NAME: Final = re.compile(r"\s*name\s*=")
"""Begin of the line of a station's file with its name."""
_README: Final = """\
Support bundle of Kata {version}, made at {at} (UTC).

It contains no patient data, no names of users, no passwords, keys or tokens. Please look through it before you send it: every file
is text.

versions.json   program, Python, packages and operating system
settings.json   settings of the service; of names and secrets only whether they are set
station.toml    configuration of the station without its name
doctor.json     answers of `kata doctor`
database.json   kind, schema, size, and number of rows of each table
events.json     the newest {events} events of the device: time, kind, code, category and motor
journal.json    journal files of the device: name, size and time
log.txt         log of the service without the audit trail
metrics.txt     figures of loop, bus and service (only from the page of a running service)
"""


def write(settings: Settings, out: Path) -> None:
    """Write the bundle.

    :raises OSError: when the file cannot be written.
    """
    parts: dict[str, Callable[[], str]] = {
        "versions.json": lambda: _json(_versions()),
        "settings.json": lambda: _json(shown_settings(settings)),
        "station.toml": lambda: (
            _without_name(settings.station) if settings.station else "# none: the built-in station\n"
        ),
        # Without the station, because the check would open its port while a running service may be moving an arm.
        "doctor.json": lambda: _json(as_json(examine(settings.model_copy(update={"station": None})))),
        "database.json": lambda: _json(_with_database(settings, _database)),
        "events.json": lambda: _json(_with_database(settings, _events)),
        "journal.json": lambda: _json(_journal(settings)),
        "log.txt": _unit_log,
    }
    at = datetime.now(UTC).isoformat(timespec="seconds")
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as bundle:
        bundle.writestr("README.txt", _README.format(version=__version__, at=at, events=EVENTS))
        for name, make in parts.items():
            bundle.writestr(name, _part_or_reason(make))


def shown_settings(settings: Settings) -> dict[str, Any]:
    """Return every setting with its value, or with whether it is set."""
    values = settings.model_dump(mode="json")
    defaults = {name: field.get_default(call_default_factory=True) for name, field in Settings.model_fields.items()}
    return {
        name: value if name in DISCLOSED_SETTINGS else "default" if getattr(settings, name) == defaults[name] else "set"
        for name, value in values.items()
    }


def _part_or_reason(make: Callable[[], str]) -> str:
    """Return a part, or the reason why it is missing. The reason is the type of the error, because its message may contain data."""
    try:
        return make()
    except Exception as error:
        return f"This part could not be made: {type(error).__name__}\n"


def _json(content: object) -> str:
    return json.dumps(content, indent=2, ensure_ascii=False, default=str) + "\n"


def _versions() -> dict[str, Any]:
    return {
        "kata": __version__,
        "python": platform.python_version(),
        "system": platform.platform(),
        "machine": platform.machine(),
        "processors": os.cpu_count(),
        "packages": {
            package.name: package.version
            for package in sorted(distributions(), key=lambda distribution: distribution.name.lower())
        },
    }


def _with_database(settings: Settings, read_part: Callable[[Database, Session], Any]) -> Any:
    database = Database(settings.effective_database_url)
    try:
        if database.file and not database.file.exists():
            return "The first start creates the database."
        with database.read() as session:
            return read_part(database, session)
    finally:
        database.close()


def _database(database: Database, session: Session) -> dict[str, Any]:
    names = sorted(inspect(session.connection()).get_table_names())
    return {
        "kind": database.kind,
        "bytes": database.size_bytes(),
        "schema": MigrationContext.configure(session.connection()).get_current_revision(),
        "rows": {name: session.scalar(select(func.count()).select_from(table(name))) for name in names},
    }


def _events(_: Database, session: Session) -> list[dict[str, Any]]:
    """Return the newest events. Stations are replaced by numbers, because clinics choose their names."""
    row = DeviceEventRow
    columns = (row.station, row.at, row.kind, row.code, row.category, row.axis, row.ended_at)
    newest = [
        dict(record._mapping) for record in session.execute(select(*columns).order_by(row.at.desc()).limit(EVENTS))
    ]
    numbers = {name: n for n, name in enumerate(sorted({event["station"] for event in newest}), start=1)}
    return [
        event
        | {"station": numbers[event["station"]], "code": event["code"] if _CODE.fullmatch(event["code"]) else "unknown"}
        for event in newest
    ]


def _without_name(station: Path) -> str:
    """Return a station's file without its name, because clinics choose it."""
    return "".join(line for line in station.read_text().splitlines(keepends=True) if not _NAME.match(line))


def _journal(settings: Settings) -> list[dict[str, Any]]:
    files = sorted(file for file in settings.journal.rglob("*") if file.is_file())
    return [
        {
            "name": str(file.relative_to(settings.journal)),
            "bytes": file.stat().st_size,
            "at": datetime.fromtimestamp(file.stat().st_mtime, UTC).isoformat(timespec="seconds"),
        }
        for file in files
    ]


def _unit_log() -> str:
    """Return the log of the systemd unit without rows of the audit trail, which ``KATA_LOG_FORMAT=json`` adds to it.

    The page of a running service replaces it by the service's own log.
    """
    program = shutil.which("journalctl")
    if program is None:
        return "There is no journalctl here. The service writes its log to standard error.\n"
    command = [program, "--unit", "kata", "--lines", str(LOG_LINES), "--no-pager", "--output", "cat"]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=30, check=True)
    return "".join(line for line in done.stdout.splitlines(keepends=True) if not _is_audit_row(line))


def _is_audit_row(line: str) -> bool:
    try:
        record = json.loads(line)
    except ValueError:
        return False
    return isinstance(record, dict) and record.get("logger") == AUDIT_ROW_LOGGER
