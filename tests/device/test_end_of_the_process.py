"""The control program ends only when the drives report no torque: a message may be lost, and not every drive has a watchdog."""

from tests.support.stepped import Stepped


def cycles_until_end(stepped: Stepped) -> int:
    for cycle in range(1000):
        if not stepped.cycle():
            return cycle
    raise AssertionError("the process did not end")


def test_lost_torque_off_is_repeated_before_the_end(playing: Stepped) -> None:
    playing.apparatus.deaf_to_torque_off = {3}
    playing.link.closing, playing.link.service_silent_ms = True, 1e9
    for _ in range(30):
        assert playing.cycle()
    playing.apparatus.deaf_to_torque_off = set()
    cycles_until_end(playing)
    assert not playing.torque


def test_unconfirmed_torque_off_delays_the_end_by_half_a_second(playing: Stepped) -> None:
    playing.apparatus.deaf_to_torque_off = {3}
    playing.link.closing, playing.link.service_silent_ms = True, 1e9
    assert 50 < cycles_until_end(playing) < 80


def test_idle_process_ends_at_once(stepped: Stepped) -> None:
    stepped.link.closing = True
    assert cycles_until_end(stepped) == 0
