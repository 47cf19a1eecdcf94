"""``kata identify`` runs the step "lags" of a commissioned station: it shows the result, or also records and uses it."""

from dataclasses import replace
from pathlib import Path

import pytest
from msgspec import structs

from kata.bench.commissioned import write_commissioned
from kata.cli import commission as cli
from kata.commissioning import acceptance, identify_drives
from kata.commissioning.record import read_record, record_path
from kata.commissioning.status import commissioning_status
from kata.commissioning.workbench import StepError, Workbench
from kata.device import config
from kata.device.config import StationConfig, simulated
from kata.evaluation.world import World
from kata.motion.axes import BASIC_MOTIONS
from kata.motion.builtin import built_in_motions
from kata.motion.identify_load import IdentifiedAxis
from tests.support.obedient import Obedient

AXIS = IdentifiedAxis(0.05, 0.001, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.05, 0.01, r_squared=0.99)


@pytest.fixture
def station(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the file of a commissioned station without lags. Its drives are simulated."""
    axes = tuple(structs.replace(axis, lag_s=0.0, lag2_s2=0.0) for axis in simulated("virtual").axes)
    path = tmp_path / "station.toml"
    write_commissioned(structs.replace(simulated("virtual"), axes=axes), path)

    def bench(draft: StationConfig, *, lines: bool) -> Workbench:
        world = World(draft)
        return Workbench(draft, Obedient(), world.open_transport, world.sleep, lambda: world.t_ns)

    monkeypatch.setattr(cli, "_bench_at_port", bench)
    return path


@pytest.fixture
def quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Move the motors as briefly as possible, and identify usual drives."""
    monkeypatch.setattr(identify_drives, "_EXCITATION_S", 9.0)
    monkeypatch.setattr(identify_drives, "identified", lambda samples: (AXIS,) * 5)


@pytest.mark.usefixtures("quickly")
def test_the_result_is_shown_and_nothing_is_written(station: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = {path.name: path.read_bytes() for path in station.parent.iterdir()}
    assert cli.identify(station, "Mori", write=False)
    assert {path.name: path.read_bytes() for path in station.parent.iterdir()} == before
    shown = capsys.readouterr().err
    for motor in range(1, 6):
        for name in ("lag s: 0.0 -> 0.05", "second-order lag s2", "friction deg", "residual deg", "lag uncertainty s"):
            assert f"motor {motor} {name}" in shown


@pytest.mark.campaign
def test_the_result_is_used_after_the_motions_have_passed(station: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(acceptance, "BASIC_MOTIONS", BASIC_MOTIONS[3:4])
    monkeypatch.setattr(acceptance, "built_in_motions", lambda: built_in_motions()[3:4])
    former = read_record(record_path(station))
    assert former is not None
    assert cli.identify(station, "Mori", write=True)
    record, now = read_record(record_path(station)), config.read(station)
    assert record is not None and record.passed and record.previous == former.digest
    assert [(ran.step, ran.by) for ran in record.steps[-3:]] == [("gains", former.by), ("lags", ""), ("acceptance", "")]
    assert record.by == "Mori"
    assert all(0.03 < axis.lag_s < 0.2 for axis in now.axes)
    played = [value for value in record.steps[-1].values if value.motor == 3]
    assert {value.name for value in played} == {
        f"motion 4, {load}: {what}" for load in ("weight", "empty") for what in ("peak error deg", "RMSE deg")
    }
    assert all(abs(float(value.after or 0)) < 1.0 for value in record.steps[-1].values)
    assert commissioning_status(station, now).missing is None


@pytest.mark.usefixtures("quickly")
def test_patients_are_refused_until_the_motions_have_passed(station: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(acceptance, "BASIC_MOTIONS", BASIC_MOTIONS[3:4])
    monkeypatch.setattr(acceptance, "built_in_motions", lambda: built_in_motions()[3:4])
    monkeypatch.setattr(acceptance, "LIMITS_DEG", {4: 0.01})
    before = station.read_bytes()
    assert not cli.identify(station, "Mori", write=True)
    assert station.read_bytes() == before
    record = read_record(record_path(station))
    assert record is not None and record.steps[-1].fault_key is not None
    assert record.steps[-1].fault_key.code == "tracking_poor"
    missing = commissioning_status(station, config.read(station)).missing
    assert missing is not None and missing.key.code == "commissioning_unfinished"


@pytest.mark.usefixtures("quickly")
def test_a_poor_fit_changes_nothing(
    station: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    poor = (*(AXIS,) * 3, replace(AXIS, r_squared=0.5), AXIS)
    monkeypatch.setattr(identify_drives, "identified", lambda samples: poor)
    before = {path.name: path.read_bytes() for path in station.parent.iterdir()}
    assert not cli.identify(station, "Mori", write=True)
    assert {path.name: path.read_bytes() for path in station.parent.iterdir()} == before
    assert "Lag and friction of motor 4 explain only 50 %" in capsys.readouterr().err


def test_an_uncertain_lag_is_refused() -> None:
    identify_drives.check_fit(2, replace(AXIS, lag_uncertainty_s=0.014))
    with pytest.raises(StepError, match=r"lag of motor 2 is uncertain: 0\.05 s, and with 95 % confidence up to 0\.016"):
        identify_drives.check_fit(2, replace(AXIS, lag_uncertainty_s=0.016))


def test_a_station_that_is_not_commissioned_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "station.toml"
    config.write(simulated("virtual"), path)
    with pytest.raises(SystemExit):
        cli.identify(path, "Mori", write=False)
    assert "The steps before lags have not passed: there is no commissioning record" in capsys.readouterr().err
