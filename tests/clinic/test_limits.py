"""A doctor's limits, checked against a motion before it is played."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from uuid import UUID

import numpy as np
import pytest

from kata.clinic.episodes import limits, service
from kata.clinic.episodes.schemas import SPEED_RANGE_DEG_S, EpisodeCreate, EpisodeUpdate
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.database.engine import Database
from kata.device.config_rules import RANGES
from kata.errors import ProblemError
from kata.motion.axes import BASIC_MOTIONS, Side
from kata.motion.edit import Motion
from kata.motion.linkage import motor_angles_deg
from kata.motion.method import Method
from kata.motion.reach import FREE_DEG, ArmLimits
from tests.support.databases import upgraded_file

TIMES_S = np.arange(0, 4.005, 0.01)


class Clinic:
    """A patient whose right shoulder is treated."""

    def __init__(self, database: Database) -> None:
        self._database = database
        with database.write() as session:
            patient = patients.create(session, PatientCreate(clinic_number="1", name="N", affected_side="right"))
            self._patient_id: UUID = patient.id
            self._episode_id = patient.episodes[0].id

    def also_treat(self, side: Side) -> None:
        """Limit the other shoulder's episode from now on."""
        with self._database.write() as session:
            self._episode_id = service.open_new(session, self._patient_id, EpisodeCreate(side=side)).id

    def allow(self, **given: Any) -> None:
        with self._database.write() as session:
            service.change(session, self._episode_id, EpisodeUpdate(limits_by="Dr. Mori", **given))

    def check(
        self, motion: Motion, level: int = 10, side: Side = "right", method: Method = "smooth"
    ) -> limits.MotorLimits:
        with self._database.read() as session:
            return limits.allowed(session, self._patient_id, side).check(motion, level, method)


@pytest.fixture
def clinic(tmp_path: Path) -> Iterator[Clinic]:
    database = Database(upgraded_file(tmp_path / "kata.db"))
    yield Clinic(database)
    database.close()


def moved(axis: int, to_deg: float, side: Side = "right", abduction_deg: float = 10.0) -> Motion:
    """Return a motion in which one angle of the body reaches its highest value at 2 s and returns."""
    pose = np.zeros((len(TIMES_S), 5))
    pose[:, 2] = abduction_deg
    pose[:, axis - 1] = pose[0, axis - 1] + (to_deg - pose[0, axis - 1]) * (0.5 - 0.5 * np.cos(np.pi * TIMES_S / 2))
    return Motion(TIMES_S, motor_angles_deg(pose, side))


def refusal(clinic: Clinic, motion: Motion, **given: Any) -> ProblemError:
    with pytest.raises(ProblemError) as refused:
        clinic.check(motion, **given)
    assert refused.value.message.endswith(".")
    assert refused.value.next_step
    return refused.value


@pytest.mark.parametrize(
    ("motion", "axis", "top_deg", "abduction_deg"),
    [
        (1, 1, 15.0, 10.0),
        (2, 2, 12.0, 10.0),
        (3, 4, 60.0, 80.0),
        (4, 3, 70.0, 10.0),
        (5, 4, 60.0, 10.0),
        (6, 5, -40.0, 10.0),
    ],
)
def test_recording_beyond_a_limit_is_refused_with_both_angles(
    clinic: Clinic, motion: int, axis: int, top_deg: float, abduction_deg: float
) -> None:
    moving = moved(axis, top_deg, "right", abduction_deg)
    inside = top_deg + np.sign(top_deg)
    clinic.allow(limits=[{"motion": motion, "highest_deg" if top_deg > 0 else "lowest_deg": inside}])
    clinic.check(moving)

    beyond = top_deg - np.sign(top_deg)
    clinic.allow(limits=[{"motion": motion, "highest_deg" if top_deg > 0 else "lowest_deg": beyond}])
    refused = refusal(clinic, moving)
    assert (refused.status, refused.code) == (422, "beyond_doctors_limit")
    assert refused.message.startswith(f"Motion {motion} ({BASIC_MOTIONS[motion - 1].name.lower()}) would go to ")
    assert f"no {'more' if top_deg > 0 else 'less'} than {beyond:g}°." in refused.message
    said_deg, said_s = (
        float(refused.message.split("° at ")[0].split()[-1]),
        float(refused.message.split(" s; ")[0].split()[-1]),
    )
    assert said_deg == pytest.approx(top_deg, abs=0.2)
    assert said_s == pytest.approx(2.0, abs=0.1)


