"""Configures Dynamixel drives: writes every register that the station's configuration determines, and reads it back."""

from collections.abc import Sequence
from typing import Final

from kata.device import texts
from kata.device.bus.dynamixel.models import MIN_FIRMWARE, MODELS, known_models
from kata.device.bus.dynamixel.registers import BUS_WATCHDOG, FIRMWARE, TORQUE_ENABLE, Register
from kata.device.bus.dynamixel.requests import DynamixelRequests
from kata.device.bus.interface import BusError
from kata.device.config import Axis
from kata.messages import Text

_NO_TORQUE: Final = Register("torque enable", TORQUE_ENABLE, b"\0")


class DynamixelConfiguration(DynamixelRequests):
    """Finds the drives and configures them."""

    def _configure(self, motor: int, axis: Axis, registers: Sequence[Register]) -> None:
        self._require_one_drive(motor, axis.id)
        model, *others = registers
        self._check_model(motor, axis, model)
        if self._register(motor, axis.id, _NO_TORQUE) != _NO_TORQUE.data:
            raise BusError(texts.DRIVE_HAS_TORQUE(motor=motor, drive_id=axis.id))
        self._write(motor, axis.id, BUS_WATCHDOG, b"\0")
        for register in others:
            # EEPROM cells wear, so a register is written only if its value differs.
            if register.address >= TORQUE_ENABLE or self._register(motor, axis.id, register) != register.data:
                self._write(motor, axis.id, register.address, register.data)
            if self._register(motor, axis.id, register) != register.data:
                raise BusError(texts.DRIVE_SETTING_REFUSED(motor=motor, drive_id=axis.id, setting=register.name))

    def _check_model(self, motor: int, axis: Axis, model: Register) -> None:
        number = int.from_bytes(self._register(motor, axis.id, model), "little")
        (firmware,) = self._register(motor, axis.id, Register("firmware version", FIRMWARE, b"\0"))
        if problem := model_problem(motor, axis, number, firmware):
            raise BusError(problem)


def model_problem(motor: int, axis: Axis, model: int, firmware: int) -> Text | None:
    """Return why a drive with this model number and firmware is not suitable for this axis; None if it is."""
    if model not in MODELS:
        return texts.DRIVE_UNKNOWN_MODEL(motor=motor, drive_id=axis.id, model=model, known=known_models())
    if model != axis.model:
        return texts.DRIVE_OTHER_MODEL(motor=motor, drive_id=axis.id, model=model, wanted=axis.model)
    if firmware < MIN_FIRMWARE:
        return texts.DRIVE_OLD_FIRMWARE(motor=motor, drive_id=axis.id, firmware=firmware, oldest=MIN_FIRMWARE)
    return None
