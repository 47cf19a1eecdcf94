"""No pin has a known vulnerability, checked without an advisory database: each is newer than the last vulnerable version."""

import json
import re
import tomllib
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from packaging.version import Version

from tests.support.paths import ROOT

_TABLE = Path(__file__).with_name("lowest_safe.toml")
_LOCKS = ("frontend", "tests/browser", "tests/fhir_validators")


def python_pins() -> dict[str, list[Version]]:
    """Return the pinned versions of the Python packages for running and development."""
    pins: dict[str, list[Version]] = {}
    for file in ("requirements.txt", "requirements-dev.txt"):
        for name, version in re.findall(
            r"^([\w.-]+)(?:\[\w+\])?==([^\s;\\]+)", (ROOT / file).read_text(), re.MULTILINE
        ):
            pins.setdefault(name.lower(), []).append(Version(version))
    return pins


def node_pins() -> dict[str, list[Version]]:
    """Return the pinned versions of the Node packages."""
    pins: dict[str, list[Version]] = {}
    for folder in _LOCKS:
        packages = json.loads((ROOT / folder / "package-lock.json").read_text())["packages"]
        for path, package in packages.items():
            if path and "version" in package:
                pins.setdefault(path.rpartition("node_modules/")[2], []).append(Version(package["version"]))
    return pins


@pytest.mark.parametrize(("kind", "pins"), [("python", python_pins), ("node", node_pins)])
def test_every_pin_is_at_least_the_lowest_safe_version(kind: str, pins: Any) -> None:
    found = pins()
    rows = tomllib.loads(_TABLE.read_text())[kind]
    assert len(rows) == len({row["name"] for row in rows})
    old = [
        (row["name"], str(version), row["lowest"])
        for row in rows
        for version in found[row["name"]]
        if version < Version(row["lowest"])
    ]
    assert old == []


def test_every_row_names_its_advisories_and_the_table_its_day() -> None:
    table = tomllib.loads(_TABLE.read_text())
    for row in (*table["python"], *table["node"]):
        assert all(re.fullmatch(r"CVE-\d{4}-\d{4,}|GHSA(-\w{4}){3}", advisory) for advisory in row["advisories"])
        assert row["advisories"]
    looked_up = re.search(r"Looked up on (\d{4}-\d\d-\d\d)", _TABLE.read_text())
    assert looked_up and date.fromisoformat(looked_up[1]) >= date(2026, 11, 22)
