"""``kata doctor``: whether this computer can do the work, in plain lines, each with what to do.

Everything that can be tried is tried; nothing is changed, and no drive on the port is spoken to.
"""

import grp
import os
import platform
import shutil
import sqlite3
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final, Literal

import serial
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import inspect
from sqlalchemy.exc import SQLAlchemyError

from kata.auth.openid import OpenIdError, Provider
from kata.backups.catalogue import last_good
from kata.backups.key import key_location
from kata.database.base import utc_now
from kata.database.engine import Database, DatabaseError
from kata.database.upgrade import migrations
from kata.device import config
from kata.device.bus.bandwidth import max_cycle_hz
from kata.errors import ProblemError
from kata.settings import Settings
from kata.system.privileges import fifo_granted, kernel_preemption, memory_lock_granted

State = Literal["ok", "warning", "problem"]

_WAL_FIXED: Final = (3, 51, 3)
_WAL_SINCE: Final = (3, 7, 0)
_PYTHON: Final = (3, 11)
_ROOM_WANTED_GB: Final = 5.0
_ROOM_NEEDED_GB: Final = 0.5
_LATENCY_MS: Final = 1
_OLDEST: Final = timedelta(days=2)
_BY_ID: Final = Path("/dev/serial/by-id")
_TTYS: Final = Path("/sys/class/tty")
_HUGE_PAGES: Final = Path("/sys/kernel/mm/transparent_hugepage/enabled")


@dataclass(frozen=True)
class CheckResult:
    """One line: what was looked at, how it stands, and what to do where it is not well."""

    name: str
    state: State
    message: str
    what_to_do: str = ""


def examine(settings: Settings) -> list[CheckResult]:
    """Look at everything; a look that fails itself is a problem, and the others go on."""
    looks: list[Callable[[Settings], Iterator[CheckResult]]] = [
        _python,
        _sqlite,
        _processor,
        _huge_pages,
        _real_time,
        _station,
        _data,
        _database,
        _backups,
        _openid,
    ]
    return [finding for look in looks for finding in look(settings)]


def as_json(findings: list[CheckResult]) -> list[dict[str, str]]:
    """For a program to read."""
    return [asdict(finding) for finding in findings]


def _python(settings: Settings) -> Iterator[CheckResult]:
    version = platform.python_version()
    if sys.version_info >= _PYTHON:
        yield CheckResult("Python", "ok", version)
    else:
        yield CheckResult("Python", "problem", f"{version} is too old.", "Install Python 3.11 or newer.")


def _sqlite(settings: Settings) -> Iterator[CheckResult]:
    version = sqlite3.sqlite_version
    if _WAL_SINCE <= sqlite3.sqlite_version_info < _WAL_FIXED:
        yield CheckResult(
            "SQLite",
            "ok",
            f"{version} can corrupt a WAL when two connections write and checkpoint together; Kata writes "
            "and checkpoints with one connection only, the others are read-only.",
            "Do not let another program write to Kata's database.",
        )
    else:
        yield CheckResult("SQLite", "ok", version)


def _processor(settings: Settings) -> Iterator[CheckResult]:
    cores = len(os.sched_getaffinity(0))
    if cores >= 2:
        yield CheckResult("Processor", "ok", f"{cores} cores")
    else:
        yield CheckResult("Processor", "warning", "One core only.", "Two let the control loop run beside the service.")
    preemption = kernel_preemption()
    if preemption in ("PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT"):
        yield CheckResult("Kernel", "ok", f"Linux {platform.release()}, {preemption}")
    else:
        yield CheckResult(
            "Kernel",
            "warning",
            f"Linux {platform.release()} does not say that it can be preempted.",
            "A kernel with PREEMPT_DYNAMIC or PREEMPT_RT keeps cycles punctual.",
        )


def _huge_pages(settings: Settings) -> Iterator[CheckResult]:
    """Kata's own programs have none made; where the kernel does it for everybody, a browser beside them is enough."""
    if not _HUGE_PAGES.exists():
        return
    if "[always]" not in _HUGE_PAGES.read_text():
        yield CheckResult("Huge pages", "ok", "Made only where a program asks for them.")
        return
    yield CheckResult(
        "Huge pages",
        "warning",
        "The kernel gathers every program's memory into huge pages, which can keep the control loop off its core for milliseconds.",
        "On the kernel's command line: transparent_hugepage=madvise",
    )


