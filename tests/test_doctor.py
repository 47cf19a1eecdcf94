"""``kata doctor``: its findings about a computer."""

import contextlib
import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from kata.backups.catalogue import import_records
from kata.backups.create import create_backup
from kata.backups.key import make_key
from kata.cli import doctor
from kata.cli.doctor import CheckResult, examine
from kata.cli.serve import _warn_of_proxy
from kata.commissioning.latency import measure_adapter
from kata.database.engine import Database
from kata.device.config import simulated
from kata.evaluation.world import World
from kata.settings import Settings
from kata.simulator.adapter import AdapterLatency
from kata.simulator.process import SimulatorProcess
from tests.support.databases import upgraded_file
from tests.support.kata_command import kata, kata_here
from tests.support.other_disk import other_disk


@pytest.fixture
def port() -> Iterator[str]:
    """A pseudo-terminal: opens as an adapter does."""
    ours, theirs = os.openpty()
    yield os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


def found(name: str, folder: Path, station: str | None = None) -> CheckResult:
    """Return the first finding with this name. ``station``: the TOML of the station's file."""
    settings = Settings(data=folder, database_url="", station=None)
    if station is not None:
        file = folder / "station.toml"
        file.write_text(station)
        settings = Settings(data=folder, database_url="", station=file)
    return next(finding for finding in examine(settings) if finding.name == name)


def test_station_with_an_opening_port_passes(tmp_path: Path, port: str) -> None:
    finding = found("Port", tmp_path, f'port = "{port}"')
    assert finding.state == "ok"
    assert port in finding.message


def test_missing_port_is_a_problem(tmp_path: Path) -> None:
    finding = found("Port", tmp_path, 'port = "/dev/ttyKATA"')
    assert finding.state == "problem"
    assert "/dev/ttyKATA does not exist" in finding.message
    assert "Plug in the RS-485 adapter" in finding.what_to_do


def test_unreadable_station_is_a_problem_and_other_lines_still_print(tmp_path: Path) -> None:
    (tmp_path / "station.toml").write_text("rate_hz = 30")
    findings = examine(Settings(data=tmp_path, database_url="", station=tmp_path / "station.toml"))
    states = {finding.name: finding for finding in findings}
    assert states["Station"].state == "problem"
    assert "must divide cycle_hz" in states["Station"].message
    assert states["Data folder"].state == "ok"


def test_adapter_that_delays_replies_is_reported(tmp_path: Path, port: str, monkeypatch: pytest.MonkeyPatch) -> None:
    timer = tmp_path / "tty" / Path(port).name / "device" / "latency_timer"
    timer.parent.mkdir(parents=True)
    monkeypatch.setattr(doctor, "_TTYS", tmp_path / "tty")
    for latency_ms, state in (("16\n", "warning"), ("1\n", "ok")):
        timer.write_text(latency_ms)
        finding = found("Adapter's latency timer", tmp_path, f'port = "{port}"')
        assert finding.state == state
    assert finding.message == "1 ms"


STATION = """name = "Station"
port = "{port}"
[inputs]
estop_second_port = 3
"""


@pytest.mark.parametrize(
    ("latency_ms", "state"), [((0.0, 0.0), "ok"), ((16.0, 0.0), "problem")], ids=["quick", "latency timer at 16 ms"]
)
def test_an_adapter_is_judged_by_its_latency(latency_ms: tuple[float, float], state: str) -> None:
    world = World(simulated("virtual"))
    world.latency = AdapterLatency(*latency_ms)
    figures = measure_adapter(world.config, world.open_transport)
    assert figures.silent == () and figures.damaged == 0
    # These drives are new: their own return delay is 0.5 ms.
    assert figures.late_ms == pytest.approx(latency_ms[0] + 0.5, abs=0.1)
    verdict = doctor._adapter(world.config, figures)
    assert verdict.state == state
    assert f"{int(figures.carried_hz)} cycles a second; the station uses 100" in verdict.message
    assert ("latency timer" in verdict.what_to_do) == (state == "problem")


def test_the_doctor_speaks_to_the_drives(tmp_path: Path) -> None:
    simulator = SimulatorProcess(tmp_path)
    try:
        station = STATION.format(port=simulator.port)
        assert found("Drives", tmp_path, station).state == "ok"
        with contextlib.closing(simulator.client()) as client:
            client.fault("silent", motor=3)
            client.fault("noise")
        finding = found("Drives", tmp_path, station)
        assert (finding.state, finding.message) == ("problem", "These motors do not answer at 1000000 bit/s: 3.")
        assert found("Bus noise", tmp_path, station).state == "problem"
    finally:
        simulator.close()


