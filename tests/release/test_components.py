"""The CycloneDX lists of components: complete, valid, and equal in each build."""

import json
from pathlib import Path
from typing import Any

import pytest

from hatch_build import list_page_packages, list_python_packages
from tests.support.paths import ROOT
from tests.support.pins import pins

pytestmark = pytest.mark.campaign


@pytest.fixture(scope="module")
def lists(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return both lists by their name."""
    folder = tmp_path_factory.mktemp("lists")
    list_python_packages(ROOT, folder / "python.cdx.json")
    list_page_packages(ROOT, folder / "page.cdx.json")
    return {file.name.partition(".")[0]: file for file in folder.iterdir()}


def components(file: Path) -> dict[str, str]:
    """Return the version of each component by its name, with its npm scope."""
    listed: list[dict[str, Any]] = json.loads(file.read_text())["components"]
    return {
        "/".join(filter(None, (component.get("group"), component["name"]))): component["version"]
        for component in listed
    }


def test_the_list_of_python_names_every_pin(lists: dict[str, Path]) -> None:
    pinned = {name: block.split("==")[1].split()[0] for name, block in pins("requirements.txt").items()}
    assert components(lists["python"]) == pinned


def test_the_list_of_the_page_names_every_locked_package(lists: dict[str, Path]) -> None:
    packages = json.loads((ROOT / "frontend/package-lock.json").read_text())["packages"]
    locked = {
        (path.rpartition("node_modules/")[2], package["version"])
        for path, package in packages.items()
        if path and not package.get("dev")
    }
    assert len(locked) > 20
    assert set(components(lists["page"]).items()) == locked


@pytest.mark.parametrize(("name", "version"), [("python", "V1_6"), ("page", "V1_5")])
def test_the_lists_are_valid_and_name_no_build(lists: dict[str, Path], name: str, version: str) -> None:
    # The import takes seconds, also of the workers that do not run this test.
    from cyclonedx.schema import SchemaVersion
    from cyclonedx.validation.json import JsonStrictValidator

    schema = SchemaVersion[version]
    text = lists[name].read_text()
    assert JsonStrictValidator(schema).validate_str(text) is None
    assert str(ROOT) not in text
    assert "timestamp" not in text
    assert "serialNumber" not in text
