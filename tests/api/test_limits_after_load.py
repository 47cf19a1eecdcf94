"""A doctor may change the limits after a recording was loaded. Its next motion is then refused."""

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from uuid import uuid4

import pytest

from kata.api.contraindication_watch import require_allowed
from kata.clinic.episodes.limits import DoctorLimits
from kata.clinic.episodes.schemas import MotionLimit
from kata.errors import ProblemError
from kata.station.schemas import PatientRef
from kata.station.snapshot_tracker import Occupation

LOADED = DoctorLimits("right", "Dr. Mori", None, None, ())
LOWER = replace(LOADED, motions=(MotionLimit(motion=4, lowest_deg=0.0, highest_deg=60.0),))


def checked(now: DoctorLimits | None) -> None:
    """Check a loaded run of the right shoulder whose present limits in the cache are ``now``."""
    patient = PatientRef(id=uuid4(), name="Abe Jun")
    station: Any = SimpleNamespace(
        occupation=Occupation("run", patient, session_id=uuid4(), side="right", limits=LOADED)
    )
    recordings = {uuid4(): SimpleNamespace(side="left", allowed=LOWER)}
    if now is not None:
        recordings[uuid4()] = SimpleNamespace(side="right", allowed=now)
    known = SimpleNamespace(banner=SimpleNamespace(contraindications_of=lambda side: []), recordings=recordings)
    cache: Any = SimpleNamespace(find_session=lambda session_id: known)
    unused: Any = None
    asyncio.run(require_allowed(station, cache, unused))


@pytest.mark.parametrize("now", [None, LOADED, replace(LOADED)])
def test_unchanged_limits_allow_the_motion(now: DoctorLimits | None) -> None:
    checked(now)


@pytest.mark.parametrize(
    "now",
    [
        LOWER,
        replace(LOADED, max_speed_deg_s=20.0),
        replace(LOADED, max_resistance_level=3),
        replace(LOADED, self_paced_permitted=True),
    ],
)
def test_changed_limits_refuse_the_motion(now: DoctorLimits) -> None:
    with pytest.raises(ProblemError) as refused:
        checked(now)
    assert refused.value.code == "limits_changed"
