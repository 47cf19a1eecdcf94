"""Routes with which the page runs the commissioning."""

from typing import Annotated, Final, Literal

from fastapi import APIRouter, Depends, Request
from fastapi.concurrency import run_in_threadpool
from pydantic import Field, StrictInt

from kata.api import texts
from kata.api.commissioning_run import CommissioningRun, RunKind
from kata.api.errors import refused
from kata.api.gains_schemas import GainsAnswer, GainTuningReview
from kata.api.lease_dependencies import browser
from kata.api.seen_state import SeenState, guarded
from kata.api.services import services_of
from kata.clinic.commissionings.schemas import CommissioningStepRun
from kata.clinic.sessions import service as sessions
from kata.commissioning.record import CHECKED, CommissioningRecord, readable_record, record_path
from kata.commissioning.status import commissioning_status
from kata.commissioning.steps import STEP_TEXTS, passed_steps
from kata.dependencies import PROBLEMS, TheDatabase, TheStation
from kata.device import config
from kata.errors import ProblemError
from kata.station.schemas import OptionalKey, TextKey
from kata.types import Schema

router = APIRouter(prefix="/api/station/commissioning/run", tags=["commissioning"])

StepKey = Literal[
    "ids", "registers", "inputs", "axes", "torque", "zero", "range", "stops", "gains", "lags", "acceptance"
]
_ORDER: Final = [step.key for step in STEP_TEXTS]


class CommissioningStart(SeenState):
    """The kind of run and its first step."""

    kind: RunKind = Field(description="full: all steps that have not passed. check: the periodic check.")
    begin: StepKey | None = Field(
        None, description="First step of the run; by default the first step that has not passed."
    )


class CommissioningConfirmation(SeenState):
    """Confirms that the technician has carried out an instruction."""

    number: StrictInt = Field(ge=1)
    gains: GainsAnswer | None = Field(None, description="Answer to a review of gains; by default they are kept.")


class CommissioningInstruction(Schema):
    """An instruction to the technician."""

    number: int = Field(ge=1, description="Number of the instruction. It is used once while the service runs.")
    kind: str = Field(examples=["press_estop"])
    text: str
    text_key: OptionalKey = None
    motor: int = Field(ge=0, description="Number of the motor or the pose; 0: the instruction concerns none.")
    seen: bool = Field(description="True if the drives show when the instruction has been carried out.")
    press: bool = Field(description="True if the procedure waits for a confirmation.")
    review: GainTuningReview | None = Field(None, description="Step responses to compare while gains are tuned.")


class CommissioningStepState(Schema):
    """A step of the procedure."""

    key: StepKey
    title: str
    title_key: OptionalKey = None
    description: str
    description_key: OptionalKey = None
    state: Literal["waiting", "running", "passed", "failed"]
    result: CommissioningStepRun | None = Field(
        description="Result of the step's last run; null: the step has not run yet."
    )


class CommissioningRunState(Schema):
    """State of the commissioning procedure."""

    possible: bool = Field(description="False if the service has no station file.")
    practice: bool = Field(description="True if the procedure runs on a factory-new simulated apparatus, for training.")
    running: bool
    kind: RunKind
    by: str
    step: StepKey | None = Field(
        description="The step that is running or, if none is, ran last; null: no step has run since the service started."
    )
    instruction: CommissioningInstruction | None
    steps: list[CommissioningStepState]
    presses: int = Field(ge=0, description="Number of confirmations since the procedure's start.")
    passed: bool | None = Field(description="Null: the procedure is running, or has not run since the service started.")
    may_check: bool = Field(description="True if the station is commissioned, so that the periodic check can run.")
    may_repeat: bool = Field(
        description="True if a run may begin at any step, because the station is commissioned and its last periodic check has passed. The record takes over the steps before."
    )


async def _run(request: Request) -> CommissioningRun:
    return services_of(request).commissioning_run


TheRun = Annotated[CommissioningRun, Depends(_run)]


@router.get("", summary="Get the state of the commissioning")
async def get_commissioning_run(run: TheRun) -> CommissioningRunState:
    """Return the steps with their results, and what the technician is asked to do."""
    run.note_request(browser())
    return await run_in_threadpool(_state, run)


