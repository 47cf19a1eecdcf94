"""Prints how many examples a part of the campaign needs to fail: ``python -m tests.campaign.search PART``; 0: none fails."""

import argparse
import logging
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, get_args

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from hypothesis.errors import HypothesisException
from hypothesis.stateful import RuleBasedStateMachine, run_state_machine_as_test

from tests.campaign.crossings import Crossings
from tests.campaign.reverts import BUDGET, Finder
from tests.campaign.sequences import Sequences
from tests.support.effective_config import accepted, changes, hold_effective
from tests.support.pushes import hold_answered, pushes

_MACHINES: Final[dict[Finder, tuple[type[RuleBasedStateMachine], int]]] = {
    "sequences": (Sequences, 100),
    "crossings": (Crossings, 50),
}
"""With the steps of an example."""


class Count:
    """Counts the running example and remembers the first that failed."""

    def __init__(self) -> None:
        self.begun = 0
        self.failed = 0

    def fail(self, error: BaseException | None) -> None:
        """Note the error of an example, unless it is one of hypothesis' own exceptions."""
        if isinstance(error, Exception) and not isinstance(error, HypothesisException):
            self.failed = self.failed or self.begun


def search(part: Finder) -> int:
    """Return the number of the first example that fails, or 0. The same examples each time."""
    count = Count()
    chosen = settings(
        max_examples=BUDGET[part],
        stateful_step_count=_MACHINES[part][1] if part in _MACHINES else 1,
        phases=[Phase.generate],
        report_multiple_bugs=False,
        derandomize=True,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    try:
        if part in _MACHINES:
            run_state_machine_as_test(_counted(_MACHINES[part][0], count), settings=chosen)
        else:
            _search_property(*_PROPERTIES[part], count, chosen)
    except Exception:
        if not count.failed:
            raise
    return count.failed


def _counted(machine: type[RuleBasedStateMachine], count: Count) -> type[RuleBasedStateMachine]:
    class Counted(machine):  # type: ignore[valid-type, misc]
        def __init__(self) -> None:
            count.begun += 1
            super().__init__()

        def teardown(self) -> None:
            # It is called while the error of a step propagates.
            count.fail(sys.exc_info()[1])
            try:
                super().teardown()
            except Exception as error:
                count.fail(error)
                raise

    return Counted


def _hold_configuration(folder: Path, fields: dict[str, Any]) -> None:
    config = accepted(folder, fields)
    if config is not None:
        hold_effective(config)


_PROPERTIES: Final[dict[Finder, tuple[st.SearchStrategy[Any], Callable[[Path, Any], None]]]] = {
    "configurations": (changes(), _hold_configuration),
    "pushes": (pushes(), hold_answered),
}
"""Each with its examples, and the check of one of them in an empty folder."""


def _search_property(
    examples: st.SearchStrategy[Any], check: Callable[[Path, Any], None], count: Count, chosen: settings
) -> None:
    with tempfile.TemporaryDirectory() as folder:

        @chosen
        @given(examples)
        def hold(example: Any) -> None:
            count.begun += 1
            try:
                check(Path(tempfile.mkdtemp(dir=folder)), example)
            except Exception as error:
                count.fail(error)
                raise

        hold()


if __name__ == "__main__":
    logging.disable()
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=get_args(Finder))
    sys.stdout.write(f"{search(parser.parse_args().part)}\n")
