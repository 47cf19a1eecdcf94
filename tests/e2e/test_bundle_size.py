"""The size of the scripts that the first page loads before it draws, and the styles that it needs."""

import gzip
import json
import re
from typing import Any

from fastapi import FastAPI
from fastapi.testclient import TestClient

from kata.api import static_files
from tests.support.paths import ROOT

DIST = ROOT / "frontend/dist"
LIMIT_KB = 250
MANTINE = ROOT / "frontend/node_modules/@mantine/core/styles.css"
MANTINE_CLASS = re.compile(r"\bm_[0-9a-f]{6,8}\b")
"""A class name of Mantine's style sheet, which its scripts name too."""


def test_first_page_loads_at_most_a_quarter_megabyte_of_script() -> None:
    manifest: dict[str, Any] = json.loads((DIST / ".vite/manifest.json").read_text())
    loaded: set[str] = set()

    def load(name: str) -> None:
        if name not in loaded:
            loaded.add(name)
            for other in manifest[name].get("imports", []):
                load(other)

    page = (DIST / "index.html").read_text()
    started = set(re.findall(r'<script type="module"[^>]* src="/([^"]+)"', page))
    names = {chunk["file"]: name for name, chunk in manifest.items()}
    assert started
    for file in started:
        load(names[file])
    # The page loads one catalogue dynamically, before it draws anything.
    catalogues = ["src/locales/en/index.ts", "src/locales/ja/index.ts"]
    for catalogue in catalogues:
        assert set(manifest[catalogue].get("imports", [])) <= loaded, catalogue
    load(catalogues[0])
    app = FastAPI()
    static_files.install(app, DIST)
    with TestClient(app, headers={"accept-encoding": "gzip, deflate, br, zstd"}) as client:
        sizes = {name: sent_kb(client, manifest[name]["file"]) for name in loaded}
    assert sum(sizes.values()) <= LIMIT_KB, sizes


def sent_kb(client: TestClient, file: str) -> float:
    """Return the kilobytes (1000 bytes) that go over the wire."""
    with client.stream("GET", f"/{file}") as answer:
        assert answer.status_code == 200
        return sum(map(len, answer.iter_raw())) / 1000


def test_every_script_and_style_is_compressed_unchanged() -> None:
    files = [file for file in (DIST / "assets").iterdir() if file.suffix in (".js", ".css")]
    assert len(files) > 50
    for file in files:
        compressed = file.with_name(f"{file.name}.gz")
        # Compressing a small file saves nothing.
        assert compressed.is_file() or file.stat().st_size < 1000, file.name
        if compressed.is_file():
            assert gzip.decompress(compressed.read_bytes()) == file.read_bytes()


def test_styles_have_each_mantine_component_of_the_scripts() -> None:
    """The page imports Mantine's styles component by component (``src/app/mantine.css``)."""
    files = [file for file in (DIST / "assets").iterdir() if file.suffix in (".js", ".css")]
    used, styled = (
        {name for file in files if file.suffix == suffix for name in MANTINE_CLASS.findall(file.read_text())}
        for suffix in (".js", ".css")
    )
    needed = used & set(MANTINE_CLASS.findall(MANTINE.read_text()))
    assert len(needed) > 100
    assert needed <= styled


def test_preloads_name_all_files_of_the_addressed_page() -> None:
    """One script starts all files of a page at once (``frontend/preloads.ts``)."""
    manifest: dict[str, Any] = json.loads((DIST / ".vite/manifest.json").read_text())
    page = (DIST / "index.html").read_text()
    script = re.search(r'<script async src="/(assets/preload-[^"]+)"', page)
    assert script
    written = (DIST / script.group(1)).read_text()
    preloads = json.loads(written.removeprefix("{\nconst preloads = ").partition(";\n")[0])
    first = set(re.findall(r'(?:src|href)="/(assets/[^"]+)"', page))

    def needed(name: str, found: set[str]) -> set[str]:
        chunk = manifest[name]
        if chunk["file"] not in found:
            found |= {chunk["file"], *chunk.get("css", [])}
            for other in chunk.get("imports", []):
                needed(other, found)
        return found

    def named(path: str, language: str) -> set[str]:
        pages = [files for pattern, files in preloads["pages"] if re.search(pattern, path)]
        assert len(pages) == 1, path
        return {preloads["files"][index] for index in (*preloads["first"][language], *pages[0][language])}

    features = {
        "/": "home/HomePage",
        "/station": "station/StationPage",
        "/patients": "patients/PatientsPage",
        "/patients/1": "patients/PatientPage",
        "/sessions/1": "sessions/SessionPage",
    }
    for path, feature in features.items():
        for language, other in (("en", "ja"), ("ja", "en")):
            files = named(path, language)
            assert needed(f"src/features/{feature}.tsx", set()) - first <= files, path
            assert manifest[f"src/locales/{language}/index.ts"]["file"] in files
            assert manifest[f"src/locales/{other}/index.ts"]["file"] not in files


def test_browsers_compile_plotly_while_they_load_it() -> None:
    """Functions in parentheses are compiled then, all others at their first call (``frontend/plotlyModule.ts``)."""
    manifest: dict[str, Any] = json.loads((DIST / ".vite/manifest.json").read_text())
    (built,) = (chunk["file"] for name, chunk in manifest.items() if name.endswith("plotly-basic.min.js"))
    source = (DIST / built).read_text()
    assert re.match(r"var (\w+)=\(\(\)=>\{", source)
    parts = re.findall(r"\w+=\w+\((\(?)(?:\(\w+(?:,\w+)?\)|\w+)=>\{", source)
    assert parts.count("(") > 300, parts
