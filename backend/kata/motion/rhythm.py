"""Calculates the scapulohumeral rhythm of a motion from the angles of the apparatus' links: the rotation in the shoulder joint for each
degree of the scapula's upward rotation.

Three angles follow from a pose (:mod:`kata.motion.axes`), all in degrees:

* elevation of the upper arm against the trunk: arccos(cos flexion cos(abduction + upward rotation)), by
  :func:`kata.motion.shoulder.humerus_direction`;
* elevation in the shoulder joint: arccos(cos flexion cos abduction), the same without the scapula;
* upward rotation of the scapula (psi, motion 2).

A *pass* is a part of the motion in which the arm is raised or lowered. Within a band of elevation, the joint's and the scapula's angle are
each fitted by a straight line over the elevation. The ratio is the joint's slope divided by the scapula's slope. Because the lines are
fitted over the elevation, which always covers the band, the ratio is defined even if the joint hardly moves, as in a frozen shoulder.

In a band of ``b`` deg in which the scapula turns by ``s``, an error of ``e`` at one end changes the ratio by about ``b e / s^2``. The links
are not bones: these angles do not include slip at the scapula's board and at the cuff. ``docs/explanation/rhythm.md`` states the limits of
the figure.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from kata.motion.axes import CANONICAL_SIDE, POSE_RANGE_DEG, Side
from kata.motion.linkage import Floats, pose_deg
from kata.motion.shoulder import elevation_deg, humerus_direction

Direction = Literal["raising", "lowering"]
Plane = Literal["abduction", "scaption", "flexion", "other", "changing"]
NoRatio = Literal["not_covered", "at_limit", "scapula_still", "scapula_reversed", "joint_reversed"]
"""The reason why a band has no ratio."""
Source = Literal["giphart_2013", "braman_2009"]

BANDS_DEG: Final = ((30.0, 60.0), (60.0, 90.0), (90.0, 120.0))
"""Bands of elevation. Below 30 deg the scapula first settles, so that a ratio has no meaning."""
LIMIT_DEG: Final = POSE_RANGE_DEG[1][1] - 0.5
"""From this upward rotation the apparatus may hold the scapula at the end of its range, so that a ratio would be too high."""
LEAST_SCAPULA_DEG: Final = 2.6
"""A scapula that turns less within 30 deg has no ratio, because half a step of a 12-bit encoder (0.044 deg) could change it by over 0.2."""
LEAST_PASS_DEG: Final = 30.0
"""A pass raises or lowers the arm by at least this angle; a shorter one could not cover a band."""
AHEAD_DEG: Final = 4.0
"""The scapula runs ahead if it turned farther than the sound side's by more than this at the same elevation. The apparatus played back
motion 2 of the same shoulder within +-4 deg (Sun et al. 2025, Section 4.2), so a smaller difference does not show a difference between the
sides.
"""
_TURN_DEG: Final = 10.0
"""The arm has changed its direction if it moved back by this angle. A smaller movement is a hesitation of the hand."""
_GAP_S: Final = 0.5
"""A pass ends if there is no sample for longer than this."""
_STEP_DEG: Final = 0.25
_EDGE_DEG: Final = 2.0
"""A band is covered if the pass comes at least this near to both ends of the band."""
_MOST_ROWS: Final = 60_000
"""Maximum number of rows: ten minutes at 100 Hz. Of a longer motion only every second, third, ... row is used."""
_SAME_PLANE_DEG: Final = 20.0
"""Two passes belong to the same motion if their planes of elevation differ by at most this angle."""
_STEADY_DEG: Final = 30.0
"""A pass whose plane of elevation varies by more than this angle has no plane."""
_FORWARD_DEG: Final = (0.0, 90.0)
_PLANES_DEG: Final[tuple[tuple[Plane, float, float], ...]] = (
    ("abduction", -15.0, 15.0),
    ("scaption", 25.0, 50.0),
    ("flexion", 75.0, 105.0),
)


@dataclass(frozen=True)
class PublishedRatio:
    """A published ratio of healthy people who moved their arms actively. ``deviation``: standard deviation between people, if published."""

    source: Source
    ratio: float
    deviation: float | None


REFERENCES: Final[dict[tuple[Plane, Direction], PublishedRatio]] = {
    ("abduction", "raising"): PublishedRatio("giphart_2013", 2.0, 0.4),
    ("scaption", "raising"): PublishedRatio("giphart_2013", 1.6, 0.5),
    ("flexion", "raising"): PublishedRatio("giphart_2013", 1.1, 0.3),
}
"""Giphart et al., J. Bone Joint Surg. Am. 95 (2013) 238: biplane fluoroscopy, linear regression; eight men, five people in abduction."""
REACHING: Final[dict[Direction, PublishedRatio]] = {
    "raising": PublishedRatio("braman_2009", 2.3, None),
    "lowering": PublishedRatio("braman_2009", 2.7, None),
}
"""Braman et al., J. Shoulder Elbow Surg. 18 (2009) 960: bone pins, reaching overhead in a plane that each person chose."""


@dataclass(frozen=True)
class BandRatio:
    """The ratio within a band of elevation, or the reason for its absence. ``scapula_deg`` and ``joint_deg``: changes of the
    fitted lines.
    """

    from_deg: float
    to_deg: float
    ratio: float | None
    reason: NoRatio | None
    scapula_deg: float | None
    joint_deg: float | None
    passes: int = 1


@dataclass(frozen=True)
class Pass:
    """One raising or lowering of the arm: mean angles for each degree of elevation, ``(k,)`` each, in ascending order of elevation."""

    direction: Direction
    plane: Plane
    plane_deg: float
    elevation_deg: Floats
    scapula_deg: Floats
    joint_deg: Floats


@dataclass(frozen=True)
class Rhythm:
    """The rhythm of all passes in one direction and plane: the widest pass, and the medians of the ratios."""

    widest: Pass
    passes: int
    bands: tuple[BandRatio, ...]
    whole: BandRatio
    """The ratio from 30 deg to the end of the pass, or to the elevation at which the scapula reached its limit."""

    @property
    def reference(self) -> PublishedRatio | None:
        """The published ratio for this plane and direction, if there is one.

        The ratio of overhead reaching is the reference if the plane changes or has no name, because those people chose their own plane.
        """
        widest = self.widest
        if widest.plane in ("changing", "other") and _FORWARD_DEG[0] <= widest.plane_deg <= _FORWARD_DEG[1]:
            return REACHING[widest.direction]
        return REFERENCES.get((widest.plane, widest.direction))


@dataclass(frozen=True)
class MotionRhythm:
    """The rhythms of a motion, and the ranges of elevation and upward rotation in the whole motion."""

    rhythms: tuple[Rhythm, ...]
    elevation_range_deg: tuple[float, float]
    scapula_range_deg: tuple[float, float]
    start_deg: tuple[float, float]
    """Elevation and upward rotation at the first sample."""

    def like(self, other: Pass) -> Pass | None:
        """Return the widest pass in the same direction and plane as ``other``, or None."""
        return next((rhythm.widest for rhythm in self.rhythms if _same_motion(rhythm.widest, other)), None)


@dataclass(frozen=True)
class Lead:
    """Difference between the rotations of this scapula and the sound side's since the start, at the same elevation of the same motion."""

    from_deg: float
    to_deg: float
    largest_deg: float
    """Largest difference; below 0 if the scapula turned less than the sound side's."""
    at_elevation_deg: float
    ahead_from_deg: float | None
    """The lowest elevation at which the scapula runs ahead (:data:`AHEAD_DEG`); None if it does not."""


