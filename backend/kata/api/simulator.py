"""REST for the simulated apparatus' hand, pedal and switch; there only while simulating."""

from contextlib import closing
from pathlib import Path
from typing import Annotated, Literal
from uuid import uuid4

from fastapi import APIRouter, Body, Depends, Query, Request
from pydantic import Field, StrictBool

from kata.api import texts
from kata.clinic import texts as clinic_texts
from kata.dependencies import PROBLEMS
from kata.errors import ProblemError
from kata.messages import text_of
from kata.motion.axes import CANONICAL_SIDE, Side
from kata.motion.builtin import built_in_motions
from kata.motion.linkage import OutOfReachError, motor_angles_deg
from kata.motion.taught import Taught, TaughtError, parse_csv, read_csv
from kata.simulator.apparatus import State
from kata.simulator.hand import HandRefusedError
from kata.simulator.process import SimulatorProcess
from kata.station.schemas import OptionalKey, TextKey
from kata.types import Name, Schema

Source = Literal["built-in", "recorded", "uploaded"]


class Motion(Schema):
    """A motion that the simulated hand can follow."""

    id: str
    name: str
    name_key: OptionalKey = None
    source: Source
    duration_s: float = Field(gt=0, description="Seconds.")


class Hand(Schema):
    """The simulated hand."""

    phase: Literal["away", "reaching", "tracing", "leaving"]
    motion: str | None
    left_s: float = Field(ge=0, description="Seconds until it has let go.")


class SimulatorState(Schema):
    """What stands in for hand, foot and switch."""

    pedal_down: bool
    estop_pressed: bool
    hand: Hand
    motions: list[Motion]


class PedalRequest(Schema):
    """Put the foot down or lift it."""

    down: StrictBool


class EstopRequest(Schema):
    """Press the switch or release it."""

    pressed: StrictBool


class GuideRequest(Schema):
    """Which motion the hand follows; it presses the pedal by itself."""

    motion_id: str


class Simulation:
    """The simulator, and the motions its hand knows."""

    def __init__(self, process: SimulatorProcess, taught: Path | None) -> None:
        """``taught``: folder of recorded motions; files there that are none are left out."""
        self.process = process
        self._motions: dict[str, tuple[Source, Taught]] = {
            f"built-in-{n}": ("built-in", motion) for n, motion in enumerate(built_in_motions(), start=1)
        }
        for file in sorted(taught.glob("*.csv")) if taught else ():
            try:
                self._motions[f"recorded-{file.stem}"] = ("recorded", read_csv(file))
            except TaughtError:
                continue

    def turn(self, side: Side) -> None:
        """The apparatus is to stand for a side.

        :raises ProblemError: 409 while its motors hold the arm or the hand guides it.
        """
        with closing(self.process.client()) as client:
            try:
                client.turn(turned=side != CANONICAL_SIDE)
            except HandRefusedError as error:
                raise _refused(error) from error

    def motions(self) -> list[Motion]:
        """All of them."""
        return [self._motion(key) for key in self._motions]

    def add(self, motion: Taught) -> Motion:
        """An uploaded one, kept until the service ends."""
        key = f"uploaded-{uuid4()}"
        self._motions[key] = ("uploaded", motion)
        return self._motion(key)

    def get(self, key: str) -> Taught:
        """One motion.

        :raises ProblemError: 404.
        """
        if key not in self._motions:
            raise ProblemError(404, "not_found", texts.MOTION_NOT_FOUND(), texts.CHOOSE_FROM_LIST())
        return self._motions[key][1]

    def _motion(self, key: str) -> Motion:
        source, taught = self._motions[key]
        return Motion(
            id=key,
            name=taught.name,
            name_key=TextKey.of(taught.name),
            source=source,
            duration_s=taught.duration_s,
        )


def _refused(error: HandRefusedError) -> ProblemError:
    return ProblemError(409, "hand_refused", texts.SENTENCE(clause=text_of(error)), texts.HAND_WAIT())


def _any_simulation(request: Request) -> Simulation | None:
    simulation: Simulation | None = request.app.state.simulation
    return simulation


def _simulation(request: Request) -> Simulation:
    simulation = _any_simulation(request)
    if simulation is None:
        raise ProblemError(404, "not_simulating", texts.NOT_SIMULATING(), texts.USE_REAL_INPUTS())
    return simulation


TheSimulation = Annotated[Simulation, Depends(_simulation)]
AnySimulation = Annotated[Simulation | None, Depends(_any_simulation)]
router = APIRouter(prefix="/api/simulator", tags=["simulator"], responses=PROBLEMS.of(404))


@router.get("")
def get_simulator(simulation: TheSimulation) -> SimulatorState:
    """Hand, pedal, switch and the motions there are."""
    with closing(simulation.process.client()) as client:
        return _told(simulation, client.state())


@router.post("/pedal", responses=PROBLEMS.of(422))
def set_pedal(simulation: TheSimulation, wanted: PedalRequest) -> SimulatorState:
    """Put the foot on the pedal or lift it."""
    with closing(simulation.process.client()) as client:
        return _told(simulation, client.pedal(wanted.down))


@router.post("/estop", responses=PROBLEMS.of(422))
def set_estop(simulation: TheSimulation, wanted: EstopRequest) -> SimulatorState:
    """Press the emergency stop or release it."""
    with closing(simulation.process.client()) as client:
        return _told(simulation, client.estop(wanted.pressed))


@router.post("/guide", responses=PROBLEMS.of(409, 422))
def guide_arm(simulation: TheSimulation, wanted: GuideRequest) -> SimulatorState:
    """Let the hand take the arm along a motion, foot on the pedal."""
    motion = simulation.get(wanted.motion_id)
    with closing(simulation.process.client()) as client:
        try:
            return _told(simulation, client.guide(motion))
        except HandRefusedError as error:
            raise _refused(error) from error


@router.post("/release")
def release_arm(simulation: TheSimulation) -> SimulatorState:
    """Let go of arm and pedal."""
    with closing(simulation.process.client()) as client:
        return _told(simulation, client.release())


@router.post("/motions", status_code=201, responses=PROBLEMS.of(422))
def upload_motion(
    simulation: TheSimulation,
    name: Annotated[Name, Query(description="What to call it.")],
    csv: Annotated[
        str, Body(media_type="text/csv", max_length=20_000_000, description="time_s and the five pose columns.")
    ],
) -> Motion:
    """Give the hand a motion of your own: a CSV file of poses."""
    try:
        motion = parse_csv(csv, name)
        motor_angles_deg(motion.poses_deg)
    except (TaughtError, OutOfReachError) as error:
        unusable = texts.MOTION_FILE_UNUSABLE(file=name, reason=text_of(error))
        raise ProblemError(422, "not_a_motion", unusable, clinic_texts.MEND_FILE()) from error
    return simulation.add(motion)


def _told(simulation: Simulation, state: State) -> SimulatorState:
    return SimulatorState(
        pedal_down=state.pedal_down,
        estop_pressed=state.estop_pressed,
        hand=Hand(phase=state.hand.phase, motion=state.hand.motion, left_s=state.hand.left_s),
        motions=simulation.motions(),
    )
