"""``kata commission`` and ``kata identify``: the commissioning procedure of :mod:`kata.commissioning` in a terminal."""

import select
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final, Protocol

from msgspec import structs

from kata.cli.commission_gains import GAINS_KEYS, choice_of, review_lines
from kata.cli.commission_lines import LineFrontEnd, LineTechnician
from kata.clinic.profile.computer_zone import computer_zone
from kata.commissioning import texts
from kata.commissioning.gains_review import GainsChoice, GainsReview
from kata.commissioning.procedure import (
    STEPS,
    CommissioningStep,
    begin_record,
    check,
    commission,
    continue_from,
    first_draft,
    run_step,
    with_step,
)
from kata.commissioning.record import (
    CommissioningRecord,
    RecordedStep,
    RecordError,
    configuration_of,
    has_configuration,
    read_record,
    record_path,
    write_record,
    writing_problem,
)
from kata.commissioning.status import commissioning_status
from kata.commissioning.steps import passed_steps
from kata.commissioning.workbench import ManualAction, StepError, Technician, Workbench
from kata.device import config
from kata.device.bus.serial_transport import port_of
from kata.device.config import StationConfig
from kata.evaluation.factory_new import FactoryNewApparatus, SimulatedTechnician
from kata.reporting import letterhead
from kata.reporting.rendering import PrintOptions, can_print, commissioning_pdf
from kata.reporting.texts import NO_PRINTING
from kata.settings import Settings
from kata.system import realtime
from kata.system.console import console, fail

STEP_KEYS: Final = tuple(step.key for step in STEPS)
_END: Final = "q"
_IDENTIFICATION: Final = STEPS[STEP_KEYS.index("lags")]


class TerminalTechnician:
    """Shows instructions in a terminal. The key Enter confirms an instruction, and q ends the step."""

    def __init__(self) -> None:
        self._review: GainsReview | None = None
        self._choice = GainsChoice("keep")

    def instruct(self, instruction: ManualAction) -> None:
        """See :class:`~kata.commissioning.workbench.Technician`."""
        self._review = instruction.review
        hint = "" if instruction.seen else "  [Enter: done, q: end]"
        if self._review:
            console.print(review_lines(self._review), markup=False, soft_wrap=True)
            hint = GAINS_KEYS
        console.print(f"  -> {instruction.text}{hint}", markup=False, soft_wrap=True)

    def has_confirmed(self) -> bool:
        """See :class:`~kata.commissioning.workbench.Technician`."""
        readable, _, _ = select.select([sys.stdin], [], [], 0.0)
        if not readable:
            return False
        line = sys.stdin.readline()
        if not line or line.strip().lower() == _END:
            raise StepError(texts.TECHNICIAN_STOPPED())
        if self._review is None:
            return True
        choice = choice_of(line, self._review)
        if choice is None:
            console.print(f"  Not understood, or outside the limits.{GAINS_KEYS}", markup=False, soft_wrap=True)
            return False
        self._choice = choice
        return True

    def gains_choice(self) -> GainsChoice:
        """See :class:`~kata.commissioning.workbench.Technician`."""
        return self._choice


class FrontEnd(Protocol):
    """Shows the progress of the procedure."""

    def announce(self, step: CommissioningStep) -> None:
        """Show that a step begins."""

    def report(self, ran: RecordedStep) -> None:
        """Show the result of a step."""

    def finish(self, *, passed: bool, text: str) -> None:
        """Show the end of the procedure."""


class TerminalFrontEnd:
    """Shows the progress in a terminal."""

    def announce(self, step: CommissioningStep) -> None:
        """See :class:`FrontEnd`."""
        place = STEP_KEYS.index(step.key) + 1
        console.print(f"\n{place}/{len(STEPS)} {step.title}\n   {step.description}", markup=False, soft_wrap=True)

    def report(self, ran: RecordedStep) -> None:
        """See :class:`FrontEnd`."""
        for value in ran.values:
            motor = f"motor {value.motor} " if value.motor else ""
            before = "" if value.before is None else f"{value.before} -> "
            console.print(f"     {motor}{value.name}: {before}{value.after}", markup=False)
        console.print("   passed" if ran.passed else f"   FAILED: {ran.fault}", markup=False)

    def finish(self, *, passed: bool, text: str) -> None:
        """See :class:`FrontEnd`."""
        console.print(text, markup=False, soft_wrap=True)


