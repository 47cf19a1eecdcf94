"""Lists the fields of a station's configuration with their units, and the differences between two configurations."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import msgspec

from kata.device.config import StationConfig
from kata.device.config_rules import RANGES, Range

_AXES: Final = "axes"
_UNITS: Final = {"inertia": "kg m2, kg m, kg", "girdle_nm_rad": "Nm/rad", "balancer_m": "m"}
"""Of fields that have no range of their own."""


@dataclass(frozen=True)
class ConfigField:
    """One field. ``name`` is written as in messages, with axes counted from 1. ``accepted`` is None for a text."""

    name: str
    value: str
    unit: str
    accepted: Range | None


@dataclass(frozen=True)
class FieldChange:
    """A field that differs. ``before`` or ``after`` is empty if only the other configuration has the field."""

    name: str
    unit: str
    before: str
    after: str


def fields_of(config: StationConfig) -> list[ConfigField]:
    """Return every field. Registers of Modbus drives are omitted if the station has other drives."""
    fields = []
    for name, value in _flat(msgspec.to_builtins(config)):
        if name.startswith("modbus.") and config.protocol != "modbus":
            continue
        accepted = _range_of(name, config.protocol)
        unit = accepted.unit if accepted else _UNITS.get(name.rpartition(".")[2], "")
        fields.append(ConfigField(name, _shown(value), unit, accepted))
    return fields


def changes_between(before: StationConfig, after: StationConfig) -> list[FieldChange]:
    """Return the fields that differ, in the order of the file."""
    old, new = ({field.name: field for field in fields_of(config)} for config in (before, after))
    changes = []
    for name in {**old, **new}:
        first, second = old.get(name), new.get(name)
        values = first.value if first else "", second.value if second else ""
        if values[0] != values[1]:
            unit = (first or second or ConfigField(name, "", "", None)).unit
            changes.append(FieldChange(name, unit, *values))
    return changes


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, part in value.items():
            yield from _flat(part, f"{name}.{key}" if name else key)
    elif name == _AXES:
        for motor, axis in enumerate(value, start=1):
            yield from _flat(axis, f"{_AXES}[{motor}]")
    else:
        yield name, value


def _range_of(name: str, protocol: str) -> Range | None:
    """Return the range of a field, or None. A range for this axis takes precedence over a range for all axes."""
    holder, _, field = name.rpartition(".")
    general = f"{_AXES}.{field}" if holder.startswith(_AXES) else name
    ranges = [accepted for accepted in RANGES if accepted.protocol in (None, protocol)]
    for wanted in (name, general):
        for accepted in ranges:
            if accepted.field == wanted:
                return accepted
    return None


def _shown(value: Any) -> str:
    match value:
        case None:
            return ""
        case bool():
            return "true" if value else "false"
        case list() | tuple():
            return ", ".join(_shown(part) for part in value)
        case float():
            return f"{value:.10g}"
        case _:
            return str(value)
