"""Defines the procedure of commissioning: runs the steps in their order, and records each step.

The emergency stop's contacts are checked before any motor has torque, because the later steps rely on it.
"""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime
from typing import Final

from msgspec import structs

from kata import __version__
from kata.commissioning.acceptance import play_motions
from kata.commissioning.axes import check_torque, find_axes
from kata.commissioning.gains import tune_gains
from kata.commissioning.identify_drives import identify_drives
from kata.commissioning.ids import assign_ids
from kata.commissioning.inputs import check_inputs
from kata.commissioning.record import (
    CHECKED,
    CommissioningRecord,
    RecordedStep,
    configuration_digest,
    sealed,
)
from kata.commissioning.registers import write_registers
from kata.commissioning.steps import STEP_TEXTS, passed_steps
from kata.commissioning.stops import check_stops
from kata.commissioning.travel import find_range
from kata.commissioning.workbench import StepError, Workbench
from kata.commissioning.zero import find_zeros
from kata.device.bus.interface import BusError
from kata.device.config import Inputs, StationConfig, as_toml
from kata.messages import Text, text_of


@dataclass(frozen=True)
class CommissioningStep:
    """One step: its key in the record, its title, the description of its action, and the function that performs it."""

    key: str
    title: Text
    description: Text
    run: Callable[[Workbench], None]


_FUNCTIONS: Final[dict[str, Callable[[Workbench], None]]] = {
    "ids": assign_ids,
    "registers": write_registers,
    "inputs": check_inputs,
    "axes": find_axes,
    "torque": check_torque,
    "zero": find_zeros,
    "range": find_range,
    "stops": check_stops,
    "gains": tune_gains,
    "lags": identify_drives,
    "acceptance": play_motions,
}
STEPS: Final = tuple(
    CommissioningStep(step.key, step.title, step.description, _FUNCTIONS[step.key]) for step in STEP_TEXTS
)
"""The steps in their order."""


def first_draft(name: str, port: str) -> StationConfig:
    """Return the first configuration of a new station: two contacts of the emergency stop, five drives with ids 1 to 5."""
    return StationConfig(name=name, port=port, inputs=Inputs(estop_second_port=3))


def run_step(step: CommissioningStep, workbench: Workbench, now: Callable[[], datetime]) -> RecordedStep:
    """Run a step. A failed step does not change the draft."""
    draft, began = workbench.draft, now()
    workbench.values.clear()
    workbench.curves.clear()
    fault: Text | None = None
    try:
        step.run(workbench)
    except StepError as failure:
        fault = failure.fault
    except BusError as error:
        fault = text_of(error)
    if fault is not None:
        workbench.draft = draft
    return RecordedStep(
        step=step.key,
        began_at=began.isoformat(timespec="seconds"),
        ended_at=now().isoformat(timespec="seconds"),
        passed=fault is None,
        fault=str(fault or ""),
        fault_key=fault.key if fault is not None else None,
        values=tuple(workbench.values),
        curves=tuple(workbench.curves),
    )


def begin_record(config: StationConfig, by: str, previous: str = "") -> CommissioningRecord:
    """Return an empty record. ``previous``: digest of the previous record."""
    return CommissioningRecord(
        station=config.name,
        by=by,
        kata=__version__,
        steps=(),
        configuration=as_toml(config),
        configuration_digest=configuration_digest(config),
        previous=previous,
    )


def continue_from(former: CommissioningRecord, config: StationConfig, by: str, begin: str) -> CommissioningRecord:
    """Return a record that takes over the steps before ``begin`` from a finished record. The other steps must run again.

    The newest run of each step is taken over, which may be one of a periodic check. It names the person who ran it. From the first step
    on that the former record does not have, as one of an earlier release may not, nothing is taken over.
    """
    newest = {ran.step: ran for ran in (*former.steps, *former.checks)}
    before = itertools.takewhile(lambda step: step.key != begin and step.key in newest, STEPS)
    steps = tuple(structs.replace(newest[step.key], by=newest[step.key].by or former.by) for step in before)
    return structs.replace(begin_record(config, by, former.digest), steps=steps)


def commission(
    workbench: Workbench, record: CommissioningRecord, now: Callable[[], datetime], begin: str | None = None
) -> Iterator[tuple[CommissioningStep, CommissioningRecord | None]]:
    """Run the steps until one fails. Yield each step before it runs (with None) and after it has run (with the record so far).

    :param begin: key of the first step to run; by default the first step that has not passed in the record.
    """
    for step in _remaining(record, begin):
        yield step, None
        ran = run_step(step, workbench, now)
        record = with_step(record, ran, workbench.draft)
        yield step, record
        if not ran.passed:
            return


def check(
    workbench: Workbench, record: CommissioningRecord, now: Callable[[], datetime], by: str = ""
) -> Iterator[tuple[CommissioningStep, CommissioningRecord | None]]:
    """Run the periodic check, as :func:`commission` runs the procedure. The configuration is not changed.

    :param by: who runs it.
    """
    draft = workbench.draft
    for step in STEPS:
        if step.key not in CHECKED:
            continue
        yield step, None
        ran = structs.replace(run_step(step, workbench, now), by=by)
        workbench.draft = draft
        record = sealed(structs.replace(record, checks=(*record.checks, ran)))
        yield step, record
        if not ran.passed:
            return


def with_step(record: CommissioningRecord, ran: RecordedStep, draft: StationConfig) -> CommissioningRecord:
    """Return the record with one more step and the configuration after it."""
    steps = (*record.steps, ran)
    return sealed(
        structs.replace(
            record,
            steps=steps,
            configuration=as_toml(draft),
            configuration_digest=configuration_digest(draft),
            passed=passed_steps(steps) == {step.key for step in STEPS},
        )
    )


def _remaining(record: CommissioningRecord, begin: str | None) -> tuple[CommissioningStep, ...]:
    order = [step.key for step in STEPS]
    place = order.index(begin) if begin else len(passed_steps(record.steps))
    return STEPS[place:]