@dataclass
class WorkCounter:
    """Wraps a technician. Counts the person's actions, and measures the time in which the machine works without the person."""

    technician: Technician
    now_ns: Callable[[], int]
    presses: int = 0
    """Number of instructions that the person confirms."""
    others: int = 0
    """Number of instructions whose completion the drives detect."""
    waited_ns: int = 0
    _since_ns: int | None = None

    def instruct(self, instruction: ManualAction) -> None:
        """See :class:`~kata.commissioning.workbench.Technician`."""
        self.presses += not instruction.seen
        self.others += instruction.seen
        self._since_ns = self.now_ns()
        self.technician.instruct(instruction)

    def has_confirmed(self) -> bool:
        """See :class:`~kata.commissioning.workbench.Technician`."""
        confirmed = self.technician.has_confirmed()
        if confirmed and self._since_ns is not None:
            self.waited_ns += self.now_ns() - self._since_ns
            self._since_ns = None
        return confirmed

    def gains_choice(self) -> GainsChoice:
        """See :class:`~kata.commissioning.workbench.Technician`."""
        return self.technician.gains_choice()


def run(
    station: Path, port: str | None, by: str, first: str | None, simulated: int | None, *, lines: bool = False
) -> bool:
    """Commission a station from the step ``first`` on. Return True if every step has passed and the configuration is written.

    ``lines``: True if a program runs the procedure, see :mod:`kata.cli.commission_lines`.
    """
    front: FrontEnd = LineFrontEnd() if lines else TerminalFrontEnd()
    _require_signing(station)
    if simulated is None:
        record, draft = begin(station, port, by, first)
        if draft.protocol != "dynamixel":
            fail(texts.ONLY_DYNAMIXEL())
        workbench = _bench_at_port(draft, lines=lines)
    else:
        # Each practice begins with factory-new drives.
        workbench, first = _practice_bench(simulated, lines=lines), None
        record = begin_record(workbench.draft, by)
    counter = WorkCounter(workbench.technician, workbench.now_ns)
    workbench.technician, began_ns = counter, workbench.now_ns()
    if not _run_steps(workbench, record, front, station, first):
        return False
    machine_s = (workbench.now_ns() - began_ns - counter.waited_ns) / 1e9
    work = f"The technician confirmed {counter.presses} instructions, the drives detected {counter.others} actions, and the apparatus worked for {machine_s:.0f} s."
    front.finish(passed=True, text=f"Commissioned. Configuration: {station}. Record: {record_path(station)}.\n{work}")
    return True


def identify(station: Path, by: str, *, write: bool) -> bool:
    """Identify lag and friction as the step "lags" does. Return True if the fit is good.

    ``write``: then record the step as a commissioning from "lags" on does, run the remaining step "acceptance", and write the configuration.
    Without it, and after a poor fit, no file is changed.
    """
    front = TerminalFrontEnd()
    _, record, draft = _plan(station, None, by, _IDENTIFICATION.key)
    if write:
        _require_signing(station)
    workbench = _bench_at_port(draft, lines=False)
    front.announce(_IDENTIFICATION)
    ran = run_step(_IDENTIFICATION, workbench, lambda: datetime.now(UTC))
    front.report(ran)
    console.print(f"   {_play_line(record)}", markup=False, soft_wrap=True)
    if not ran.passed:
        front.finish(passed=False, text="Not identified. Nothing was written.")
        return False
    if not write:
        front.finish(
            passed=True, text="Nothing was written. With --write the command identifies again and writes the result."
        )
        return True
    record, _ = begin(station, None, by, _IDENTIFICATION.key)
    record = with_step(record, ran, workbench.draft)
    _save(record, station)
    if not _run_steps(workbench, record, front, station, None):
        return False
    front.finish(passed=True, text=f"Identified. Configuration: {station}. Record: {record_path(station)}.")
    return True


def _run_steps(
    workbench: Workbench, record: CommissioningRecord, front: FrontEnd, station: Path, first: str | None
) -> bool:
    """Run the steps of the procedure that are left, and save the record after each. Return True if every step has passed."""
    for step, ran in commission(workbench, record, lambda: datetime.now(UTC), first):
        if ran is None:
            front.announce(step)
            continue
        record = ran
        _save(record, station)
        front.report(record.steps[-1])
    if not record.passed:
        text = "Not commissioned. Run kata commission again; it begins with the step that failed."
        front.finish(passed=False, text=text)
    return record.passed


def _save(record: CommissioningRecord, station: Path) -> None:
    """Write the record and its PDF and, if every step has passed, the station's file."""
    if record.passed:
        config.write(configuration_of(record), station)
        config.read(station)
    signed = write_record(record, record_path(station))
    if can_print():
        record_path(station).with_suffix(".pdf").write_bytes(_report_of(signed))
    else:
        console.print(f"{NO_PRINTING()} The record itself is complete.", markup=False, soft_wrap=True)


