"""Chooses the paths between the arm and a recording so that they stay within the limits of the arm's pose.

A setpoint beyond these limits is moved back inside. On a path that leads through them, it could jump where limits meet, and the
setpoint gate would cut torque.
"""

from collections.abc import Sequence

import numpy as np

from kata.device.movement import RAMP_S, Movement
from kata.device.run import Run
from kata.device.run_limits import PATH_TOLERANCE_DEG
from kata.motion.approach import MinimumJerkMove, PathSequence, unidirectional_approach
from kata.motion.linkage import Floats
from kata.motion.path import Path


def approach_path(run: Run, here_deg: Floats) -> tuple[Path, float]:
    """Return the path from the arm at ``here_deg``, ``(5,)``, to the recording's start, and by how many degrees it exceeds the limits.

    It passes a pose beside the start, so that every axis arrives from the side to which it will leave. If that detour exceeds the limits,
    the path is straight.
    """
    start_deg, departure_deg = run.trajectory.start_deg, run.trajectory.departure_deg
    speed_deg_s = run.config.approach_speed_deg_s
    excess_deg = run.limits.path_excess_deg(here_deg, start_deg + departure_deg, start_deg)
    if excess_deg <= PATH_TOLERANCE_DEG:
        return unidirectional_approach(here_deg, start_deg, departure_deg, speed_deg_s), excess_deg
    return MinimumJerkMove(here_deg, start_deg, speed_deg_s), run.limits.path_excess_deg(here_deg, start_deg)


def straight_return_path(run: Run, here_deg: Sequence[float]) -> MinimumJerkMove | None:
    """Return the straight path from the setpoint ``here_deg``, ``(5,)``, to the end of the return; None if it exceeds the limits."""
    assert run.return_to_deg is not None
    path = MinimumJerkMove(np.array(here_deg), run.return_to_deg, run.config.approach_speed_deg_s)
    return path if run.limits.path_excess_deg(path.start_deg, path.goal_deg) <= PATH_TOLERANCE_DEG else None


def return_path_via_start(run: Run, here_deg: Sequence[float]) -> PathSequence:
    """Return the path from the setpoint ``here_deg``, ``(5,)``, through the recording's start to the end of the return.

    From the start the path stays within the limits; see :meth:`kata.device.run.Run.begin`.
    """
    assert run.return_to_deg is not None
    start_deg, speed_deg_s = run.trajectory.start_deg, run.config.approach_speed_deg_s
    return PathSequence(
        [
            MinimumJerkMove(np.array(here_deg), start_deg, speed_deg_s),
            MinimumJerkMove(start_deg, run.return_to_deg, speed_deg_s),
        ]
    )


def reverse_along_recording(run: Run, movement: Movement) -> None:
    """Move back along the recording, with no axis faster than on an approach."""
    fastest = np.max(run.trajectory.top_speed_deg_s)
    movement.top_override = min(1.0, run.config.approach_speed_deg_s / max(float(fastest), 1.0))
    movement.direction, movement.ramp_s, movement.reverse_to_s = -1, RAMP_S, 0.0
