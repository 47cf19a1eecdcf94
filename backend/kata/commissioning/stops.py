"""Step 8: checks torque-off, the drives' watchdog, and the emergency stop with torque."""

from collections.abc import Callable
from typing import Final

from kata.commissioning import texts
from kata.commissioning.live_drives import LiveDrives, live_drives
from kata.commissioning.workbench import ManualAction, StepError, Workbench

_LIMIT_S: Final = 1.0
_WATCHDOG_STEP_S: Final = 0.02


def check_stops(workbench: Workbench) -> None:
    """Test each way of stopping while the motors hold."""
    workbench.confirm(ManualAction("stand_clear", texts.STAND_CLEAR()))
    with live_drives(workbench) as drives:
        drives.hold()
        drives.release()
        workbench.add_value("torque off after, ms", after=_all_off(workbench, drives))
        drives.hold()
        _check_watchdog(workbench, drives)
        drives.release()
        drives.hold()
        _check_estop(workbench, drives)
    # Configure the drives again, now with their full torque limits. They keep these and the limits of their range.
    with live_drives(workbench, share=1.0) as drives:
        workbench.watch(ManualAction("release_estop", texts.RELEASE_ESTOP()), _released(drives), texts.ESTOP_NOT_SEEN())


def _all_off(workbench: Workbench, drives: LiveDrives) -> float:
    """Return the time in ms until no drive has torque."""
    begin_ns = workbench.now_ns()
    drives.read_only()
    while any(drives.torque_on):
        if workbench.now_ns() - begin_ns > _LIMIT_S * 1e9:
            raise StepError(texts.TORQUE_STAYS_ON(motor=drives.torque_on.index(True) + 1))
        drives.read_only()
    return round((workbench.now_ns() - begin_ns) / 1e6, 1)


def _check_watchdog(workbench: Workbench, drives: LiveDrives) -> None:
    """Send nothing on the bus, as after the end of the process. Every drive's watchdog must trip."""
    workbench.sleep(workbench.draft.bus_watchdog_ms / 1000 + 2 * _WATCHDOG_STEP_S)
    begin_ns = workbench.now_ns()
    drives.read_only()
    while not all(drives.state.watchdog_tripped):
        if workbench.now_ns() - begin_ns > _LIMIT_S * 1e9:
            raise StepError(texts.WATCHDOG_SILENT(motor=drives.state.watchdog_tripped.index(False) + 1))
        drives.read_only()
    workbench.add_value("watchdog, ms", after=workbench.draft.bus_watchdog_ms)


def _check_estop(workbench: Workbench, drives: LiveDrives) -> None:
    """Let the technician press the emergency stop while the motors hold. Torque must go off."""

    def is_off() -> bool:
        try:
            drives.cycle()
        except StepError as failure:
            return failure.fault.key.code == texts.ESTOP_DURING_STEP.code
        return False

    workbench.watch(ManualAction("press_estop", texts.PRESS_ESTOP()), is_off, texts.ESTOP_NOT_SEEN())
    workbench.add_value("emergency stop: torque off after, ms", after=_all_off(workbench, drives))


def _released(drives: LiveDrives) -> Callable[[], bool]:
    def is_closed() -> bool:
        drives.read_only()
        return drives.state.estop == "closed"

    return is_closed
