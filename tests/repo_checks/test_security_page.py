"""docs/explanation/security.md names existing tests and sections, and covers every requirement of the standard."""

import ast
import re
import tomllib

from tests.support.paths import ROOT

_PAGE = (ROOT / "docs/explanation/security.md").read_text()
_TABLE, _, _BEHIND = _PAGE.split("## OWASP ASVS 5.0.0, level 2")[1].partition("### What does not apply")
_APART, _, _OPEN = _BEHIND.partition("### Open")


def rows(text: str) -> list[list[str]]:
    """A table row: requirement, implementation, evidence."""
    cells = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")
    ]
    return cells[2:]


def numbers(text: str) -> list[str]:
    """Yield every named requirement, also within ``1.2.3-1.2.5``, ``6.6`` and ``17``."""
    found: list[str] = []
    for first, last in re.findall(r"(?<![\d.])(\d+(?:\.\d+){0,2})(?:-(\d+\.\d+\.\d+))?(?![\d.]*\d)", text):
        if not last:
            found += [one for one in every() if one == first or one.startswith(f"{first}.")]
            continue
        assert first.rpartition(".")[0] == last.rpartition(".")[0], f"{first}-{last} goes over the end of a section"
        section, _, start = first.rpartition(".")
        found += [f"{section}.{n}" for n in range(int(start), int(last.rpartition(".")[2]) + 1)]
    return found


def every() -> list[str]:
    """Return the standard's requirements of levels 1 and 2."""
    sections: dict[str, int] = tomllib.loads((ROOT / "tests/repo_checks/asvs_5_0_0.toml").read_text())["sections"]
    return [f"{section}.{n}" for section, count in sections.items() for n in range(1, count + 1)]


def names_in(file: str) -> set[str]:
    tree = ast.parse((ROOT / file).read_text())
    return {one.name for one in ast.walk(tree) if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef)}


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
        assert re.search(r"`tests/|`make check`|\]\(#", shown), requirement


def test_every_referenced_section_exists() -> None:
    there = {
        re.sub(r"[^\w -]", "", title).lower().replace(" ", "-")
        for title in re.findall(r"^##+ (.+)$", _PAGE, re.MULTILINE)
    }
    there |= set(re.findall(r'<a id="(\w+)">', _PAGE))
    assert set(re.findall(r"\]\(#([\w-]+)\)", _PAGE)) <= there


def test_every_requirement_of_levels_1_and_2_appears_once() -> None:
    assert len(every()) == 253
    met = [number for requirement, *_ in rows(_TABLE) for number in numbers(requirement)]
    apart = [number for requirement, _why in rows(_APART) for number in numbers(requirement)]
    opened = [number for requirement, *_ in rows(_OPEN) for number in numbers(requirement)]
    assert sorted(met + apart + opened) == sorted(every())


def test_nothing_is_open() -> None:
    assert rows(_OPEN) == []