def rhythm_of(times_s: ArrayLike, motors_deg: ArrayLike, side: Side = CANONICAL_SIDE) -> MotionRhythm:
    """Return the rhythm of motor angles ``(n, 5)`` at times ``(n,)``.

    :raises OutOfReachError: when no pose has the motor angles of a row.
    """
    times = np.asarray(times_s, dtype=np.float64)
    step = max(1, -(-len(times) // _MOST_ROWS))
    return rhythm_of_poses(times[::step], pose_deg(np.asarray(motors_deg, dtype=np.float64)[::step], side))


def rhythm_of_poses(times_s: Floats, poses_deg: Floats) -> MotionRhythm:
    """Return the rhythm of poses ``(n, 5)`` at times ``(n,)``."""
    arm = humerus_direction(poses_deg)
    elevation = elevation_deg(arm)
    joint = np.degrees(np.arccos(np.clip(np.prod(np.cos(np.radians(poses_deg[:, 2:4])), axis=1), -1.0, 1.0)))
    # On the canonical side Y points away from the arm.
    plane = np.degrees(np.arctan2(arm[:, 0], -arm[:, 1]))
    rows = np.column_stack([elevation, poses_deg[:, 1], joint, plane])
    groups: list[list[Pass]] = []
    for part in np.split(rows, np.flatnonzero(np.diff(times_s) > _GAP_S) + 1):
        for first, last in _turns(part[:, 0]):
            new_pass = _pass(part[first : last + 1])
            group = next((group for group in groups if _same_motion(group[0], new_pass)), None)
            if group is None:
                groups.append([new_pass])
            else:
                group.append(new_pass)
    return MotionRhythm(
        tuple(_combined(passes) for passes in groups),
        (float(elevation.min()), float(elevation.max())),
        (float(poses_deg[:, 1].min()), float(poses_deg[:, 1].max())),
        (float(elevation[0]), float(poses_deg[0, 1])),
    )


def lead(own: MotionRhythm, sound: MotionRhythm) -> Lead | None:
    """Return the scapula's lead over the sound side's while the arm is raised in the same plane.

    Both rotations are relative to the start of their motion, because the scapula's board is fastened separately on each side.

    :returns: None without 30 deg of common elevation below the scapula's limit, or if a motion starts with a raised arm.
    """
    raised = next((rhythm.widest for rhythm in own.rhythms if rhythm.widest.direction == "raising"), None)
    other = sound.like(raised) if raised else None
    if raised is None or other is None or max(own.start_deg[0], sound.start_deg[0]) > BANDS_DEG[0][0]:
        return None
    at = np.arange(
        max(raised.elevation_deg[0], other.elevation_deg[0]), min(raised.elevation_deg[-1], other.elevation_deg[-1])
    )
    turned = [np.interp(at, pass_.elevation_deg, pass_.scapula_deg) for pass_ in (raised, other)]
    # At its limit the apparatus holds the scapula back. A difference there is not caused by the shoulder.
    free = np.maximum(*turned) < LIMIT_DEG
    at, ahead = at[free], (turned[0] - own.start_deg[1] - turned[1] + sound.start_deg[1])[free]
    if len(at) < LEAST_PASS_DEG:
        return None
    largest = int(np.argmax(np.abs(ahead)))
    over = at[ahead > AHEAD_DEG]
    return Lead(
        from_deg=float(at[0]),
        to_deg=float(at[-1]),
        largest_deg=float(ahead[largest]),
        at_elevation_deg=float(at[largest]),
        ahead_from_deg=float(over[0]) if len(over) else None,
    )


def _same_motion(one: Pass, other: Pass) -> bool:
    return one.direction == other.direction and abs(one.plane_deg - other.plane_deg) <= _SAME_PLANE_DEG


def _turns(elevation: Floats) -> Iterator[tuple[int, int]]:
    """Yield first and last index of each pass."""
    low = high = 0
    rising: bool | None = None
    for n, value in enumerate(elevation.tolist()):
        low = n if value < elevation[low] else low
        high = n if value > elevation[high] else high
        if rising is not True and value - elevation[low] >= _TURN_DEG:
            yield from _far_enough(elevation, high if rising is False else 0, low, rising)
            rising, high = True, n
        elif rising is not False and elevation[high] - value >= _TURN_DEG:
            yield from _far_enough(elevation, low if rising else 0, high, rising)
            rising, low = False, n
    if rising is not None:
        first, last = (low, high) if rising else (high, low)
        yield from _far_enough(elevation, first, last, rising)


def _far_enough(elevation: Floats, first: int, last: int, rising: bool | None) -> Iterator[tuple[int, int]]:
    if rising is not None and abs(elevation[last] - elevation[first]) >= LEAST_PASS_DEG:
        yield first, last


def _pass(rows: Floats) -> Pass:
    """Return a pass from its rows of elevation, upward rotation, elevation in the joint and plane, ``(n, 4)``."""
    fastest = float(np.abs(np.diff(rows[:, 0])).max())
    finer = max(1, int(np.ceil(fastest / _STEP_DEG)))
    at = np.linspace(0, len(rows) - 1, (len(rows) - 1) * finer + 1)
    fine = np.column_stack([np.interp(at, np.arange(len(rows)), column) for column in rows.T])
    degree = np.floor(fine[:, 0]).astype(int)
    degree -= degree.min()
    count = np.bincount(degree)
    means = np.column_stack([np.bincount(degree, column) / np.maximum(count, 1) for column in fine.T])[count > 0]
    raised = means[means[:, 0] >= BANDS_DEG[0][0], 3]
    middle = float(np.median(raised)) if len(raised) else 0.0
    spread = float(np.ptp(np.percentile(raised, (10, 90)))) if len(raised) else 0.0
    return Pass(
        "raising" if rows[-1, 0] > rows[0, 0] else "lowering",
        _plane(middle, spread),
        middle,
        *means[:, :3].T,
    )


def _plane(middle_deg: float, spread_deg: float) -> Plane:
    if spread_deg > _STEADY_DEG:
        return "changing"
    return next((name for name, low, high in _PLANES_DEG if low <= middle_deg <= high), "other")


def _combined(passes: Sequence[Pass]) -> Rhythm:
    by_width = sorted(passes, key=lambda pass_: float(np.ptp(pass_.elevation_deg)), reverse=True)
    bands = tuple(_median([_band(pass_, low, high) for pass_ in by_width]) for low, high in BANDS_DEG)
    return Rhythm(by_width[0], len(passes), bands, _median([_whole(pass_) for pass_ in by_width]))


def _median(ratios: Sequence[BandRatio]) -> BandRatio:
    """Return the medians of the available ratios. Without any ratio, return the first entry with its reason."""
    available = [ratio for ratio in ratios if ratio.ratio is not None]
    if not available:
        return ratios[0]

    def middle(name: str) -> float:
        return float(np.median([getattr(ratio, name) for ratio in available]))

    return BandRatio(
        middle("from_deg"),
        middle("to_deg"),
        middle("ratio"),
        None,
        middle("scapula_deg"),
        middle("joint_deg"),
        len(available),
    )


def _whole(pass_: Pass) -> BandRatio:
    """Return the ratio from 30 deg to the end of the pass, or to the elevation at which the scapula reached its limit."""
    low = max(BANDS_DEG[0][0], float(pass_.elevation_deg[0]))
    at_limit_deg = pass_.elevation_deg[(np.abs(pass_.scapula_deg) >= LIMIT_DEG) & (pass_.elevation_deg >= low)]
    high = float(at_limit_deg[0]) - 1.0 if len(at_limit_deg) else float(pass_.elevation_deg[-1])
    if high - low < LEAST_PASS_DEG - _EDGE_DEG:
        return BandRatio(low, max(low, high), None, "at_limit" if len(at_limit_deg) else "not_covered", None, None)
    return _band(pass_, low, high)


def _band(pass_: Pass, low: float, high: float) -> BandRatio:
    at = pass_.elevation_deg
    inside = (at >= low) & (at <= high)
    covered = at[0] <= low + _EDGE_DEG and at[-1] >= high - _EDGE_DEG
    if not covered:
        return BandRatio(low, high, None, "not_covered", None, None)
    if np.any(np.abs(pass_.scapula_deg[inside]) >= LIMIT_DEG):
        return BandRatio(low, high, None, "at_limit", None, None)
    scapula, joint = (_slope(at[inside], part[inside]) * (high - low) for part in (pass_.scapula_deg, pass_.joint_deg))
    reason = _why_none(scapula, joint, high - low)
    return BandRatio(low, high, None if reason else joint / scapula, reason, scapula, joint)


def _slope(x: Floats, y: Floats) -> float:
    """Return the slope of the straight line fitted to ``y`` over ``x``. The live rhythm fits many, and a general fit takes ten times as long."""
    from_middle = x - x.mean()
    return float(from_middle @ y / (from_middle @ from_middle))


def _why_none(scapula_deg: float, joint_deg: float, band_deg: float) -> NoRatio | None:
    if abs(scapula_deg) < LEAST_SCAPULA_DEG * np.sqrt(band_deg / LEAST_PASS_DEG):
        return "scapula_still"
    if scapula_deg < 0:
        return "scapula_reversed"
    return "joint_reversed" if joint_deg < 0 else None
