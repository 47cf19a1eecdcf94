"""``kata demo``: the main job in real time, without a browser."""

import json
from pathlib import Path
from typing import NoReturn

import pytest

from kata.clinic import texts
from kata.database.engine import Database
from kata.errors import ProblemError
from kata.motion.builtin import built_in_motions
from kata.motion.taught import Taught
from tests.support.kata_command import kata, kata_here
from tests.support.motions import write_csv


# 10 Hz is not the default, so it proves the option too; stations and journeys prove the whole job at 100 Hz.
@pytest.mark.parametrize("rate_hz", [10, pytest.param(100, marks=pytest.mark.campaign)])
def test_demo_teaches_plays_compares_and_stores(tmp_path: Path, motion: Taught, rate_hz: int) -> None:
    taught, out, data = write_csv(motion, tmp_path / "a motion.csv"), tmp_path / "out.json", tmp_path / "data"
    data.mkdir()
    done = kata("demo", "--taught", taught, "--json", out, "--data", data, "--rate-hz", str(rate_hz), folder=tmp_path)

    assert done.returncode == 0, done.stderr
    assert "RMSE" in done.stdout
    answer = json.loads(out.read_text())
    assert set(answer) == {"motors", "samples", "rate_hz"}
    assert answer["rate_hz"] == rate_hz
    assert answer["samples"] > 0.9 * motion.duration_s * rate_hz
    assert [motor["motor"] for motor in answer["motors"]] == [1, 2, 3, 4, 5]
    for motor in answer["motors"]:
        assert set(motor) == {"motor", "peak_deg", "rmse_deg", "start_deg"}
        assert abs(motor["start_deg"]) <= 1.0
        assert motor["motor"] == 5 or abs(motor["peak_deg"]) <= 6.0
    with Database(f"sqlite:///{data / 'kata.db'}").reader.connect() as connection:
        for table in ("patients", "recordings", "recording_samples", "sessions", "runs", "run_samples"):
            assert connection.exec_driver_sql(f"SELECT count(*) FROM {table}").scalar() == 1

    again = kata_here("demo", "--taught", taught, "--data", data)
    assert again.returncode == 1
    assert "already contains a database" in again.stderr


def test_demo_reports_errors_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text("time_s,elbow\n0,1\n")
    for file, sentence in (("bad.csv", "missing: scapula_abduction"), ("none.csv", "No such file")):
        done = kata_here("demo", "--taught", tmp_path / file)
        assert done.returncode == 1
        assert sentence in done.stderr
        assert "Traceback" not in done.stderr


def test_demo_reports_a_refusal(tmp_path: Path, motion: Taught, monkeypatch: pytest.MonkeyPatch) -> None:
    async def refused(*_: object) -> NoReturn:
        raise ProblemError(422, "unplayable", texts.RUN_NOT_PLAYABLE(reason="motor 3 would move at 90 deg/s"))

    monkeypatch.setattr("kata.cli.demo._demonstrated", refused)
    done = kata_here("demo", "--taught", write_csv(motion, tmp_path / "fast.csv"), "--data", tmp_path)
    assert done.returncode == 1
    assert "cannot be played with these settings: motor 3 would move at" in done.stderr
    assert "Traceback" not in done.stderr


# The refusal itself is tested with the API.
@pytest.mark.campaign
def test_demo_reports_a_motion_too_fast_for_the_apparatus(tmp_path: Path) -> None:
    slow = built_in_motions()[3]
    fast = Taught("fast", slow.times_s / 8, slow.poses_deg)
    done = kata("demo", "--taught", write_csv(fast, tmp_path / "fast.csv"), folder=tmp_path)
    assert done.returncode == 1
    assert "cannot be played: motor 3 would move at" in done.stderr
    assert "Traceback" not in done.stderr
