"""The reference of a station's file, written from the tables in :mod:`kata.device.config_rules`."""

from typing import Any, Final

import msgspec

from kata.device.config import Axis, Inputs, ModbusMap, StationConfig
from kata.device.config_rules import RANGES, RULES, Range

_HOLDERS: Final[dict[str, type[msgspec.Struct]]] = {
    "": StationConfig,
    "inputs": Inputs,
    "axes": Axis,
    "modbus": ModbusMap,
}


def configuration() -> str:
    """Return the page docs/configuration.md."""
    return f"""# The station's file

Generated from the tables in `backend/kata/device/config_rules.py` by `python -m kata.device.documentation docs`.

A station has one TOML file (`kata serve --station FILE.toml`). It is read once, at start. A field that is left out has its default. An
unknown field, a value of the wrong type, a value outside its range or a broken rule is refused with a message that names field, value
and range; nan and inf are outside every range. Axes are written as `[[axes]]` five times and counted from 1 in messages.

Use two contacts for the emergency stop where you can (`inputs.estop_port` normally closed, `inputs.estop_second_port` normally open): a
lost port mode, a short circuit or a welded contact is noticed only when the two must always differ.

## Numbers

| Field | Default | Range | Why |
|---|---|---|---|
{chr(10).join(map(_row, RANGES))}

## Words

| Field | Default | Values |
|---|---|---|
| `name` | `Station 1` | 1 to 100 printable characters |
| `side` | `right` | `left`, `right`: the shoulder that the apparatus stands for |
| `port` | `/dev/ttyUSB0` | the path of the serial port; prefer `/dev/serial/by-id/...` |
| `protocol` | `dynamixel` | `dynamixel`, `modbus` |
| `inputs.usb_pedal` | none | an absolute path, as `/dev/input/by-id/...-event-kbd` |
| `modbus.function_23` | `true` | `true`, `false`: the drives know function 23 |

## Rules between fields

| Rule | Why |
|---|---|
{chr(10).join(f"| {rule.text} | {rule.reason} |" for rule in RULES)}
"""


def _row(one: Range) -> str:
    field = f"`{one.field}`" + (f" ({one.protocol})" if one.protocol else "")
    return f"| {field} | {_default(one)} | {one.shown} | {one.reason} |"


def _default(one: Range) -> str:
    holder, _, name = one.field.rpartition(".")
    if holder.startswith("axes["):
        axis = StationConfig().axes[int(holder[len("axes[") : -1]) - 1]
        return f"{getattr(axis, name):g}"
    field = next(field for field in msgspec.structs.fields(_HOLDERS[holder]) if field.name == name)
    return _shown(field.default)


def _shown(value: Any) -> str:
    if value is msgspec.NODEFAULT:
        return "required"
    return "none" if value is None else f"{value:,}" if isinstance(value, int) else f"{value:g}"
