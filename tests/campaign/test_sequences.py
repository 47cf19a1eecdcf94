"""The fault campaign: five short sequences in every test run, ten thousand long ones in `make campaign`."""

import logging

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.stateful import RuleBasedStateMachine, run_state_machine_as_test

from tests.campaign.crossings import Crossings
from tests.campaign.sequences import Sequences

log = logging.getLogger(__name__)

_ALL = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large]


@pytest.mark.timeout(600)
def test_no_sequence_of_events_leaves_torque_on_after_a_stop() -> None:
    few = settings(max_examples=5, stateful_step_count=10, derandomize=True, deadline=None, suppress_health_check=_ALL)
    run_state_machine_as_test(Sequences, settings=few)


@pytest.mark.campaign
@pytest.mark.timeout(0)
@pytest.mark.parametrize("core", range(2))
def test_ten_thousand_sequences_leave_no_torque_after_a_stop(core: int) -> None:
    """Two halves for two processes (``-n 2``)."""
    _run_new_examples(Sequences, examples=5_000, steps=100)


@pytest.mark.timeout(600)
def test_stop_waits_for_nothing_on_its_way_from_service() -> None:
    few = settings(max_examples=2, stateful_step_count=30, derandomize=True, deadline=None, suppress_health_check=_ALL)
    run_state_machine_as_test(Crossings, settings=few)


@pytest.mark.campaign
@pytest.mark.timeout(0)
def test_two_thousand_crossings_never_delay_a_stop() -> None:
    _run_new_examples(Crossings, examples=2_000, steps=50)


def _run_new_examples(machine: type[RuleBasedStateMachine], *, examples: int, steps: int) -> None:
    """Run examples that no earlier run and no other process has drawn. Each is drawn alone.

    In one run, half of the examples would only repeat parts of the one before. ``derandomize=False`` is explicit: the profile "steady" sets
    it, and both halves would then draw the same examples.
    """
    chosen = settings(
        # The first example of a run is always the simplest one.
        max_examples=2,
        stateful_step_count=steps,
        derandomize=False,
        database=None,
        deadline=None,
        suppress_health_check=_ALL,
        print_blob=True,
    )
    for drawn in range(1, examples + 1):
        run_state_machine_as_test(machine, settings=chosen)
        if drawn % 500 == 0:
            log.info("%s: %d of %d examples of %d steps", machine.__name__, drawn, examples, steps)
