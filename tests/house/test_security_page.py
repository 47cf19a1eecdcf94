"""docs/security.md names tests that exist, and sections that stand on it."""

import ast
import re

from tests.conftest import ROOT

_PAGE = (ROOT / "docs/security.md").read_text()


def rows() -> list[list[str]]:
    """Of the table of requirements that are met: requirement, how, what shows it."""
    table = _PAGE.split("## OWASP ASVS 5.0, level 2")[1].split("### Open")[0]
    cells = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if line.startswith("|")
    ]
    return cells[2:]


def names_in(file: str) -> set[str]:
    tree = ast.parse((ROOT / file).read_text())
    return {one.name for one in ast.walk(tree) if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef)}


def test_every_test_that_it_names_exists() -> None:
    missing = []
    for file, name in re.findall(r"`(tests/[\w/]+\.py)(?:::(\w+))?`", _PAGE):
        if not (ROOT / file).is_file() or (name and name not in names_in(file)):
            missing.append(f"{file}::{name}")
    assert missing == []


def test_every_requirement_is_shown_by_a_test_a_check_or_a_section() -> None:
    assert len(rows()) > 60
    for requirement, _how, shown in rows():
        assert re.match(r"\d+\.\d+", requirement)
        assert re.search(r"`tests/|`make check`|\]\(#", shown), requirement


def test_every_section_that_it_refers_to_is_there() -> None:
    there = {
        re.sub(r"[^\w -]", "", title).lower().replace(" ", "-")
        for title in re.findall(r"^##+ (.+)$", _PAGE, re.MULTILINE)
    }
    there |= set(re.findall(r'<a id="(\w+)">', _PAGE))
    assert set(re.findall(r"\]\(#([\w-]+)\)", _PAGE)) <= there


def test_no_requirement_is_both_met_and_open() -> None:
    opened = _PAGE.split("### Open")[1]
    numbers = re.compile(r"\b\d+\.\d+\.\d+\b")
    met = {number for requirement, *_ in rows() for number in numbers.findall(requirement)}
    assert met.isdisjoint(numbers.findall(opened))
