"""The fault campaign: a few hundred sequences in every test run, ten thousand in `make campaign`."""

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.stateful import run_state_machine_as_test

from tests.campaign.crossings import Crossings
from tests.campaign.sequences import Sequences

_ALL = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large]


@pytest.mark.timeout(600)
def test_no_sequence_of_events_leaves_torque_on_after_a_stop() -> None:
    few = settings(max_examples=40, stateful_step_count=30, derandomize=True, deadline=None, suppress_health_check=_ALL)
    run_state_machine_as_test(Sequences, settings=few)


@pytest.mark.campaign
@pytest.mark.timeout(0)
@pytest.mark.parametrize("core", range(2))
def test_ten_thousand_sequences_leave_no_torque_after_a_stop(core: int) -> None:
    """In two halves, of which two processes take one each (``-n 2``)."""
    many = settings(
        max_examples=5_000, stateful_step_count=100, deadline=None, suppress_health_check=_ALL, print_blob=True
    )
    run_state_machine_as_test(Sequences, settings=many)


@pytest.mark.timeout(600)
def test_stop_waits_for_nothing_on_its_way_from_service() -> None:
    few = settings(max_examples=40, stateful_step_count=30, derandomize=True, deadline=None, suppress_health_check=_ALL)
    run_state_machine_as_test(Crossings, settings=few)


@pytest.mark.campaign
@pytest.mark.timeout(0)
def test_two_thousand_crossings_never_delay_a_stop() -> None:
    many = settings(
        max_examples=2_000, stateful_step_count=50, deadline=None, suppress_health_check=_ALL, print_blob=True
    )
    run_state_machine_as_test(Crossings, settings=many)
