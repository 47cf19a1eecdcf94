"""``kata doctor``: check whether this computer can run Kata. Each finding is one line; a problem has a remedy.

The checks change nothing. They read registers of the drives to measure how late answers arrive, and write no register.
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

from kata.api.connection_limits import is_listed
from kata.audit.anchor_copy import is_elsewhere
from kata.auth.openid import OpenIdError
from kata.auth.openid_provider import Provider
from kata.backups.catalogue import last_good
from kata.backups.key import key_location
from kata.commissioning import texts
from kata.commissioning.latency import LatencyFigures, measure_adapter, measure_bus
from kata.commissioning.status import commissioning_status
from kata.database.base import utc_now
from kata.database.engine import Database, DatabaseError
from kata.database.upgrade import migrations
from kata.device import config
from kata.device.bus.bandwidth import max_cycle_hz
from kata.device.bus.interface import BusError
from kata.device.bus.serial_transport import port_of
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
_DAMAGED_SHARE: Final = 0.02
"""Share of damaged answers above which the bus is reported. A bus without faults has no damaged answers."""
_OLDEST: Final = timedelta(days=2)
_BY_ID: Final = Path("/dev/serial/by-id")
_TTYS: Final = Path("/sys/class/tty")
_KEY_PLACES: Final = {
    "here": "The key is on this computer.",
    "elsewhere": "The key is not on this computer.",
    "nowhere": "There is no key yet.",
}
_HUGE_PAGES: Final = Path("/sys/kernel/mm/transparent_hugepage/enabled")


@dataclass(frozen=True)
class CheckResult:
    """The result of one check, with the remedy of a problem."""

    name: str
    state: State
    message: str
    what_to_do: str = ""


def examine(settings: Settings) -> list[CheckResult]:
    """Run all checks."""
    checks: list[Callable[[Settings], Iterator[CheckResult]]] = [
        _python,
        _sqlite,
        _processor,
        _huge_pages,
        _real_time,
        _station,
        _data,
        _database,
        _backups,
        _audit,
        _proxy,
        _openid,
    ]
    return [finding for check in checks for finding in check(settings)]


def as_json(findings: list[CheckResult]) -> list[dict[str, str]]:
    """Return the findings as JSON."""
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
            f"{version} can corrupt a WAL when two connections write and checkpoint together. In Kata one connection writes "
            "and checkpoints, and the others are read-only.",
            "Do not let another program write to Kata's database.",
        )
    else:
        yield CheckResult("SQLite", "ok", version)


def _processor(settings: Settings) -> Iterator[CheckResult]:
    cores = len(os.sched_getaffinity(0))
    if cores >= 2:
        yield CheckResult("Processor", "ok", f"{cores} cores")
    else:
        yield CheckResult(
            "Processor",
            "warning",
            "There is only one core.",
            "Use a computer with at least two cores, so that the service does not delay the control loop.",
        )
    preemption = kernel_preemption()
    if preemption in ("PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT"):
        yield CheckResult("Kernel", "ok", f"Linux {platform.release()}, {preemption}")
    else:
        yield CheckResult(
            "Kernel",
            "warning",
            f"Linux {platform.release()} reports no preemption.",
            "Use a kernel with PREEMPT_DYNAMIC or PREEMPT_RT, so that cycles begin on time.",
        )


def _huge_pages(settings: Settings) -> Iterator[CheckResult]:
    """Warn if the kernel gives huge pages to every program. Kata refuses them for itself, but a browser on this computer gets them."""
    if not _HUGE_PAGES.exists():
        return
    if "[always]" not in _HUGE_PAGES.read_text():
        yield CheckResult("Huge pages", "ok", "The kernel uses them only for programs that request them.")
        return
    yield CheckResult(
        "Huge pages",
        "warning",
        "The kernel uses huge pages for every program, which can delay the control loop by milliseconds.",
        "Add to the kernel's command line: transparent_hugepage=madvise",
    )


def _real_time(settings: Settings) -> Iterator[CheckResult]:
    if fifo_granted():
        yield CheckResult("Real-time scheduling", "ok", "SCHED_FIFO is granted.")
    else:
        yield CheckResult(
            "Real-time scheduling",
            "warning",
            "SCHED_FIFO is not granted, so cycles are late on a busy computer.",
            "Set LimitRTPRIO=70 in the service's systemd unit. For a user, write 'kata - rtprio 70' to a file in /etc/security/limits.d/.",
        )
    if memory_lock_granted():
        yield CheckResult("Locked memory", "ok", "Memory can be locked.")
    else:
        yield CheckResult(
            "Locked memory",
            "warning",
            "Memory cannot be locked, so a cycle may wait for the disk when memory is short.",
            "Set LimitMEMLOCK=infinity in the service's systemd unit. For a user, write 'kata - memlock unlimited' to a file in "
            "/etc/security/limits.d/.",
        )


def _station(settings: Settings) -> Iterator[CheckResult]:
    if settings.station is None:
        yield CheckResult(
            "Station",
            "ok",
            "No station's file was given. With --station FILE.toml the command also checks the file and its port.",
        )
        return
    try:
        station = config.read(settings.station)
    except config.ConfigError as error:
        yield CheckResult("Station", "problem", str(error), "Correct the file.")
        return
    yield CheckResult("Station", "ok", f"{station.name}: {station.port}, {station.baud} baud, {station.rate_hz} Hz")
    bandwidth = (
        f"{station.protocol} at {station.baud} bit/s allows at most {int(max_cycle_hz(station))} cycles a second"
    )
    yield CheckResult("Bus", "ok", f"{bandwidth}; the station uses {station.cycle_hz}.")
    status = commissioning_status(settings.station, station)
    if status.missing:
        yield CheckResult(
            "Commissioning", "problem", f"The station is not commissioned: {status.missing}.", texts.RUN_COMMISSION()
        )
    elif status.due_at and status.due_at < utc_now():
        yield CheckResult(
            "Commissioning",
            "warning",
            f"The periodic check was due on {status.due_at:%Y-%m-%d}.",
            f"Stop the service and run: kata commission {settings.station} --check",
        )
    else:
        yield CheckResult("Commissioning", "ok", f"The next periodic check is due on {status.due_at:%Y-%m-%d}.")
    yield from _port(station)


def _port(station: config.StationConfig) -> Iterator[CheckResult]:
    port = Path(station.port)
    if not port.exists():
        adapters = ", ".join(str(path) for path in _by_id()) or "none"
        yield CheckResult(
            "Port",
            "problem",
            f"{port} does not exist.",
            f"Plug in the RS-485 adapter, or correct the port in the station's file. Adapters found: {adapters}.",
        )
        return
    if not os.access(port, os.R_OK | os.W_OK):
        group = grp.getgrgid(port.stat().st_gid).gr_name
        yield CheckResult(
            "Port",
            "problem",
            f"This user has no permission to open {port}.",
            f"The port belongs to the group {group}; most adapters belong to dialout. Run: sudo usermod --append --groups dialout USER. "
            "Then log in again.",
        )
        return
    try:
        serial.Serial(str(port), station.baud, timeout=0, exclusive=True).close()
    except (OSError, ValueError) as error:
        yield CheckResult(
            "Port",
            "problem",
            f"{port} cannot be opened: {error}",
            "Check whether Kata or another program uses it, and whether the adapter supports this baud rate.",
        )
        return
    yield CheckResult("Port", "ok", f"{port} opens at {station.baud} baud.")
    yield from _name_of(port)
    yield from _latency_timer(port)
    yield _direction(station)
    yield from _drives(station)


def _name_of(port: Path) -> Iterator[CheckResult]:
    if not port.resolve().name.startswith(("ttyUSB", "ttyACM")) or port.parent == _BY_ID:
        return
    lasting = [str(path) for path in _by_id() if path.resolve() == port.resolve()]
    yield CheckResult(
        "Port's name",
        "warning",
        f"{port} may get another number when the adapter is plugged in again.",
        f'Write in the station\'s file: port = "{lasting[0] if lasting else "/dev/serial/by-id/..."}"',
    )


def _latency_timer(port: Path) -> Iterator[CheckResult]:
    """Warn about a slow latency timer, because FTDI adapters delay replies by up to 16 ms by default."""
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
        f"{latency_ms} ms: the adapter may delay each reply by this time. Kata requests low latency when it opens the "
        "port; this is the value without that request.",
        f'Run: setserial {port} low_latency. To make this permanent, add a udev rule: ACTION=="add", SUBSYSTEM=="usb-serial", '
        f'DRIVER=="ftdi_sio", ATTR{{latency_timer}}="{_LATENCY_MS}"',
    )


def _direction(station: config.StationConfig) -> CheckResult:
    """Return who switches the adapter between sending and receiving, and whether the kernel can do so if it has to."""
    if station.rts_direction == "off":
        message = "It switches between sending and receiving by itself (rts_direction = off)."
        return CheckResult("Adapter's direction", "ok", message)
    try:
        port_of(station)(station.port, station.baud).close()
    except BusError as error:
        what_to_do = "Set rts_direction in the station's file, or use an adapter that switches by itself."
        return CheckResult("Adapter's direction", "problem", f"{error}.", what_to_do)
    message = f"The kernel switches it by RTS, which is {station.rts_direction} while Kata sends."
    return CheckResult("Adapter's direction", "ok", message)


def _drives(station: config.StationConfig) -> Iterator[CheckResult]:
    """Measure how late the drives answer through this adapter, and compare the rate that the adapter carries with the station's rate."""
    dynamixel = station.protocol == "dynamixel"
    try:
        figures = measure_adapter(station) if dynamixel else measure_bus(station)
    except BusError as error:
        yield CheckResult("Drives", "problem", str(error), "Check the adapter and its cable.")
        return
    if figures.silent:
        silent = ", ".join(map(str, figures.silent))
        yield CheckResult(
            "Drives",
            "problem",
            f"These motors do not answer at {station.baud} bit/s: {silent}.",
            "Check power and cables. New drives have another id and baud rate"
            + ("; kata commission sets them." if dynamixel else "."),
        )
    else:
        yield CheckResult("Drives", "ok", f"Five drives answered at {station.baud} bit/s.")
    if figures.damaged > _DAMAGED_SHARE * figures.requests:
        yield CheckResult(
            "Bus noise",
            "problem",
            f"{100 * figures.damaged / figures.requests:.0f} % of {figures.requests} answers were damaged.",
            "Check shielding, termination and ground of the bus.",
        )
    if figures.carried_hz:
        yield _adapter(station, figures)


