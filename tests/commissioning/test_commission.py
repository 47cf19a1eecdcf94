"""A factory-new apparatus is commissioned, and each planted fault is named."""

import itertools
import math
import os
import struct
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from kata.cli import commission as cli
from kata.commissioning import identify_drives, texts
from kata.commissioning.live_drives import LiveSample, live_drives
from kata.commissioning.procedure import (
    STEPS,
    begin_record,
    commission,
    run_step,
    with_step,
)
from kata.commissioning.record import (
    CommissioningRecord,
    RecordError,
    configuration_digest,
    configuration_of,
    read_record,
    record_path,
    sealed,
    write_record,
)
from kata.commissioning.step_response import step_response
from kata.commissioning.steps import passed_steps
from kata.commissioning.workbench import ManualAction, StepError, Workbench
from kata.device import texts as device_texts
from kata.device.bus.dynamixel.registers import COUNTS_PER_TURN, DEG_PER_COUNT, zero_count
from kata.device.config import simulated
from kata.device.config_rules import MOTOR_RANGES_DEG
from kata.evaluation.factory_new import FactoryNewApparatus, Mistakes, SimulatedTechnician
from kata.evaluation.world import World
from kata.messages import Template
from kata.motion.axes import AXES
from kata.motion.identify import excitation
from kata.reporting.letterhead import Letterhead
from kata.reporting.phrases import LANGUAGES
from kata.reporting.rendering import PrintOptions, commissioning_page, commissioning_pdf
from kata.simulator.control_table import BAUD, ID
from kata.simulator.fault_injector import SimulatedFault
from tests.support.obedient import Obedient

ZERO_DEG = 0.2
"""The largest error of a zero that the issue accepts."""
CLOCK_BEGIN = datetime(2026, 1, 5, 9, 0, tzinfo=UTC)


def commissioned(
    apparatus: FactoryNewApparatus,
    mistakes: Mistakes | None = None,
    last: str = "lags",
    technician: SimulatedTechnician | None = None,
) -> CommissioningRecord:
    """Run the procedure until a step or its first fault. The last step takes half a minute of processor time."""
    workbench = apparatus.workbench(technician or SimulatedTechnician(apparatus, mistakes))
    minutes = itertools.count()
    record = begin_record(workbench.draft, "test")
    for _, ran in commission(workbench, record, lambda: CLOCK_BEGIN + timedelta(minutes=next(minutes))):
        record = ran or record
        if ran and ran.steps[-1].step == last:
            break
    return record


@cache
def jammed() -> CommissioningRecord:
    """Return the record of a procedure that ended at a stuck axis."""
    return commissioned(FactoryNewApparatus(3), Mistakes(jams_before_torque=2))


def check(seed: int, last: str) -> tuple[CommissioningRecord, SimulatedTechnician]:
    """Commission an apparatus until a step, and compare the record with the truth. Return the technician too."""
    apparatus = FactoryNewApparatus(seed)
    technician = SimulatedTechnician(apparatus)
    record = commissioned(apparatus, last=last, technician=technician)
    assert [step.fault for step in record.steps if not step.passed] == []
    assert record.steps[-1].step == last
    config = configuration_of(record)
    assert configuration_digest(config) == record.configuration_digest
    for motor, axis, servo in zip(AXES, config.axes, apparatus.servos, strict=True):
        assert servo.table[ID] == axis.id == motor
        assert servo.table[BAUD] == 3, "1 Mbit/s"
        assert axis.direction == apparatus.direction[motor - 1]
        off = (zero_count(axis) - apparatus.zero_count[motor - 1] + COUNTS_PER_TURN / 2) % COUNTS_PER_TURN
        assert abs(off - COUNTS_PER_TURN / 2) * DEG_PER_COUNT <= ZERO_DEG
        # Inside the true ends, and as wide as they and the apparatus' design allow.
        (low, high), (lowest, highest) = apparatus.stops_deg[motor - 1], MOTOR_RANGES_DEG[motor - 1]
        assert low + 1.0 <= axis.min_deg <= max(low + 2.5, lowest)
        assert min(high - 2.5, highest) <= axis.max_deg <= high - 1.0
        assert 0.03 < axis.lag_s < 0.2
    return record, technician


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.campaign)])
def test_a_factory_new_apparatus_is_commissioned(seed: int) -> None:
    _, technician = check(seed, "lags")
    shown = {(instruction.kind, instruction.number): str(instruction.text) for instruction in technician.instructions}
    assert "scapula rotation -8°, abduction 60°" in shown["fit_pose", 2]
    for kind in ("connect_only", "sweep_axis"):
        assert "lift the arm forward (flexion)" in shown[kind, 4], "instructions name motions of motors"


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(100, 120))
def test_twenty_apparatus_are_commissioned(seed: int) -> None:
    check(seed, "lags")


