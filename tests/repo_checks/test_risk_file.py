"""The risk file in docs/risk names tests, requirements and packages that exist."""

import re

import pytest

from docs.risk_file import (
    PROBABILITIES,
    SEVERITIES,
    direct_python_packages,
    hazards,
    missing_tests,
    page_versions,
    python_versions,
    read_components,
    read_hazards,
    read_requirements,
    risk,
)

_REAL = "tests/device/test_stops.py::test_a_jump_is_never_sent"
_IN_A_CLASS = "tests/audit/test_audit.py::test_change_without_its_audit_row_is_not_made"


@pytest.mark.parametrize(
    "broken",
    [
        "tests/device/test_stops.py::test_that_was_renamed",
        "tests/device/test_gone.py::test_a_jump_is_never_sent",
        "tests/device/test_stops.py",
        "docs/risk_file.py::read_hazards",
        "tests/release/test_update.py::test_fifty_kills_leave_a_whole_clinic",
        "tests/release/test_deb.py::test_an_interrupted_installation_is_repeated",
    ],
)
def test_broken_link_is_found(broken: str) -> None:
    assert missing_tests([_REAL, _IN_A_CLASS, broken]) == [broken]


def test_every_requirement_names_tests_that_exist() -> None:
    assert len(read_requirements()) > 20
    for requirement in read_requirements():
        assert requirement.tests, requirement.id
        assert missing_tests(requirement.tests) == [], requirement.id


def test_every_control_is_a_requirement_and_the_reverse() -> None:
    known = [requirement.id for requirement in read_requirements()]
    used = {name for hazard in read_hazards() for name in hazard.controls}
    assert sorted(known) == sorted(used)
    assert all(hazard.controls for hazard in read_hazards())


def test_items_are_numbered_once_and_in_order() -> None:
    for letter, items in (("R", read_requirements()), ("H", read_hazards())):
        assert [item.id for item in items] == [f"{letter}{number:02}" for number in range(1, len(items) + 1)]


def test_estimates_are_within_the_scales_and_controls_reduce_them() -> None:
    assert len(read_hazards()) > 10
    for hazard in read_hazards():
        assert hazard.severity in SEVERITIES, hazard.id
        assert {hazard.before, hazard.after} <= set(PROBABILITIES), hazard.id
        assert hazard.after < hazard.before, hazard.id


def test_high_residual_risk_is_called_unacceptable_and_names_a_measure() -> None:
    high = [hazard for hazard in read_hazards() if risk(hazard.severity, hazard.after) == "high"]
    assert high
    for hazard in high:
        assert hazard.residual.startswith("Not acceptable"), hazard.id
        assert hazard.outside != "none", hazard.id


@pytest.mark.parametrize(
    ("severity", "probability", "level"), [(2, 2, "low"), (5, 1, "medium"), (3, 3, "medium"), (5, 2, "high")]
)
def test_level_is_severity_times_probability(severity: int, probability: int, level: str) -> None:
    assert risk(severity, probability) == level


def test_hazards_say_who_estimated_and_claim_no_certification() -> None:
    assert "developers' estimates" in hazards()
    assert "No certification is claimed." in hazards()


def test_every_direct_dependency_is_described() -> None:
    described = read_components()
    assert set(described.python) == direct_python_packages() <= set(python_versions())
    assert set(described.page) == set(page_versions())
    for component in (*described.python.values(), *described.page.values()):
        assert re.fullmatch(r"[\w.-]+/[\w.-]+", component.tracker)
