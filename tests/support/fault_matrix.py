"""The fault matrix: the required effect, cause and time limit of each fault kind of each signal in each mode.

Seven kinds, thirty signals, nine modes. This table is the requirement; test_matrix.py runs its cells: `make test`
with one of the five motors for each kind of each signal, `make campaign` with the other four.
"""

from dataclasses import dataclass
from typing import Final, Literal

from kata.device.ipc_messages import Mode

Kind = Literal["off", "stuck", "garbage", "wrong", "slow", "delayed", "intermittent"]
KINDS: Final[tuple[Kind, ...]] = ("off", "stuck", "garbage", "wrong", "slow", "delayed", "intermittent")
"""off: nothing, or zero. stuck: the last value forever. garbage: impossible values, or invalid bytes. wrong: valid, plausible and
false. slow: one in five cycles. delayed: correct, but late (angles and currents
by 100 ms, replies by 150 ms, heartbeats by 600 ms). intermittent: every other cycle. Registers and torque
reports arrive with the status, so they have its delays."""

SIGNALS: Final = (
    *(f"position {motor}" for motor in range(1, 6)),
    *(f"current {motor}" for motor in range(1, 6)),
    *(f"reply {motor}" for motor in range(1, 6)),
    *(f"registers {motor}" for motor in range(1, 6)),
    *(f"torque {motor}" for motor in range(1, 6)),
    "e-stop",
    "second contact",
    "pedal",
    "bus",
    "service",
)

MODES: Final[tuple[Mode, ...]] = (
    "offline",
    "idle",
    "teaching",
    "ready",
    "approaching",
    "playing",
    "paused",
    "returning",
    "stopped",
)
_RESTING: Final[tuple[Mode, ...]] = ("idle", "ready", "teaching")
_MOVING: Final[tuple[Mode, ...]] = ("approaching", "playing", "returning")
_ENERGISED: Final[tuple[Mode, ...]] = (*_MOVING, "paused")


@dataclass(frozen=True)
class Stops:
    """The apparatus stops for this cause, with torque off (or the mode stopped, if torque was off) within this time."""

    cause: str
    within_ms: int


@dataclass(frozen=True)
class Continues:
    """The apparatus does not stop: the fault is harmless here, or not detectable from this signal."""


@dataclass(frozen=True)
class StaysOffline:
    """The apparatus stays offline while the fault is present."""


@dataclass(frozen=True)
class ProcessEnds:
    """The device process ends without torque."""


Expected = Stops | Continues | StaysOffline | ProcessEnds
Row = dict[Mode, Expected]

_CYCLE = 10
_RAMP = 200


def _row(
    *,
    offline: Expected | None = None,
    resting: Expected | None = None,
    moving: Expected | None = None,
    paused: Expected | None = None,
    stopped: Expected | None = None,
) -> Row:
    """Modes that are not given continue."""
    row: Row = dict.fromkeys(MODES, Continues())
    row["offline"] = offline or Continues()
    row.update(dict.fromkeys(_RESTING, resting or Continues()))
    row.update(dict.fromkeys(_MOVING, moving or Continues()))
    row["paused"] = paused or Continues()
    row["stopped"] = stopped or Continues()
    return row


def _always(cause: str, within_ms: int, *, offline: Expected) -> Row:
    """Return a row that stops in every mode. In ``stopped`` the fault becomes a further cause."""
    stops = Stops(cause, within_ms)
    return _row(offline=offline, resting=stops, moving=stops, paused=stops, stopped=stops)


def _energised(cause: str, within_ms: int, *, paused: bool = True, resting: Expected | None = None) -> Row:
    """Return a row that stops in every mode with torque. At rest some faults only show at the next movement."""
    stops = Stops(cause, within_ms)
    return _row(resting=resting, moving=stops, paused=stops if paused else None)


_HARMLESS: Final = _row()
_WAITS: Final = StaysOffline()

