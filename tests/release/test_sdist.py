"""The sdist: reproducible, and complete."""

import tarfile
from pathlib import Path

import pytest

from kata import __version__
from tests.support.release_builds import built, copied_checkout, set_times


@pytest.fixture(scope="module")
def sdists(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return two sdists, built in two folders from files of two times."""
    files = []
    for name, at, zone in (("first", 1.6e9, "UTC"), ("another-folder", 1.7e9, "Asia/Tokyo")):
        folder = tmp_path_factory.mktemp(name)
        project = copied_checkout(folder / "source")
        set_times(project, at)
        files.append(built(project, "sdist", folder / "dist", TZ=zone))
    return files


def test_two_builds_of_the_sdist_are_byte_equal(sdists: list[Path]) -> None:
    assert sdists[0].name == sdists[1].name == f"kata-{__version__}.tar.gz"
    assert sdists[0].read_bytes() == sdists[1].read_bytes()


def test_the_sdist_has_what_a_wheel_is_built_from(sdists: list[Path]) -> None:
    with tarfile.open(sdists[0]) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {"frontend/package-lock.json", "requirements.txt", "hatch_build.py", "docs/conf.py", "LICENSE"} <= names
    assert any(name.startswith("migrations/versions/") for name in names)
    assert not any("node_modules" in name or name.startswith(("frontend/dist", "docs/_build")) for name in names)
