"""Makes the reference page of limits and timeouts: each value is read from the source file that defines it."""

import ast
import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
_BACKEND: Final = "backend/kata/"
_PAGE: Final = "frontend/src/"

_SUBJECTS: Final[dict[str, tuple[tuple[str, str, str], ...]]] = {
    "The operator and the browser": (
        (
            "station/lease.py",
            "PAUSE_AFTER_ABSENCE_S",
            "A playback pauses after this absence of the operator's browser.",
        ),
        (
            "station/lease.py",
            "STOP_AND_END_LEASE_AFTER_S",
            "If the operator's browser is absent for this time, a motion or a held arm is stopped. A return is completed. The lease ends when torque is off.",
        ),
        (
            "station/guard.py",
            "COMMAND_VALID_S",
            "A command that can start motion expires so long after the state it was based on.",
        ),
        ("station/station.py", "_REPLY_LIMIT_S", "The service waits for the device's answer to a command."),
        ("station/station.py", "_LOAD_LIMIT_S", "The service waits for the device's answer to a Load."),
        ("api/live.py", "_PERIOD_S", "Period of the live state."),
        ("api/live.py", "_PERIOD_AT_REST_S", "Period of the live state while the apparatus is at rest."),
        ("api/live.py", "PING_S", "The service pings each WebSocket so often."),
        ("api/live.py", "PONG_S", "A WebSocket without an answer to the ping is closed."),
        ("lib/live/store.ts", "CONFIRM_EVERY_MS", "A page's script confirms so often that it has shown a live state."),
        (
            "station/lease.py",
            "PRESENT_AFTER_SHOWN_S",
            "A page counts as present for this time after the service sent the newest live state that the page has confirmed. A page that hangs therefore pauses a playback after this time plus `PAUSE_AFTER_ABSENCE_S`.",
        ),
        ("safety/useHold.ts", "HOLD_MS", "The press that moves the arm to the start is held for so long."),
        (
            "lib/live/store.ts",
            "STOP_ANSWER_TIMEOUT_MS",
            "Stop is repeated as an HTTP request when the WebSocket has not answered.",
        ),
        ("lib/live/store.ts", "LOST_AFTER_MS", "The page shows the connection as lost when no message has come."),
        ("lib/live/store.ts", "RECONNECT_DELAYS_MS", "Delays before the page's attempts to reconnect."),
        ("lib/live/store.ts", "OPEN_TIMEOUT_MS", "An attempt to connect that does not succeed within this time ends."),
        ("lib/api/stationApi.ts", "STOP_TIMEOUT_MS", "The page waits for the answer to a Stop request."),
        ("features/alarms/sound.ts", "SOUND_PAUSE_MS", "The alarm sound stays paused for so long."),
    ),
    "The device": (
        ("device/config.py", "StationConfig.cycle_hz", "Bus cycles a second."),
        ("device/config.py", "StationConfig.rate_hz", "Samples and setpoints a second."),
        ("device/loop_telemetry.py", "SNAPSHOT_HZ", "Snapshots a second."),
        ("device/config.py", "StationConfig.service_silence_ms", "A silent service stops the arm."),
        (
            "station/device_process.py",
            "_HEARTBEAT_S",
            "Heartbeat of the service. In idle and offline it sends one after each snapshot.",
        ),
        ("device/config.py", "StationConfig.silence_ms", "A silent drive is a fault."),
        ("device/config.py", "StationConfig.bus_watchdog_ms", "A drive stops itself when the bus is silent."),
        ("device/config.py", "Inputs.max_age_cycles", "An input is valid for so many cycles."),
        ("device/config.py", "Inputs.contacts_disagree_ms", "The two contacts of the emergency stop may be equal."),
        ("device/faults.py", "MAX_OVERRUN_MS", "A setpoint that is so late is the fault `overrun`."),
        ("device/config.py", "StationConfig.following_error_deg", "Following error that is a fault."),
        (
            "device/config.py",
            "StationConfig.following_error_ms",
            "A following error lasts so long before it is a fault.",
        ),
        ("device/config.py", "StationConfig.limit_tolerance_deg", "A measured angle may exceed its range by so much."),
        ("device/config.py", "Axis.max_speed_deg_s", "Highest speed of an axis."),
        ("device/config.py", "Axis.max_acceleration_deg_s2", "Highest acceleration of an axis."),
        ("device/config.py", "Axis.max_torque_nm", "Highest torque of an axis."),
        ("device/config.py", "StationConfig.approach_speed_deg_s", "Speed of approach and return."),
        ("device/movement.py", "RAMP_S", "Time constant of a ramp."),
        ("device/resistance.py", "RESISTANCE_AFTER_NS", "A push lasts so long before it counts as resistance."),
        ("device/resistance.py", "PUSH_END_LIMIT_NS", "After a reversal the push has so long to end."),
        ("device/config.py", "StationConfig.reversal_s", "Resistance takes the arm back along the path by so much."),
        (
            "device/drive_health.py",
            "TEMPERATURE_MARGIN_C",
            "A drive warns so much below the temperature at which it switches off.",
        ),
        (
            "device/drive_health.py",
            "VOLTAGE_MARGIN_V",
            "A drive warns so much within the lowest and highest voltage of its supply.",
        ),
        ("device/drive_health.py", "WARNING_HOLD_S", "A warning remains for so long after its condition has ended."),
        ("station/drive_trend.py", "TREND_HOURS", "Voltage and temperature of the drives are kept for so long."),
        ("device/ipc_messages.py", "RESISTANCE_LEVELS", "Number of resistance levels."),
        ("device/range_override.py", "REDUCTION_STEP", "One press of Reduce range removes this share of the range."),
        ("device/range_override.py", "MIN_SHARE", "Reduce range leaves at least this share."),
        (
            "device/state_machine_base.py",
            "UNLOAD_AFTER_MINUTES",
            "A loaded recording that has not been started is unloaded after this time without a command.",
        ),
        ("device/loader.py", "CHECK_LIMIT_S", "A recording is checked within this time or refused."),
        ("device/journal_set.py", "_SYNC_NS", "The journal is synced to the disk so often."),
        ("station/device_process.py", "_RESTART_S", "Pauses before the device process is restarted."),
    ),
    "Login sessions": (
        (
            "settings.py",
            "Settings.idle_minutes",
            "The screen of a logged-in user locks after this time without activity.",
        ),
        ("settings.py", "Settings.login_session_hours", "A login session ends."),
        (
            "auth/login_session.py",
            "Limits.extension",
            "A login session that operates a moving arm is extended by at most this.",
        ),
        ("auth/login_session.py", "_RECENT", "A login or reauthentication counts as recent for so long."),
        (
            "auth/auth_cache.py",
            "_STOP_VALID_S",
            "A user who was authenticated within this time can stop without the database.",
        ),
        ("auth/login.py", "_CHECK_PERIOD_S", "Ended login sessions are looked for so often."),
        ("auth/throttle.py", "MOST_ATTEMPTS_BY_NAME", "Failed sign-ins of one user name before the first wait."),
        ("auth/throttle.py", "FIRST_WAIT_BY_NAME_S", "First wait of a user name. Each further failure doubles it."),
        ("auth/throttle.py", "LONGEST_WAIT_BY_NAME_S", "Longest wait of a user name."),
        ("auth/throttle.py", "MOST_ATTEMPTS_BY_ADDRESS", "Failed sign-ins from one address before the first wait."),
        ("auth/throttle.py", "FIRST_WAIT_BY_ADDRESS_S", "First wait of an address. Each further failure doubles it."),
        ("auth/throttle.py", "LONGEST_WAIT_BY_ADDRESS_S", "Longest wait of an address."),
        ("auth/accounts.py", "CODE_VALIDITY", "A one-time code is valid."),
        ("auth/set_up.py", "SET_UP_LINK_VALIDITY", "The set-up link is valid."),
        ("auth/passwords.py", "SHORTEST", "Shortest password, in characters."),
        ("auth/openid_provider.py", "_CONNECT_S", "The OpenID provider accepts a connection within this time."),
        ("auth/openid_router.py", "_PROVIDER_LIMIT_S", "The OpenID provider answers within this time."),
        ("clinic/restricted/service.py", "BREAK_GLASS_DURATION", "Break-glass access to a restricted record lasts."),
    ),
    "The database and the station's disk": (
        ("database/engine.py", "_CONNECT_TIMEOUT_S", "A connection to PostgreSQL takes at most this."),
        ("database/engine.py", "SERVICE_ANSWER_S", "The database answers within this time or counts as unavailable."),
        ("database/availability.py", "_RETRY_S", "An unavailable database is tried again so often."),
        ("database/delivery.py", "_LONGEST_PAUSE_S", "Longest pause between two deliveries of the spool."),
        ("database/spool.py", "_MAX_WAITING", "Records that may wait in memory while the disk is full."),
        ("clinic/sessions/offline_cache.py", "_REFRESH_S", "The offline cache is refreshed this often."),
        ("clinic/sessions/offline_cache.py", "_MAX_PATIENTS", "Most patients in the offline cache."),
        ("clinic/sessions/prefetch.py", "_MOST_SAMPLES", "Samples of them that are kept."),
        ("database/series.py", "BLOCK_SAMPLES", "Samples in one block."),
        ("plotting/downsampling.py", "LINE_POINTS", "Points of each line in an overview."),
        ("audit/deduplication.py", "WINDOW_S", "Equal audit entries within this time are one."),
    ),
    "The clinic": (
        ("station/fleet.py", "SILENT_AFTER_S", "Another station is shown as silent."),
        (
            "features/fleet/store.ts",
            "STATIONS_LOST_AFTER_MS",
            "The list of stations shows its connection as lost when no message has come.",
        ),
        (
            "features/fleet/store.ts",
            "STATIONS_RECONNECT_DELAYS_MS",
            "Delays before the attempts of the list of stations to reconnect.",
        ),
        (
            "features/fleet/store.ts",
            "STATIONS_OPEN_TIMEOUT_MS",
            "An attempt of the list of stations to connect that does not succeed within this time ends.",
        ),
        ("api/body_limits.py", "LARGEST_BODY", "Largest request, in bytes."),
        ("api/body_limits.py", "LARGEST_FILE", "Largest file to import, in bytes."),
        ("clinic/recordings/service.py", "SHORTEST_TAKE_S", "Shortest take."),
        ("clinic/programmes/schemas.py", "MOST_ITEMS", "Items in a programme."),
        ("interop/fhir_import.py", "MOST_PATIENTS", "Patients in one FHIR import."),
        ("backups/create.py", "KEEP_ALL_BACKUPS_DAYS", "Days for which all backups are kept."),
        ("backups/create.py", "KEEP_MONTHLY_BACKUP_MONTHS", "Months for which the first backup of each month is kept."),
        ("settings.py", "Settings.backup_time", "Time of the daily backup."),
    ),
}
"""File, constant (or class and field), and what the value limits."""

