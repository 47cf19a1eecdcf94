"""The X-series models that the driver knows, with the figures of their data sheets.

Source: ROBOTIS e-Manual, page of each model, "Specifications" (stall torque and current at the recommended voltage) and
"Control Table of EEPROM Area" (model number). All models have current control and a current unit of 2.69 mA.
"""

from typing import Final, NamedTuple

AMPERE_PER_UNIT: Final = 0.00269
MIN_FIRMWARE: Final = 38
"""Older firmware has no bus watchdog and no drive mode (e-Manual, addresses 10 and 98)."""


class DriveModel(NamedTuple):
    """One model. ``stall_nm`` and ``stall_a`` are torque and current with the shaft blocked."""

    name: str
    stall_nm: float
    stall_a: float
    volts: tuple[float, float] = (10.0, 14.8)
    """Lowest and highest supply voltage: "Input Voltage" in the specifications."""

    @property
    def nm_per_a(self) -> float:
        """Return the torque constant in N m/A, as the e-Manual calculates it: stall torque divided by stall current."""
        return self.stall_nm / self.stall_a


_VOLTS_24: Final = (21.6, 26.4)
"""The e-Manual states only 24.0 V. The tolerance of 10 % is our assumption."""

MODELS: Final = {
    1020: DriveModel("XM430-W350", 4.1, 2.3),
    1030: DriveModel("XM430-W210", 3.0, 2.3),
    1100: DriveModel("XH540-W270", 9.9, 4.9),
    1110: DriveModel("XH540-W150", 7.1, 4.9),
    1120: DriveModel("XM540-W270", 10.6, 4.4),
    1130: DriveModel("XM540-W150", 7.3, 4.4),
    1140: DriveModel("XH540-V270", 9.2, 2.4, _VOLTS_24),
    1150: DriveModel("XH540-V150", 6.4, 2.4, _VOLTS_24),
}
"""Models by the model number in registers 0 and 1."""


def known_models() -> str:
    """Return numbers and names of all models, for messages."""
    return ", ".join(f"{number} ({model.name})" for number, model in MODELS.items())
