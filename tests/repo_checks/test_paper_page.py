"""The page that leads from the paper to the code leaves out nothing and names what exists."""

import ast
import re
from functools import cache

import pytest

from docs.paper import PLACES
from tests.support.paths import ROOT

SECTIONS = ["1", "2.1", "2.2", "3.1", "3.1.1", "3.1.2", "3.2", *(f"4.{n}" for n in range(1, 9)), "4", "5"]
NAMED = sorted({name for place in PLACES for name in (*place.code, *place.tests)})


def parts(kind: str) -> list[str]:
    """Return every number of a kind that the page names, with ranges written out."""
    found: list[str] = []
    for place in PLACES:
        for part in place.parts.split("; "):
            named, _, numbers = part.partition(" ")
            if named.rstrip("s") != kind:
                continue
            for number in numbers.split(", "):
                first, _, last = number.partition("-")
                head, digits = re.fullmatch(r"(.*?)(\d+)", first).groups()  # type: ignore[union-attr]
                until = int(last.removeprefix(head) or digits) if last else int(digits)
                found += [f"{head}{n}" for n in range(int(digits), until + 1)]
    return found


@cache
def names_in(path: str) -> set[str]:
    """Return the functions, classes, methods (``Class.method``) and constants of a module."""
    found: set[str] = set()
    for node in ast.parse((ROOT / path).read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        if isinstance(node, ast.ClassDef):
            found |= {f"{node.name}.{member.name}" for member in node.body if isinstance(member, ast.FunctionDef)}
        targets = (
            node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        )
        found |= {target.id for target in targets if isinstance(target, ast.Name)}
    return found


def test_every_part_of_the_paper_appears_once() -> None:
    assert sorted(parts("Section")) == sorted(SECTIONS)
    assert sorted(parts("Equation"), key=int) == [str(n) for n in range(1, 21)]
    assert sorted(parts("Figure")) == sorted([*(str(n) for n in range(1, 19)), *(f"A{n}" for n in range(1, 15))])
    assert sorted(parts("Table")) == ["1", "2"]


@pytest.mark.parametrize("name", NAMED)
def test_named_code_and_tests_exist(name: str) -> None:
    path, _, symbol = name.partition("::")
    assert symbol in names_in(path)


def test_what_is_built_is_tested() -> None:
    for place in PLACES:
        if place.status == "built":
            assert place.code, place.parts
            assert place.tests, place.parts
            assert all(name.startswith("tests/") for name in place.tests)
