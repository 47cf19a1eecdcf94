"""The course of voltage and temperature, and its route."""

from pathlib import Path

from msgspec import structs

from kata.device.ipc_messages import Snapshot
from kata.station.drive_trend import INTERVAL_S, TREND_HOURS, DriveTrend
from tests.support.stepped import Stepped


class Clock:
    """A clock that tests set."""

    s = 1000.0

    def __call__(self) -> float:
        return self.s


def snapshot(tmp_path: Path, temperature_c: float | None) -> Snapshot:
    """Return a snapshot in which motor 2 has this temperature."""
    whole = Stepped(tmp_path).snapshot
    axes = [structs.replace(axis, temperature_c=temperature_c if axis.motor == 2 else None) for axis in whole.axes]
    return structs.replace(whole, axes=tuple(axes))


def test_one_point_is_kept_for_each_interval(tmp_path: Path) -> None:
    clock = Clock()
    trend = DriveTrend(clock)
    for step, temperature_c in ((0.0, 40.0), (INTERVAL_S - 1, 41.0), (1.0, 42.0)):
        clock.s += step
        trend.take(snapshot(tmp_path, temperature_c))
    assert [point.temperature_c for point in trend.points()] == [
        [None, value, None, None, None] for value in (40.0, 42.0)
    ]


def test_nothing_is_kept_of_drives_that_report_nothing(tmp_path: Path) -> None:
    trend = DriveTrend()
    trend.take(snapshot(tmp_path, None))
    assert trend.points() == []
    trend.take(snapshot(tmp_path, 40.0))
    assert len(trend.points()) == 1


def test_points_older_than_some_hours_are_forgotten(tmp_path: Path) -> None:
    clock = Clock()
    trend, points = DriveTrend(clock), int(TREND_HOURS * 3600 / INTERVAL_S)
    hot, cold = snapshot(tmp_path, 70.0), snapshot(tmp_path, 30.0)
    trend.take(hot)
    for _ in range(points):
        clock.s += INTERVAL_S
        trend.take(cold)
    assert len(trend.points()) == points
    assert {point.temperature_c[1] for point in trend.points()} == {30.0}
