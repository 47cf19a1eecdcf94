"""The ``kata`` command in a separate process."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from kata.database.engine import Database
from tests.support.databases import upgraded_file
from tests.support.kata_command import kata_here
from tests.support.processes import descendants, is_running


def test_serve_requires_the_choice_of_an_apparatus(tmp_path: Path) -> None:
    done = kata_here("serve", "--data", tmp_path)
    assert done.returncode == 1
    assert "--station FILE.toml" in done.stderr


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        # tests/device/test_config.py has the sentence of each rule.
        ("= =", "station.toml"),
        ("cycle_hz = 10\nrate_hz = 10", "the emergency stop is noticed later than after 50 ms"),
    ],
)
def test_serve_reports_a_wrong_station_file(tmp_path: Path, text: str, sentence: str) -> None:
    file = tmp_path / "station.toml"
    file.write_text(text)
    done = kata_here("serve", "--station", file, "--data", tmp_path, "--port", "0")
    assert done.returncode == 1
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr


def test_serve_reports_a_port_in_use(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        done = kata_here("serve", "--simulate", "--data", tmp_path, "--port", port)
    assert done.returncode == 1
    assert f"Cannot listen on 127.0.0.1:{port}" in done.stderr
    assert "Traceback" not in done.stderr


def test_serve_reports_a_newer_database(tmp_path: Path) -> None:
    database = Database(upgraded_file(tmp_path / "kata.db"))
    with database.writer.begin() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = '9999'")
    database.close()
    done = kata_here("serve", "--simulate", "--data", tmp_path, "--port", "0")
    assert done.returncode == 1
    assert "written by a newer version of Kata" in done.stderr
    assert "Traceback" not in done.stderr


def until_started(pid: int) -> set[int]:
    """Wait until the service has started its simulator and its device process, and this its reference builder. Return their ids."""
    limit = time.monotonic() + 60
    while True:
        started = descendants(pid)
        commands = " ".join(Path(f"/proc/{child}/cmdline").read_text().replace("\0", " ") for child in started)
        if all(module in commands for module in ("kata.simulator", "kata.device ", "kata.device.reference_builder")):
            return started
        assert time.monotonic() < limit, commands
        time.sleep(0.05)


@pytest.mark.parametrize(
    ("how", "code"),
    [
        # The service handles Ctrl-C like the signal of systemd.
        pytest.param(signal.SIGINT, {0}, marks=pytest.mark.campaign),
        (signal.SIGTERM, {0}),
        (signal.SIGKILL, {-signal.SIGKILL}),
    ],
)
def test_service_leaves_no_process_however_it_ends(tmp_path: Path, how: signal.Signals, code: set[int]) -> None:
    command = [sys.executable, "-m", "kata", "serve", "--simulate", "--data", str(tmp_path), "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as served:
        try:
            assert served.stderr is not None
            answer = ""
            while "Kata is ready" not in answer:
                line = served.stderr.readline()
                assert line, answer
                answer += line
            started = until_started(served.pid)
            if how == signal.SIGINT:
                os.killpg(served.pid, how)  # Ctrl-C reaches the whole group
            else:
                os.kill(served.pid, how)
            assert served.wait(30) in code
            rest = served.stderr.read()
        finally:
            served.kill()
    assert "Traceback" not in rest
    limit = time.monotonic() + 20
    while any(is_running(pid) for pid in started):
        assert time.monotonic() < limit, [pid for pid in started if is_running(pid)]
        time.sleep(0.05)
    assert "ended" in (tmp_path / "device.log").read_text()
