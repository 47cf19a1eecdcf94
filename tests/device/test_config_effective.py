"""Each accepted configuration keeps the supervisor effective, and every drive register computed from it fits its field."""

from pathlib import Path
from typing import Any, Final

import pytest
from hypothesis import given

from kata.device.config_rules import RANGES
from tests.support.effective_config import BASES, accepted, changes, fields_of, hold_effective, rows, set_value
from tests.support.examples import examples

# -- an apparatus in which one thing is wrong -----------------------------------------------------------------------


# -- configurations in and around what is accepted ------------------------------------------------------------------


@given(changes())
@examples(few=50, many=300)
def test_each_accepted_configuration_keeps_the_supervisor_effective(
    tmp_path_factory: pytest.TempPathFactory, fields: dict[str, Any]
) -> None:
    config = accepted(tmp_path_factory.mktemp("station"), fields)
    if config is not None:
        hold_effective(config)


@pytest.mark.parametrize("base", BASES)
def test_both_ends_of_every_range_keep_the_supervisor_effective(tmp_path: Path, base: str) -> None:
    refused = set()
    for row in rows(base):
        for value in (row.low, row.high):
            fields = fields_of(base)
            set_value(fields, row, value)
            config = accepted(tmp_path, fields)
            if config is None:
                refused.add(row.field)
                continue
            hold_effective(config)
    assert refused <= NEEDS_OTHERS, "the end of a range that nothing can have is no range"


NEEDS_OTHERS: Final = {
    "baud", "rate_hz", "cycle_hz", "return_delay_us", "silence_ms", "following_error_ms", "bus_watchdog_ms",
    "inputs.drive_id", "inputs.estop_port", "inputs.estop_second_port", "inputs.pedal_port",
    "inputs.contacts_disagree_ms", "inputs.max_age_cycles", "axes.id",
    "axes.max_acceleration_deg_s2", *(f"axes[{motor}].{end}" for motor in range(1, 6) for end in ("min_deg", "max_deg")),
    *(row.field for row in RANGES if row.field.startswith("modbus.")),
}  # fmt: skip
"""Fields whose end of range is only possible with other values of other fields."""