_POSITION: Final[dict[Kind, Row]] = {
    "off": _energised("position_jump", 2 * _CYCLE),
    # A constant angle is only detected when the setpoint moves.
    "stuck": _energised("position_frozen", 3000, paused=False),
    "garbage": _energised("position_jump", 3 * _CYCLE),
    "wrong": _energised("position_jump", 2 * _CYCLE),
    "slow": _HARMLESS,
    "delayed": _HARMLESS,
    "intermittent": _energised("position_jump", 2 * _CYCLE),
}
_CURRENT: Final[dict[Kind, Row]] = {
    # Missing current is a weak motor: the following error shows it, if it matters.
    "off": _HARMLESS,
    "stuck": _HARMLESS,
    "garbage": _energised("overtorque", 100 + 3 * _CYCLE),
    "wrong": _energised("overtorque", 100 + 3 * _CYCLE),
    "slow": _HARMLESS,
    "delayed": _HARMLESS,
    # A good cycle clears the count.
    "intermittent": _HARMLESS,
}
_REPLY: Final[dict[Kind, Row]] = {
    "off": _always("drive_silent", 100 + 3 * _CYCLE, offline=_WAITS),
    # The same valid answer repeatedly: its angle is constant.
    "stuck": _energised("position_frozen", 3000, paused=False),
    "garbage": _always("drive_garbled", 100 + 3 * _CYCLE, offline=_WAITS),
    "wrong": _always("drive_silent", 100 + 3 * _CYCLE, offline=_WAITS),
    "slow": _HARMLESS,
    "delayed": _always("drive_silent", 100 + 3 * _CYCLE, offline=_WAITS),
    "intermittent": _HARMLESS,
}
_ESTOP: Final[dict[Kind, Row]] = {
    "off": _always("estop_unknown", 4 * _CYCLE, offline=_WAITS),
    # A contact that sticks closed reads as closed. The test before a session finds it.
    "stuck": _HARMLESS,
    "garbage": _always("estop_pressed", 10 * _CYCLE, offline=Stops("estop_pressed", 300)),
    "wrong": _always("estop_pressed", _CYCLE, offline=Stops("estop_pressed", 300)),
    # It is known at times, so that the apparatus becomes ready, and stops.
    "slow": _always("estop_unknown", 6 * _CYCLE, offline=Stops("estop_unknown", 300)),
    "delayed": _always("estop_unknown", 4 * _CYCLE, offline=_WAITS),
    "intermittent": _HARMLESS,
}
_STATUS: Final = 6 * _CYCLE
"""Each drive sends its status every fifth cycle."""
# A drive's registers, compared with the configuration.
_REGISTERS: Final[dict[Kind, Row]] = {
    # Not read yet: no difference is known, but nothing starts.
    "off": _row(offline=_WAITS),
    "stuck": _HARMLESS,
    "garbage": _always("drive_reset", _STATUS, offline=_WAITS),
    # Offline nothing has started: the drive is configured, and the apparatus becomes ready.
    "wrong": _always("drive_reset", _STATUS, offline=Continues()),
    "slow": _HARMLESS,
    "delayed": _HARMLESS,
    "intermittent": _always("drive_reset", 2 * _STATUS, offline=Stops("drive_reset", 300)),
}
# A drive's report of its torque. Torque that is on is never shown as off.
_FOUND: Final = Stops("torque_found", 300)
_TORQUE_WORD: Final[dict[Kind, Row]] = {
    "off": _always("drive_silent", 1000 + 3 * _CYCLE, offline=_WAITS),
    "stuck": _HARMLESS,
    "garbage": _energised("torque_lost", 400, resting=Stops("torque_remains", 400))
    | {"offline": _FOUND, "stopped": Stops("torque_remains", 400)},
    "wrong": _energised("torque_lost", _STATUS, resting=Stops("torque_remains", _STATUS))
    | {"offline": _FOUND, "stopped": Stops("torque_remains", _STATUS)},
    "slow": _HARMLESS,
    "delayed": _HARMLESS,
    "intermittent": _energised("torque_lost", 2 * _STATUS, resting=Stops("torque_remains", 2 * _STATUS))
    | {"offline": _FOUND, "stopped": Stops("torque_remains", 2 * _STATUS)},
}
_SECOND_CONTACT: Final[dict[Kind, Row]] = {
    # A broken wire reads as an unpressed switch. The test before a session finds it.
    "off": _HARMLESS,
    "stuck": _HARMLESS,
    # A reading in which the contacts differ clears the count.
    "garbage": _HARMLESS,
    "wrong": _always("contacts_disagree", 100 + 3 * _CYCLE, offline=Stops("contacts_disagree", 300)),
    "slow": _HARMLESS,
    "delayed": _HARMLESS,
    "intermittent": _HARMLESS,
}
# The pedal stops nothing: it records samples. Other tests have its safety rules.
_PEDAL: Final[dict[Kind, Row]] = dict.fromkeys(KINDS, _HARMLESS)
_BUS: Final[dict[Kind, Row]] = {
    "off": _always("bus_lost", _CYCLE, offline=_WAITS),
    # Old answers have their old time.
    "stuck": _always("estop_unknown", 4 * _CYCLE, offline=_WAITS),
    "garbage": _always("estop_unknown", 4 * _CYCLE, offline=_WAITS),
    "wrong": _always("estop_unknown", 4 * _CYCLE, offline=_WAITS),
    "slow": _always("estop_unknown", 6 * _CYCLE, offline=_WAITS),
    "delayed": _always("estop_unknown", 4 * _CYCLE, offline=_WAITS),
    "intermittent": _HARMLESS,
}
_GONE: Final = _energised("service_silent", _RAMP + 3 * _CYCLE, resting=ProcessEnds())
_GONE_EVERYWHERE: Final = _GONE | {"offline": ProcessEnds(), "stopped": ProcessEnds()}
_SERVICE: Final[dict[Kind, Row]] = {
    "off": _GONE_EVERYWHERE,
    "stuck": _energised("service_silent", 500 + _RAMP + 3 * _CYCLE),
    # The connection is closed after a message that cannot be decoded.
    "garbage": _GONE_EVERYWHERE,
    "wrong": _energised("other_run", _RAMP + 6 * _CYCLE),
    "slow": _HARMLESS,
    "delayed": _energised("service_silent", 500 + _RAMP + 3 * _CYCLE),
    "intermittent": _HARMLESS,
}
_TABLES: Final = {
    "position": _POSITION,
    "current": _CURRENT,
    "reply": _REPLY,
    "registers": _REGISTERS,
    "torque": _TORQUE_WORD,
    "e-stop": _ESTOP,
    "second": _SECOND_CONTACT,
    "pedal": _PEDAL,
    "bus": _BUS,
    "service": _SERVICE,
}


def expected(kind: Kind, signal: str, mode: Mode) -> Expected:
    """Return the requirement of a cell; a missing cell is an error."""
    return _TABLES[signal.split()[0]][kind][mode]
