"""Each benchmark runs briefly and writes its figures; their values are not tested.

Every test run has the benchmarks of the installed command; `make campaign` has the others.
"""

from pathlib import Path
from typing import Final

import pytest

from benchmarks import sign_in
from benchmarks.attacks import ATTACKS
from kata.bench.loop import LoopCase, loop_cases
from kata.bench.running_service import WITHOUT_REAL_TIME, RunningService, prepare_records
from kata.bench.stop import LOADS
from kata.database.postgresql_programs import postgresql_program
from tests.support.bench_command import bench

_WITH_POSTGRESQL: Final = postgresql_program("initdb") is not None


def loop(out: Path, rate_hz: int, load: str) -> None:
    quick = ("--seconds", "1", "--rates", str(rate_hz), "--no-fifo", f"--{load}", "--plot-minutes", "0.1")
    report = bench("loop", *quick, out=out)
    kinds = ("lateness_p50_ms", "lateness_p99_ms", "lateness_p999_ms", "lateness_max_ms", "missed")
    assert {f"{kind}_{rate_hz}hz_{load}_nofifo" for kind in kinds} <= set(report["figures"])
    assert load == "idle" or any("WebSocket messages read" in note for note in report["notes"])


def test_loop_without_privileges(tmp_path: Path) -> None:
    """Works for every user on every computer."""
    loop(tmp_path / "loop.json", 100, "idle")


@pytest.mark.campaign
def test_loop_under_load_and_without_privileges(tmp_path: Path) -> None:
    """On a busy computer the apparatus may stop, so this is not part of every test run."""
    loop(tmp_path / "loop.json", 10, "loaded")


@pytest.mark.campaign
def test_estop(tmp_path: Path) -> None:
    report = bench("estop", "--presses", "3", "--idle", "--plot-minutes", "0.1", out=tmp_path / "estop.json")
    figures = report["figures"]
    assert figures["estop_presses"] >= 3
    assert 0 < figures["estop_p50_ms"] <= figures["estop_p999_ms"] <= figures["estop_max_ms"]
    assert "estop_other_causes" in figures


def stop(out: Path, *loads: str) -> None:
    figures = bench("stop", "--stops", "2", "--loads", ",".join(loads), out=out)["figures"]
    for load in loads:
        assert 0 < figures[f"stop_p50_ms_{load}"] <= figures[f"stop_p999_ms_{load}"] <= figures[f"stop_max_ms_{load}"]


@pytest.mark.campaign
def test_stop(tmp_path: Path) -> None:
    stop(tmp_path / "stop.json", "idle", "slow_disk")


@pytest.mark.campaign
def test_stop_under_every_load(tmp_path: Path) -> None:
    stop(tmp_path / "stop.json", *LOADS)


@pytest.mark.campaign
def test_soak(tmp_path: Path) -> None:
    report = bench("soak", "--minutes", "0.02", out=tmp_path / "soak.json")
    wanted = {"soak_missed", "soak_reference_missed", "soak_service_growth_mb", "soak_device_growth_mb"}
    assert set(report["figures"]) == wanted


@pytest.mark.campaign
def test_a_session_ends_and_the_next_is_played_in(tmp_path: Path) -> None:
    records = prepare_records(tmp_path, play_s=1.0, plot_s=1.0)
    with RunningService(tmp_path, records, cycle_hz=100, rate_hz=100, settings=WITHOUT_REAL_TIME) as service:
        service.play(records)
        service.until(lambda live: live.mode == "idle", 60)
        after = service.begin_next_session(records)
        assert after.session_id != records.session_id
        service.play(after)


@pytest.mark.campaign
def test_pages(tmp_path: Path) -> None:
    report = bench("pages", "--pages", "20", "--stalled", "2", "--seconds", "1", out=tmp_path / "pages.json")
    figures = report["figures"]
    for suffix in ("1", "all", "stalled"):
        assert 0 < figures[f"delivery_p99_ms_{suffix}"] <= figures[f"delivery_max_ms_{suffix}"]
        assert {f"lateness_p999_ms_{suffix}", f"missed_{suffix}", f"growth_mb_{suffix}"} <= set(figures)


