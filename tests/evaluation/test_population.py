"""End-feel tests of many random patients."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from kata.evaluation.end_feel import EndFeelCase, StiffPlant
from kata.evaluation.population import (
    PatientFigures,
    RandomPatient,
    icc,
    judge,
    random_patients,
    refit_summary,
    refitted_patients,
    summary,
)
from kata.evaluation.stretch import Patient

QUICK = EndFeelCase("simple", 0, "healthy", 3, speed_deg_s=10.0, person=1)
"""Twice the usual speed."""


def test_icc_is_the_share_of_the_variance_between_patients() -> None:
    # Shrout and Fleiss, Psychol. Bull. 1979, 86, 420, Table 4: ICC(1,1) of this example is .17.
    ratings = np.array(
        [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]], dtype=float
    )
    assert icc(ratings) == pytest.approx(0.17, abs=0.005)
    assert icc(np.array([[1.0, 1.0], [2.0, 2.0], [4.0, 4.0]])) == pytest.approx(1.0)


def test_number_determines_a_patient() -> None:
    patients = random_patients("simple", range(60))
    assert patients == random_patients("simple", range(60))
    assert {patient.acts for patient in patients} == set(get_args(Patient))
    assert {patient.case.motor for patient in patients} == {3, 4, 5}
    assert {patient.case.patient for patient in random_patients("mujoco", range(60))} == {
        "frozen", "freezing", "thawing", "healthy",
    }  # fmt: skip


def test_persons_differ_and_a_refitted_arm_ends_elsewhere() -> None:
    one, other = (StiffPlant(3, motor=3, person=person).joints[2] for person in (1, 2))
    assert one.rom != other.rom and one.parameters.stiffness_nm != other.parameters.stiffness_nm
    again = StiffPlant(3, motor=3, person=1)
    assert again.joints[2].rom == one.rom
    again.refit(3, 2.0)
    assert np.degrees(np.array(one.rom) - again.joints[2].rom) == pytest.approx([2.0, 2.0])
    first, second, *_ = refitted_patients("simple", range(2), 3)
    assert first.case.refit_deg != second.case.refit_deg
    assert replace(first.case, refit_deg=0.0) == replace(second.case, refit_deg=0.0)


def test_unmeasured_patient_has_no_part_in_the_icc() -> None:
    measured = PatientFigures(RandomPatient(QUICK, "relaxed"), "measured", -0.1, -0.1, 80.0, 0.1, (20.0,), 30.0)
    results = [replace(measured, range_deg=range_deg) for range_deg in (80.0, 81.0, 60.0, 60.5, 70.0, None)]
    lines = refit_summary(results, 2)
    assert lines[0].startswith("ICC of range_deg: 0.99") and "2 of 3 patients" in lines[0]
    shown = summary([replace(measured, peak_over_nm=over_nm) for over_nm in (0.1, 0.3)])
    assert "50.0 % above 0.2" in shown[0]
    assert "2 answers: p50 20 ms, p99.9 20 ms" in shown[1]


@pytest.mark.campaign
def test_patient_who_coughs_gets_no_more_from_the_apparatus() -> None:
    found = judge(RandomPatient(QUICK, "cough"))
    assert found.capsule_over_nm is not None and found.peak_over_nm is not None
    assert found.capsule_over_nm < 0.2
