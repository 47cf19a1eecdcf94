"""Links, lengths and names of the documentation."""

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from docs.generate import PAGES
from tests.support.paths import ROOT

LONGEST = 1500
"""Words of a page. Generated pages are exempt: their tables are as long as the code makes them."""
LONGEST_README = 1000
DECISIONS = ROOT / "docs/explanation/decisions"
ARCHITECTURE = ROOT / "docs/explanation/architecture.md"
_FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


def pages() -> list[Path]:
    """Return every Markdown file of the repository."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    return [ROOT / line for line in listed.stdout.splitlines() if (ROOT / line).is_file()]


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub makes them."""
    titles = re.findall(r"^#+ (.+)$", _FENCE.sub("", page.read_text()), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title.strip()).lower().replace(" ", "-") for title in titles}


def broken_links(page: Path) -> Iterator[str]:
    for target in _LINK.findall(_FENCE.sub("", page.read_text())):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        if not file.exists() or (anchor and file.suffix == ".md" and anchor not in anchors(file)):
            yield f"{page.relative_to(ROOT)}: {target}"


def test_every_relative_link_leads_somewhere() -> None:
    assert len(pages()) > 40
    assert [link for page in pages() for link in broken_links(page)] == []


def test_no_page_is_too_long() -> None:
    exempt = {ROOT / "docs/reference" / name for name in PAGES} | {ROOT / "CHANGELOG.md"}
    lengths = {
        page.relative_to(ROOT).as_posix(): len(page.read_text().split()) for page in pages() if page not in exempt
    }
    assert {name: length for name, length in lengths.items() if length > LONGEST} == {}
    assert lengths["README.md"] <= LONGEST_README


def test_decisions_are_numbered_once_and_titled() -> None:
    records = sorted(DECISIONS.glob("0*.md"))
    numbers = [record.name[:4] for record in records]
    assert len(numbers) == len(set(numbers)) > 20
    for record in records:
        title = record.read_text().splitlines()[0]
        assert re.fullmatch(rf"# {record.name[:4]}\. .{{15,}}", title), record.name


def sources() -> list[Path]:
    return [
        file
        for folder in ("backend", "frontend/src", "tests", "docs")
        for file in (ROOT / folder).rglob("*")
        if file.suffix in (".py", ".ts", ".tsx") and "node_modules" not in file.parts
    ]


def quoted() -> set[str]:
    """Return what the architecture page quotes as code."""
    return set(re.findall(r"`([^`]+)`", _FENCE.sub("", ARCHITECTURE.read_text())))


@pytest.mark.parametrize("base", ["explanation/architecture.md", "explanation/safety.md", "explanation/device.md"])
def test_every_file_that_a_page_names_exists(base: str) -> None:
    text = _FENCE.sub("", (ROOT / "docs" / base).read_text())
    named = {name for name in re.findall(r"`([\w/.-]+)`", text) if re.search(r"\.(py|tsx?|json|toml|yml)$", name)}
    assert named
    folders = [ROOT, ROOT / "backend/kata", ROOT / "backend/kata/device", ROOT / "backend/kata/clinic/assessments"]
    assert {name for name in named if not any((folder / name).is_file() for folder in folders)} == set()


def test_every_constant_in_the_architecture_exists() -> None:
    code = "\n".join(file.read_text() for file in sources())
    names = {part for name in quoted() if re.fullmatch(r"[A-Za-z_]\w*(\.\w+)?", name) for part in name.split(".")}
    names -= {"py", "ts"}
    unknown = {name for name in names if not re.search(rf"\b{name}\b", code)}
    folders = {path.name for path in (ROOT / "backend/kata").iterdir()} | {
        path.name for path in (ROOT / "frontend/src").iterdir()
    }
    assert unknown - folders - {"kata", "migrations", "journal"} == set()
