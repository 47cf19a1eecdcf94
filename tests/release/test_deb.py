"""The Debian package: installed, upgraded, removed and purged by dpkg in a copy of this computer's root, without systemd running.

The packages have small wheels in place of Kata's: the tests cover the package's files and scripts. `make deb` builds the real package.
"""

import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.paths import ROOT
from tests.support.small_wheel import small_wheel

pytestmark = pytest.mark.timeout(600)

DEBIAN = ROOT / "deploy/debian"
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
    subprocess.run([DEBIAN / "build.sh", version, wheels, root.upper], check=True)
    (made,) = root.upper.glob(f"kata_{version}_*.deb")
    return f"/{made.name}"


def test_package_depends_on_what_its_scripts_run() -> None:
    scripts = "".join((DEBIAN / name).read_text() for name in ("postinst", "postrm", "prerm"))
    depends = re.search("^Depends: (.*)$", (DEBIAN / "control").read_text(), re.MULTILINE)
    assert depends
    # Not in a minimal Debian.
    packages = {"adduser ": "adduser", "-m venv": "python3-venv", "deb-systemd-helper ": "init-system-helpers", "systemctl ": "systemd"}  # fmt: skip
    used = {package for command, package in packages.items() if command in scripts}
    assert used == set(packages.values())
    assert used <= {entry.split()[0] for entry in depends[1].split(", ")}


def test_two_builds_of_the_package_are_byte_equal(tmp_path: Path) -> None:
    if not shutil.which("dpkg-deb"):
        pytest.skip("needs Debian")
    small_wheel(tmp_path, "1.0.0", {"kata_release.py": PROGRAM})
    made = []
    for name, at in (("first", 1.6e9), ("second", 1.7e9)):
        os.utime(next(tmp_path.glob("*.whl")), (at, at))
        command: list[str | Path] = [DEBIAN / "build.sh", "1.0.0", tmp_path, tmp_path / name]
        subprocess.run(command, check=True, env=os.environ | {"SOURCE_DATE_EPOCH": "1500000000"})
        made.append(next((tmp_path / name).iterdir()).read_bytes())
    assert made[0] == made[1]


@pytest.mark.campaign
def test_the_package_is_installed_upgraded_and_removed(root: CopiedRoot, tmp_path: Path) -> None:
    root.run(f"dpkg -i {package(root, tmp_path, '1.0.0')}")
    assert root.run("kata --version").stdout == "kata 1.0.0\n"
    assert root.run("readlink /opt/kata/current").stdout == "versions/1.0.0\n"
    assert root.run("stat --format '%U %a' /var/lib/kata").stdout == "kata 700\n"
    assert {"dialout", "input"} <= set(root.run("id --name --groups kata").stdout.split())
    assert root.run("systemctl is-enabled kata").stdout == "enabled\n"
    root.run("echo KATA_PORT=8001 >>/etc/kata/environment; echo record >/var/lib/kata/kata.db")

    root.run(f"dpkg -i {package(root, tmp_path, '1.0.1')}")
    assert root.run("kata --version").stdout == "kata 1.0.1\n"
    assert root.run("readlink /opt/kata/current").stdout == "versions/1.0.1\n"
    assert "KATA_PORT=8001" in root.run("cat /etc/kata/environment").stdout

    root.run("dpkg --remove kata")
    assert root.run("ls /opt").stdout.find("kata") == -1
    assert "KATA_PORT=8001" in root.run("cat /etc/kata/environment").stdout
    assert root.run("ls /usr/bin/kata", check=False).stdout == ""
    purged = root.run("dpkg --purge kata")
    assert root.run("find /etc/systemd -name 'kata*'").stdout == ""
    assert "stay in /var/lib/kata" in purged.stdout
    assert root.run("cat /var/lib/kata/kata.db").stdout == "record\n"
    assert root.run("ls /etc/kata", check=False).stdout == ""


@pytest.mark.campaign
def test_an_upgrade_leaves_a_disabled_service_disabled(root: CopiedRoot, tmp_path: Path) -> None:
    root.run(f"dpkg -i {package(root, tmp_path, '1.0.0')}")
    root.run("systemctl disable kata")
    root.run(f"dpkg -i {package(root, tmp_path, '1.0.1')}")
    assert root.run("systemctl is-enabled kata", check=False).stdout == "disabled\n"


@pytest.mark.campaign
def test_an_upgrade_moves_the_station_to_the_services_folder(root: CopiedRoot, tmp_path: Path) -> None:
    root.run(f"dpkg -i {package(root, tmp_path, '1.0.0')}")
    root.run("echo one >/etc/kata/station.toml; echo two >/etc/kata/station.commissioning.json")
    root.run("echo three >/etc/kata/station.commissioning-key.pem")
    root.run(f"dpkg -i {package(root, tmp_path, '1.0.1')}")
    root.run("echo changed >/etc/kata/station.toml")
    root.run(f"dpkg -i {package(root, tmp_path, '1.0.2')}")
    for name, content in (
        ("station.toml", "one"),
        ("station.commissioning.json", "two"),
        ("station.commissioning-key.pem", "three"),
    ):
        assert root.run(f"cat /var/lib/kata/{name}").stdout == f"{content}\n"
        assert root.run(f"stat --format '%U %a' /var/lib/kata/{name}").stdout == "kata 600\n"


@pytest.mark.campaign
def test_upgrades_keep_two_versions_and_never_go_back(root: CopiedRoot, tmp_path: Path) -> None:
    first = package(root, tmp_path, "1.0.0")
    root.run(f"dpkg -i {first}")
    for version in ("1.0.1", "1.0.2"):
        root.run(f"dpkg -i {package(root, tmp_path, version)}")
    assert root.run("ls /opt/kata/versions").stdout.split() == ["1.0.1", "1.0.2"]
    refused = root.run(f"dpkg -i {first}", check=False)
    assert refused.returncode != 0
    assert "Version 1.0.2 of Kata is in use." in refused.stderr
    assert root.run("kata --version").stdout == "kata 1.0.2\n"


@pytest.mark.campaign
def test_an_interrupted_installation_is_repeated(root: CopiedRoot, tmp_path: Path) -> None:
    root.run(f"dpkg --unpack {package(root, tmp_path, '1.0.0')}")
    root.run("mkdir -p /opt/kata/versions/1.0.0/bin; touch /opt/kata/versions/1.0.0/bin/kata")
    root.run("dpkg --configure kata")
    assert root.run("kata --version").stdout == "kata 1.0.0\n"


@pytest.mark.campaign
def test_every_file_is_root_owned_and_as_the_rules_say(root: CopiedRoot, tmp_path: Path) -> None:
    deb = package(root, tmp_path, "1.0.0")
    listed = root.run(f"dpkg-deb --contents {deb}").stdout.splitlines()
    assert all(line.split()[1] == "root/root" for line in listed)
    files = {line.split()[5].lstrip(".") for line in listed if not line.split()[5].endswith("/")}
    assert {
        "/usr/lib/systemd/system/kata.service",
        "/usr/lib/udev/rules.d/60-kata.rules",
        "/etc/kata/environment",
    } <= files
    assert root.run(f"dpkg-deb --info {deb} conffiles").stdout.split() == sorted(
        file for file in files if file.startswith("/etc/")
    )