def test_global_huge_pages_are_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = tmp_path / "enabled"
    monkeypatch.setattr(doctor, "_HUGE_PAGES", chosen)
    assert not [
        finding
        for finding in examine(Settings(data=tmp_path, database_url="", station=None))
        if finding.name == "Huge pages"
    ]
    for words, state in (("[always] madvise never", "warning"), ("always [madvise] never", "ok")):
        chosen.write_text(words)
        assert found("Huge pages", tmp_path).state == state


def test_the_databases_schema_is_looked_at(tmp_path: Path) -> None:
    assert "The first start creates" in found("Database", tmp_path).message
    database = Database(upgraded_file(tmp_path / "kata.db"))
    assert found("Database", tmp_path).message.endswith("has the newest schema.")
    with database.writer.begin() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = '9999'")
    database.close()
    finding = found("Database", tmp_path)
    assert finding.state == "problem"
    assert "written by a newer version of Kata" in finding.message


def test_backups_are_requested_until_one_is_known_to_restore(tmp_path: Path) -> None:
    assert found("Backups", tmp_path).state == "ok", "nothing to lose yet"
    database = Database(upgraded_file(tmp_path / "kata.db"))
    settings = Settings(data=tmp_path, database_url="", station=None)
    make_key(settings)
    finding = found("Backups", tmp_path)
    assert (finding.state, "There is no verified backup" in finding.message) == ("warning", True)
    create_backup(settings, "asked")
    import_records(settings, database)
    database.close()
    assert found("Backups", tmp_path).state == "ok"
    assert "another disk" in found("Backups' folder", tmp_path).what_to_do


def test_a_file_that_is_no_database_is_a_problem(tmp_path: Path) -> None:
    (tmp_path / "kata.db").write_text("this is something else, long enough to be looked at")
    finding = found("Database", tmp_path)
    assert finding.state == "problem"
    assert "cannot be opened" in finding.message


def test_a_folder_that_cannot_be_written_is_a_problem(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    finding = found("Data folder", tmp_path / "file")
    assert finding.state == "problem"


def test_missing_privileges_are_reported_with_their_setting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "fifo_granted", lambda: False)
    monkeypatch.setattr(doctor, "memory_lock_granted", lambda: False)
    assert "LimitRTPRIO" in found("Real-time scheduling", tmp_path).what_to_do
    assert "LimitMEMLOCK" in found("Locked memory", tmp_path).what_to_do


@pytest.mark.parametrize(("station", "code"), [(None, 0), ('port = "/dev/ttyKATA"', 1)])
def test_command_prints_lines_and_exits_1_on_problems(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, station: str | None, code: int
) -> None:
    for name in [name for name in os.environ if name.startswith("KATA_")]:
        monkeypatch.delenv(name)
    command: list[str | Path] = ["doctor", "--data", tmp_path]
    if station is not None:
        (tmp_path / "station.toml").write_text(station)
        command += ["--station", tmp_path / "station.toml"]
    done = kata(*command, folder=tmp_path) if station else kata_here(*command)
    assert done.returncode == code, done.stderr
    assert "SQLite" in done.stdout
    assert "Traceback" not in done.stderr
    done = kata_here(*command, "--json")
    assert done.returncode == code
    states = {finding["state"] for finding in json.loads(done.stdout)}
    assert states <= {"ok", "warning", "problem"}
    assert ("problem" in states) == bool(code)


def test_unlisted_proxy_is_reported_until_it_is_listed(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    settings = Settings(data=tmp_path, database_url="")
    _warn_of_proxy(settings, "192.0.2.9")
    assert "192.0.2.9 came through a proxy that is not in KATA_TRUSTED_PROXIES" in caplog.text
    (shown,) = [finding for finding in examine(settings) if finding.name == "Proxy"]
    assert (shown.state, "192.0.2.9" in shown.message) == ("warning", True)
    assert shown.what_to_do.endswith("KATA_TRUSTED_PROXIES=192.0.2.9")
    listed = Settings(data=tmp_path, database_url="", trusted_proxies="192.0.2.0/24")
    assert not [finding for finding in examine(listed) if finding.name == "Proxy"]


def test_audit_trail_without_a_copy_elsewhere_is_reported(tmp_path: Path) -> None:
    assert found("Audit trail", tmp_path).state == "warning"
    beside = Settings(data=tmp_path, database_url="", audit_anchor_copy=tmp_path / "copy.anchor")
    (shown,) = [finding for finding in examine(beside) if finding.name == "Audit trail"]
    assert (shown.state, "same disk" in shown.message) == ("warning", True)
    with other_disk(tmp_path) as disk:
        elsewhere = disk / "kata.anchor"
        other = Settings(data=tmp_path, database_url="", audit_anchor_copy=elsewhere)
        (shown,) = [finding for finding in examine(other) if finding.name == "Audit trail"]
    assert (shown.state, str(elsewhere) in shown.message) == ("ok", True)
