"""Routes for hand, pedal and emergency stop of the simulated apparatus. They answer 404 if the apparatus is real."""

from contextlib import closing
from typing import Annotated, Literal

from fastapi import APIRouter, Body, Depends, Query, Request
from pydantic import Field, StrictBool

from kata.api import texts
from kata.api.services import services_of
from kata.api.simulation import HandMotion, Simulation, hand_refused
from kata.clinic import texts as clinic_texts
from kata.dependencies import PROBLEMS
from kata.errors import ProblemError
from kata.messages import text_of
from kata.motion.linkage import OutOfReachError, motor_angles_deg
from kata.motion.taught import TaughtError, parse_csv
from kata.simulator.apparatus import State
from kata.simulator.effort import MOST_NM
from kata.simulator.hand import HandRefusedError
from kata.types import Name, Schema


class Hand(Schema):
    """The simulated hand."""

    phase: Literal["away", "reaching", "tracing", "leaving"]
    motion: str | None
    left_s: float = Field(ge=0, description="Seconds until the hand releases the arm.")


Effort = Annotated[
    float,
    Field(
        ge=-MOST_NM,
        le=MOST_NM,
        description="Torque of the simulated patient along the path, newton metres: above 0 the patient helps, below 0 the patient resists.",
    ),
]


class SimulatorState(Schema):
    """The state of the simulated hand, pedal and emergency stop."""

    pedal_down: bool
    estop_pressed: bool
    hand: Hand
    effort_nm: Effort
    motions: list[HandMotion]


class PedalRequest(Schema):
    """Press or release the pedal."""

    down: StrictBool


class EstopRequest(Schema):
    """Press or release the emergency stop."""

    pressed: StrictBool


class EffortRequest(Schema):
    """The effort of the simulated patient; 0: relaxed."""

    effort_nm: Effort


class GuideRequest(Schema):
    """The motion that the hand follows with the pedal pressed."""

    motion_id: str


def _any_simulation(request: Request) -> Simulation | None:
    return services_of(request).simulation


def _simulation(request: Request) -> Simulation:
    simulation = _any_simulation(request)
    if simulation is None:
        raise ProblemError(404, "not_simulating", texts.NOT_SIMULATING(), texts.USE_REAL_INPUTS())
    return simulation


TheSimulation = Annotated[Simulation, Depends(_simulation)]
AnySimulation = Annotated[Simulation | None, Depends(_any_simulation)]
router = APIRouter(prefix="/api/simulator", tags=["simulator"], responses=PROBLEMS.of(404))


@router.get("", summary="Read the state of the simulated inputs")
def get_simulator(simulation: TheSimulation) -> SimulatorState:
    """Return hand, pedal, emergency stop and the available motions."""
    with closing(simulation.process.client()) as client:
        return _state(simulation, client.state())


@router.post("/pedal", summary="Press or release the simulated pedal", responses=PROBLEMS.of(422))
def set_pedal(simulation: TheSimulation, body: PedalRequest) -> SimulatorState:
    """Press or release the pedal and return the new state."""
    with closing(simulation.process.client()) as client:
        return _state(simulation, client.pedal(body.down))


@router.post("/estop", summary="Press or release the simulated emergency stop", responses=PROBLEMS.of(422))
def set_estop(simulation: TheSimulation, body: EstopRequest) -> SimulatorState:
    """Press or release the emergency stop and return the new state."""
    with closing(simulation.process.client()) as client:
        return _state(simulation, client.estop(body.pressed))


@router.post("/guide", summary="Guide the arm with the simulated hand", responses=PROBLEMS.of(409, 422))
def guide_arm(simulation: TheSimulation, body: GuideRequest) -> SimulatorState:
    """Make the hand guide the arm along a motion with the pedal pressed."""
    motion = simulation.get(body.motion_id)
    with closing(simulation.process.client()) as client:
        try:
            return _state(simulation, client.guide(motion))
        except HandRefusedError as error:
            raise hand_refused(error) from error


@router.post("/effort", summary="Let the simulated patient help or resist", responses=PROBLEMS.of(422))
def set_effort(simulation: TheSimulation, body: EffortRequest) -> SimulatorState:
    """Set the patient's effort along the path. It acts while the motors hold or move the arm."""
    with closing(simulation.process.client()) as client:
        return _state(simulation, client.effort(body.effort_nm))


@router.post("/release", summary="Release the arm and the pedal")
def release_arm(simulation: TheSimulation) -> SimulatorState:
    """Make the hand release the arm and the pedal."""
    with closing(simulation.process.client()) as client:
        return _state(simulation, client.release())


@router.post("/motions", status_code=201, summary="Upload a motion for the simulated hand", responses=PROBLEMS.of(422))
def upload_motion(
    simulation: TheSimulation,
    name: Annotated[Name, Query(description="Name of the motion.")],
    csv: Annotated[
        str,
        Body(media_type="text/csv", max_length=20_000_000, description="Columns: time_s and the five pose columns."),
    ],
) -> HandMotion:
    """Add a motion that the hand can follow, from a CSV file of poses."""
    try:
        motion = parse_csv(csv, name)
        motor_angles_deg(motion.poses_deg)
    except (TaughtError, OutOfReachError) as error:
        unusable = texts.MOTION_FILE_UNUSABLE(file=name, reason=text_of(error))
        raise ProblemError(422, "not_a_motion", unusable, clinic_texts.MEND_FILE()) from error
    return simulation.add(motion)


def _state(simulation: Simulation, state: State) -> SimulatorState:
    return SimulatorState(
        pedal_down=state.pedal_down,
        estop_pressed=state.estop_pressed,
        hand=Hand(phase=state.hand.phase, motion=state.hand.motion, left_s=state.hand.left_s),
        effort_nm=state.effort_nm,
        motions=simulation.motions(),
    )
