"""Rules for the tests themselves: where helpers live and how tests are named."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.paths import ROOT

MOST_WORDS = 10


@pytest.fixture(scope="module")
def trees() -> dict[Path, ast.Module]:
    """Return the syntax tree of each module of the tests."""
    return {path.relative_to(ROOT): ast.parse(path.read_text()) for path in sorted((ROOT / "tests").rglob("*.py"))}


def _imports(tree: ast.Module) -> Iterator[str]:
    """Yield each imported module and each imported name with its module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")
            yield from (f"{node.module}.{name.name}" for name in node.names)


def _is_test_module(module: str) -> bool:
    first, _, rest = module.partition(".")
    return first in ("conftest", "") or (
        first == "tests" and any(part.startswith("test_") or part == "conftest" for part in rest.split("."))
    )


@pytest.mark.parametrize(
    ("module", "refused"),
    [
        ("tests.device.test_load", True),
        ("tests.device.conftest", True),
        (".test_load", True),
        ("tests.support.stepped", False),
        ("kata.device.state_machine", False),
    ],
)
def test_imported_test_modules_are_recognized(module: str, refused: bool) -> None:
    assert _is_test_module(module) is refused


def test_no_module_imports_a_test_module(trees: dict[Path, ast.Module]) -> None:
    wrong = [
        f"{path}: {module}" for path, tree in trees.items() for module in _imports(tree) if _is_test_module(module)
    ]
    assert wrong == [], "Shared helpers belong in tests/support."


def test_test_names_have_at_most_ten_words(trees: dict[Path, ast.Module]) -> None:
    wrong = [
        f"{path}: {node.name}"
        for path, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and node.name.startswith("test_")
        and len(node.name.split("_")) - 1 > MOST_WORDS
    ]
    assert wrong == []