def test_on_the_left_the_bodys_angle_counts_too(clinic: Clinic) -> None:
    clinic.also_treat("left")
    clinic.allow(limits=[{"motion": 2, "highest_deg": 8.0}])
    clinic.check(moved(2, 7.0, "left"), side="left")
    clinic.check(moved(2, -12.0, "left"), side="left")
    assert refusal(clinic, moved(2, 9.0, "left"), side="left").code == "beyond_doctors_limit"


def test_horizontal_flexion_is_limited_once_the_arm_is_raised(clinic: Clinic) -> None:
    clinic.allow(limits=[{"motion": 3, "highest_deg": 20.0}])
    clinic.check(moved(4, 30.0, abduction_deg=10.0))
    assert refusal(clinic, moved(4, 60.0, abduction_deg=10.0)).code == "beyond_doctors_limit"
    assert refusal(clinic, moved(4, 60.0, abduction_deg=80.0)).code == "beyond_doctors_limit"


def test_refused_value_never_reads_like_an_allowed_one(clinic: Clinic) -> None:
    clinic.allow(limits=[{"motion": 4, "highest_deg": 70.0}])
    assert "70.1°" in refusal(clinic, moved(3, 70.02)).message


def test_device_receives_the_limits_of_single_motors(clinic: Clinic) -> None:
    still = moved(3, 10.5)
    assert clinic.check(still) == ()
    clinic.allow(limits=[{"motion": 1, "highest_deg": 10.0}])
    assert clinic.check(still) == ()
    free = (-360.0, 360.0)
    clinic.allow(limits=[{"motion": 4, "lowest_deg": 0.0, "highest_deg": 90.0}, {"motion": 6, "lowest_deg": -30.0}])
    assert clinic.check(still) == (free, free, (0.0, 90.0), free, (-30.0, 360.0))


def test_device_receives_the_range_of_motor_4_for_both_motions(clinic: Clinic) -> None:
    still = moved(3, 10.5)
    clinic.allow(limits=[{"motion": 5, "lowest_deg": -10.0, "highest_deg": 120.0}])
    assert clinic.check(still)[3] == (-360.0, 360.0)
    clinic.allow(limits=[{"motion": 5, "lowest_deg": -10.0, "highest_deg": 120.0}, {"motion": 3, "highest_deg": 90.0}])
    assert clinic.check(still)[3] == (-360.0, 120.0)


def test_a_higher_level_than_the_doctor_allows_is_refused(clinic: Clinic) -> None:
    clinic.allow(max_resistance_level=12)
    clinic.check(moved(3, 40.0), level=12)
    refused = refusal(clinic, moved(3, 40.0), level=13)
    assert refused.code == "level_not_allowed"
    assert "12" in refused.message
    assert "Dr. Mori" in refused.message


@pytest.mark.parametrize("method", ["smooth", "paper"])
def test_a_motion_faster_than_the_doctor_allows_is_refused(clinic: Clinic, method: Method) -> None:
    """Motor 3 goes 40 deg up in 2 s: 31.4 deg/s in the middle, 31.3 over a tenth of a second."""
    lift = moved(3, 50.0)
    clinic.allow(max_speed_deg_s=31.5)
    clinic.check(lift, method=method)
    clinic.allow(max_speed_deg_s=31.0)
    refused = refusal(clinic, lift, method=method)
    assert (refused.status, refused.code) == (422, "too_fast_for_doctor")
    assert re.fullmatch(
        r"Motor 3 would move at 31\.[34]°/s at (0\.9|1\.0|2\.9|3\.0) s; Dr\. Mori allows no more than 31°/s\.",
        refused.message,
    )


def test_without_a_speed_limit_the_station_sets_the_speed(clinic: Clinic) -> None:
    clinic.allow(max_speed_deg_s=10.0)
    assert refusal(clinic, moved(3, 50.0)).code == "too_fast_for_doctor"
    clinic.allow(max_speed_deg_s=None)
    clinic.check(moved(3, 50.0))