_SKIPPED: Final = re.compile(r"^(simulator|bench|evaluation|cli/seed|cli/demo|device/bus/dynamixel/registers)")
_UNIT: Final = re.compile(
    r"_(S|MS|NS|HZ|DEG|DEG_S|NM|BYTES|PERCENT|MINUTES|HOURS|DAYS)$|MOST|LONGEST|LARGEST|SHORTEST|^_?MAX_"
)


def limits() -> str:
    """Return the page of limits and timeouts."""
    tables = "\n\n".join(
        f"## {subject}\n\n| Limit | Value | Constant | File |\n|---|---|---|---|\n"
        + "\n".join(_row(file, constant, what) for file, constant, what in rows)
        for subject, rows in _SUBJECTS.items()
    )
    chosen = {(file, constant) for rows in _SUBJECTS.values() for file, constant, _ in rows}
    others = "\n".join(
        f"| `{name}` | {value} | `{_BACKEND}{file}` |" for file, name, value in _all() if (file, name) not in chosen
    )
    return f"""# Limits and timeouts

This page is generated by `python -m docs.generate`. Do not edit it.
Values are read from the source. The suffix of a constant is its unit. Fields of `StationConfig`, `Axis` and `Inputs` are defaults that the
[station's file](configuration.md) can change; fields of `Settings` can be changed in the [settings](settings.md).

{tables}

## Other constants of the backend

| Constant | Value | File |
|---|---|---|
{others}
"""


