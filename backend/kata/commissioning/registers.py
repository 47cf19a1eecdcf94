"""Step 2: checks each drive, then writes and verifies every configured register."""

from typing import Final

from kata.commissioning import texts
from kata.commissioning.drive_line import DriveLine
from kata.commissioning.ids import check_answers
from kata.commissioning.live_drives import live_drives
from kata.commissioning.workbench import ManualAction, StepError, Workbench, naming_drive
from kata.device.bus.dynamixel.configuration import model_problem
from kata.device.bus.dynamixel.models import MODELS
from kata.device.bus.dynamixel.registers import FIRMWARE, TORQUE_ENABLE, configured_registers
from kata.device.config import Axis
from kata.motion.axes import AXES

_TEMPERATURE_LIMIT: Final = 31
_SHUTDOWN_MARGIN_C: Final = 30
"""An unused drive must be at least this far below the temperature at which it switches off (80 deg C by default)."""
_HARDWARE_ERROR: Final = 70
_VOLTAGE: Final = 144
_TEMPERATURE: Final = 146


def write_registers(workbench: Workbench) -> None:
    """Check model, firmware, voltage and temperature of each drive. Write and verify the registers of all drives."""
    before: dict[tuple[int, str], bytes] = {}
    with workbench.line() as line:
        _let_go(workbench, line)
        for motor, axis in zip(AXES, workbench.draft.axes, strict=True):
            with naming_drive(motor, axis.id):
                workbench.add_value("damaged_answers_percent", motor, after=check_answers(line, motor, axis.id))
                _check_drive(workbench, line, motor, axis)
                for register in configured_registers(workbench.draft, axis):
                    before[motor, register.name] = line.read(axis.id, register.address, len(register.data))
    # The driver writes the registers and reads each one back. Its verification then reads all of them again.
    with live_drives(workbench, share=1.0):
        pass
    with workbench.line() as line:
        for motor, axis in zip(AXES, workbench.draft.axes, strict=True):
            for register in configured_registers(workbench.draft, axis):
                with naming_drive(motor, axis.id):
                    now = line.read(axis.id, register.address, len(register.data))
                if now != before[motor, register.name]:
                    workbench.add_value(
                        register.name, motor, before=before[motor, register.name].hex(), after=now.hex()
                    )


def _let_go(workbench: Workbench, line: DriveLine) -> None:
    """Switch torque off. If a drive has torque, it may hold an arm: first wait until the technician supports the arm."""
    for motor, axis in zip(AXES, workbench.draft.axes, strict=True):
        with naming_drive(motor, axis.id):
            (torque,) = line.read(axis.id, TORQUE_ENABLE, 1)
        if torque:
            workbench.confirm(ManualAction("support_arm", texts.SUPPORT_ARM(motor=motor), motor))
            break
    for motor, axis in zip(AXES, workbench.draft.axes, strict=True):
        with naming_drive(motor, axis.id):
            line.write(axis.id, TORQUE_ENABLE, b"\0")


def _check_drive(workbench: Workbench, line: DriveLine, motor: int, axis: Axis) -> None:
    model = int.from_bytes(line.read(axis.id, 0, 2), "little")
    (firmware,) = line.read(axis.id, FIRMWARE, 1)
    if problem := model_problem(motor, axis, model, firmware):
        raise StepError(problem)
    volt = int.from_bytes(line.read(axis.id, _VOLTAGE, 2), "little") / 10
    lowest, highest = MODELS[model].volts
    if volt < lowest:
        raise StepError(texts.VOLTAGE_LOW(motor=motor, volt=volt, least=lowest))
    if volt > highest:
        raise StepError(texts.VOLTAGE_HIGH(motor=motor, volt=volt, most=highest))
    (celsius,) = line.read(axis.id, _TEMPERATURE, 1)
    (limit,) = line.read(axis.id, _TEMPERATURE_LIMIT, 1)
    if celsius > limit - _SHUTDOWN_MARGIN_C:
        raise StepError(texts.DRIVE_TOO_WARM(motor=motor, celsius=celsius))
    (error,) = line.read(axis.id, _HARDWARE_ERROR, 1)
    if error:
        raise StepError(texts.HARDWARE_ERROR_FOUND(motor=motor, code=error))
    for name, value in (("model", model), ("firmware", firmware), ("voltage_v", volt), ("temperature_c", celsius)):
        workbench.add_value(name, motor, after=value)