def _adapter(station: config.StationConfig, figures: LatencyFigures) -> CheckResult:
    """Return whether the adapter carries the station's rate, and what to change."""
    measured = (
        f"{figures.measured}: this adapter carries up to {int(figures.carried_hz)} cycles a second; the station uses "
        f"{station.cycle_hz}."
    )
    if figures.carried_hz >= station.cycle_hz:
        return CheckResult("Adapter", "ok", measured)
    lower_hz = int(figures.carried_hz // station.rate_hz) * station.rate_hz
    other = f"cycle_hz = {lower_hz}" if lower_hz else f"rate_hz and cycle_hz of at most {int(figures.carried_hz)}"
    return CheckResult(
        "Adapter",
        "problem",
        measured,
        f"Set the adapter's latency timer to {_LATENCY_MS} ms (setserial {station.port} low_latency), use an adapter without one, or "
        f"set in the station's file: {other}.",
    )


def _by_id() -> list[Path]:
    return sorted(_BY_ID.iterdir()) if _BY_ID.is_dir() else []


def _data(settings: Settings) -> Iterator[CheckResult]:
    folder = settings.data
    # The first start creates a missing folder, so check the nearest existing one.
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    try:
        with tempfile.TemporaryFile(dir=existing) as file:
            file.write(b"kata")
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        yield CheckResult(
            "Data folder",
            "problem",
            f"{existing} cannot be written to: {error.strerror}.",
            "Give this user write access, or choose another folder with --data.",
        )
        return
    yield CheckResult("Data folder", "ok", f"{folder} can be written and synced.")
    room_gb = shutil.disk_usage(existing).free / 1e9
    state: State = "ok" if room_gb >= _ROOM_WANTED_GB else "warning" if room_gb >= _ROOM_NEEDED_GB else "problem"
    advice = (
        ""
        if state == "ok"
        else "Free up space: an hour of treatment at 100 Hz needs about 60 MB, and a full disk stops the apparatus."
    )
    yield CheckResult("Disk space", state, f"{room_gb:.1f} GB are free.", advice)


def _database(settings: Settings) -> Iterator[CheckResult]:
    try:
        database = Database(settings.effective_database_url)
    except DatabaseError as error:
        yield CheckResult("Database", "problem", str(error), "Correct KATA_DATABASE_URL.")
        return
    try:
        url = database.url.render_as_string(hide_password=True)
        if database.file and not database.file.exists():
            yield CheckResult("Database", "ok", f"The first start creates {url}.")
            return
        with database.reader.connect() as connection:
            present = MigrationContext.configure(connection).get_current_revision()
            tables = inspect(connection).get_table_names()
    except SQLAlchemyError as error:
        cause = getattr(error, "orig", None) or error
        yield CheckResult(
            "Database",
            "problem",
            f"{url} cannot be opened: {cause}",
            "Check that the database server is running, or restore a backup.",
        )
        return
    finally:
        database.close()
    yield _schema(url, present, empty=not tables)


def _backups(settings: Settings) -> Iterator[CheckResult]:
    if key_location(settings) == "nowhere":
        yield CheckResult("Backups", "ok", "The first start of the service creates their key.")
        return
    on_data = settings.backup_folder.exists() and settings.backup_folder.stat().st_dev == settings.data.stat().st_dev
    if on_data:
        yield CheckResult(
            "Backups' folder",
            "warning",
            f"{settings.backup_folder} is on the same disk as the database: if the disk fails, both are lost.",
            "Set KATA_BACKUP_DIR to a folder on another disk or computer.",
        )
    good_at = _last_good_at(settings)
    if good_at and good_at > utc_now() - _OLDEST:
        yield CheckResult("Backups", "ok", f"The last verified backup was made on {good_at:%Y-%m-%d %H:%M} UTC.")
        return
    last = f"The last verified backup was made on {good_at:%Y-%m-%d}" if good_at else "There is no verified backup"
    yield CheckResult(
        "Backups",
        "warning",
        f"{last}. {_KEY_PLACES[key_location(settings)]}",
        "Run kata backup: it makes a backup and reports problems. On the computer with the key, verify a backup: kata restore FILE --verify --key KEY",
    )


def _audit(settings: Settings) -> Iterator[CheckResult]:
    copy = settings.audit_anchor_copy
    for file in (copy, settings.effective_audit_anchor):
        if file and is_elsewhere(file, settings.data):
            yield CheckResult("Audit trail", "ok", f"The trail's last entries are also recorded in {file}.")
            return
    reason = f"{copy} is on the same disk or its folder does not exist" if copy else "there is no copy of the anchor"
    yield CheckResult(
        "Audit trail",
        "warning",
        f"A user with full access to this computer can shorten database and anchor together without a trace: {reason}.",
        "Set KATA_AUDIT_ANCHOR_COPY to a file on another disk or computer, or collect the log (KATA_LOG_FORMAT=json).",
    )


def _proxy(settings: Settings) -> Iterator[CheckResult]:
    try:
        address = settings.unlisted_proxy_file.read_text()
        listed = is_listed(address, settings.trusted_proxies)
    except (OSError, ValueError):
        return
    if not listed:
        yield CheckResult(
            "Proxy",
            "warning",
            f"Requests came through a proxy at {address} that is not in KATA_TRUSTED_PROXIES. All users behind it count as one "
            "address, so the wrong passwords of one user delay the login of all.",
            f"If this is the clinic's proxy, set KATA_TRUSTED_PROXIES={address}",
        )


def _openid(settings: Settings) -> Iterator[CheckResult]:
    if not settings.openid_issuer:
        return
    try:
        keys = Provider(settings).count_keys()
    except OpenIdError as error:
        yield CheckResult("OpenID provider", "problem", str(error), "Correct KATA_OPENID_SECRET_FILE.")
    except ProblemError:
        yield CheckResult(
            "OpenID provider",
            "problem",
            f"{settings.openid_issuer} does not answer as an OpenID provider of this name, so users cannot log in by OpenID.",
            "Check KATA_OPENID_ISSUER, the network, and the provider's certificate (REQUESTS_CA_BUNDLE: the clinic's own authority).",
        )
    else:
        yield CheckResult("OpenID provider", "ok", f"{settings.openid_issuer} answers and offers {keys} keys.")


def _last_good_at(settings: Settings) -> datetime | None:
    """Return the time of the last verified backup. Return None if there is none or if the database cannot be read, which another check
    reports.
    """
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


def _schema(url: str, present: str | None, *, empty: bool) -> CheckResult:
    script = ScriptDirectory(str(migrations()))
    if present == script.get_current_head():
        return CheckResult("Database", "ok", f"{url} has the newest schema.")
    if empty:
        return CheckResult("Database", "ok", f"{url} is empty; the first start creates its tables.")
    if present and present not in {revision.revision for revision in script.walk_revisions()}:
        return CheckResult(
            "Database",
            "problem",
            f"{url} was written by a newer version of Kata.",
            "Start that version, or restore a backup.",
        )
    return CheckResult(
        "Database",
        "warning",
        f"{url} has an older schema.",
        "The next start upgrades it; make a backup first.",
    )