@pytest.mark.campaign
@pytest.mark.timeout(1_200)
@pytest.mark.parametrize("seed", [100, 101, 102])
def test_an_apparatus_follows_like_one_set_up_by_hand(seed: int) -> None:
    record, _ = check(seed, "acceptance")
    assert record.passed
    assert mean_rmse_deg(record) <= 1.2 * mean_rmse_deg(same_set_up_by_hand(seed))


def mean_rmse_deg(record: CommissioningRecord) -> float:
    values = [value.after for value in record.steps[-1].values if value.name.endswith("RMSE deg")]
    assert len(values) == 16
    return sum(float(value or 0) for value in values) / len(values)


def same_set_up_by_hand(seed: int) -> CommissioningRecord:
    """Return the acceptance of the same apparatus with the true zeros and directions, and the lags of the drives as designed."""
    apparatus = FactoryNewApparatus(seed)
    for servo, motor in zip(apparatus.servos, AXES, strict=True):
        servo.table[ID], servo.table[BAUD] = motor, 3
    truth = zip(simulated("virtual").axes, apparatus.direction, apparatus.zero_count, strict=True)
    axes = tuple(
        structs.replace(axis, direction=direction, zero_count=round(zero) % COUNTS_PER_TURN)
        for axis, direction, zero in truth
    )
    config = structs.replace(apparatus.world.config, axes=axes)
    workbench = replace(apparatus.workbench(SimulatedTechnician(apparatus)), draft=config)
    return with_step(begin_record(config, "hand"), run_step(STEPS[-1], workbench, lambda: CLOCK_BEGIN), config)


@pytest.mark.campaign
def test_lag_and_friction_are_refused_where_the_fit_is_poor() -> None:
    times = np.arange(0, 10, 0.01)
    setpoints = excitation([15.0, 109.0, 8.0, 0.0, 0.0], 10.0, 0.01)
    random = np.random.default_rng(1).normal(0, 4, setpoints.shape).cumsum(axis=0) / 10
    samples = [LiveSample(*row) for row in zip(times.tolist(), setpoints, setpoints + random, random, strict=True)]
    found = identify_drives.identified(samples)
    with pytest.raises(StepError, match="Lag and friction of motor 1 explain"):
        identify_drives.check_fit(1, found[0])


class LateComputer:
    """A clock whose sleep sometimes lasts longer."""

    def __init__(self, world: World, every: int, late_s: float) -> None:
        self._world = world
        self._every, self._late_s = every, late_s
        self._sleeps = 0

    def sleep(self, seconds: float) -> None:
        self._sleeps += 1
        self._world.sleep(seconds + (0.0 if self._sleeps % self._every else self._late_s))


def lags_of(late_s: float, every: int = 1) -> list[float]:
    """Return the lags that a computer identifies whose cycles are sometimes late."""
    world = World(simulated("virtual"))
    computer = LateComputer(world, every, late_s)
    workbench = Workbench(world.config, Obedient(), world.open_transport, computer.sleep, lambda: world.t_ns)
    identify_drives.identify_drives(workbench)
    return [axis.lag_s for axis in workbench.draft.axes]


@pytest.mark.campaign
@pytest.mark.parametrize(("late_s", "every"), [(0.003, 70), (0.035, 90)])
def test_single_late_cycles_change_no_lag(late_s: float, every: int) -> None:
    assert lags_of(late_s, every) == pytest.approx(lags_of(0.0), rel=0.05)


@pytest.mark.campaign
def test_many_late_cycles_are_refused_with_their_number() -> None:
    with pytest.raises(StepError, match=r"this computer missed \d+ of \d+ cycles"):
        lags_of(0.015, every=10)


def test_a_computer_that_is_too_slow_is_named() -> None:
    """The drives' watchdogs stop the motors. Each later figure would blame a motor."""
    world = World(simulated("virtual"))
    workbench = Workbench(world.config, Obedient(), world.open_transport, world.wait, lambda: world.t_ns)
    with live_drives(workbench) as drives:
        drives.hold()
        workbench.sleep(0.3)
        with pytest.raises(StepError, match="Motor 1 stopped because it received no messages"):
            drives.settle(0.1)
        workbench.sleep(0.01)
        assert not any(drive.torque_on for drive in world.apparatus.drives)


def test_a_step_response_has_its_figures() -> None:
    times = np.arange(0, 2, 0.01)
    rate, ringing = 4.0, 10.0
    angles = 2.0 * (1 - np.exp(-rate * times) * (np.cos(ringing * times) + rate / ringing * np.sin(ringing * times)))
    found = step_response(times, angles - 0.1 * (times > 1), 2.0)
    assert found.overshoot == pytest.approx(np.exp(-rate * np.pi / ringing), abs=0.01)
    assert found.rise_s == pytest.approx(0.13, abs=0.03)
    assert found.steady_error_deg == pytest.approx(0.1, abs=0.01)


