"""Step 1: finds the drives and sets id and baud rate of each, one drive at a time."""

from typing import Final

from msgspec import structs

from kata.commissioning import texts
from kata.commissioning.axes import MOTION_TEXTS
from kata.commissioning.drive_line import DriveLine, FoundDrive, LineError
from kata.commissioning.workbench import FACTORY_BAUD, ManualAction, StepError, Workbench, naming_drive
from kata.device.bus.dynamixel.registers import TORQUE_ENABLE
from kata.motion.axes import AXES

BAUD_CODES: Final = {
    9_600: 0,
    57_600: 1,
    115_200: 2,
    1_000_000: 3,
    2_000_000: 4,
    3_000_000: 5,
    4_000_000: 6,
    4_500_000: 7,
}
"""Values of register 8 (ROBOTIS e-Manual)."""
_ID: Final = 7
_BAUD: Final = 8
_PRESENT: Final = 120
_PRESENT_BYTES: Final = 27
"""Registers that differ between two drives: tick, current, velocity, position, voltage, temperature."""
_TRIES: Final = 25
_TOLERATED_SHARE: Final = 0.04
"""Tolerated share of damaged answers. A good bus has none. One damaged answer in the sample is tolerated."""


def assign_ids(workbench: Workbench) -> None:
    """Set the drives' ids to 1 to 5, and the station's baud rate. If all drives have them already, change nothing."""
    workbench.confirm(ManualAction("connect_all", texts.CONNECT_ALL()))
    if not _all_have_their_ids(workbench):
        for motor in AXES:
            _assign(workbench, motor)
        workbench.confirm(ManualAction("connect_all", texts.CONNECT_ALL()))
    with workbench.line() as line:
        for motor in AXES:
            check_answers(line, motor, motor)
    workbench.change_axes(lambda motor, axis: structs.replace(axis, id=motor))


def _all_have_their_ids(workbench: Workbench) -> bool:
    """Return True if exactly the ids 1 to 5 answer at the station's baud rate, and no drive answers at the factory's baud rate."""
    with workbench.line() as line:
        if sorted(line.find()) != list(AXES):
            return False
        try:
            for motor in AXES:
                line.read(motor, _PRESENT, _PRESENT_BYTES)
        except LineError:
            return False
    if workbench.draft.baud == FACTORY_BAUD:
        return True
    with workbench.line(FACTORY_BAUD) as line:
        return not line.find()


def _assign(workbench: Workbench, motor: int) -> None:
    text = texts.CONNECT_ONLY(motor=motor, motion=MOTION_TEXTS[motor]())
    workbench.confirm(ManualAction("connect_only", text, motor))
    drive = _search(workbench, motor)
    with workbench.line(drive.baud) as line:
        check_answers(line, motor, drive.drive_id)
        with naming_drive(motor, drive.drive_id):
            line.write(drive.drive_id, TORQUE_ENABLE, b"\0")
            if drive.drive_id != motor:
                line.write(drive.drive_id, _ID, bytes([motor]))
            if drive.baud != workbench.draft.baud:
                line.write(motor, _BAUD, bytes([BAUD_CODES[workbench.draft.baud]]))
    with workbench.line() as line:
        try:
            now = line.read(motor, _ID, 2)
        except LineError as error:
            raise StepError(texts.ID_NOT_TAKEN(motor=motor)) from error
    if now != bytes([motor, BAUD_CODES[workbench.draft.baud]]):
        raise StepError(texts.ID_NOT_TAKEN(motor=motor))
    workbench.add_value("id", motor, before=drive.drive_id, after=motor)
    workbench.add_value("baud", motor, before=drive.baud, after=workbench.draft.baud)


def _search(workbench: Workbench, motor: int) -> FoundDrive:
    """Return the only drive on the bus, at any baud rate and id."""
    first = (FACTORY_BAUD, workbench.draft.baud)
    for baud in (*first, *(rate for rate in BAUD_CODES if rate not in first)):
        with workbench.line(baud) as line:
            drives = line.find()
            if len(drives) > 1:
                raise StepError(texts.SEVERAL_DRIVES_FOUND(drives=len(drives), motor=motor))
            if drives:
                return next(iter(drives.values()))
            if line.damaged:
                # Several drives answered at once, or noise hid the answer.
                raise StepError(texts.DRIVES_ANSWER_TOGETHER(drive_id=1, motor=motor))
    raise StepError(texts.NO_DRIVE_FOUND(motor=motor))


def check_answers(line: DriveLine, motor: int, drive_id: int) -> float:
    """Read a drive several times. Return the percentage of damaged answers.

    :raises StepError: when drives share the id, too many answers are damaged, or the drive does not answer.
    """
    sample = [line.read_once(drive_id, _PRESENT, _PRESENT_BYTES) for _ in range(_TRIES)]
    valid = sum(data is not None for data, _ in sample)
    damaged = sum(other_bytes for _, other_bytes in sample)
    if valid < _TRIES / 2 and damaged:
        raise StepError(texts.DRIVES_ANSWER_TOGETHER(drive_id=drive_id, motor=motor))
    if not valid:
        raise StepError(texts.NO_DRIVE_FOUND(motor=motor))
    if damaged > _TOLERATED_SHARE * _TRIES:
        raise StepError(texts.BUS_NOISE(motor=motor, damaged_percent=100 * damaged / _TRIES))
    return 100 * damaged / _TRIES
