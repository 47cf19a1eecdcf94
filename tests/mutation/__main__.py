"""Mutation testing of the modules that evaluate faults and stop the apparatus: ``python -m tests.mutation [module ...]``.

Each change of :mod:`tests.mutation.mutants` to one of the modules below is tested in its own process. The process imports the changed
module and runs the tests that execute the changed lines, the fastest first, until one fails. Surviving changes are printed. More
survivors than :data:`ALLOWED`, or one without a reason in survivors.toml, fail the run.

Why not a library: docs/explanation/decisions/0009-mutation-testing-uses-our-own-script.md.
"""

import ast
import gc
import importlib.abc
import importlib.util
import os
import resource
import shutil
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib.machinery import ModuleSpec, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, Final

import pytest
from coverage import Coverage
from rich.console import Console

from tests.mutation.mutants import Mutant, mutants

ROOT: Final = Path(__file__).parents[2]
DEVICE: Final = ROOT / "backend/kata/device"
MODULES: Final = (
    "faults", "late_command", "latched_stop", "setpoint_gate", "setpoint_limiters", "cycle_state", "state_machine", "state_machine_base", "refusals", "run_limits", "resistance", "run", "movement", "range_override", "teaching",
)  # fmt: skip
"""Modules, the most important first."""
TESTS: Final = sorted(
    str(path)
    for path in (ROOT / "tests/device").glob("test_*.py")
    # The fault matrix and the power cuts take long; other tests assert the same requirements individually.
    if path.stem not in ("test_matrix", "test_power", "test_ipc", "test_journal", "test_latency_histogram")
)
SURVIVORS: Final = Path(__file__).parent / "survivors.toml"
ALLOWED: Final = 3
_LONGEST_S: Final = 120
"""Processor time. A change after which the tests do not end counts as detected."""
_QUIET: Final = ("-q", "-x", "--no-header", "--assert=plain", "-p", "no:cacheprovider", "-o", "timeout=20")
"""Without pytest's assertion rewriting, which explains failures: its messages are not read, and it takes half of the time."""


@dataclass
class Survey:
    """A pytest plugin for the unchanged run: records each test's executed lines and duration."""

    coverage: Coverage
    seconds: dict[str, float] = field(default_factory=dict)
    tests_at: dict[Path, dict[int, set[str]]] = field(default_factory=dict)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Record one test."""
        self.coverage.switch_context(item.nodeid)
        began = time.monotonic()
        result = yield
        self.seconds[item.nodeid] = time.monotonic() - began
        self.coverage.switch_context("")
        return result

    def tests_for(self, mutant: Mutant) -> list[str]:
        """Return the tests that execute a changed line, or all tests if it is executed at import; the fastest first."""
        at = self.tests_at[mutant.file]
        coming = {test for line in mutant.lines for test in at.get(line, ())} if mutant.lines else set(self.seconds)
        return sorted(coming & self.seconds.keys(), key=lambda test: self.seconds[test])


@dataclass
class Chosen:
    """A pytest plugin that selects and orders tests."""

    order: dict[str, int]

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Apply the selection."""
        items[:] = sorted((item for item in items if item.nodeid in self.order), key=lambda i: self.order[i.nodeid])


class _Changed(SourceFileLoader):
    def __init__(self, name: str, mutant: Mutant) -> None:
        super().__init__(name, str(mutant.file))
        self._mutant = mutant

    def get_code(self, fullname: str) -> CodeType:
        code: CodeType = compile(self._mutant.tree, self._mutant.file, "exec")
        return code


class _Finder(importlib.abc.MetaPathFinder):
    def __init__(self, mutant: Mutant) -> None:
        self._mutant = mutant

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        if name != f"kata.device.{self._mutant.file.stem}":
            return None
        return importlib.util.spec_from_file_location(name, self._mutant.file, loader=_Changed(name, self._mutant))


