"""Replaces a part of a motion by a part that was taught again. The motion outside the part does not change its path.

A hand does not begin and end exactly at the marks. The new part is therefore moved to them: at each end it is shifted by its distance from
the mark, and the shift decreases by minimum jerk (:mod:`kata.motion.approach`). Between the two shifts it is as it was taught. The
motion comes to rest at the marks, as at every join.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from kata.motion import texts
from kata.motion.approach import MinimumJerkMove
from kata.motion.edit import JOIN_SPEED_DEG_S, NAME_LETTERS, EditError, Motion, MotionBuilder, eased, halves
from kata.motion.linkage import Floats

MAX_GAP_DEG: Final = 20.0
"""Largest distance of an end of the new part from its mark. At a larger one the part was probably taught for another place."""
SHORTEST_S: Final = 0.5
"""Shortest part that can be replaced."""


def retaught(motion: Motion, start_s: float, end_s: float, part: Motion, name: str) -> Motion:
    """Return the motion with the part between two times replaced by ``part``, whose recording has this name.

    :raises EditError: when a mark is not within the motion, or an end of the part is too far from its mark.
    """
    if not (start_s >= 0 and end_s <= motion.duration_s and end_s - start_s >= SHORTEST_S):
        raise EditError(
            texts.RETAUGHT_MARKS_REFUSED(start_s=start_s, end_s=end_s, least_s=SHORTEST_S, duration_s=motion.duration_s)
        )
    marks = motion.at(np.array([start_s, end_s]))
    gaps = marks - part.angles_deg[[0, -1]]
    if np.abs(gaps).max() > MAX_GAP_DEG:
        end, axis = np.unravel_index(int(np.argmax(np.abs(gaps))), gaps.shape)
        raise EditError(
            texts.RETAUGHT_TOO_FAR(
                motor=int(axis) + 1,
                distance_deg=float(abs(gaps[end, axis])),
                at_s=(start_s, end_s)[int(end)],
                most_deg=MAX_GAP_DEG,
            )
        )
    line = MotionBuilder()
    before, after = halves(motion, start_s)[0], halves(motion, end_s)[1]
    if before:
        line.add(eased(before, start=False))
    line.add(eased(_moved_to_marks(part, gaps)))
    if after:
        line.add(eased(after, end=False))
    done = texts.DONE_RETAUGHT(start_s=start_s, end_s=end_s, recording=name[:NAME_LETTERS])
    return line.motion((*motion.done, done))


def _moved_to_marks(part: Motion, gaps: Floats) -> Motion:
    """Return the part, shifted at its ends by the gaps ``(2, 5)``. A shift lasts at most as long as the part."""
    still = np.zeros(gaps.shape[1])
    shift = np.zeros_like(part.angles_deg)
    for gap, elapsed_s in ((gaps[0], part.times_s), (gaps[1], part.duration_s - part.times_s)):
        move = MinimumJerkMove(gap, still, JOIN_SPEED_DEG_S)
        faster = max(1.0, move.duration_s / part.duration_s)
        shift += np.array([move.at(float(time_s) * faster) for time_s in elapsed_s])
    return replace(part, angles_deg=part.angles_deg + shift)
