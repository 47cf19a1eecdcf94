"""Implements ``kata update``: replaces this version with another, and goes back automatically if the other does not become ready.

Versions are folders beside each other. The services start through one symbolic link, which is replaced atomically:

    /opt/kata/current -> versions/1.0.0
    /opt/kata/versions/1.0.0, /opt/kata/versions/1.1.0
    /opt/kata/update/state.json     while an update is not finished

Before each step the state is written to the disk, and each step can be repeated. After a power cut the link and the database belong to the
same version, and :meth:`Update.resume` finishes the update or undoes it.
"""

import fcntl
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, Literal, get_args

import msgspec

from kata.system.service_unit import BusyError, ServiceUnit, UnitError
from kata.system.sync import sync_folder
from kata.system.update_bundle import read_manifest, unpack_bundle

_VERSIONS: Final = "versions"
_LINK: Final = "current"
_COMPLETE: Final = "complete"
"""Name of the file that marks a version's folder as completely installed."""
_WHEELS: Final = "wheels-"
_DISK_SPACE_FACTOR: Final = 5
"""Required disk space as a multiple of the bundle: the wheels, unpacked files and compiled modules."""
_READABLE: Final = 0o022
"""File mode creation mask of an installation, which the services' users must be able to read. Other files of Kata are private."""
_CLEAN: Final = {"PIP_CONFIG_FILE": os.devnull, "PIP_DISABLE_PIP_VERSION_CHECK": "1"}

Step = Literal[
    "install", "backup", "stop", "save", "switch", "start", "back_stop", "back_data", "back_link", "back_start"
]
"""The steps of an update in order, followed by the steps that undo it in order."""
_FORWARD: Final = get_args(Step)[:6]
_BACK: Final = get_args(Step)[6:]


class UpdateError(Exception):
    """An update was refused, undone or not finished. The message says which, why, and what to do."""


class UpdateState(
    msgspec.Struct, frozen=True, tag_field="format", tag="kata-update-state/1", rename={"old": "from", "new": "to"}
):
    """The state of an update that is not finished."""

    old: str
    new: str
    units: list[str]
    step: Step
    """The step that is running, or that was running when the update was interrupted."""
    keep: bool = False
    """True if the new version's folder must stay when the update is undone, because another program has installed it."""
    saved: bool = False
    """True if the data from before the update was saved."""
    reason: str = ""
    """The reason for undoing the update; empty if it is not undone."""


