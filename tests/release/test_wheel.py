"""The wheel: reproducible, and complete in an environment outside the checkout. Builds need the npm registry, so the campaign runs them."""

import os
import signal
import subprocess
import sys
import time
import urllib.request
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from kata import __version__
from tests.support.ports import free_port
from tests.support.release_builds import built, copied_checkout, set_times, unpacked

pytestmark = [pytest.mark.campaign, pytest.mark.timeout(1800)]


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return a wheel built from the checkout and one built from its sdist, in two folders, from files of two times."""
    first, second = tmp_path_factory.mktemp("first"), tmp_path_factory.mktemp("another-folder")
    checkout = copied_checkout(first / "source")
    set_times(checkout, 1.6e9)
    sdist = built(checkout, "sdist", first / "sdist")
    project = unpacked(sdist, second / "source")
    set_times(project, 1.7e9)
    return [
        built(checkout, "wheel", first / "dist", TZ="UTC"),
        built(project, "wheel", second / "dist", TZ="Asia/Tokyo", LANG="C"),
    ]


@pytest.fixture(scope="module")
def installed(wheels: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install the wheel with its extra into a new environment, and return the ``kata`` command."""
    folder = tmp_path_factory.mktemp("installed") / "venv"
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    wanted = f"{wheels[0]}[postgresql]"
    subprocess.run([folder / "bin/python", "-m", "pip", "install", "--quiet", wanted], check=True, env=_clean())
    return folder / "bin/kata"


def test_wheels_of_checkout_and_sdist_are_byte_equal(wheels: list[Path]) -> None:
    first, second = (zipfile.ZipFile(file) for file in wheels)
    differing = [member.filename for member in first.infolist() if first.read(member) != second.read(member.filename)]
    assert differing == []
    assert wheels[0].name == f"kata-{__version__}-py3-none-any.whl"
    assert wheels[0].read_bytes() == wheels[1].read_bytes()


def test_the_wheel_lists_its_components(wheels: list[Path]) -> None:
    with zipfile.ZipFile(wheels[0]) as wheel:
        names = set(wheel.namelist())
    folder = f"kata-{__version__}.dist-info/sboms"
    assert {f"{folder}/python.cdx.json", f"{folder}/page.cdx.json"} <= names


def test_an_installed_wheel_serves_page_and_manual(installed: Path, tmp_path: Path) -> None:
    with _serving(installed, tmp_path) as url:
        assert "/assets/" in _text(url + "/")
        assert "Kata" in _text(url + "/docs/")
        assert "<html" in _text(url + "/docs/manual/ja/index.html")
        assert f'"version":"{__version__}"' in _text(url + "/health/ready")


def test_an_installed_wheel_works_with_postgresql(installed: Path, services_url: str, tmp_path: Path) -> None:
    with _serving(installed, tmp_path, KATA_DATABASE_URL=services_url) as url:
        assert '"database":"postgresql"' in _text(url + "/health/ready")


@contextmanager
def _serving(command: Path, folder: Path, **environment: str) -> Iterator[str]:
    port = free_port()
    arguments = [str(command), "serve", "--simulate", "--data", str(folder / "data"), "--port", str(port)]
    process = subprocess.Popen(arguments, env=_clean() | environment, cwd=folder)
    try:
        deadline = time.monotonic() + 60
        while not _is_ready(f"http://127.0.0.1:{port}"):
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.1)
        yield f"http://127.0.0.1:{port}"
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(30)


def _is_ready(url: str) -> bool:
    try:
        return bool(_text(url + "/health/ready"))
    except OSError:
        return False


def _text(url: str) -> str:
    with urllib.request.urlopen(url, timeout=5) as answer:
        content: bytes = answer.read()
    return content.decode()


def _clean() -> dict[str, str]:
    """Return the environment without the checkout's modules."""
    return {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