def _real_time(settings: Settings) -> Iterator[CheckResult]:
    if fifo_granted():
        yield CheckResult("Real-time scheduling", "ok", "SCHED_FIFO is granted.")
    else:
        yield CheckResult(
            "Real-time scheduling",
            "warning",
            "SCHED_FIFO is not granted: on a busy computer cycles will be late.",
            "In the service's systemd unit: LimitRTPRIO=70. For a user: 'kata - rtprio 70' in /etc/security/limits.d/.",
        )
    if memory_lock_granted():
        yield CheckResult("Locked memory", "ok", "Memory can be locked.")
    else:
        yield CheckResult(
            "Locked memory",
            "warning",
            "Memory cannot be locked: a computer short of memory may make a cycle wait for its disk.",
            "In the service's systemd unit: LimitMEMLOCK=infinity. For a user: 'kata - memlock unlimited' in "
            "/etc/security/limits.d/.",
        )


def _station(settings: Settings) -> Iterator[CheckResult]:
    if settings.station is None:
        yield CheckResult("Station", "ok", "None given; --station FILE.toml has it looked at, with its port.")
        return
    try:
        station = config.read(settings.station)
    except config.ConfigError as error:
        yield CheckResult("Station", "problem", str(error), "Mend the file.")
        return
    yield CheckResult("Station", "ok", f"{station.name}: {station.port}, {station.baud} baud, {station.rate_hz} Hz")
    ceiling = f"{station.protocol} at {station.baud} bit/s carries at most {int(max_cycle_hz(station))} cycles a second"
    yield CheckResult("Bus", "ok", f"{ceiling}; {station.cycle_hz} are asked for.")
    yield from _port(station)


def _port(station: config.StationConfig) -> Iterator[CheckResult]:
    port = Path(station.port)
    if not port.exists():
        there = ", ".join(str(path) for path in _by_id()) or "there is no serial adapter at all"
        yield CheckResult(
            "Port", "problem", f"{port} is not there.", f"Plug the RS-485 adapter in, or correct port: {there}."
        )
        return
    if not os.access(port, os.R_OK | os.W_OK):
        group = grp.getgrgid(port.stat().st_gid).gr_name
        yield CheckResult(
            "Port",
            "problem",
            f"{port} may not be opened by this user.",
            f"It belongs to the group {group}, adapters mostly to dialout: sudo usermod --append --groups dialout USER; "
            "then sign in anew.",
        )
        return
    try:
        serial.Serial(str(port), station.baud, timeout=0, exclusive=True).close()
    except (OSError, ValueError) as error:
        yield CheckResult(
            "Port",
            "problem",
            f"{port} cannot be opened: {error}",
            "Is Kata, or another program, using it? Otherwise, does the adapter do this baud rate?",
        )
        return
    yield CheckResult("Port", "ok", f"{port} opens at {station.baud} baud.")
    yield from _name_of(port)
    yield from _latency_timer(port)


def _name_of(port: Path) -> Iterator[CheckResult]:
    if not port.resolve().name.startswith(("ttyUSB", "ttyACM")) or port.parent == _BY_ID:
        return
    lasting = [str(path) for path in _by_id() if path.resolve() == port.resolve()]
    yield CheckResult(
        "Port's name",
        "warning",
        f"{port} may have another number after the adapter was plugged in anew.",
        f'In the station\'s file: port = "{lasting[0] if lasting else "/dev/serial/by-id/..."}"',
    )


def _latency_timer(port: Path) -> Iterator[CheckResult]:
    """FTDI's adapters keep replies back for 16 ms unless told otherwise."""
    timer = _TTYS / port.resolve().name / "device" / "latency_timer"
    if not timer.exists():
        return
    latency_ms = int(timer.read_text())
    if latency_ms <= _LATENCY_MS:
        yield CheckResult("Adapter's latency timer", "ok", f"{latency_ms} ms")
        return
    yield CheckResult(
        "Adapter's latency timer",
        "warning",
        f"{latency_ms} ms: each reply may be kept back for that long. Kata asks for low latency itself when it opens the "
        "port; this says what holds without.",
        f'setserial {port} low_latency; for good, a udev rule: ACTION=="add", SUBSYSTEM=="usb-serial", '
        f'DRIVER=="ftdi_sio", ATTR{{latency_timer}}="{_LATENCY_MS}"',
    )


def _by_id() -> list[Path]:
    return sorted(_BY_ID.iterdir()) if _BY_ID.is_dir() else []


