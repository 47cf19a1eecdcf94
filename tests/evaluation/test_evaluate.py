"""Cases, figures and reports."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from kata.device import config
from kata.evaluation.cases import REPOSITIONING_ERROR_DEG, Case, paper_cases, recorded_cases
from kata.evaluation.outcome import Outcome, as_json
from kata.evaluation.page import as_html
from kata.evaluation.run import Job, evaluate_jobs, play
from kata.motion.axes import AXES
from kata.motion.method import Method
from kata.motion.taught import Taught, TaughtError
from tests.support.motions import write_csv


@pytest.fixture(scope="module")
def outcomes(short: Taught) -> list[Outcome]:
    """Both sides, two variations, two plays each."""
    cases = [Case("short", side, short, AXES, 7) for side in ("left", "right")]
    return [outcome for seed in (1, 2) for case in cases for outcome in play(Job(case, "smooth", 2, seed))]


def test_fourteen_cases_are_the_papers_with_motors_of_its_figures() -> None:
    cases = paper_cases()
    assert [(case.number, case.side) for case in cases] == [
        (number, side) for number in range(1, 8) for side in ("left", "right")
    ]
    assert [case.motors for case in cases[::2]] == [(1, 2), (1, 2), (4,), (3,), (4,), (5,), (1, 2, 3, 4, 5)]


def test_folder_is_evaluated_file_by_file_on_both_sides(tmp_path: Path, short: Taught) -> None:
    write_csv(short, tmp_path / "b.csv")
    write_csv(short, tmp_path / "a.csv")
    cases = recorded_cases(tmp_path)
    assert [(case.name, case.side) for case in cases] == [
        ("a", "left"), ("a", "right"), ("b", "left"), ("b", "right"),
    ]  # fmt: skip
    assert all(case.motors == AXES for case in cases)


def test_folder_without_motions_is_reported(tmp_path: Path) -> None:
    with pytest.raises(TaughtError, match="holds no CSV files"):
        recorded_cases(tmp_path)


def test_arm_starts_near_the_motion_and_varies_each_time(short: Taught) -> None:
    case = Case("short", "left", short, AXES)
    poses = [case.repositioning(seed, play).poses_deg[0] for seed in (None, 1) for play in (1, 2)]
    assert len({tuple(pose) for pose in poses}) == 4
    for pose in poses:
        error_deg = np.abs(pose - short.poses_deg[0])
        assert 0.5 < error_deg.max() <= REPOSITIONING_ERROR_DEG
    assert np.array_equal(poses[0], case.repositioning(None, 1).poses_deg[0])


def test_every_figure_covers_its_motors_and_the_sides_differ(outcomes: list[Outcome]) -> None:
    report = as_json(outcomes, simulated=True)
    assert report["simulated"] is True
    assert report["problems"] == []
    assert [(case["seed"], case["side"], case["repetition"]) for case in report["cases"]] == [
        (seed, side, repetition) for seed in (1, 2) for side in ("left", "right") for repetition in (1, 2)
    ]
    for case in report["cases"]:
        assert set(case) == {"name", "side", "method", "repetition", "seed", "motors"}
        assert [motor["motor"] for motor in case["motors"]] == [1, 2, 3, 4, 5]
        for motor in case["motors"]:
            assert set(motor) == {"motor", "peak_deg", "rmse_deg", "start_deg", "lag_ms"}
            assert motor["rmse_deg"] <= abs(motor["peak_deg"])
    left, right = report["cases"][0], report["cases"][2]
    assert left["motors"][0] != right["motors"][0]


def test_processes_change_neither_figures_nor_order(short: Taught, outcomes: list[Outcome]) -> None:
    cases = [Case("short", side, short, AXES, 7) for side in ("left", "right")]
    done: list[Job] = []
    jobs = [Job(case, "smooth", 2, seed) for seed in (1, 2) for case in cases]
    together = evaluate_jobs(jobs, done.append)
    assert as_json(together, simulated=True) == as_json(outcomes, simulated=True)
    assert len(done) == len(jobs)


def test_refused_motion_is_reported_as_a_problem_without_figures(short: Taught) -> None:
    fast = Taught("fast", short.times_s / 6, short.poses_deg)
    report = as_json(play(Job(Case("fast", "right", fast, AXES), "smooth", 2, None)), simulated=True)
    assert report["cases"] == []
    assert len(report["problems"]) == 1
    assert report["problems"][0]["repetition"] == 1
    assert "cannot be played" in report["problems"][0]["problem"]


def test_motion_beyond_the_linkages_reach_is_a_problem_too(short: Taught) -> None:
    poses = short.poses_deg.copy()
    poses[:, 0] = 80.0
    far = Taught("far", short.times_s, poses)
    report = as_json(play(Job(Case("far", "right", far, AXES), "smooth", 1, None)), simulated=True)
    assert "cannot reach" in report["problems"][0]["problem"]


def test_report_is_self_contained_and_says_it_is_simulated(outcomes: list[Outcome]) -> None:
    html = as_html(outcomes, simulated=True)
    assert not re.search(r"<(script|link|img|iframe)[^>]*\b(src|href)=", html)
    assert html.count("Plotly.newPlot(") == 2
    for title in ("Figure 17: short, left, simulated", "Figure 18: short, right, simulated"):
        assert title in html
    assert "peaks beyond -10" in html
    assert "All figures come from simulated drives" in html
    assert all("simulated" in heading for heading in re.findall(r"<h[23]>(.*?)</h[23]>", html))


def test_the_command_writes_both_files_and_prints_the_tables(tmp_path: Path, short: Taught) -> None:
    folder = tmp_path / "motions"
    folder.mkdir()
    write_csv(short, folder / "short.csv")
    command = ["evaluate", "--taught", folder, "--methods", "smooth", "--json", "out.json", "--html", "out.html"]
    done = subprocess.run(
        [sys.executable, "-m", "kata", *map(str, command)], capture_output=True, text=True, cwd=tmp_path, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert "(simulated)" in done.stdout
    report = json.loads((tmp_path / "out.json").read_text())
    assert [(case["name"], case["side"]) for case in report["cases"]] == [("short", "left"), ("short", "right")]
    assert (tmp_path / "out.html").stat().st_size > 1_000_000


def test_the_command_knows_its_methods(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "kata", "evaluate", "--methods", "clever"],
        capture_output=True, text=True, cwd=tmp_path, timeout=60,
    )  # fmt: skip
    assert done.returncode == 2
    assert "clever is not one of" in done.stderr


def test_only_the_learning_method_changes_from_play_to_play(short: Taught) -> None:
    case = Case("short", "right", short, AXES, 7)
    outcomes = {method: play(Job(case, method, 3, 1)) for method in get_args(Method)}
    rmse = {name: [sum(motor.rmse_deg for motor in play.motors) for play in plays] for name, plays in outcomes.items()}

    assert rmse["learned"][0] == rmse["smooth"][0]
    assert rmse["learned"][2] < rmse["learned"][1] < rmse["learned"][0]
    assert rmse["learned"][2] < 0.9 * rmse["smooth"][2]
    assert rmse["smooth"][2] == pytest.approx(rmse["smooth"][0], rel=0.2)
    assert rmse["paper"][0] > 1.5 * rmse["smooth"][0]


def test_only_the_paper_method_jumps_at_the_start(short: Taught) -> None:
    case = Case("short", "right", short, AXES, 7)
    starts = {
        method: max(abs(motor.start_deg) for motor in play(Job(case, method, 1, 1))[0].motors)
        for method in get_args(Method)
    }
    assert starts["paper"] > 1.0
    assert starts["smooth"] < 0.5
    assert starts["learned"] < 0.5


def test_real_apparatus_moves_only_with_explicit_consent(tmp_path: Path) -> None:
    config.write(config.StationConfig(), tmp_path / "station.toml")
    done = subprocess.run(
        [sys.executable, "-m", "kata", "evaluate", "--station", "station.toml"],
        input="n\n", capture_output=True, text=True, cwd=tmp_path, timeout=60,
    )  # fmt: skip
    assert done.returncode == 1
    assert "The apparatus of station.toml will move" in done.stdout
    assert "Aborted" in done.stderr
