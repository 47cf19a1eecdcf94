"""Which registers are read when, and the verification state: no bus, no drives."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.device.bus.verification import ROUND_S, Verification

DRIVES, BLOCKS = 5, 3


def verified(cycle_hz: int = 100) -> Verification:
    """Return a verification in which every block of every drive has been read."""
    made = Verification(DRIVES, BLOCKS, cycle_hz)
    for drive in range(DRIVES):
        for block in range(BLOCKS):
            made.found(drive, block, ())
    return made


def asked(
    verification: Verification, cycles: int, *, lost: frozenset[tuple[int, int]] = frozenset()
) -> list[tuple[int, int] | None]:
    """Return the reads of this many cycles; reads of ``lost`` are never answered."""
    found = []
    for _ in range(cycles):
        due = verification.next_read()
        found.append(due)
        if due and due not in lost:
            verification.found(*due, ())
    return found


ROTATION = {(drive, block) for drive in range(DRIVES) for block in range(1, BLOCKS)}


@pytest.mark.parametrize("cycle_hz", [20, 40, 100, 200, 500])
def test_every_block_is_read_within_the_round(cycle_hz: int) -> None:
    cycles = round(ROUND_S * cycle_hz)
    reads = asked(verified(cycle_hz), cycles)
    assert set(reads) >= ROTATION
    assert reads.count(None) >= cycles / 2, "statuses come less often"


def test_lost_answer_is_requested_again_at_the_next_turn() -> None:
    verification = verified()
    first = next(due for due in iter(verification.next_read, ()) if due)
    again = next(due for due in iter(verification.next_read, ()) if due)
    assert again == first
    verification.found(*again, ())
    assert next(due for due in iter(verification.next_read, ()) if due) != first


def test_unanswered_block_delays_no_other() -> None:
    lost = frozenset({(0, 1)})
    verification = verified()
    asked(verification, 400, lost=lost)
    assert ROTATION - lost <= set(asked(verification, round(1.5 * ROUND_S * 100), lost=lost))

    verification.forget(0)
    verification.forget(4)
    verification.found(0, 0, ())
    verification.found(4, 0, ())
    assert {(4, 1), (4, 2), (0, 2)} <= set(asked(verification, 12, lost=lost))
    assert verification.verified(4)
    assert not verification.verified(0)


@given(
    cycle_hz=st.sampled_from([20, 50, 100, 200]),
    lost=st.frozensets(st.sampled_from(sorted(ROTATION)), max_size=4),
    forgotten=st.frozensets(st.integers(0, DRIVES - 1)),
)
def test_status_is_read_at_least_every_other_cycle(
    cycle_hz: int, lost: frozenset[tuple[int, int]], forgotten: frozenset[int]
) -> None:
    verification = verified(cycle_hz)
    for drive in forgotten:
        verification.forget(drive)
        verification.found(drive, 0, ())
    reads = asked(verification, 4 * cycle_hz, lost=lost)
    assert all(before is None or after is None for before, after in itertools.pairwise(reads))


def test_urgent_block_is_read_first_and_delays_no_other() -> None:
    urgent = (0, 2)
    for lost in (frozenset[tuple[int, int]](), frozenset({urgent})):
        verification = Verification(DRIVES, BLOCKS, 100, urgent=urgent)
        reads = [due for due in asked(verification, 48, lost=lost) if due]
        assert reads[0] == urgent
        assert set(reads) >= ROTATION


def test_nothing_is_read_of_drives_that_have_only_a_status() -> None:
    assert asked(Verification(DRIVES, 1, 100), 50) == [None] * 50


def test_wrong_register_stays_wrong_until_read_again() -> None:
    verification = verified()
    verification.found(2, 1, ["return delay time", "drive mode"])
    for _ in range(3):
        verification.heard(2, answered=False)
    assert verification.mismatch(2) == "return delay time"
    verification.found(2, 1, ())
    assert verification.mismatch(2) == ""
    assert not verification.verified(2), "the other blocks have not been read since it was silent"
    for block in range(BLOCKS):
        verification.found(2, block, ())
    assert verification.verified(2)
