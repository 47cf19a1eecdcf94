"""A command is valid until its expiry, and only if its sender has seen the newest stop."""

from kata.device.late_command import STOPPED_MEANWHILE, out_of_date

EXPIRES_NS = 2_000_000_000


def test_command_is_valid_up_to_its_expiry() -> None:
    assert out_of_date(3, EXPIRES_NS, stops=3, t_ns=EXPIRES_NS) is None
    refusal = out_of_date(3, EXPIRES_NS, stops=3, t_ns=EXPIRES_NS + 1)
    assert refusal is not None and refusal.code == "expired"


def test_command_whose_sender_missed_a_stop_is_refused() -> None:
    assert out_of_date(3, EXPIRES_NS, stops=4, t_ns=0) is STOPPED_MEANWHILE
    assert out_of_date(4, EXPIRES_NS, stops=3, t_ns=0) is STOPPED_MEANWHILE