@router.post("", responses=PROBLEMS.of(409, 422, 503), summary="Start the commissioning")
async def start_commissioning(
    request: Request, run: TheRun, station: TheStation, database: TheDatabase, body: CommissioningStart
) -> CommissioningRunState:
    """Take the drives from the control program and start the procedure or the periodic check.

    Refused while a session of this station is open, and while the station is not idle. A simulated station practises on a factory-new
    simulated apparatus. Stop ends the procedure with torque off. So does the loss of the browser that started it or gave the last
    confirmation, in steps in which motors have torque: after 2 s while the motors work, after 30 s while an instruction is shown.
    """
    guard = await guarded(station, body)
    name = services_of(request).station_name

    def open_sessions() -> bool:
        with database.read() as session:
            return sessions.has_open(session, name)

    if await run_in_threadpool(open_sessions):
        raise ProblemError(409, "session_open", texts.SESSION_OPEN(), texts.END_SESSION_FIRST())
    before = await run_in_threadpool(_check_start, run, body)
    if refusal := await run.start(body.kind, body.begin, browser(), before, guard):
        raise refused(refusal)
    return await run_in_threadpool(_state, run)


@router.post("/confirm", responses=PROBLEMS.of(409, 422), summary="Confirm an instruction")
async def confirm_commissioning(
    run: TheRun, station: TheStation, body: CommissioningConfirmation
) -> CommissioningRunState:
    """Confirm that an instruction was carried out. Refused if the page now shows another instruction, if the confirmation is more than 2 s
    old, because motors may then move without warning, and if gains are outside their limits.
    """
    await guarded(station, body)
    choice = body.gains.model_dump() if body.gains else None
    if choice and run.shows(body.number) and not run.accepts(choice):
        raise ProblemError(409, "gains_refused", texts.GAINS_REFUSED(), texts.CHOOSE_WITHIN_LIMITS())
    if not run.confirm(body.number, browser(), choice):
        raise ProblemError(409, "other_instruction", texts.OTHER_INSTRUCTION(), texts.READ_INSTRUCTION_AGAIN())
    return await run_in_threadpool(_state, run)


def _check_start(run: CommissioningRun, start: CommissioningStart) -> set[str]:
    """Check that the procedure would accept this start. Return the steps that have passed before it.

    :raises ProblemError: 409.
    """
    record = _record(run)
    if start.kind == "check" and not _may_check(record):
        raise ProblemError(409, "check_impossible", texts.CHECK_IMPOSSIBLE(), texts.COMMISSION_FIRST())
    if start.begin and _ORDER.index(start.begin) > len(_passed(record)) and not _may_repeat(run):
        raise ProblemError(409, "steps_missing", texts.STEPS_MISSING(), texts.BEGIN_EARLIER())
    return set(_ORDER[: _ORDER.index(start.begin)]) if start.begin else _passed(record)


def _record(run: CommissioningRun) -> CommissioningRecord | None:
    """Return the record of the real apparatus; None if there is no usable record."""
    return None if run.file is None or run.practises else readable_record(record_path(run.file))


def _may_check(record: CommissioningRecord | None) -> bool:
    """Return True if the periodic check can run: the commissioning has passed."""
    return record is not None and record.passed


def _may_repeat(run: CommissioningRun) -> bool:
    """Return True if a run may begin at any step: the station is commissioned with the configuration in its file."""
    if run.file is None or run.practises:
        return False
    try:
        return commissioning_status(run.file, config.read(run.file)).missing is None
    except config.ConfigError:
        return False


def _passed(record: CommissioningRecord | None) -> set[str]:
    """Return the steps that an unfinished record has passed; empty for a finished record, because a new commissioning starts from the
    first step.
    """
    return set() if record is None or record.passed else passed_steps(record.steps)


def _state(run: CommissioningRun) -> CommissioningRunState:
    progress, record = run.progress, _record(run)
    kind = progress.kind if progress else "full"
    outcomes = {outcome["step"]: outcome for outcome in progress.ended} if progress else {}
    before = progress.before if progress else _passed(record)
    running = progress is not None and progress.running
    steps = []
    for step in STEP_TEXTS:
        if kind == "check" and step.key not in CHECKED:
            continue
        outcome = outcomes.get(step.key)
        if progress and running and progress.step == step.key and outcome is None:
            state = "running"
        elif outcome is not None:
            state = "passed" if outcome["passed"] else "failed"
        else:
            state = "passed" if step.key in before else "waiting"
        result = {name: value for name, value in outcome.items() if name != "by"} if outcome else None
        steps.append(
            CommissioningStepState.model_validate(
                {
                    "key": step.key,
                    "title": step.title,
                    "title_key": TextKey.of(step.title),
                    "description": step.description,
                    "description_key": TextKey.of(step.description),
                    "state": state,
                    "result": result,
                }
            )
        )
    return CommissioningRunState.model_validate(
        {
            "possible": run.file is not None,
            "practice": run.practises,
            "running": running,
            "kind": kind,
            "by": progress.by if progress else "",
            "step": (progress.step or None) if progress else None,
            "instruction": progress.instruction if progress else None,
            "steps": steps,
            "presses": progress.presses if progress else 0,
            "passed": None if progress is None or running else progress.passed,
            "may_check": _may_check(record),
            "may_repeat": _may_repeat(run),
        }
    )