def wrong_model(apparatus: FactoryNewApparatus) -> None:
    servo = apparatus.servos[2]
    servo.exchange(1, 1030)
    servo.reset(0xFF, 0)


def low_voltage(apparatus: FactoryNewApparatus) -> None:
    apparatus.servos[3].expose(volt=9.2)


def noise(apparatus: FactoryNewApparatus) -> None:
    apparatus.world.faults.fault(SimulatedFault("noise"))


def nothing(apparatus: FactoryNewApparatus) -> None:
    """The mistake is the technician's."""


def wire(apparatus: FactoryNewApparatus) -> None:
    apparatus.world.apparatus.break_estop_wire(broken=True)


def second_wire(apparatus: FactoryNewApparatus) -> None:
    apparatus.world.apparatus.break_second_wire(broken=True)


def welded(apparatus: FactoryNewApparatus) -> None:
    apparatus.world.apparatus.weld_contact(welded=True)


def shut_in(apparatus: FactoryNewApparatus) -> None:
    low, high = apparatus.stops_deg[3]
    apparatus.stops_deg = (*apparatus.stops_deg[:3], (low, high - 60.0), *apparatus.stops_deg[4:])


FAULTS: list[tuple[str, Callable[[FactoryNewApparatus], None], Mistakes, Template, int | None]] = [
    ("swapped ids", nothing, Mistakes(connects={3: 4, 4: 3}), texts.DRIVES_SWAPPED, 3),
    ("one drive twice", nothing, Mistakes(connects={4: 3}), texts.NO_DRIVE_FOUND, 3),
    ("noise", noise, Mistakes(), texts.BUS_NOISE, 1),
    ("wrong model", wrong_model, Mistakes(), device_texts.DRIVE_OTHER_MODEL, 3),
    ("low voltage", low_voltage, Mistakes(), texts.VOLTAGE_LOW, 4),
    ("broken e-stop wire", wire, Mistakes(), texts.ESTOP_WIRE_BROKEN, None),
    ("wire broken by the test", nothing, Mistakes(wire_stays_broken=True), texts.ESTOP_WIRE_BROKEN, None),
    ("broken second wire", second_wire, Mistakes(), texts.SECOND_WIRE_BROKEN, None),
    ("welded contact", welded, Mistakes(), texts.CONTACT_WELDED, None),
    ("stuck axis", nothing, Mistakes(jams_before_torque=2), texts.AXIS_STUCK, 2),
    ("reversed: push disagrees", nothing, Mistakes(moves_wrong_way={5}), texts.AXIS_REVERSED, 5),
    (
        "reversed: both by hand wrong",
        nothing,
        Mistakes(moves_wrong_way={4}, pushes_wrong_way={4}),
        texts.AXIS_REVERSED,
        4,
    ),
    ("blocked range", shut_in, Mistakes(), texts.RANGE_TOO_SMALL, 4),
]
_LONG = {"blocked range", "reversed: both by hand wrong"}
"""These faults are found after motors have moved, which takes longest. The campaign plants them."""


@pytest.mark.parametrize(
    ("plant", "mistakes", "fault", "motor"),
    [pytest.param(*row[1:], id=row[0], marks=pytest.mark.campaign if row[0] in _LONG else []) for row in FAULTS],
)
def test_a_planted_fault_is_named(
    plant: Callable[[FactoryNewApparatus], None], mistakes: Mistakes, fault: Template, motor: int | None
) -> None:
    apparatus = FactoryNewApparatus(3)
    plant(apparatus)
    record = commissioned(apparatus, mistakes)
    assert not record.passed
    last = record.steps[-1]
    assert last.fault_key is not None
    assert (last.fault_key.code, last.fault_key.params.get("motor")) == (fault.code, motor), last.fault


def test_no_motor_moves_while_a_technician_pushes() -> None:
    apparatus = FactoryNewApparatus(3)
    technician = SimulatedTechnician(apparatus)
    goals: set[tuple[float, ...]] = set()

    def sleep(seconds: float) -> None:
        if any(instruction.kind == "push_axis" for instruction in technician.instructions):
            goals.add(tuple(round(math.degrees(servo.drive.goal), 2) for servo in apparatus.servos))
        apparatus.world.wait(seconds)

    workbench = replace(apparatus.workbench(technician), sleep=sleep)
    for step in STEPS[:5]:
        assert run_step(step, workbench, lambda: CLOCK_BEGIN).passed
    assert [instruction.kind for instruction in technician.instructions].count("push_axis") == 5
    assert len(goals) == 1


