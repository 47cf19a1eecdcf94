"""Step 8: checks torque-off, the drives' watchdog, and the emergency stop with torque."""

from collections.abc import Callable
from typing import Final

from kata.commissioning import texts
from kata.commissioning.bench import Bench, ManualAction, StepError
from kata.commissioning.live_drives import LiveDrives, live_drives

_LIMIT_S: Final = 1.0
_WATCHDOG_STEP_S: Final = 0.02


def check_stops(bench: Bench) -> None:
    """Test each way of stopping while the motors hold."""
    bench.confirm(ManualAction("stand_clear", texts.STAND_CLEAR()))
    with live_drives(bench) as drives:
        drives.hold()
        drives.release()
        bench.add_value("torque off after, ms", after=_all_off(bench, drives))
        drives.hold()
        _check_watchdog(bench, drives)
        drives.release()
        drives.hold()
        _check_estop(bench, drives)
    # The drives keep their full torque limits and the limits of their range.
    with live_drives(bench, share=1.0) as drives:
        bench.watch(ManualAction("release_estop", texts.RELEASE_ESTOP()), _released(drives), texts.ESTOP_NOT_SEEN())


def _all_off(bench: Bench, drives: LiveDrives) -> float:
    """Return the time in ms until no drive has torque."""
    begin_ns = bench.now_ns()
    drives.read_only()
    while any(drives.torque_on):
        if bench.now_ns() - begin_ns > _LIMIT_S * 1e9:
            raise StepError(texts.TORQUE_STAYS_ON(motor=drives.torque_on.index(True) + 1))
        drives.read_only()
    return round((bench.now_ns() - begin_ns) / 1e6, 1)


def _check_watchdog(bench: Bench, drives: LiveDrives) -> None:
    """Send nothing on the bus, as after the end of the process. Every drive's watchdog must trip."""
    bench.sleep(bench.draft.bus_watchdog_ms / 1000 + 2 * _WATCHDOG_STEP_S)
    begin_ns = bench.now_ns()
    drives.read_only()
    while not all(drives.tripped):
        if bench.now_ns() - begin_ns > _LIMIT_S * 1e9:
            raise StepError(texts.WATCHDOG_SILENT(motor=drives.tripped.index(False) + 1))
        drives.read_only()
    bench.add_value("watchdog, ms", after=bench.draft.bus_watchdog_ms)


def _check_estop(bench: Bench, drives: LiveDrives) -> None:
    """Let the technician press the emergency stop while the motors hold. Torque must go off."""

    def is_off() -> bool:
        try:
            drives.cycle()
        except StepError as failure:
            return failure.fault.key.code == texts.ESTOP_DURING_STEP.code
        return False

    bench.watch(ManualAction("press_estop", texts.PRESS_ESTOP()), is_off, texts.ESTOP_NOT_SEEN())
    bench.add_value("emergency stop: torque off after, ms", after=_all_off(bench, drives))


def _released(drives: LiveDrives) -> Callable[[], bool]:
    def look() -> bool:
        drives.read_only()
        return drives.inputs is not None and not drives.inputs.estop_open

    return look
