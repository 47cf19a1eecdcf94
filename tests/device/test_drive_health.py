"""Supply voltage and temperature of the drives, and the warnings before their own limits."""

import pytest
from msgspec import structs

from kata.device.bus.interface import DriveHealth
from kata.device.drive_health import TEMPERATURE_MARGIN_C, VOLTAGE_MARGIN_V, WARNING_HOLD_S
from tests.support.stepped import Stepped

WELL = DriveHealth(0, 2, 12.0, 40.0, min_voltage_v=9.5, max_voltage_v=16.0, max_temperature_c=80.0)


def shown(stepped: Stepped) -> list[tuple[str, int]]:
    """Return code and motor of the warnings in the next snapshot."""
    stepped.forward(0.1)
    return [(warning.code, warning.motor) for warning in stepped.snapshot.warnings]


def test_values_are_in_the_snapshot_and_unknown_when_old(stepped: Stepped) -> None:
    stepped.apparatus.health = {2: WELL}
    stepped.forward(0.1)
    axes = stepped.snapshot.axes
    assert [(axis.voltage_v, axis.temperature_c) for axis in axes] == [(None, None)] * 2 + [(12.0, 40.0)] + [
        (None, None)
    ] * 2
    assert stepped.snapshot.warnings == ()
    stepped.apparatus.health = {}
    stepped.forward(9.8)
    assert stepped.snapshot.axes[2].temperature_c == 40.0
    stepped.forward(0.5)
    assert stepped.snapshot.axes[2].temperature_c is None


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"temperature_c": 80.0 - TEMPERATURE_MARGIN_C}, "drive_hot"),
        ({"temperature_c": 79.9 - TEMPERATURE_MARGIN_C}, None),
        ({"voltage_v": 9.5 + VOLTAGE_MARGIN_V}, "supply_low"),
        ({"voltage_v": 9.6 + VOLTAGE_MARGIN_V}, None),
        ({"voltage_v": 16.0 - VOLTAGE_MARGIN_V}, "supply_high"),
        ({"voltage_v": 15.9 - VOLTAGE_MARGIN_V}, None),
        ({"temperature_c": 99.0, "max_temperature_c": None}, None),
        ({"voltage_v": 1.0, "min_voltage_v": None}, None),
        ({"voltage_v": None, "temperature_c": None}, None),
    ],
)
def test_drive_warns_within_a_margin_of_its_own_limits(
    stepped: Stepped, change: dict[str, float | None], code: str | None
) -> None:
    stepped.apparatus.health = {2: structs.replace(WELL, **change)}
    assert shown(stepped) == ([(code, 3)] if code else [])


def test_warning_names_motor_value_and_limit_and_is_one_event(playing: Stepped) -> None:
    playing.apparatus.health = {2: structs.replace(WELL, temperature_c=72.0)}
    playing.forward(1.0)
    (warning,) = playing.snapshot.warnings
    assert warning.message == "Motor 3 has reached 72 °C. It switches off above 80 °C."
    assert warning.message_key is not None and warning.next_step_key is not None
    assert [event.message for event in playing.link.events if event.code == "drive_warning"] == [warning.message]


def test_a_warning_is_no_stop(playing: Stepped) -> None:
    playing.apparatus.health = {2: structs.replace(WELL, temperature_c=79.0, voltage_v=9.6)}
    playing.forward(1.0)
    assert playing.mode == "playing"
    assert playing.causes() == []
    assert playing.torque


def test_warning_remains_for_a_while_after_its_condition(stepped: Stepped) -> None:
    stepped.apparatus.health = {2: structs.replace(WELL, voltage_v=9.8)}
    assert shown(stepped) == [("supply_low", 3)]
    stepped.apparatus.health = {2: WELL}
    stepped.forward(WARNING_HOLD_S - 0.3)
    assert shown(stepped) == [("supply_low", 3)]
    stepped.forward(0.3)
    assert shown(stepped) == []
    # The next time is another event.
    stepped.apparatus.health = {2: structs.replace(WELL, voltage_v=9.8)}
    stepped.forward(0.1)
    assert [event.code for event in stepped.link.events].count("drive_warning") == 2


def test_warnings_of_several_drives_are_in_axis_order(stepped: Stepped) -> None:
    hot, low = structs.replace(WELL, temperature_c=75.0, axis=4), structs.replace(WELL, voltage_v=9.6, axis=1)
    both = structs.replace(WELL, temperature_c=75.0, voltage_v=9.6, axis=3)
    stepped.apparatus.health = {4: hot, 1: low, 3: both}
    assert shown(stepped) == [("supply_low", 2), ("drive_hot", 4), ("supply_low", 4), ("drive_hot", 5)]