class UsbTechnician(SimulatedTechnician):
    """Steps on a pedal that the computer sees as a keyboard."""

    def __init__(self, apparatus: FactoryNewApparatus, pedal: Path) -> None:
        super().__init__(apparatus)
        self._pedal = os.open(pedal, os.O_RDWR | os.O_NONBLOCK)

    def instruct(self, instruction: ManualAction) -> None:
        if instruction.kind in ("press_pedal", "release_pedal"):
            os.write(self._pedal, struct.pack("@llHHi", 0, 0, 1, 30, instruction.kind == "press_pedal"))
        super().instruct(instruction)


@pytest.mark.parametrize("plugged_in", [True, False])
def test_a_usb_pedal_is_checked(tmp_path: Path, *, plugged_in: bool) -> None:
    pedal = tmp_path / "pedal"
    os.mkfifo(pedal)
    apparatus = FactoryNewApparatus(3)
    workbench = apparatus.workbench(UsbTechnician(apparatus, pedal))
    for step in STEPS[:2]:
        assert run_step(step, workbench, lambda: CLOCK_BEGIN).passed
    path = str(pedal if plugged_in else tmp_path / "elsewhere")
    workbench.change(inputs=structs.replace(workbench.draft.inputs, usb_pedal=path))
    ran = run_step(STEPS[2], workbench, lambda: CLOCK_BEGIN)
    assert ran.passed is plugged_in
    if plugged_in:
        assert ran.values[-1].name == "pedal"
    else:
        assert ran.fault == texts.USB_PEDAL_NOT_SEEN(path=path)


def test_the_record_is_printed() -> None:
    record = structs.replace(jammed(), station="<Station 3>")
    for language in LANGUAGES:
        how = PrintOptions(Letterhead("The clinic"), language, "UTC", CLOCK_BEGIN)
        page = commissioning_page(record, how)
        assert "&lt;Station 3&gt;" in page.html and "<Station 3>" not in page.html
        assert record.digest in page.html and record.configuration_digest in page.html
        assert "Motor 2 moved 0.0 of 3.0°" in page.html
        pdf = commissioning_pdf(record, how)
        assert pdf.startswith(b"%PDF") and len(pdf) > 5_000


def test_a_changed_record_is_refused(tmp_path: Path) -> None:
    path = record_path(tmp_path / "station.toml")
    record = commissioned(FactoryNewApparatus(3), Mistakes(connects={3: 4, 4: 3}))
    assert {type(value.after) for step in record.steps for value in step.values} >= {int, float, str}
    assert read_record(path) is None
    record = write_record(record, path)
    assert read_record(path) == record
    path.write_text(path.read_text().replace('"passed": false', '"passed": true'))
    with pytest.raises(RecordError, match="was changed after it was written"):
        read_record(path)
    path.write_text("{")
    with pytest.raises(RecordError, match="cannot be read"):
        read_record(path)


def test_name_port_and_side_do_not_change_what_was_commissioned() -> None:
    config = simulated("virtual")
    other = structs.replace(config, name="Room 2", port="/dev/ttyUSB7", side="left")
    assert configuration_digest(other) == configuration_digest(config)
    axes = (structs.replace(config.axes[0], direction=-1), *config.axes[1:])
    assert configuration_digest(structs.replace(config, axes=axes)) != configuration_digest(config)


def test_a_repeated_step_invalidates_the_steps_after_it() -> None:
    record = jammed()
    assert passed_steps(record.steps) == {"ids", "registers", "inputs", "axes"}
    again = next(step for step in record.steps if step.step == "registers")
    assert passed_steps((*record.steps, again)) == {"ids", "registers"}
    assert [step.key for step in STEPS][:2] == ["ids", "registers"]


def test_the_command_continues_an_unfinished_record(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    unfinished = commissioned(FactoryNewApparatus(3), Mistakes(connects={3: 4, 4: 3}))
    unfinished = write_record(unfinished, record_path(station))
    record, draft = cli.begin(station, "/dev/ttyUSB3", "other", None)
    assert record == unfinished
    assert draft == structs.replace(configuration_of(unfinished), port="/dev/ttyUSB3")
    with pytest.raises(SystemExit):
        cli.begin(station, None, "other", "zero")
    write_record(sealed(structs.replace(unfinished, passed=True)), record_path(station))
    again, _ = cli.begin(station, None, "other", None)
    assert (again.steps, again.by, len(again.previous)) == ((), "other", 64)
    assert read_record(record_path(station)) is None, "the former record has another name"
    assert len(list(tmp_path.glob("station.commissioning.*.json"))) == 1


def test_the_terminal_confirms_and_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = os.pipe()
    with os.fdopen(ours) as keyboard:
        monkeypatch.setattr("sys.stdin", keyboard)
        technician = cli.TerminalTechnician()
        assert not technician.has_confirmed()
        os.write(theirs, b"\n")
        assert technician.has_confirmed()
        os.write(theirs, b"q\n")
        with pytest.raises(StepError, match="The technician ended the step"):
            technician.has_confirmed()
    os.close(theirs)
