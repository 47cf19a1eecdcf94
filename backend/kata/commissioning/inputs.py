"""Step 3: checks the emergency stop and the pedal before any motor has torque."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Final

from kata.commissioning import texts
from kata.commissioning.drive_line import DriveLine
from kata.commissioning.workbench import ManualAction, StepError, Workbench, naming_drive
from kata.device.bus.dynamixel.registers import PORT_DATA
from kata.device.pedal import UsbPedal
from kata.messages import Text

_CONTACT_S: Final = 0.2
"""Contacts that contradict each other for this long have a fault. The contacts of a switch move within 20 ms."""
_PLUG_IN_S: Final = 30.0
"""Time for plugging in a cable. During this time an unplugged cable is not reported as a broken wire."""


def check_inputs(workbench: Workbench) -> None:
    """Let the technician press, release and unplug the emergency stop, and press and release the pedal. Check the contacts."""
    with workbench.line() as line:
        contacts, missing = _Contacts(workbench, line), texts.ESTOP_NOT_SEEN()
        workbench.watch(ManualAction("release_estop", texts.RELEASE_ESTOP()), contacts.estop(pressed=False), missing)
        workbench.watch(ManualAction("press_estop", texts.PRESS_ESTOP()), contacts.estop(pressed=True), missing)
        workbench.watch(ManualAction("release_estop", texts.RELEASE_ESTOP()), contacts.estop(pressed=False), missing)
        workbench.watch(
            ManualAction("unplug_estop", texts.UNPLUG_ESTOP()),
            lambda: not contacts.is_normally_closed_contact_closed(),
            missing,
        )
        plugged_in = contacts.estop(pressed=False, steady_s=_PLUG_IN_S)
        workbench.watch(ManualAction("plug_in_estop", texts.PLUG_IN_ESTOP()), plugged_in, missing)
        workbench.add_value("emergency stop", after="pressed, released, unplugged: seen")
        usb = workbench.draft.inputs.usb_pedal
        if usb is None:
            _check_pedal(workbench, contacts.pedal, texts.PEDAL_NOT_SEEN())
    if usb is not None:
        with closing(UsbPedal(Path(usb), workbench.now_ns)) as pedal:
            _check_pedal(workbench, pedal.down, texts.USB_PEDAL_NOT_SEEN(path=usb))


def _check_pedal(workbench: Workbench, is_down: Callable[[], bool | None], missing: Text) -> None:
    """Let the technician press and release the pedal. ``is_down`` returns None while the state is unknown."""
    workbench.watch(ManualAction("press_pedal", texts.PRESS_PEDAL()), lambda: is_down() is True, missing)
    workbench.watch(ManualAction("release_pedal", texts.RELEASE_PEDAL()), lambda: is_down() is False, missing)
    workbench.add_value("pedal", after="pressed, released: seen")


class _Contacts:
    """Reads the contacts of emergency stop and pedal, and reports their faults."""

    def __init__(self, workbench: Workbench, line: DriveLine) -> None:
        self._workbench = workbench
        self._line = line
        self._inputs = workbench.draft.inputs
        self._steady: tuple[tuple[bool, bool | None], int] | None = None

    def is_normally_closed_contact_closed(self) -> bool:
        """Return True if the normally closed contact is closed."""
        return self._closed(self._inputs.estop_port)

    def pedal(self) -> bool:
        """Return True if the pedal is down."""
        return self._closed(self._inputs.pedal_port)

    def estop(self, *, pressed: bool, steady_s: float = _CONTACT_S) -> Callable[[], bool]:
        """Return a function that returns True when both contacts show that the switch is pressed (or released).

        The function raises a StepError that names the broken wire or the welded contact if the contacts contradict each other for
        ``steady_s``.
        """
        self._steady = None

        def is_satisfied() -> bool:
            second_port = self._inputs.estop_second_port
            state = (
                self.is_normally_closed_contact_closed(),
                None if second_port is None else self._closed(second_port),
            )
            if state == (not pressed, None if second_port is None else pressed):
                return True
            now_ns = self._workbench.now_ns()
            if self._steady is None or self._steady[0] != state:
                self._steady = state, now_ns
            if now_ns - self._steady[1] > steady_s * 1e9 and state in ((False, False), (True, True)):
                raise StepError(_contradiction(state[0], pressed=pressed))
            return False

        return is_satisfied

    def _closed(self, port: int) -> bool:
        drive_id = self._inputs.drive_id
        motor = [axis.id for axis in self._workbench.draft.axes].index(drive_id) + 1
        with naming_drive(motor, drive_id):
            return self._line.read(drive_id, PORT_DATA + 2 * port, 1) == b"\0"


def _contradiction(closed: bool, *, pressed: bool) -> Text:
    """Return the fault that explains why both contacts are closed, or both open."""
    if closed:
        return texts.CONTACT_WELDED()
    return texts.SECOND_WIRE_BROKEN() if pressed else texts.ESTOP_WIRE_BROKEN()