def test_speed_limit_range_equals_the_stations_configurable_range() -> None:
    of_station = next(row for row in RANGES if row.field == "axes.max_speed_deg_s")
    assert (of_station.low, of_station.high) == SPEED_RANGE_DEG_S


def test_nothing_is_played_to_a_shoulder_without_an_open_episode(clinic: Clinic) -> None:
    refused = refusal(clinic, moved(3, 40.0, "left"), side="left")
    assert (refused.status, refused.code) == (409, "no_open_episode")


def test_recording_beyond_the_scapulas_range_is_refused(clinic: Clinic) -> None:
    impossible = Motion(TIMES_S, np.tile([90.0, 0.0, 10.0, 0.0, 0.0], (len(TIMES_S), 1)))
    clinic.check(impossible)
    clinic.allow(limits=[{"motion": 1, "highest_deg": 10.0}])
    assert refusal(clinic, impossible).code == "scapula_unknown"


def at_abduction(abduction_deg: float, flexion_deg: float) -> Motion:
    """The arm is lifted sideways and then flexed, and comes back the same way."""
    times_s = np.arange(0.0, 12.005, 0.01)
    pose = np.zeros((len(times_s), 5))
    pose[:, 2] = np.interp(times_s, [0, 2, 10, 12], [5, abduction_deg, abduction_deg, 5])
    pose[:, 3] = np.interp(times_s, [2, 6, 10], [0, flexion_deg, 0])
    return Motion(times_s, motor_angles_deg(pose))


@pytest.mark.parametrize("abduction_deg", [0.0, 30.0, 44.0, 46.0, 60.0, 85.0])
def test_limits_have_no_hole_where_motor_4_changes_its_motion(clinic: Clinic, abduction_deg: float) -> None:
    clinic.allow(limits=[{"motion": 4, "highest_deg": 90.0}, {"motion": 5, "highest_deg": 90.0}])
    clinic.check(at_abduction(abduction_deg, 85.0))
    # When the arm is level at the side, only abduction raises it, not flexion.
    raised = at_abduction(abduction_deg, 110.0) if abduction_deg < 80 else at_abduction(abduction_deg + 10.0, 0.0)
    refused = refusal(clinic, raised)
    assert refused.code == "beyond_doctors_limit"


def test_refusal_of_a_raised_arm_names_elevation_and_limit(clinic: Clinic) -> None:
    clinic.allow(limits=[{"motion": 4, "highest_deg": 90.0}, {"motion": 5, "highest_deg": 90.0}])
    assert re.fullmatch(
        r"The elevation of the upper arm would be 13[01]\.\d° at \d\.\d s; "
        r"Dr\. Mori allows no more than 90\.0° in this pose\.",
        refusal(clinic, at_abduction(46.0, 160.0)).message,
    )


def test_device_receives_the_limits_of_the_pose(clinic: Clinic) -> None:
    with clinic._database.read() as session:
        assert limits.allowed(session, clinic._patient_id, "right").arm is None
    clinic.allow(
        limits=[
            {"motion": 1, "lowest_deg": -5.0},
            {"motion": 3, "highest_deg": 100.0},
            {"motion": 4, "highest_deg": 80.0},
            {"motion": 5, "lowest_deg": -10.0, "highest_deg": 120.0},
        ]
    )
    with clinic._database.read() as session:
        arm = limits.allowed(session, clinic._patient_id, "right").arm
    assert arm == ArmLimits(
        scapula_deg=((-5.0, FREE_DEG), (-FREE_DEG, FREE_DEG)),
        side_deg=80.0,
        front_deg=120.0,
        back_deg=80.0,
        plane_deg=(-FREE_DEG, 100.0),
        flexion_from_deg=(-10.0, -20.0),
    )


def test_plane_limit_counts_whichever_motor_raised_the_arm(clinic: Clinic) -> None:
    clinic.allow(limits=[{"motion": 3, "highest_deg": 60.0}])
    clinic.check(at_abduction(80.0, 55.0))
    assert refusal(clinic, at_abduction(80.0, 70.0)).code == "beyond_doctors_limit"
    refused = refusal(clinic, at_abduction(10.0, 60.0))
    assert refused.message.startswith("The plane of elevation would be ")
    clinic.check(at_abduction(10.0, 30.0))
