"""Pins, licences and versions of the repository."""

import json
import re
import subprocess
from email import message_from_string
from importlib.metadata import Distribution, distribution, distributions
from pathlib import Path
from typing import Any

import plotly
import pytest
from packaging.utils import canonicalize_name

from tests.support.paths import ROOT
from tests.support.pins import pins

# Licences compatible with Apache-2.0 for unchanged packages. LGPL: psycopg, which is never part of our wheel.
FITTING = re.compile(
    r"MIT|BSD|Apache|ISC|PSF|Python-2\.0|Python Software Foundation|0BSD|Unlicense|MPL-2\.0|Mozilla|HPND|CC0|CC-BY-4\.0|BlueOak|Zlib|OFL",
    re.IGNORECASE,
)
UNFITTING = re.compile(r"(?<!L)GPL|AGPL|SSPL|Commons Clause|Proprietary", re.IGNORECASE)
LGPL = {"psycopg", "psycopg-binary"}


def test_environment_holds_only_what_is_pinned() -> None:
    """In an old environment, a leftover package can hide that its pin is missing."""
    pinned = {canonicalize_name(name) for name in pins("requirements-dev.txt")}
    installed = {canonicalize_name(dist.metadata["Name"]) for dist in distributions()}
    assert installed - pinned <= {"kata", "pip", "setuptools"}


@pytest.mark.parametrize("name", ["requirements.txt", "requirements-dev.txt"])
def test_every_pin_has_hashes_and_no_address(name: str) -> None:
    text = (ROOT / name).read_text()
    assert "://" not in text
    assert not re.search(r"^\s*--(?!hash)", text, re.MULTILINE)
    found = pins(name)
    assert len(found) > 20
    assert all("--hash=sha256:" in block for block in found.values())


@pytest.mark.parametrize(
    "name", [f"{folder}/package-lock.json" for folder in ("frontend", "tests/browser", "tests/fhir_validators")]
)
def test_the_locked_packages_have_hashes_and_no_address(name: str) -> None:
    packages = json.loads((ROOT / name).read_text())["packages"]
    for path, package in packages.items():
        # A bundled package is covered by the hash of the package that contains it.
        if path and not package.get("inBundle"):
            assert "resolved" not in package, path
            assert package["integrity"].startswith("sha512-"), path


def test_the_page_writes_texts_never_markup() -> None:
    """No text is executed: React puts strings into text nodes, and the source does not bypass that."""
    dangerous = re.compile(
        r"dangerouslySetInnerHTML|\b(?:inner|outer)HTML\b|insertAdjacentHTML|document\.write|createContextualFragment"
        r"|\bsrcdoc\b|\beval\(|new Function\(|javascript:|\b(?:window|parent|opener|top|source)\.postMessage\("
    )
    pages = [*(ROOT / "frontend/src").rglob("*.ts*"), *(ROOT / "frontend/public").rglob("*.js")]
    assert len(pages) > 100
    found = [path.name for path in pages if not path.name.endswith(".d.ts") and dangerous.search(path.read_text())]
    assert found == []


def _licence(dist: Distribution) -> str:
    metadata = message_from_string(dist.read_text("METADATA") or "")
    classifiers = [
        line.rpartition("::")[2] for line in metadata.get_all("Classifier", []) if line.startswith("License")
    ]
    first_line = metadata.get("License", "").strip().partition("\n")[0]
    return " ".join([metadata.get("License-Expression", ""), first_line, *classifiers]).strip() or _of_its_file(dist)


def _of_its_file(dist: Distribution) -> str:
    """Return the title of the licence file of a package whose metadata names no licence."""
    files = [file for file in dist.files or [] if file.name.startswith("LICENSE")]
    return files[0].read_text().strip().partition("\n")[0] if files else ""


@pytest.mark.parametrize("folder", ["frontend", "tests/browser", "tests/fhir_validators"])
def test_every_package_of_node_is_pinned_exactly(folder: str) -> None:
    package = json.loads((ROOT / folder / "package.json").read_text())
    for name, version in (package.get("dependencies", {}) | package.get("devDependencies", {})).items():
        assert re.fullmatch(r"\d+\.\d+\.\d+", version), name


@pytest.mark.parametrize("name", sorted(pins("requirements.txt")))
def test_licences_of_python_packages_are_compatible(name: str) -> None:
    block = pins("requirements.txt")[name]
    try:
        dist = distribution(name)
    except ModuleNotFoundError:
        assert "sys_platform" in block or "platform" in block or "python_full_version" in block, name
        return
    licence = _licence(dist)
    if name in LGPL:
        assert "LGPL" in licence
        return
    assert FITTING.search(licence), licence
    assert not UNFITTING.search(licence), licence


def test_licences_of_page_packages_are_compatible() -> None:
    packages: dict[str, Any] = json.loads((ROOT / "frontend/package-lock.json").read_text())["packages"]
    shipped = {path: package for path, package in packages.items() if path and not package.get("dev")}
    assert len(shipped) > 20
    for path, package in shipped.items():
        assert FITTING.search(package["license"]), (path, package["license"])
        assert not UNFITTING.search(package["license"]), path


def test_page_and_figures_use_the_same_plotly_version() -> None:
    bundled = Path(plotly.__file__).parent / "package_data/plotly.min.js"
    with bundled.open(encoding="utf-8") as script:
        match = re.search(r"plotly\.js v(\d+\.\d+\.\d+)", script.read(300))
    assert match
    package = json.loads((ROOT / "frontend/package.json").read_text())
    assert package["dependencies"]["plotly.js-basic-dist-min"] == match.group(1)


def test_no_symbolic_link_is_tracked() -> None:
    """A committed link once pointed to a folder of a developer's computer."""
    listed = subprocess.run(["git", "ls-files", "--stage"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    assert [line for line in listed.stdout.splitlines() if line.startswith("120000")] == []
