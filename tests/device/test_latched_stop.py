"""A stop from its first cause until it is acknowledged."""

from kata.device.faults import FaultKey
from kata.device.latched_stop import LatchedStop

ESTOP: FaultKey = ("estop_pressed", None)
SILENT: FaultKey = ("drive_silent", 2)
OPERATOR: FaultKey = ("operator_stop", None)
HELD: FaultKey = ("load_repeated", 3)


def test_first_cause_stays_first_and_later_ones_are_appended() -> None:
    stop = LatchedStop(at_ns=7)
    assert [cause.code for cause in stop.update([SILENT], [OPERATOR])] == ["drive_silent", "operator_stop"]
    assert [cause.code for cause in stop.update([ESTOP, SILENT], [])] == ["estop_pressed"]
    assert stop.update([SILENT], [OPERATOR]) == []

    state = stop.state()
    assert state.at_ns == 7
    assert [cause.code for cause in state.causes] == ["drive_silent", "operator_stop", "estop_pressed"]


def test_cause_is_cleared_while_its_fault_is_absent() -> None:
    stop = LatchedStop(at_ns=0)
    stop.update([SILENT], [OPERATOR])
    assert [cause.cleared for cause in stop.causes()] == [False, True]
    stop.update([], [])
    assert [cause.cleared for cause in stop.causes()] == [True, True]
    stop.update([SILENT], [])
    assert [cause.cleared for cause in stop.causes()] == [False, True]


def test_same_fault_of_another_motor_is_another_cause() -> None:
    stop = LatchedStop(at_ns=0)
    stop.update([SILENT], [])
    new = stop.update([("drive_silent", 4)], [])
    assert [(cause.axis, cause.message) for cause in new] == [(5, "Motor 5 does not answer.")]
    assert [(cause.axis, cause.cleared) for cause in stop.causes()] == [(3, True), (5, False)]


def test_cause_names_its_motor_counted_from_1_or_none() -> None:
    stop = LatchedStop(at_ns=0)
    of_motor, of_none = stop.update([SILENT, ESTOP], [])
    assert (of_motor.axis, of_motor.message, of_motor.category) == (3, "Motor 3 does not answer.", 0)
    assert (of_none.axis, of_none.message) == (None, "The emergency stop was pressed.")


def test_strictest_cause_decides_how_to_stop() -> None:
    stop = LatchedStop(at_ns=0)
    for key, category in ((HELD, 2), (OPERATOR, 1), (ESTOP, 0), (HELD, 0)):
        stop.update([], [key])
        assert stop.category == category
