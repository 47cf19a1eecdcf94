"""Pushes of a patient against the drive in every phase of a playback and of an end-feel test, and the answers that the device must give."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, get_args

import msgspec
import numpy as np
from hypothesis import strategies as st

from kata.device.ipc_messages import Approach, EndFeel, Pause, Play, Return
from kata.motion.trajectory import Trajectory
from tests.support.stepped import Stepped
from tests.support.trajectories import LOAD

Phase = Literal[
    "approach", "play", "hold", "pause", "reversal", "return",
    "paused reversal", "play after a paused reversal", "reversal to the start", "way back of a test", "paused test",
]  # fmt: skip
_ANSWERS: Final[dict[Phase, str]] = {
    "approach": "load_on_the_way",
    "play": "load_reversal",
    "hold": "load_reversal",
    "pause": "load_while_held",
    "reversal": "load_on_the_way",
    "return": "load_on_the_way",
    "paused reversal": "load_while_held",
    "play after a paused reversal": "load_reversal",
    "reversal to the start": "load_while_held",
    "way back of a test": "load_on_the_way",
}
_REVERSED: Final = frozenset({"reversal", "paused reversal", "play after a paused reversal", "reversal to the start"})
"""Phases after a first push, which turned the arm back."""
_TESTS: Final = frozenset({"way back of a test", "paused test"})
_FASTEST_TEST_DEG_S: Final = 10.0
_LEAST_TEST_LEVEL: Final = 3
"""At half of level 1 a test ends at once."""
_STROKE_DEG: Final = 30.0
_MIDDLE_DEG: Final = (12.0, 110.5, 60.0, 60.0, -25.0)
"""About the middle of each axis' range. The stroke, and the arm 6.5 deg before it, are inside."""
_ANSWER_CYCLES: Final = 12
"""0.1 s, and one cycle each to detect the push and to react."""
_YIELDS_S: Final = 0.5
_YIELDED_DEG: Final = 0.1
"""Least distance that a held arm has yielded to its motor's rated torque after :data:`_YIELDS_S`."""
_GIVEN_WAY_DEG: Final = 0.5
"""Least distance that a paused end-feel test has given way to more than its torque after :data:`_YIELDS_S`, if the way out was twice as long."""


@dataclass(frozen=True)
class Push:
    """A push against one motor."""

    phase: Phase
    axis: int
    speed_deg_s: float
    """Speed of the recording."""
    level: int
    above: float
    """Torque divided by the level's."""
    direction: int
    """1 or -1, where the axis is at rest. A moving axis is pushed against its movement."""

    @property
    def moving_axis(self) -> int:
        """The axis that the recording moves: the pushed axis, but another one on the way back of an end-feel test."""
        return (self.axis + 1) % 5 if self.phase == "way back of a test" else self.axis


def pushes() -> st.SearchStrategy[Push]:
    """Draw a push. Nearly half of the speeds are below 2 deg/s."""
    return st.builds(
        Push,
        st.sampled_from(get_args(Phase)),
        axis=st.integers(0, 4),
        speed_deg_s=st.floats(-3.0, 5.9).map(lambda exponent: min(60.0, max(0.05, 2.0**exponent))),
        level=st.integers(1, 25),
        above=st.floats(1.001, 1.02),
        direction=st.sampled_from([-1, 1]),
    )


