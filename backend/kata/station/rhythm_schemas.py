"""Response models of rhythm curves. The live state and the rhythm of a stored motion use them."""

from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from kata.motion.linkage import Floats
from kata.motion.rhythm import BandRatio, Direction, NoRatio, Plane, Rhythm, Source

CurveOf = Literal["taught", "played", "sound"]

_RATIO = "Degrees in the shoulder joint for each degree of upward rotation of the scapula."


class _Schema(BaseModel):
    model_config = ConfigDict(frozen=True)


class RhythmReference(_Schema):
    """A published ratio of healthy people who moved their arm themselves, measured on bones. It is not a normal range for this
    apparatus.
    """

    source: Source
    ratio: float = Field(description=_RATIO, examples=[2.0])
    ratio_deviation: float | None = Field(
        description="Standard deviation between people; null if none was published.", examples=[0.4]
    )


class RhythmBand(_Schema):
    """The ratio within a band of elevation, or the reason why there is none."""

    from_deg: float = Field(description="Elevation of the upper arm at the band's lower end, degrees.")
    to_deg: float = Field(description="Elevation of the upper arm at the band's upper end, degrees.")
    ratio: float | None = Field(description=f"{_RATIO} The median of the passes.", examples=[2.1])
    reason: NoRatio | None = Field(description="Reason why there is no ratio; null if there is one.")
    scapula_deg: float | None = Field(description="Upward rotation of the scapula within the band, degrees.")
    joint_deg: float | None = Field(
        description="Increase of the elevation in the shoulder joint within the band, degrees."
    )
    passes: int = Field(ge=1, description="Number of passes with this ratio.")


class RhythmCurve(_Schema):
    """Upward rotation of the scapula over the elevation of the upper arm while the arm is raised or lowered. Of several passes, it is
    the widest.
    """

    of: CurveOf
    direction: Direction
    plane: Plane = Field(
        description="Plane in which the arm is raised: abduction (at the side), scaption (in the scapula's plane), flexion (forward), other, "
        "or changing."
    )
    plane_deg: float = Field(
        description="Median angle of this plane from 30 deg of elevation on: 0 at the side, 90 forward."
    )
    passes: int = Field(ge=1)
    elevation_deg: list[float] = Field(description="Elevation of the upper arm against the trunk, ascending, degrees.")
    scapula_deg: list[float] = Field(description="Upward rotation of the scapula at each elevation, degrees.")
    bands: list[RhythmBand] = Field(description="Bands of elevation: 30 to 60, 60 to 90 and 90 to 120 deg.")
    whole: RhythmBand = Field(
        description="Band from 30 deg to the end of the pass, or to the elevation at which the scapula reached the apparatus's limit."
    )
    reference: RhythmReference | None = Field(
        description="Null if there is no published ratio for direction and plane."
    )


class RhythmLive(_Schema):
    """Rhythm of the present take or playback so far, in angles of the apparatus's links."""

    motion_id: str = Field(description="Another take or run has another value.", examples=["run 1"])
    start_elevation_deg: float = Field(description="Elevation of the upper arm at the start of the motion, degrees.")
    start_scapula_deg: float = Field(description="Upward rotation of the scapula at the start of the motion, degrees.")
    curves: list[RhythmCurve] = Field(
        description="Curves and ratios of the last two minutes. Empty until the arm has been raised or lowered by 30 deg."
    )


def curve_of(of: CurveOf, motion_rhythm: Rhythm) -> RhythmCurve:
    """Return the response model of a curve with its ratios."""
    curve, norm = motion_rhythm.widest, motion_rhythm.reference
    reference = norm and RhythmReference(source=norm.source, ratio=norm.ratio, ratio_deviation=norm.deviation)
    return RhythmCurve(
        of=of,
        direction=curve.direction,
        plane=curve.plane,
        plane_deg=rounded(curve.plane_deg),
        passes=motion_rhythm.passes,
        elevation_deg=_column(curve.elevation_deg),
        scapula_deg=_column(curve.scapula_deg),
        bands=[_band(band) for band in motion_rhythm.bands],
        whole=_band(motion_rhythm.whole),
        reference=reference,
    )


def rounded(value: float) -> float:
    """Return an angle or ratio with two decimals."""
    return round(value, 2)


def maybe_rounded(value: float | None) -> float | None:
    """Return an angle or ratio with two decimals, or None."""
    return None if value is None else rounded(value)


def _band(band: BandRatio) -> RhythmBand:
    return RhythmBand(
        from_deg=rounded(band.from_deg),
        to_deg=rounded(band.to_deg),
        ratio=maybe_rounded(band.ratio),
        reason=band.reason,
        scapula_deg=maybe_rounded(band.scapula_deg),
        joint_deg=maybe_rounded(band.joint_deg),
        passes=band.passes,
    )


def _column(values: Floats) -> list[float]:
    two_decimals: list[float] = np.round(values, 2).tolist()
    return two_decimals
