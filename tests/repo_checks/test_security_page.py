"""The ASVS pages of docs/reference name tests that exist, and leave out no requirement of the standard."""

import ast
import re
import tomllib
from functools import cache

from tests.support.paths import ROOT

_REFERENCE = ROOT / "docs/reference"
_TABLE = "\n".join(
    line
    for name in ("asvs-input-and-browser.md", "asvs-identity.md", "asvs-operations.md")
    for line in (_REFERENCE / name).read_text().splitlines()
    if line.startswith("|") and not line.startswith(("| Requirement |", "|---"))
)
_BEHIND = (_REFERENCE / "asvs.md").read_text().split("## What does not apply")[1]
_APART, _, _OPEN = _BEHIND.partition("## Open")
_PAGE = _TABLE + _BEHIND


def rows(text: str) -> list[list[str]]:
    """Return the cells of each row of a table without its head: requirement, how, what shows it."""
    cells = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")
    ]
    return [row for row in cells if row[0] != "Requirement" and not row[0].startswith("---")]


def numbers(text: str) -> list[str]:
    """Every requirement that is named, also within ``1.2.3-1.2.5``, ``6.6`` and ``17``."""
    found: list[str] = []
    for first, last in re.findall(r"(?<![\d.])(\d+(?:\.\d+){0,2})(?:-(\d+\.\d+\.\d+))?(?![\d.]*\d)", text):
        if not last:
            found += [number for number in every() if number == first or number.startswith(f"{first}.")]
            continue
        assert first.rpartition(".")[0] == last.rpartition(".")[0], f"{first}-{last} goes over the end of a section"
        section, _, start = first.rpartition(".")
        found += [f"{section}.{n}" for n in range(int(start), int(last.rpartition(".")[2]) + 1)]
    return found


def every() -> list[str]:
    """The standard's requirements of levels 1 and 2."""
    sections: dict[str, int] = tomllib.loads((ROOT / "tests/repo_checks/asvs_5_0_0.toml").read_text())["sections"]
    return [f"{section}.{n}" for section, count in sections.items() for n in range(1, count + 1)]


@cache
def names_in(file: str) -> set[str]:
    tree = ast.parse((ROOT / file).read_text())
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)}


def test_every_named_test_exists() -> None:
    missing = []
    for file, name in re.findall(r"`(tests/[\w/]+\.py)(?:::(\w+))?`", _PAGE):
        if not (ROOT / file).is_file() or (name and name not in names_in(file)):
            missing.append(f"{file}::{name}")
    assert missing == []


def test_every_requirement_cites_a_test_a_check_or_a_section() -> None:
    assert len(rows(_TABLE)) > 60
    for requirement, _how, shown in rows(_TABLE):
        assert re.match(r"\d+\.\d+", requirement)
        assert re.search(r"`tests/|`make check`|\]\(\.\./explanation/", shown), requirement


def test_every_requirement_of_levels_1_and_2_appears_once() -> None:
    assert len(every()) == 253
    met = [number for requirement, *_ in rows(_TABLE) for number in numbers(requirement)]
    apart = [number for requirement, _why in rows(_APART) for number in numbers(requirement)]
    opened = [number for requirement, *_ in rows(_OPEN) for number in numbers(requirement)]
    assert sorted(met + apart + opened) == sorted(every())


def test_nothing_is_open() -> None:
    assert rows(_OPEN) == []
