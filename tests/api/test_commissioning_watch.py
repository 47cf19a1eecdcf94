"""The service knows whether its station is commissioned with the configuration in use."""

from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from kata.api import commissioning_watch
from kata.api.commissioning_watch import CommissioningWatch
from kata.bench.commissioned import write_commissioned
from kata.clinic.stations.tables import StationRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.device import config
from kata.device.config import simulated
from kata.device.ipc_messages import Refusal


@pytest.mark.parametrize("place", ["commissioning_status", "import_records"])
def test_configuration_adopted_during_a_check_is_evaluated(
    place: str, tmp_path: Path, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The procedure ends while the delivery thread evaluates its new record against the former configuration."""
    file = tmp_path / "station.toml"
    former = simulated("virtual")
    config.write(former, file)
    watch = CommissioningWatch(database, former, file, simulated=False)
    with database.write() as session:
        session.add(StationRow(name=former.name, config="", registered_at=utc_now(), started_at=utc_now()))
    new = structs.replace(former, axes=tuple(structs.replace(axis, lag_s=0.07) for axis in former.axes))
    write_commissioned(new, file)
    original = getattr(commissioning_watch, place)

    def adopt_then(*values: Any) -> Any:
        monkeypatch.undo()
        result = original(*values)
        watch.use(config.read(file))
        return result

    monkeypatch.setattr(commissioning_watch, place, adopt_then)
    refusals: list[Refusal | None] = []
    watch.on_change = refusals.append
    watch.check()
    assert watch.refusal is not None
    watch.check()
    assert watch.refusal is None
    assert refusals[-1] is None
    watch.check()
    assert len(refusals) == 2
