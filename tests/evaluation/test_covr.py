"""Steps after COVR's protocols on simulated arms (docs/reference/validation-protocols.md)."""

import logging
from itertools import product
from typing import get_args

import pytest

from kata.evaluation.covr import (
    MOTORS,
    PUSHES_DEG_S,
    STRENGTHS_NM,
    CovrCase,
    cases,
    conditions,
    is_refused_beyond,
    judge,
    line,
)
from kata.simulator.mechanics import PlantName

log = logging.getLogger(__name__)

pytestmark = [pytest.mark.campaign, pytest.mark.timeout(3600)]

WITHIN_DEG = 0.5
"""Largest distance of the true arm beyond its limit while the robot alone moves it: gear play and the arm's soft parts."""


@pytest.mark.parametrize("plant", get_args(PlantName))
def test_robot_in_control_stays_within_the_limit(plant: PlantName) -> None:
    for condition in conditions("robot_in_control"):
        figures = [judge(case) for case in cases("robot_in_control", plant, condition)]
        log.info(line(figures, condition))
        assert max(one.beyond_deg for one in figures) <= WITHIN_DEG


@pytest.mark.parametrize(("plant", "motor"), [*product(get_args(PlantName), MOTORS)])
def test_recording_beyond_the_limit_is_refused(plant: PlantName, motor: int) -> None:
    assert is_refused_beyond(CovrCase("robot_in_control", plant, motor, 1))


@pytest.mark.parametrize("plant", get_args(PlantName))
def test_strong_push_outwards_is_answered(plant: PlantName) -> None:
    """The strongest and fastest hand: the playback ends by a stop or a reversal."""
    condition = {"push_deg_s": PUSHES_DEG_S[-1], "strength_nm": STRENGTHS_NM[-1]}
    figures = [judge(case) for case in cases("human_pushes", plant, condition)]
    log.info(line(figures, condition))
    assert all(one.outcome != "completed" for one in figures)


@pytest.mark.parametrize("plant", get_args(PlantName))
def test_arm_that_is_held_is_answered(plant: PlantName) -> None:
    for condition in conditions("human_holds"):
        figures = [judge(case) for case in cases("human_holds", plant, condition)]
        log.info(line(figures, condition))
        if condition["strength_nm"] == STRENGTHS_NM[-1]:
            assert all(one.outcome != "completed" for one in figures)