def run_check(station: Path, by: str, *, lines: bool = False) -> bool:
    """Run the periodic check of a commissioned station. Return True if every step has passed. ``lines``: as in :func:`run`."""
    front: FrontEnd = LineFrontEnd() if lines else TerminalFrontEnd()
    try:
        draft, record = config.read(station), read_record(record_path(station))
    except (RecordError, config.ConfigError) as error:
        fail(str(error))
    if record is None or not record.passed or not has_configuration(record, draft):
        fail("The station is not commissioned with this configuration.")
    _require_signing(station)
    workbench = _bench_at_port(draft, lines=lines)
    for step, ran in check(workbench, record, lambda: datetime.now(UTC), by):
        if ran is None:
            front.announce(step)
            continue
        record = ran
        write_record(record, record_path(station))
        front.report(record.checks[-1])
    passed = record.checks[-1].passed
    front.finish(
        passed=passed, text="The periodic check has passed." if passed else "The periodic check has found a fault."
    )
    return passed


def begin(station: Path, port: str | None, by: str, first: str | None) -> tuple[CommissioningRecord, StationConfig]:
    """Return the unfinished record to continue, or a new one, and the configuration to begin with. A former record gets another name.

    :param first: the first step to run. A new record takes over the steps before it if the station is commissioned.
    """
    former, record, draft = _plan(station, port, by, first)
    if former and record is not former:
        path = record_path(station)
        path.rename(path.with_suffix(f".{former.digest[:8]}.json"))
    return record, draft


def _plan(
    station: Path, port: str | None, by: str, first: str | None
) -> tuple[CommissioningRecord | None, CommissioningRecord, StationConfig]:
    """Return the present record, and what :func:`begin` returns. No file is changed."""
    try:
        former = read_record(record_path(station))
        present = config.read(station) if station.exists() else first_draft(station.stem, port or "/dev/ttyUSB0")
        unfinished = configuration_of(former) if former and not former.passed else None
    except (RecordError, config.ConfigError) as error:
        fail(str(error))
    if former and unfinished:
        record, draft = former, _at_port(unfinished, port)
    else:
        draft = _at_port(present, port)
        record = begin_record(draft, by, former.digest if former else "")
        if former and first and commissioning_status(station, present).missing is None:
            record = continue_from(former, draft, by, first)
    if first and STEP_KEYS.index(first) > len(passed_steps(record.steps)):
        missing = commissioning_status(station, present).missing
        fail(
            f"The steps before {first} have not passed: {missing}."
            if missing
            else f"The steps before {first} have not passed."
        )
    return former, record, draft


def _play_line(record: CommissioningRecord) -> str:
    """Return the play that the step "zero" has measured. Encoders are on the motor's side of the play, so that no movement shows it."""
    zero = [ran for ran in record.steps if ran.step == "zero" and ran.passed][-1]
    play = ", ".join(f"motor {value.motor} {value.after}" for value in zero.values if value.name == "play deg")
    return f"Play deg, measured with the fixture on {zero.ended_at[:10]}: {play or 'not recorded'}"


def _require_signing(station: Path) -> None:
    """End the command if a record cannot be signed and written, before a step runs."""
    if problem := writing_problem(station):
        fail(f"The record could not be written: {problem}.")


def _bench_at_port(draft: StationConfig, *, lines: bool) -> Workbench:
    """Return the workbench of a real apparatus. If the system allows it, this thread then has the real-time priority of the device process."""
    realtime.schedule(realtime.CONTROL_PRIORITY)
    if not lines:
        return Workbench(draft, TerminalTechnician(), port_of(draft), time.sleep, time.monotonic_ns)
    technician = LineTechnician()
    return Workbench(draft, technician, port_of(draft), technician.stoppable(time.sleep), time.monotonic_ns)


def _practice_bench(seed: int, *, lines: bool) -> Workbench:
    """Return the workbench of a factory-new simulated apparatus, with simulated hands."""
    apparatus = FactoryNewApparatus(seed)
    hands = SimulatedTechnician(apparatus)
    workbench = apparatus.workbench(hands)
    if lines:
        technician = LineTechnician()
        technician.hands = hands
        workbench.technician, workbench.sleep = technician, technician.stoppable(workbench.sleep)
    return workbench


def _at_port(draft: StationConfig, port: str | None) -> StationConfig:
    return structs.replace(draft, port=port) if port else draft


def _report_of(record: CommissioningRecord) -> bytes:
    """Return the record as PDF, with the letterhead of the clinic's settings (KATA_CLINIC_NAME and others)."""
    settings = Settings()
    try:
        head = letterhead.read(
            settings.clinic_name, settings.clinic_address, settings.clinic_phone, settings.clinic_logo
        )
    except letterhead.LetterheadError as error:
        fail(str(error))
    zone = settings.clinic_time_zone or computer_zone()
    return commissioning_pdf(record, PrintOptions(head, "en", zone, datetime.now(UTC)), "valid")