class Update:
    """Updates the installation in one folder, and all services that run from it."""

    def __init__(self, root: Path, units: Sequence[str], ready_within_s: float, say: Callable[[str], None]) -> None:
        """Prepare the update. :param say: prints a sentence about the progress."""
        self._root, self._ready_within_s, self._say = root, ready_within_s, say
        self._units = [ServiceUnit(name) for name in units]
        self._state_file = root / "update" / "state.json"
        self._steps: dict[Step, Callable[[UpdateState], UpdateState | None]] = {
            "backup": self._back_up,
            "stop": self._stop_idle,
            "save": self._save_data,
            "switch": lambda state: self._link(state.new),
            "start": lambda state: self._start(state.new),
            "back_stop": self._stop_failed,
            "back_data": self._put_data_back,
            "back_link": lambda state: self._link(state.old),
            "back_start": lambda state: self._start(state.old),
        }

    def run(self, bundle: Path, public_key: Path) -> str:
        """Update to the bundle's version and return the version. An interrupted update is finished or undone first.

        :raises UpdateError: when the update is refused or undone.
        :raises BundleError: when the bundle is not signed with the key.
        :raises OSError: when a file cannot be read or written.
        """
        with self._alone():
            resumed = self._resume()
            manifest = read_manifest(bundle, public_key)
            if resumed and self.current == manifest.version:
                return manifest.version
            self._check_newer(manifest.version)
            self._check_disk_space(bundle)
            self._check_idle()
            state = UpdateState(self.current, manifest.version, [unit.name for unit in self._units], "install")
            self._write(state)
            try:
                self._install(bundle, public_key, state.new)
            except BaseException:
                self._abandon(state)
                raise
            self._continue(state, "backup")
            return state.new

    def run_installed(self, version: str) -> str:
        """Update to a version that is already installed beside this one, for example by the Debian package. Return the version.

        :raises UpdateError: when the update is refused or undone.
        :raises OSError: when a file cannot be read or written.
        """
        with self._alone():
            self._resume()
            if self.current == version:
                return version
            self._check_newer(version)
            if not (self._version_folder(version) / _COMPLETE).exists():
                raise UpdateError(f"The version {version} is not installed completely in {self._root}.")
            self._check_idle()
            state = UpdateState(self.current, version, [unit.name for unit in self._units], "backup", keep=True)
            self._continue(state, "backup")
            return version

    def resume(self) -> str:
        """Finish or undo an interrupted update. Return the version that is in use.

        :raises UpdateError: when the update had to be undone, or cannot be finished yet.
        """
        with self._alone():
            self._resume()
            return self.current

    @property
    def current(self) -> str:
        """Return the version that the link names."""
        return (self._root / _LINK).readlink().name

    def _resume(self) -> bool:
        """Finish or undo an interrupted update. Return True if there was one."""
        state = self._read()
        if state is None:
            return False
        self._units = [ServiceUnit(name) for name in state.units]
        self._say(f"The update from {state.old} to {state.new} was interrupted in the step {state.step}.")
        if state.step == "install":
            self._abandon(state)
            return True
        # A restart of the computer may have started the services, and users may have changed data since. Then the saved data is too old.
        begin: Step = "stop" if state.step in ("save", "switch") else _BACK[0] if state.step in _BACK else state.step
        self._continue(state, begin)
        return True

    def _continue(self, state: UpdateState, begin: Step) -> None:
        """Run the steps from ``begin`` on. If a forward step fails, run the steps that undo the update."""
        if begin in _FORWARD:
            for step in _FORWARD[_FORWARD.index(begin) :]:
                try:
                    state = self._do(state, step)
                except (UnitError, OSError) as error:
                    state = msgspec.structs.replace(state, reason=str(error))
                    self._say(f"Going back to {state.old}: {error}")
                    break
            else:
                self._finish(state)
                return
        try:
            for step in _BACK:
                state = self._do(state, step)
        except (UnitError, OSError) as error:
            for unit in self._units:
                unit.start()
            raise UpdateError(
                f"{error}\nThe update could not be undone completely. Repair this, then run: {self._kata(state.old)} update --resume"
            ) from error
        self._abandon(state)
        raise UpdateError(f"The update to {state.new} was undone; {state.old} is in use. {state.reason}")

    def _do(self, state: UpdateState, step: Step) -> UpdateState:
        """Write the state and run the step. Return the new state."""
        state = msgspec.structs.replace(state, step=step)
        self._write(state)
        return self._steps[step](state) or state

    # -- steps ----------------------------------------------------------------------------------------------------

    def _install(self, bundle: Path, public_key: Path, version: str) -> None:
        """Install the bundle's wheels into a new environment."""
        self._say(f"Installing {version} ...")
        folder = self._version_folder(version)
        if folder.exists():
            shutil.rmtree(folder)
        for leftover in self._state_file.parent.glob(f"{_WHEELS}*"):
            shutil.rmtree(leftover)
        with TemporaryDirectory(prefix=_WHEELS, dir=self._state_file.parent) as wheels:
            unpacked = unpack_bundle(bundle, public_key, Path(wheels))
            _run([sys.executable, "-m", "venv", folder])
            pip: list[str | Path] = [folder / "bin/python", "-m", "pip", "--quiet"]
            _run([*pip, "install", "--no-index", "--no-deps", *unpacked])
            _run([*pip, "check"])
        if (installed := _run([folder / "bin/kata", "--version"])) != f"kata {version}":
            raise UpdateError(f"The bundle of {version} contains {installed}.")
        # The files must be on the disk before the version counts as complete.
        os.sync()
        (folder / _COMPLETE).touch()
        sync_folder(folder)

    def _back_up(self, state: UpdateState) -> None:
        self._say("Making a backup ...")
        for unit in self._units:
            unit.run([self._kata(state.old), "backup"])

    def _stop_idle(self, state: UpdateState) -> None:
        for unit in self._units:
            if not unit.has_ended:
                unit.check_idle()
            self._say(f"Stopping {unit.name} ...")
            unit.stop()

    def _save_data(self, state: UpdateState) -> UpdateState:
        for unit in self._units:
            unit.run([self._kata(state.old), "data-before-update", "save"])
        return msgspec.structs.replace(state, saved=True)

    def _stop_failed(self, state: UpdateState) -> None:
        """Stop the services, unless one of them moves an arm or has an open session. A service that does not answer is stopped too."""
        for unit in self._units:
            try:
                unit.check_idle()
            except BusyError:
                raise
            except UnitError:
                pass
        for unit in self._units:
            unit.stop()

    def _put_data_back(self, state: UpdateState) -> None:
        for unit in self._units if state.saved else ():
            unit.run([self._kata(state.old), "data-before-update", "put-back"])

    def _start(self, version: str) -> None:
        """Start the services one after another."""
        for unit in self._units:
            self._say(f"Starting {unit.name} with {version} ...")
            unit.start()
            unit.wait_until_ready(version, self._ready_within_s)

    def _link(self, version: str) -> None:
        """Let the link point to a version. A reader always finds either the former version or this one."""
        if not (self._version_folder(version) / _COMPLETE).exists():
            raise OSError(f"The version {version} is not installed completely in {self._root}.")
        new_link = self._root / f"{_LINK}.new"
        new_link.unlink(missing_ok=True)
        new_link.symlink_to(Path(_VERSIONS) / version)
        new_link.replace(self._root / _LINK)
        sync_folder(self._root)

    # -- ends -----------------------------------------------------------------------------------------------------

    def _finish(self, state: UpdateState) -> None:
        """Delete the state of the update, and all versions except the new one and the one before it."""
        self._state_file.unlink()
        for folder in (self._root / _VERSIONS).iterdir():
            if folder.name not in (state.old, state.new):
                shutil.rmtree(folder, ignore_errors=True)

    def _abandon(self, state: UpdateState) -> None:
        """Delete the new version if it is not in use, and the state of the update."""
        if self.current != state.new and not state.keep:
            shutil.rmtree(self._version_folder(state.new), ignore_errors=True)
        self._state_file.unlink(missing_ok=True)

    # -- helpers --------------------------------------------------------------------------------------------------

    def _check_newer(self, version: str) -> None:
        if _numbers(version) <= _numbers(self.current):
            raise UpdateError(
                f"The bundle has version {version}, and {self.current} is in use. Only a newer version can be installed."
            )

    def _check_disk_space(self, bundle: Path) -> None:
        free, needed = shutil.disk_usage(self._root).free, _DISK_SPACE_FACTOR * bundle.stat().st_size
        if free < needed:
            raise UpdateError(
                f"The update needs {needed / 1e6:.0f} MB in {self._root}, and {free / 1e6:.0f} MB are free."
            )

    def _check_idle(self) -> None:
        try:
            for unit in self._units:
                unit.check_idle()
        except UnitError as error:
            raise UpdateError(f"{error} Nothing was changed.") from error

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Lock the installation during the block, so that only one update runs at a time."""
        self._state_file.parent.mkdir(exist_ok=True)
        with (self._state_file.parent / "lock").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise UpdateError("Another update is running.") from error
            yield

    def _read(self) -> UpdateState | None:
        try:
            return msgspec.json.decode(self._state_file.read_bytes(), type=UpdateState)
        except FileNotFoundError:
            return None
        except msgspec.MsgspecError as error:
            raise UpdateError(f"This version cannot read {self._state_file}: {error}.") from error

    def _write(self, state: UpdateState) -> None:
        """Replace the state file, and wait until it is on the disk."""
        new_file = self._state_file.with_suffix(".new")
        with new_file.open("wb") as file:
            file.write(msgspec.json.encode(state))
            file.flush()
            os.fsync(file.fileno())
        new_file.replace(self._state_file)
        sync_folder(new_file.parent)

    def _version_folder(self, version: str) -> Path:
        return self._root / _VERSIONS / version

    def _kata(self, version: str) -> Path:
        return self._version_folder(version) / "bin" / "kata"


def root_of(prefix: Path) -> Path | None:
    """Return the folder of the installation to which the environment ``prefix`` belongs as a version; None if there is none."""
    folder = prefix.resolve()
    return folder.parents[1] if folder.parent.name == _VERSIONS else None


def _run(command: Sequence[str | Path]) -> str:
    """Run a command of the installation. Return its output.

    :raises UpdateError: when the command fails.
    """
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PIP_", "PYTHON"))}
    done = subprocess.run(
        command, env=environment | _CLEAN, umask=_READABLE, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise UpdateError(
            f"{command[0]} failed, and nothing was changed: {(done.stderr or done.stdout).strip()[-2000:]}"
        )
    return done.stdout.strip()


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.split("."))