def hold_answered(folder: Path, push: Push) -> None:
    """Assert that a torque below the level has no answer, and one above it the answer of its phase, in time."""
    stepped = Stepped(folder)
    speed_deg_s = min(push.speed_deg_s, _FASTEST_TEST_DEG_S) if push.phase in _TESTS else push.speed_deg_s
    trajectory = _there_and_hold(push.moving_axis, speed_deg_s)
    stepped.apparatus.angles_deg = trajectory.start_deg.tolist()
    stepped.apparatus.angles_deg[push.axis] -= 6.5
    stepped.forward(0.1)
    rated_nm = stepped.config.axes[push.axis].max_torque_nm
    level = max(push.level, _LEAST_TEST_LEVEL) if push.phase in _TESTS else push.level
    level_nm = level / 25 * 0.98 * rated_nm
    chosen_nm = level_nm / 2
    load = msgspec.structs.replace(LOAD, resistance_level=level)
    if push.phase in _TESTS:
        test = EndFeel(motor=push.moving_axis + 1, torque_nm=chosen_nm, expected_nm=(0.0, 0.0), repetitions=1)
        load = msgspec.structs.replace(load, end_feel=test)
    assert stepped.send(load, trajectory) is None
    direction = _reach(stepped, push.phase, trajectory, push.axis, 1.01 * level_nm) or push.direction
    if push.phase == "paused test":
        _hold_gives_way(stepped, push.axis, chosen_nm * push.above, trajectory)
        return
    before = _answers(stepped)

    stepped.apparatus.torques_nm[push.axis] = direction * level_nm / push.above
    stepped.forward(0.15)
    assert _answers(stepped) == before
    at_deg = stepped.apparatus.angles_deg[push.axis]
    stepped.apparatus.torques_nm[push.axis] = direction * level_nm * push.above
    for _ in range(_ANSWER_CYCLES):
        stepped.cycle()
    assert _answers(stepped) == [*before, _ANSWERS[push.phase]]
    if _ANSWERS[push.phase] == "load_while_held":
        stepped.apparatus.torques_nm[push.axis] = direction * rated_nm
        stepped.forward(_YIELDS_S)
        assert direction * (at_deg - stepped.apparatus.angles_deg[push.axis]) >= _YIELDED_DEG


def _hold_gives_way(stepped: Stepped, axis: int, torque_nm: float, trajectory: Trajectory) -> None:
    """Assert that a paused end-feel test gives way to more than its torque, back along its way out."""
    stepped.forward(_YIELDS_S)
    at_deg = stepped.apparatus.angles_deg[axis]
    stepped.forward(_YIELDS_S)
    assert abs(stepped.apparatus.angles_deg[axis] - at_deg) <= 0.01
    stepped.apparatus.torques_nm[axis] = torque_nm
    stepped.forward(_YIELDS_S)
    way_out_deg = at_deg - float(trajectory.start_deg[axis])
    assert at_deg - stepped.apparatus.angles_deg[axis] >= min(_GIVEN_WAY_DEG, way_out_deg / 2)
    assert _answers(stepped) == []


def _there_and_hold(axis: int, speed_deg_s: float) -> Trajectory:
    """Return a recording in which one axis moves for eight seconds or through its stroke, and holds for three."""
    moving_s = min(8.0, _STROKE_DEG / speed_deg_s)
    times = np.arange(0.0, moving_s + 3.0, 0.01)
    angles = np.tile(np.array(_MIDDLE_DEG), (len(times), 1))
    angles[:, axis] += np.minimum(times, moving_s) * speed_deg_s - min(_STROKE_DEG, 8.0 * speed_deg_s) / 2
    return Trajectory(times, angles)


def _answers(stepped: Stepped) -> list[str]:
    """Return all reactions to resistance so far."""
    return [event.code for event in stepped.link.events if event.code == "load_reversal"] + stepped.causes()


def _reach(stepped: Stepped, phase: Phase, trajectory: Trajectory, axis: int, strong_nm: float) -> int:
    """Bring a loaded run into a phase. Return the direction in which the axis moves there, 0 at rest."""
    assert stepped.send(Approach()) is None
    if phase == "approach":
        stepped.forward(0.3)
        return 1
    stepped.until("paused")
    moving_s = trajectory.duration_s - 3.0
    if phase in ("pause", "return"):
        stepped.forward(0.1)
    if phase == "return":
        stepped.send(Return())
        stepped.forward(0.5)
        return -1
    if phase == "pause":
        return 0
    stepped.send(Play())
    played_s = {"hold": moving_s + 1.0, "reversal to the start": 0.3}.get(phase, 0.6 * moving_s)
    stepped.forward(played_s)
    if phase in _REVERSED:
        stepped.apparatus.torques_nm[axis] = strong_nm
        for _ in range(_ANSWER_CYCLES):
            stepped.cycle()
        assert _answers(stepped) == ["load_reversal"]
    if phase == "reversal":
        stepped.apparatus.torques_nm[axis] = 0.0
        stepped.forward(0.14)
        return -1
    if phase == "way back of a test":
        # The patient ends the test.
        stepped.apparatus.pedal_down = True
        stepped.forward(0.2)
        return 0
    if phase == "reversal to the start":
        stepped.until("paused", 0.5)
    elif phase in ("paused reversal", "play after a paused reversal", "paused test"):
        assert stepped.send(Pause()) is None
        stepped.until("paused", 0.5)
    if phase == "play after a paused reversal":
        assert stepped.send(Play()) is None
    return 0 if phase == "hold" else 1