@pytest.mark.campaign
def test_sign_in(tmp_path: Path) -> None:
    """Four services and two kinds of guessing one after another: two minutes on a busy computer."""
    report = bench("password-guessing", "--seconds", "1", "--pairs", "4", out=tmp_path / "sign-in.json")
    figures = report["figures"]
    assert figures["pairs"] == 4
    assert {"known_ms", "unknown_ms", "known_unknown_difference_ms"} <= set(figures)
    # On a busy computer the loop may stop; the report then says so.
    if not any("no more figures" in note for note in report["notes"]):
        assert {"lateness_p999_ratio_one", "lateness_p999_ratio_many", "missed_many"} <= set(figures)
        assert figures["tries_one"] == figures["locked_out_one"] + figures["weighed_one"] + figures["other_answers_one"]


@pytest.mark.campaign
def test_known_and_unknown_names_are_asked_equally_often(tmp_path: Path) -> None:
    records = prepare_records(tmp_path, play_s=1.0, plot_s=1.0)
    sign_in.make_accounts(tmp_path, 1)
    report = sign_in.measure_answer_times(tmp_path, records, 4)
    assert (len(report.known), len(report.unknown)) == (4, 4)
    assert min(*report.known, *report.unknown) > 0


@pytest.mark.campaign
def test_history(tmp_path: Path) -> None:
    small = ("--patients", "20", "--sessions", "200", "--minutes", "1.1", "--times", "2")
    report = bench("history", *small, out=tmp_path / "history.json")
    figures = report["figures"]
    wanted = {"bytes_per_hour", "error_plot_p95_ms", "lists_p50_ms_sqlite", "lists_p95_ms_sqlite", "growth_ratio_10x"}
    missing = any("PostgreSQL" in note for note in report["notes"])
    assert set(figures) == (wanted if missing else wanted | {"lists_p50_ms_postgresql", "lists_p95_ms_postgresql"})
    assert 1e6 < figures["bytes_per_hour"] < 2.5e6
    assert all(value > 0 for value in figures.values())


@pytest.mark.campaign
def test_slow_station_is_measured_with_its_own_cycle() -> None:
    wanted = loop_cases([10, 200], real_time=(True,), loaded=(False,))
    assert wanted == [LoopCase(10, False, True), LoopCase(200, False, True)]
    assert [cell.cycle_hz for cell in wanted] == [100, 200]


def stop_under_attack(out: Path, stops: int, *attacks: str, stations: int = 1) -> None:
    options = [word for name in attacks for word in ("--attack", name)]
    report = bench("stop-under-attack", "--stops", f"{stops}", "--stations", f"{stations}", *options, out=out)
    at = ["", *(f"_station_{n}" for n in range(2, stations + 1))]
    for name in (f"{attack}{station}" for attack in ("none", *attacks) for station in at):
        assert report["figures"][f"failed_{name}"] == 0
        assert 0 < report["figures"][f"p50_ms_{name}"] <= report["figures"][f"max_ms_{name}"]


@pytest.mark.campaign
def test_stop_is_answered_under_attack(tmp_path: Path) -> None:
    """Two stations on PostgreSQL and the other attacks: in the campaign."""
    stop_under_attack(tmp_path / "attack.json", 3, "socket_flood")


@pytest.mark.campaign
@pytest.mark.parametrize("stations", [1, 2] if _WITH_POSTGRESQL else [1])
@pytest.mark.parametrize("attack", ATTACKS)
def test_stop_is_answered_under_every_attack(tmp_path: Path, attack: str, stations: int) -> None:
    stop_under_attack(tmp_path / "attack.json", 5, attack, stations=stations)