def _row(file: str, constant: str, what: str) -> str:
    path = (_PAGE if file.endswith((".ts", ".tsx")) else _BACKEND) + file
    return f"| {what} | {_value(path, constant)} | `{constant}` | `{path}` |"


def _value(path: str, constant: str) -> str:
    """Return a constant's value as it is shown.

    :raises KeyError: when the file does not define it.
    """
    text = (ROOT / path).read_text()
    if path.startswith(_PAGE):
        found = re.search(rf"const {constant}(?:: \w+)? = ([^;]+);", text)
        if not found:
            raise KeyError(f"{path}: {constant}")
        return _shown(constant, found[1].replace("_", "").removesuffix(" as const").strip("[]"))
    body = ast.parse(text).body
    owner, _, name = constant.rpartition(".")
    for one in list(body):
        if isinstance(one, ast.ClassDef) and owner in ("", one.name):
            body = one.body if owner else [*body, *one.body]
    for found_name, value in _assigned(body):
        if found_name == name:
            return _shown(name, value)
    raise KeyError(f"{path}: {constant}")


def _assigned(body: list[ast.stmt]) -> Iterator[tuple[str, str]]:
    """Yield name and value of each annotated or plain assignment."""
    for node in body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.value:
            yield node.target.id, ast.unparse(node.value)
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            yield node.targets[0].id, ast.unparse(node.value)


