"""The ``kata`` command, as somebody types it."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from kata.database.engine import Database
from kata.motion.axes import POSE_COLUMNS
from kata.motion.builtin import built_in_motions
from kata.motion.taught import Taught
from tests.upgraded import upgraded_file


def kata(*arguments: str | Path, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"COLUMNS": "200"}
    command = [sys.executable, "-m", "kata", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, env=environment, timeout=120)


def write_csv(motion: Taught, path: Path) -> Path:
    rows = [",".join(("time_s", *POSE_COLUMNS))]
    for time_s, pose in zip(motion.times_s, motion.poses_deg, strict=True):
        rows.append(",".join(f"{value:.4f}" for value in (time_s, *pose)))
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("rate_hz", [10, 100])
def test_demo_teaches_plays_compares_and_stores(tmp_path: Path, motion: Taught, rate_hz: int) -> None:
    taught, out, data = write_csv(motion, tmp_path / "a motion.csv"), tmp_path / "out.json", tmp_path / "data"
    data.mkdir()
    done = kata("demo", "--taught", taught, "--json", out, "--data", data, "--rate-hz", str(rate_hz), folder=tmp_path)

    assert done.returncode == 0, done.stderr
    assert "RMSE" in done.stdout
    told = json.loads(out.read_text())
    assert set(told) == {"motors", "samples", "rate_hz"}
    assert told["rate_hz"] == rate_hz
    assert told["samples"] > 0.9 * motion.duration_s * rate_hz
    assert [motor["motor"] for motor in told["motors"]] == [1, 2, 3, 4, 5]
    for motor in told["motors"]:
        assert set(motor) == {"motor", "peak_deg", "rmse_deg", "start_deg"}
        assert abs(motor["start_deg"]) <= 1.0
        assert motor["motor"] == 5 or abs(motor["peak_deg"]) <= 6.0
    with Database(f"sqlite:///{data / 'kata.db'}").reader.connect() as connection:
        for table in ("patients", "recordings", "recording_samples", "sessions", "runs", "run_samples"):
            assert connection.exec_driver_sql(f"SELECT count(*) FROM {table}").scalar() == 1

    again = kata("demo", "--taught", taught, "--data", data, folder=tmp_path)
    assert again.returncode == 1
    assert "holds a database already" in again.stderr


def test_demo_says_what_is_wrong_with_a_file(tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text("time_s,elbow\n0,1\n")
    for file, sentence in (("bad.csv", "missing: scapula_abduction"), ("none.csv", "No such file")):
        done = kata("demo", "--taught", file, folder=tmp_path)
        assert done.returncode == 1
        assert sentence in done.stderr
        assert "Traceback" not in done.stderr


def test_demo_says_when_a_motion_is_too_fast_for_the_apparatus(tmp_path: Path) -> None:
    slow = built_in_motions()[3]
    fast = Taught("fast", slow.times_s / 8, slow.poses_deg)
    done = kata("demo", "--taught", write_csv(fast, tmp_path / "fast.csv"), folder=tmp_path)
    assert done.returncode == 1
    assert "cannot be played: motor 3 would move at" in done.stderr
    assert "Traceback" not in done.stderr


def test_serve_wants_to_know_which_apparatus(tmp_path: Path) -> None:
    done = kata("serve", "--data", tmp_path, folder=tmp_path)
    assert done.returncode == 1
    assert "--station FILE.toml" in done.stderr


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("rate_hz = 30", "rate_hz: must divide cycle_hz"),
        ("rate = 30", "unknown field `rate`"),
        ("= =", "station.toml"),
        ("cycle_hz = 10\nrate_hz = 10", "emergency stop would be seen too late"),
        ("[inputs]\ndrive_id = 9", "inputs.drive_id"),
    ],
)
def test_serve_says_what_is_wrong_with_a_station(tmp_path: Path, text: str, sentence: str) -> None:
    (tmp_path / "station.toml").write_text(text)
    done = kata("serve", "--station", "station.toml", "--data", tmp_path, "--port", "0", folder=tmp_path)
    assert done.returncode == 1
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr


def test_serve_says_that_the_port_is_taken(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        done = kata("serve", "--simulate", "--data", tmp_path, "--port", port, folder=tmp_path)
    assert done.returncode == 1
    assert f"Cannot listen on 127.0.0.1:{port}" in done.stderr
    assert "Traceback" not in done.stderr


def test_serve_says_that_the_database_is_newer(tmp_path: Path) -> None:
    database = Database(upgraded_file(tmp_path / "kata.db"))
    with database.writer.begin() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = '9999'")
    database.close()
    done = kata("serve", "--simulate", "--data", tmp_path, "--port", "0", folder=tmp_path)
    assert done.returncode == 1
    assert "written by a newer version of Kata" in done.stderr
    assert "Traceback" not in done.stderr


def children(pid: int) -> set[int]:
    """The processes that a process has started, and those have."""
    found: set[int] = set()
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in map(int, (task / "children").read_text().split()):
            found |= {child} | children(child)
    return found


def alive(pid: int) -> bool:
    """Still running: neither gone nor waiting to be reaped."""
    status = Path(f"/proc/{pid}/stat")
    return status.exists() and status.read_text().rpartition(")")[2].split()[0] != "Z"


@pytest.mark.parametrize(
    ("how", "code"), [(signal.SIGINT, {0}), (signal.SIGTERM, {0}), (signal.SIGKILL, {-signal.SIGKILL})]
)
def test_however_it_ends_nothing_of_it_stays(tmp_path: Path, how: signal.Signals, code: set[int]) -> None:
    command = [sys.executable, "-m", "kata", "serve", "--simulate", "--data", str(tmp_path), "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as served:
        assert served.stderr is not None
        told = ""
        while "Kata is ready" not in told:
            line = served.stderr.readline()
            assert line, told
            told += line
        started = children(served.pid)
        assert len(started) >= 3  # simulator, device process, figure worker
        if how == signal.SIGINT:
            os.killpg(served.pid, how)  # Ctrl-C reaches the whole group
        else:
            os.kill(served.pid, how)
        assert served.wait(30) in code
        rest = served.stderr.read()
    assert "Traceback" not in rest
    limit = time.monotonic() + 20
    while any(alive(pid) for pid in started):
        assert time.monotonic() < limit, [pid for pid in started if alive(pid)]
        time.sleep(0.05)
    assert "ended" in (tmp_path / "device.log").read_text()
