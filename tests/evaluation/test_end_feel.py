"""The end-feel test by the real control loop on a simulated shoulder whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from kata.cli.main import app
from kata.evaluation import end_feel
from kata.evaluation.end_feel import GOALS, EndFeelCase, EndFeelErrors, cases, judge, summary
from kata.motion.end_feel import SPEED_DEG_S
from kata.simulator.independent.plant import IndependentPlant
from kata.simulator.mechanics import Mechanics, PlantName
from kata.simulator.plant import Plant

CASE = EndFeelCase("simple", 0, "healthy", 3, speed_deg_s=10.0)
"""Twice the usual speed."""


@pytest.fixture(scope="module")
def relaxed() -> EndFeelErrors:
    return judge(CASE)


@pytest.mark.campaign
def test_usual_speed_is_within_the_goals() -> None:
    test_relaxed_shoulder_is_measured_within_the_goals(judge(replace(CASE, speed_deg_s=SPEED_DEG_S)))


@pytest.mark.campaign
def test_relaxed_shoulder_is_measured_within_the_goals(relaxed: EndFeelErrors) -> None:
    assert relaxed.outcome == "measured"
    for goal in GOALS:
        assert goal.size(getattr(relaxed, goal.field)) <= goal.limit, goal.name


# In every run, tests/motion/test_end_feel.py refuses the curves of a patient who works, and tests/clinic/test_end_feel.py stores
# the refusal.
@pytest.mark.campaign
def test_guarding_patient_is_refused() -> None:
    assert judge(replace(CASE, kind="guarding")).outcome == "guarding"


def test_summary_shows_each_goal_beside_its_figures(relaxed: EndFeelErrors) -> None:
    table = summary([relaxed, replace(relaxed, range_error_deg=-3.0)])
    shown = {str(column.header): str(next(iter(column.cells))) for column in table.columns}
    assert shown["outcomes"] == "2 measured"
    assert shown["range, deg (goal 2)"].endswith("3.00; 50 %")


def test_command_judges_every_motor_of_the_chosen_seeds(monkeypatch: pytest.MonkeyPatch) -> None:
    judged: list[EndFeelCase] = []
    monkeypatch.setattr(end_feel, "judge_many", lambda chosen, processes, json_out: judged.extend(chosen))
    done = CliRunner().invoke(app, ["evaluate", "--end-feel", "--plant", "simple", "--seed", "3", "--seeds", "2"])
    assert done.exit_code == 0, done.output
    assert {(case.seed, case.motor, case.kind) for case in judged} == {
        (seed, motor, kind) for seed in (3, 4) for motor in (3, 4, 5) for kind in ("relaxed", "guarding")
    }


def test_cases_of_the_independent_plant_have_every_stage() -> None:
    found = cases("mujoco", [0, 1], ["relaxed"], [3, 4, 5])
    assert [(case.seed, case.patient, case.motor) for case in found][:4] == [
        (0, "frozen", 3), (0, "freezing", 3), (0, "thawing", 3), (0, "healthy", 3),
    ]  # fmt: skip
    assert {case.motor for case in found} == {3, 4}


@pytest.mark.parametrize("plant", ["simple", "mujoco"])
def test_weight_of_the_baseline_is_chosen_by_the_arm(plant: PlantName) -> None:
    for seed in range(4):
        case = EndFeelCase(plant, seed, "healthy", 3)
        arm, weight = (end_feel._mechanics(case, dummy=dummy)(seed) for dummy in (False, True))
        assert _mass(weight) / _mass(arm) == pytest.approx(1.0, abs=0.1)
        assert _mass(weight) != _mass(arm)


def _mass(mechanics: Mechanics) -> float:
    if isinstance(mechanics, Plant):
        return mechanics.joints[2].parameters.weight_nm
    assert isinstance(mechanics, IndependentPlant)
    return mechanics.parameters.upper_arm_kg


def test_torque_before_the_test_is_not_the_tests() -> None:
    station = end_feel.PatientStation(CASE, end_feel.station_config("simple", 0))
    asked = end_feel.requested(CASE, station)
    station.noted_ns, station.against_nm = [0], [9.0]
    run = station.play(asked.load, 6 * asked.out.duration_s)
    assert end_feel.during_run(station.against_nm, station, run).max() < 3.0


def test_test_weight_is_the_same_on_every_apparatus() -> None:
    weights = [IndependentPlant(seed, dummy=True) for seed in (1, 2)]
    assert weights[0].parameters.upper_arm_kg == weights[1].parameters.upper_arm_kg == 2.0
    assert weights[0].parameters.link_kg != weights[1].parameters.link_kg
    for weight in weights:
        torques = [weight.shoulder.passive_nm(n, angle, 1.0) for n in range(3) for angle in np.radians([-90, 90])]
        assert torques == pytest.approx([0.0] * 6, abs=1e-9)