_UNITS: Final = {
    "": "", "S": "s", "MS": "ms", "NS": "ms", "MINUTES": "minutes", "HOURS": "hours", "DAYS": "days", "MONTHS": "months", "CYCLES": "cycles", "HZ": "Hz", "PER_S": "1/s",
    "PER_S2": "1/s²", "S2": "s²", "DEG": "deg", "DEG_S": "deg/s", "DEG_S2": "deg/s²", "NM": "Nm", "NM_S": "Nm/s", "N": "N", "V": "V", "C": "°C", "DEG_NM": "deg/Nm", "NM_RAD": "Nm/rad", "DEG_S_NM": "deg/(s·Nm)",
    "NM_DEG": "Nm/deg", "NM_S_DEG": "Nm·s/deg", "NM_S2_DEG": "Nm·s²/deg", "PERCENT": "%", "BYTES": "bytes", "BYTES_PER_S": "bytes/s", "MESSAGES_PER_S": "messages/s",
}  # fmt: skip
"""Unit by the last words of a constant's name. Nanoseconds are shown in ms."""
_UNIT_WORDS: Final = {word for words in _UNITS for word in words.split("_")} | {"KG", "M", "MM", "M2", "A", "RAD"}


def _unit(name: str) -> str:
    """Return the unit that the last words of a constant's name state, or "" if it has none.

    :raises ValueError: when the words are not in :data:`_UNITS`.
    """
    words = name.upper().rpartition(".")[2].strip("_").split("_")
    # A single word such as DAYS is a name.
    unit_words = list(itertools.takewhile(_UNIT_WORDS.__contains__, reversed(words if "PER" in words else words[1:])))
    unit = "_".join(reversed(unit_words))
    if unit not in _UNITS:
        raise ValueError(f"{name}: add the unit {unit} to _UNITS")
    return _UNITS[unit]


def _shown(name: str, value: str) -> str:
    """Return a value with its unit: from a number, a field's default or a timedelta."""
    default = re.match(r"Field\(default=([^,]+),", value)
    value = default[1] if default else value
    span = re.fullmatch(r"timedelta\((\w+)=([\d.]+)\)", value)
    if span:
        return f"1 {span[1].removesuffix('s')}" if span[2] == "1" else f"{span[2]} {span[1]}"
    unit = _unit(name)
    try:
        number = _number(ast.parse(value, mode="eval").body)
    except (ValueError, SyntaxError):
        return f"{value.strip('()').replace(chr(39), '')} {unit}".strip()
    if name.upper().endswith("_NS"):
        number /= 1_000_000
    shown = f"{number:,.10g}" if isinstance(number, float) else f"{number:,}"
    return f"{shown} {unit}".strip()


def _number(node: ast.expr) -> int | float:
    """Return the value of a number or of an arithmetic expression of numbers.

    :raises ValueError: when the expression is another one.
    """
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return value
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -_number(inner)
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            return _number(left) * _number(right)
        case ast.BinOp(left=left, op=ast.LShift(), right=right):
            return int(_number(left)) << int(_number(right))
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return _number(left) / _number(right)
    raise ValueError("no number")


def _all() -> Iterator[tuple[str, str, str]]:
    """Yield file, name and value of every numeric constant with a unit or a limit in its name."""
    for path in sorted((ROOT / _BACKEND).rglob("*.py")):
        file = path.relative_to(ROOT / _BACKEND).as_posix()
        if _SKIPPED.match(file):
            continue
        for name, value in _assigned(ast.parse(path.read_text()).body):
            if not (name.isupper() and _UNIT.search(name)):
                continue
            try:
                _number(ast.parse(value, mode="eval").body)
            except (ValueError, SyntaxError):
                continue
            yield file, name, _shown(name, value)
