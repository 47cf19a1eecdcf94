"""Links, lengths and names of the documentation."""

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from docs.generate import PAGES
from tests.support.paths import ROOT, files

LONGEST = 1500
"""Words of a page. Generated pages are exempt: their tables are as long as the code makes them."""
LONGEST_README = 1000
DECISIONS = ROOT / "docs/explanation/decisions"
MAPS = sorted((ROOT / "docs/explanation").glob("where-to-change*.md"))
ARCHITECTURE = [ROOT / "docs/explanation/architecture.md", *MAPS]
BACKEND = ROOT / "backend/kata"
DIRECTLY_IN_KATA = {"actor.py", "i18n.py", "settings.py"}
OF_EACH_PACKAGE = (" the `router.py` of its package", " its `tables.py`", " `texts.py` of its package")
FRONTEND_FOLDERS = {"app", "features", "lib", "locales", "safety", "ui"}
REPOSITORY_FOLDERS = {"backend", "docs", "frontend", "migrations", "tests"}
_FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


def pages() -> list[Path]:
    """Return every Markdown file of the repository."""
    return files("*.md")


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


def test_help_of_the_page_leads_to_sections_of_each_manual() -> None:
    source = (ROOT / "frontend/src/ui/HelpLink.tsx").read_text()
    labels, chapters = set(re.findall(r'"#(help-[\w-]+)"', source)), re.findall(r'"(\w+)\.html"', source)
    guides = re.findall(r'"/docs/([\w/-]+)\.html"', source)
    assert labels and chapters and guides
    for manual in (ROOT / f"docs/manual/{language}" for language in ("en", "ja")):
        text = (manual / "index.md").read_text()
        assert set(re.findall(r"^\(([\w-]+)\)=\n## ", text, re.MULTILINE)) == labels
        assert [name for name in chapters if not (manual / f"{name}.md").exists()] == []
    assert [guide for guide in guides if not (ROOT / f"docs/{guide}.md").exists()] == []


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


@pytest.fixture(scope="module")
def members() -> dict[str, set[str]]:
    """Return the names that each Python class or module defines, by the class's name or the module's path."""
    found: dict[str, set[str]] = {}
    for file in files("*.py"):
        nodes = list(ast.walk(ast.parse(file.read_text())))
        found.setdefault(str(file), set()).update(_defined(nodes))
        for node in nodes:
            if isinstance(node, ast.ClassDef):
                found.setdefault(node.name, set()).update(_defined(ast.walk(node)))
    return found


def _defined(nodes: Iterable[ast.AST]) -> Iterator[str]:
    for node in nodes:
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                yield name
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                yield name


def quoted(page: Path) -> set[str]:
    """Return what a page quotes as code."""
    return set(re.findall(r"`([^`]+)`", _FENCE.sub("", page.read_text())))


FHIR = {"Condition.verificationStatus", "Procedure.status"}
EXPLANATIONS = sorted((ROOT / "docs/explanation").rglob("*.md"))


def test_every_file_that_a_page_names_exists() -> None:
    paths = [f"/{file.relative_to(ROOT).as_posix()}" for file in files()]
    for page in EXPLANATIONS:
        named = {name for name in quoted(page) if re.fullmatch(r"[\w/.-]+\.(py|tsx?|mjs|json|toml|yml)", name)}
        missing = {name for name in named if not any(path.endswith(f"/{name}") for path in paths)}
        assert missing == set(), page.name


def _places(cell: str) -> Iterator[tuple[str, Path]]:
    """Yield each file that a cell of a map names, and its path by the rule at the top of the maps."""
    folder = BACKEND
    for name in re.findall(r"`([\w./*-]+)`", cell):
        first = name.partition("/")[0]
        root = ROOT / "frontend/src" if first in FRONTEND_FOLDERS else ROOT if first in REPOSITORY_FOLDERS else BACKEND
        if "/" in name or (root / name).is_dir():
            found = next(root.glob(name), root / name)
            folder = found if found.is_dir() else found.parent
            yield name, found
        elif re.fullmatch(r"[\w.-]+\.(py|tsx?|json|html|toml)", name):
            yield name, (BACKEND if name in DIRECTLY_IN_KATA else folder) / name


def test_every_file_of_a_map_is_where_the_maps_say() -> None:
    rule = (ROOT / "docs/explanation/where-to-change.md").read_text()
    assert all(f"`{name}/`" in rule for name in FRONTEND_FOLDERS | REPOSITORY_FOLDERS)
    cells = [cell for page in MAPS for cell in page.read_text().split("|") if not cell.startswith(OF_EACH_PACKAGE)]
    places = [place for cell in cells for place in _places(cell)]
    assert len(places) > 100
    assert {name for name, path in places if not path.exists()} == set()


def test_every_member_that_a_page_names_exists(members: dict[str, set[str]]) -> None:
    for page in EXPLANATIONS:
        named = {name for name in quoted(page) - FHIR if re.fullmatch(r"[A-Z]\w+\.[a-z_]\w*", name)}
        named = {name for name in named if not name.endswith(".md")}
        missing = {name for name in named if name.split(".")[1] not in members.get(name.split(".")[0], ())}
        assert missing == set(), page.name


def test_every_name_in_the_architecture_is_defined(members: dict[str, set[str]]) -> None:
    named = {name for page in ARCHITECTURE for name in quoted(page) if re.fullmatch(r"_?[A-Z]\w+", name)}
    assert len(named) > 10
    defined = {name for names in members.values() for name in names}
    for file in files("*.ts", "*.tsx"):
        defined |= set(re.findall(r"^(?:export )?(?:function|const|type) (\w+)", file.read_text(), re.MULTILINE))
    assert named - defined == set()
