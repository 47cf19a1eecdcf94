"""The Debian package: installed, upgraded, removed and purged by dpkg in a copy of this computer's root, without systemd running.

The packages have small wheels in place of Kata's: the tests cover the package's files and scripts. `make deb` builds the real package.
"""

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.paths import ROOT
from tests.support.small_wheel import small_wheel

pytestmark = [pytest.mark.campaign, pytest.mark.timeout(600)]

PROGRAM = 'def main() -> None:\n    print("kata {version}")\n'


class CopiedRoot:
    """An overlay over this computer's root. Its commands run in it, and what they write stays in a folder of the test."""

    def __init__(self, folder: Path) -> None:
        self.upper, self._work, self._root = folder / "upper", folder / "work", folder / "root"
        for path in (self.upper, self._work, self._root):
            path.mkdir()

    def run(self, command: str, *, check: bool = True) -> subprocess.CompletedProcess[str]:
        """Run a shell command in the copy."""
        mounted = f"mount -t overlay overlay -o lowerdir=/,upperdir={self.upper},workdir={self._work} {self._root}"
        inside = f'{mounted} && exec chroot {self._root} sh -ec "$0"'
        done = subprocess.run(
            ["unshare", "--mount", "sh", "-ec", inside, command],
            capture_output=True, text=True, check=False, env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL": "C"},
        )  # fmt: skip
        assert not check or done.returncode == 0, done.stdout + done.stderr
        return done


@pytest.fixture
def root(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CopiedRoot]:
    if os.geteuid() != 0 or not all(map(shutil.which, ("dpkg-deb", "unshare", "chroot"))):
        pytest.skip("needs Debian, as root")
    # Not in the memory of pytest's temporary folders: an overlay needs extended attributes.
    folder = ROOT / ".cache" / "deb-test"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    yield CopiedRoot(folder)
    shutil.rmtree(folder)


def package(root: CopiedRoot, folder: Path, version: str, program: str = PROGRAM) -> str:
    """Build a package, put it into the root and return its path there."""
    wheels = folder / version
    wheels.mkdir()
    small_wheel(wheels, version, {"kata_release.py": program.replace("{version}", version)})
    subprocess.run([ROOT / "deploy/debian/build.sh", version, wheels, root.upper], check=True)
    (made,) = root.upper.glob(f"kata_{version}_*.deb")
    return f"/{made.name}"


def test_the_package_is_installed_upgraded_and_removed(root: CopiedRoot, tmp_path: Path) -> None:
    root.run(f"dpkg -i {package(root, tmp_path, '1.0.0')}")
    assert root.run("kata --version").stdout == "kata 1.0.0\n"
    assert root.run("readlink /opt/kata/current").stdout == "versions/1.0.0\n"
    assert root.run("stat --format '%U %a' /var/lib/kata").stdout == "kata 700\n"
    assert {"dialout", "input"} <= set(root.run("id --name --groups kata").stdout.split())
    assert root.run("systemctl is-enabled kata", check=False).stdout.strip() in ("disabled", "enabled")
    root.run("echo KATA_PORT=8001 >>/etc/kata/environment; echo record >/var/lib/kata/kata.db")

    root.run(f"dpkg -i {package(root, tmp_path, '1.0.1')}")
    assert root.run("kata --version").stdout == "kata 1.0.1\n"
    assert root.run("readlink /opt/kata/current").stdout == "versions/1.0.1\n"
    assert "KATA_PORT=8001" in root.run("cat /etc/kata/environment").stdout

    root.run("dpkg --remove kata")
    assert root.run("ls /opt").stdout.find("kata") == -1
    assert "KATA_PORT=8001" in root.run("cat /etc/kata/environment").stdout
    purged = root.run("dpkg --purge kata")
    assert "stay in /var/lib/kata" in purged.stdout
    assert root.run("cat /var/lib/kata/kata.db").stdout == "record\n"
    assert root.run("ls /etc/kata", check=False).stdout == ""


def test_an_interrupted_installation_is_repeated(root: CopiedRoot, tmp_path: Path) -> None:
    root.run(f"dpkg --unpack {package(root, tmp_path, '1.0.0')}")
    root.run("mkdir -p /opt/kata/versions/1.0.0/bin; touch /opt/kata/versions/1.0.0/bin/kata")
    root.run("dpkg --configure kata")
    assert root.run("kata --version").stdout == "kata 1.0.0\n"


def test_every_file_is_root_owned_and_as_the_rules_say(root: CopiedRoot, tmp_path: Path) -> None:
    deb = package(root, tmp_path, "1.0.0")
    listed = root.run(f"dpkg-deb --contents {deb}").stdout.splitlines()
    assert all(line.split()[1] == "root/root" for line in listed)
    files = {line.split()[5].lstrip(".") for line in listed if not line.endswith("/")}
    assert {
        "/usr/lib/systemd/system/kata.service",
        "/usr/lib/udev/rules.d/60-kata.rules",
        "/etc/kata/environment",
    } <= files
    assert root.run(f"dpkg-deb --info {deb} conffiles").stdout.split() == sorted(
        file for file in files if file.startswith("/etc/")
    )
