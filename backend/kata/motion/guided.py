"""Lets the scapula of a motion follow the rhythm of another motion, which the sound side of the same patient performed.

The upper arm keeps its direction in space at every time. The upward rotation of the scapula changes with the elevation of the arm as it
did in the other motion, beginning at the taught pose. Shoulder abduction (motor 3) takes up the difference: both turn the arm about
the same axis (:func:`kata.motion.shoulder.humerus_direction`). Poses have the same signs on both sides, so the rhythm is mirrored.

Raising and lowering have their own curves. After a turn, the scapula changes from one curve to the other within
:data:`BLEND_DEG` of elevation, so that it does not jump.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from kata.motion import texts
from kata.motion.axes import Side
from kata.motion.edit import NAME_LETTERS, EditError, Motion
from kata.motion.linkage import Floats, motor_angles_deg, pose_deg
from kata.motion.rhythm import LEAST_PASS_DEG, Direction, MotionRhythm, Pass, rhythm_of_poses
from kata.motion.shoulder import elevation_deg, humerus_direction

BLEND_DEG: Final = 15.0
"""After a turn the scapula changes to the other direction's curve within this elevation."""
BEYOND_DEG: Final = 3.0
"""The arm may be raised this much farther than in the sound side's motion. There the scapula keeps its angle."""
_SMOOTHED_DEG: Final = 7
"""The curves have one value for each degree, whose noise would shake the scapula. They are averaged over this number of degrees, twice."""


@dataclass(frozen=True)
class _Curves:
    """The scapula's angle over the elevation while the arm is raised, and while it is lowered."""

    raising: Pass
    lowering: Pass

    def at(self, elevation: Floats, lowered: Floats) -> Floats:
        """Return the scapula's angle. ``lowered``: 0 on the curve of raising, 1 on that of lowering."""
        up, down = (np.interp(elevation, *_smoothed(one)) for one in (self.raising, self.lowering))
        share = lowered * lowered * (3 - 2 * lowered)
        angle: Floats = up + share * (down - up)
        return angle


@dataclass(frozen=True)
class GuidingMotion:
    """A motion of the sound side: name of its recording, and its rhythm."""

    name: str
    rhythm: MotionRhythm


def guided(motion: Motion, side: Side, sound: Sequence[GuidingMotion]) -> Motion:
    """Return the motion with the scapula following the rhythm of the first motion of the sound side in the same plane.

    Times and the upper arm's direction stay the same.

    :param side: side of the motion; ``sound``: motions of the other side.
    :raises EditError: when the arm is never raised by 30 deg, no motion has this plane, or the arm is raised farther than in that motion.
    :raises OutOfReachError: when the links cannot close for a row.
    """
    poses = pose_deg(motion.angles_deg, side)
    own = rhythm_of_poses(motion.times_s, poses)
    if not own.rhythms:
        raise EditError(texts.GUIDED_NOT_RAISED(least_deg=LEAST_PASS_DEG))
    name, curves = next(((one.name, found) for one in sound if (found := _curves(own, one.rhythm))), ("", None))
    if curves is None:
        raise EditError(texts.GUIDED_OTHER_PLANE())
    elevation = elevation_deg(humerus_direction(poses))
    highest = float(elevation.max())
    top = min(float(one.elevation_deg[-1]) for one in (curves.raising, curves.lowering))
    if highest > top + BEYOND_DEG:
        raise EditError(texts.GUIDED_TOO_HIGH(recording=name, highest_deg=highest, sound_deg=top))
    target = curves.at(elevation, _lowered(elevation))
    change = poses[0, 1] + target - target[0] - poses[:, 1]
    changed = poses.copy()
    changed[:, 1] += change
    changed[:, 2] -= change
    done = (*motion.done, texts.DONE_GUIDED(recording=name[:NAME_LETTERS]))
    return replace(motion, angles_deg=motor_angles_deg(changed, side), done=done)


def _curves(own: MotionRhythm, sound: MotionRhythm) -> _Curves | None:
    """Return the curves of the sound side's motion, or None unless it has the plane of every pass of the own motion.

    Without a curve of lowering, the scapula goes back on the curve of raising, and the reverse.
    """
    found: dict[str, Pass] = {}
    for rhythm in own.rhythms:
        other: Direction = "lowering" if rhythm.widest.direction == "raising" else "raising"
        like = sound.like(rhythm.widest) or sound.like(replace(rhythm.widest, direction=other))
        if like is None or like is not found.setdefault(like.direction, like):
            return None
    either = next(iter(found.values()))
    return _Curves(found.get("raising", either), found.get("lowering", either))


def _lowered(elevation: Floats) -> Floats:
    """Return 0 while the arm is raised and 1 while it is lowered, ``(n,)``. It changes in proportion to the elevation after a turn.

    This is a play operator: a hesitation of the hand moves it only a little.
    """
    behind = np.empty_like(elevation)
    place = float(elevation[0]) - BLEND_DEG
    for n, value in enumerate(elevation.tolist()):
        place = min(max(place, value - BLEND_DEG), value)
        behind[n] = place
    share: Floats = 1.0 - (elevation - behind) / BLEND_DEG
    return share


def _smoothed(curve: Pass) -> tuple[Floats, Floats]:
    """Return elevation and scapula of a curve. Moving averages remove noise; the ends are continued straight, so they do not bend."""
    half = _SMOOTHED_DEG // 2
    scapula = curve.scapula_deg
    for _ in range(2):
        ends = (2 * scapula[0] - scapula[half:0:-1], 2 * scapula[-1] - scapula[-2 : -half - 2 : -1])
        scapula = np.convolve(
            np.concatenate([ends[0], scapula, ends[1]]), np.full(_SMOOTHED_DEG, 1 / _SMOOTHED_DEG), "valid"
        )
    return curve.elevation_deg, scapula
