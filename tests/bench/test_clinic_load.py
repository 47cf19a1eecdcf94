"""Which delays the benchmark of many stations counts."""

from benchmarks.clinic_load import overview_delays_ms
from benchmarks.stepped_station import StationFigures


def test_delay_is_counted_for_each_page_of_each_station() -> None:
    one = StationFigures("One", presses_s=[10.0], seen_s=[(0, "One", 10.2), (1, "One", 10.1)], ended_s=60.0)
    other = StationFigures("Two", seen_s=[(0, "One", 10.5)], ended_s=60.0)
    delays_ms, missed = overview_delays_ms([one, other])
    assert sorted(round(delay_ms) for delay_ms in delays_ms) == [100, 200, 500]
    assert missed == 0


def test_press_that_a_page_never_showed_is_missed() -> None:
    one = StationFigures("One", presses_s=[10.0, 30.0, 58.0], seen_s=[(0, "One", 30.3)], ended_s=60.0)
    other = StationFigures("Two", seen_s=[(0, "Two", 5.0)], ended_s=60.0)
    delays_ms, missed = overview_delays_ms([one, other])
    assert [round(delay_ms) for delay_ms in delays_ms] == [300]
    assert missed == 3, (
        "the first press on both pages, the second on the other page; the last press came too late to count"
    )