def main(modules: Sequence[str]) -> int:
    """Return 0 if the number of survivors is allowed."""
    console = Console(soft_wrap=True, highlight=False)
    scratch = Path(tempfile.mkdtemp(prefix="kata-mutation-"))
    try:
        survey = _without_change(scratch)
        if survey is None:
            console.print("The tests fail without any change.")
            return 1
        # The tested loop collects garbage; exclude the objects of this process.
        gc.collect()
        gc.freeze()
        if _noticed_without_change(survey, scratch):
            console.print("The tests fail without any change when they are run as for one: nothing could be said.")
            return 1
        console.print(f"{', '.join(modules)}; {len(survey.seconds)} tests")
        # Create them when needed: a thousand syntax trees would slow each fork.
        every = (mutant for module in modules for mutant in mutants(DEVICE / f"{module}.py"))
        done = 0
        survived: list[Mutant] = []
        for done, (mutant, noticed) in enumerate(_each(every, survey, scratch), start=1):
            if not noticed:
                survived.append(mutant)
                console.print(f"survived: {_describe(mutant)}", markup=False)
            if done % 100 == 0:
                console.print(f"{done} tried, {len(survived)} survived")
    finally:
        shutil.rmtree(scratch)
    return _verdict(console, modules, done, survived)


def _verdict(console: Console, modules: Sequence[str], tried: int, survived: list[Mutant]) -> int:
    known = {(survivor["file"], survivor["in"], survivor["was"], survivor["becomes"]) for survivor in _known()}
    unexplained = [mutant for mutant in survived if mutant.name not in known]
    gone = [name for name in known if name not in {m.name for m in survived} and name[0][:-3] in modules]
    console.print(f"{tried} changes, {tried - len(survived)} noticed, {len(survived)} survived")
    for mutant in unexplained:
        console.print(f"no reason is given for {_describe(mutant)}", markup=False)
    for name in gone:
        console.print(f"in survivors.toml, but does not survive: {name}", markup=False)
    return 1 if unexplained or gone or len(survived) > ALLOWED else 0


def _known() -> list[dict[str, Any]]:
    survivors: list[dict[str, Any]] = tomllib.loads(SURVIVORS.read_text()).get("survivor", [])
    return survivors


def _describe(mutant: Mutant) -> str:
    return f"{mutant.file.name}, {mutant.place or 'module'}:\n    {mutant.was}\n    {mutant.becomes}"


def _without_change(scratch: Path) -> Survey | None:
    coverage = Coverage(data_file=None, include=[str(DEVICE / f"{module}.py") for module in MODULES], config_file=False)
    survey = Survey(coverage)
    coverage.start()
    code = pytest.main([*TESTS, *_QUIET, f"--basetemp={scratch / 'unchanged'}"], plugins=[survey])
    coverage.stop()
    for file in map(Path, coverage.get_data().measured_files()):
        at = coverage.get_data().contexts_by_lineno(str(file))
        survey.tests_at[file] = {line: set(tests) for line, tests in at.items()}
    return None if code else survey


def _noticed_without_change(survey: Survey, scratch: Path) -> bool:
    """The tests must pass without a change, or they would detect any change."""
    file = DEVICE / "state_machine.py"
    unchanged = Mutant(file, "", "", "", range(0), ast.parse(file.read_text()))
    return any(noticed for _, noticed in _each([unchanged], survey, scratch))


def _each(every: Iterable[Mutant], survey: Survey, scratch: Path) -> Iterator[tuple[Mutant, bool]]:
    """Return True for each detected change; runs one process per processor."""
    running: dict[int, Mutant] = {}
    waiting = iter(every)
    more = True
    while True:
        while len(running) < (os.cpu_count() or 1) and more:
            mutant = next(waiting, None)
            more = mutant is not None
            if mutant:
                running[_try(mutant, survey.tests_for(mutant), scratch)] = mutant
        if not running:
            return
        process, status = os.wait()
        yield running.pop(process), status != 0


def _try(mutant: Mutant, tests: list[str], scratch: Path) -> int:
    """Test one change in its own process, which ends with 0 when no test fails."""
    process = os.fork()
    if process:
        return process
    code = 1
    try:
        # The kernel ends a process that does not end, even without its parent.
        resource.setrlimit(resource.RLIMIT_CPU, (_LONGEST_S, _LONGEST_S))
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), 1)
            os.dup2(nowhere.fileno(), 2)
        for name in [name for name in sys.modules if name.split(".")[0] in ("kata", "tests")]:
            del sys.modules[name]
        sys.meta_path.insert(0, _Finder(mutant))
        own = scratch / str(os.getpid())
        files = sorted({test.partition("::")[0] for test in tests})
        order = {test: n for n, test in enumerate(tests)}
        arguments = [*(str(ROOT / file) for file in files), *_QUIET, f"--basetemp={own}"]
        code = pytest.main(arguments, plugins=[Chosen(order)]) if tests else 0
        shutil.rmtree(own, ignore_errors=True)
    finally:
        os._exit(int(code))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or MODULES))
