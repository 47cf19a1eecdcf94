"""Rules for the structure of the code: sizes, parameters, unique names, numbers of decision records.

Ruff has no rule for them: PLR0915 counts statements instead of lines, and PLR0913 does not exclude the options of a command.
"""

import ast
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from typing import Final

from tests.support.paths import ROOT

MAX_FUNCTION_LINES: Final = 60
MAX_CLASS_LINES: Final = 300
MAX_PARAMETERS: Final = 6
BACKEND: Final = ROOT / "backend"

COMMANDS_WITHOUT_A_DECORATOR: Final = {"evaluate", "backup", "restore"}
"""Registered as commands in kata.cli.main."""

LONG_FUNCTIONS: Final = {
    "kata/simulator/plant.py step_axis": "one flat loop, in which a simulation spends most of its time",
}
"""Exceptions from the rules, with their reasons. "To be split": no reason to stay."""

LONG_CLASSES: Final[dict[str, str]] = {}

_ROUTE: Final = "a route: its parameters are those of the request, and its dependencies"
MANY_PARAMETERS: Final = {
    "kata/audit/router.py list_audit": _ROUTE,
    "kata/clinic/events/router.py list_events": _ROUTE,
    "kata/clinic/sessions/lists_router.py list_sessions": _ROUTE,
    "kata/clinic/sessions/router.py confirm_check": _ROUTE,
    "kata/interop/router.py import_motion": _ROUTE,
}

_RESPONSE: Final = "the API's schema of the object of the same name"
SHARED_CLASS_NAMES: Final = {
    "Comparison": _RESPONSE,
    "MotionTracking": _RESPONSE,
    "MotorTracking": _RESPONSE,
    "PlaybackSettings": _RESPONSE,
    "Run": _RESPONSE,
    "SpadiScore": _RESPONSE,
    "Station": _RESPONSE,
    "Teaching": _RESPONSE,
    "Tracking": _RESPONSE,
}
"""Public classes of the package kata that share a name, with the reason."""


@cache
def _trees() -> dict[str, ast.Module]:
    return {str(path.relative_to(BACKEND)): ast.parse(path.read_text()) for path in sorted(BACKEND.rglob("*.py"))}


def _definitions() -> Iterator[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef]]:
    """Yield each function and class with its file and name."""
    for path, tree in _trees().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                yield f"{path} {node.name}", node


def _lines(node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) -> int:
    assert node.end_lineno is not None
    return node.end_lineno - node.lineno + 1


def _is_command(node: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    return node.name in COMMANDS_WITHOUT_A_DECORATOR or any(
        isinstance(decorator, ast.Call)
        and isinstance(decorator.func, ast.Attribute)
        and decorator.func.attr in ("command", "callback")
        for decorator in node.decorator_list
    )


def _parameters(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return the number of parameters without self and cls."""
    named = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    return sum(argument.arg not in ("self", "cls") for argument in named)


def test_functions_have_at_most_sixty_lines() -> None:
    wrong = [
        f"{name}: {_lines(node)} lines"
        for name, node in _definitions()
        if not isinstance(node, ast.ClassDef) and _lines(node) > MAX_FUNCTION_LINES and name not in LONG_FUNCTIONS
    ]
    assert wrong == []


def test_classes_have_at_most_three_hundred_lines() -> None:
    wrong = [
        f"{name}: {_lines(node)} lines"
        for name, node in _definitions()
        if isinstance(node, ast.ClassDef) and _lines(node) > MAX_CLASS_LINES and name not in LONG_CLASSES
    ]
    assert wrong == []


def test_functions_have_at_most_six_parameters() -> None:
    wrong = [
        f"{name}: {_parameters(node)} parameters"
        for name, node in _definitions()
        if not isinstance(node, ast.ClassDef)
        and _parameters(node) > MAX_PARAMETERS
        and not _is_command(node)
        and name not in MANY_PARAMETERS
    ]
    assert wrong == []


def test_public_classes_have_unique_names() -> None:
    files: dict[str, list[str]] = defaultdict(list)
    for path, tree in _trees().items():
        # The client's structures have the names that the API gives them.
        if path == "kata/client.py":
            continue
        for node in tree.body:
            if path.startswith("kata/") and isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                files[node.name].append(path)
    wrong = {name: of for name, of in files.items() if len(of) > 1 and name not in SHARED_CLASS_NAMES}
    assert wrong == {}


def test_decision_records_have_unique_numbers() -> None:
    files = sorted((ROOT / "docs/explanation/decisions").glob("[0-9]*.md"))
    numbers = [file.name.partition("-")[0] for file in files]
    assert len(numbers) > 20
    assert [number for number in numbers if numbers.count(number) > 1] == []