def _data(settings: Settings) -> Iterator[CheckResult]:
    folder = settings.data
    # A folder that is not there yet is made at the first start, in the nearest one that is.
    there = next(path for path in (folder, *folder.parents) if path.exists())
    try:
        with tempfile.TemporaryFile(dir=there) as file:
            file.write(b"kata")
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        yield CheckResult(
            "Data folder",
            "problem",
            f"{there} cannot be written: {error.strerror}.",
            "Give the user that folder, or --data another.",
        )
        return
    yield CheckResult("Data folder", "ok", f"{folder} can be written and synced.")
    room_gb = shutil.disk_usage(there).free / 1e9
    state: State = "ok" if room_gb >= _ROOM_WANTED_GB else "warning" if room_gb >= _ROOM_NEEDED_GB else "problem"
    advice = (
        ""
        if state == "ok"
        else "Make room: an hour of treatment at 100 Hz takes some 60 MB, and a full disk stops the apparatus."
    )
    yield CheckResult("Disk space", state, f"{room_gb:.1f} GB are free.", advice)


def _database(settings: Settings) -> Iterator[CheckResult]:
    try:
        database = Database(settings.effective_database_url)
    except DatabaseError as error:
        yield CheckResult("Database", "problem", str(error), "Correct KATA_DATABASE_URL.")
        return
    try:
        shown = database.url.render_as_string(hide_password=True)
        if database.file and not database.file.exists():
            yield CheckResult("Database", "ok", f"{shown} is made at the first start.")
            return
        with database.reader.connect() as connection:
            present = MigrationContext.configure(connection).get_current_revision()
            tables = inspect(connection).get_table_names()
    except SQLAlchemyError as error:
        cause = getattr(error, "orig", None) or error
        yield CheckResult(
            "Database", "problem", f"{shown} cannot be opened: {cause}", "Is the server running? Else restore a backup."
        )
        return
    finally:
        database.close()
    yield _schema(shown, present, empty=not tables)


def _backups(settings: Settings) -> Iterator[CheckResult]:
    if key_location(settings) == "nowhere":
        yield CheckResult("Backups", "ok", "The first start makes the key that opens them.")
        return
    on_data = settings.backup_folder.exists() and settings.backup_folder.stat().st_dev == settings.data.stat().st_dev
    if on_data:
        yield CheckResult(
            "Backups' folder",
            "warning",
            f"{settings.backup_folder} is on the database's own disk, and is lost with it.",
            "Set KATA_BACKUP_DIR to a folder on another disk or computer.",
        )
    good_at = _last_good_at(settings)
    if good_at and good_at > utc_now() - _OLDEST:
        yield CheckResult(
            "Backups", "ok", f"The last one that was restored to try it is of {good_at:%Y-%m-%d %H:%M} UTC."
        )
        return
    told = (
        f"The last one that is known to be restorable is of {good_at:%Y-%m-%d}"
        if good_at
        else "None was restored to try it"
    )
    yield CheckResult(
        "Backups",
        "warning",
        f"{told}; the key is {key_location(settings)}.",
        "kata backup makes one and says what is wrong; kata restore FILE --verify --key KEY tries one where the key is.",
    )


def _openid(settings: Settings) -> Iterator[CheckResult]:
    if not settings.openid_issuer:
        return
    try:
        keys = Provider(settings).look()
    except OpenIdError as error:
        yield CheckResult("OpenID provider", "problem", str(error), "Correct KATA_OPENID_SECRET_FILE.")
    except ProblemError:
        yield CheckResult(
            "OpenID provider",
            "problem",
            f"{settings.openid_issuer} does not answer as a provider of this name: nobody can sign in by it.",
            "Look at KATA_OPENID_ISSUER, the network, and the provider's certificate (REQUESTS_CA_BUNDLE names one of the clinic's own).",
        )
    else:
        yield CheckResult("OpenID provider", "ok", f"{settings.openid_issuer} answers, and signs with {keys} keys.")


def _last_good_at(settings: Settings) -> datetime | None:
    """None also where the database cannot be read, which is told elsewhere."""
    try:
        database = Database(settings.effective_database_url)
    except DatabaseError:
        return None
    try:
        if database.file and not database.file.exists():
            return None
        with database.read() as session:
            good = last_good(session)
            return good.at if good else None
    except SQLAlchemyError:
        return None
    finally:
        database.close()


def _schema(shown: str, present: str | None, *, empty: bool) -> CheckResult:
    script = ScriptDirectory(str(migrations()))
    if present == script.get_current_head():
        return CheckResult("Database", "ok", f"{shown} has the newest schema.")
    if empty:
        return CheckResult("Database", "ok", f"{shown} is empty; its tables are made at the first start.")
    if present and present not in {revision.revision for revision in script.walk_revisions()}:
        return CheckResult(
            "Database",
            "problem",
            f"{shown} was written by a newer version of Kata.",
            "Start that version, or restore a backup.",
        )
    return CheckResult(
        "Database",
        "warning",
        f"{shown} has an older schema.",
        "The next start brings it up to date; make a backup first.",
    )
