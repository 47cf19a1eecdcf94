"""An installation in a folder of versions with a simulated station, a systemctl of its own, and releases that `kata update` installs."""

import json
import os
import shutil
import sqlite3
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Final, Literal

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

from kata.database.engine import Database
from kata.system.service_unit import ServiceUnit
from kata.system.update_bundle import write_bundle
from tests.support.databases import upgraded_file
from tests.support.paths import ROOT
from tests.support.ports import free_port
from tests.support.small_wheel import small_wheel
from tests.support.treatment import treat

FIRST: Final = "1.0.0"
_READY_WITHIN_S: Final = 90
_MIGRATION: Final = """
import sqlalchemy as sa
from alembic import op

revision, down_revision, branch_labels, depends_on = "{revision}", "{before}", None, None


def upgrade() -> None:
    op.create_table("{revision}_table", sa.Column("id", sa.Integer, primary_key=True))
    op.execute("INSERT INTO schemas (revision, oldest) VALUES ('{revision}', '{revision}')")


def downgrade() -> None:
    op.drop_table("{revision}_table")
"""
_RELEASE: Final = """
import sys
from pathlib import Path


def main() -> None:
    import kata

    kata.__version__ = "{version}"
    if len(sys.argv) > 1 and sys.argv[1] in ("serve", "backup", "data-before-update", "seed", "restore"):
        import kata.database.upgrade as upgrade

        upgrade._IN_PACKAGE = Path("{migrations}")
        if {broken} and sys.argv[1] == "serve":
            import kata.api.set_up as set_up

            def fails(*_: object) -> None:
                raise SystemExit("this release does not start")

            # After the migration.
            set_up._station_name = fails
    from kata.__main__ import main

    main()
"""
SYSTEMCTL: Final = '''#!{python}
"""Starts and stops the units of a test like systemd: in a session of their own."""
import json, os, signal, subprocess, sys, time
from pathlib import Path

# Like systemd, it finishes what was asked for when the asking process is killed.
os.setsid()
folder = Path("{folder}")
action, name, *options = sys.argv[1:]
unit = json.loads((folder / (name + ".json")).read_text())
pid_file = folder / (name + ".pid")
stopping = folder / (name + ".stopping")


def running():
    try:
        pid = int(pid_file.read_text())
        state = Path(f"/proc/{{pid}}/stat").read_text().rpartition(")")[2].split()[0]
        return pid if state != "Z" else None
    except (OSError, ValueError):
        return None


if action == "show":
    values = {{
        "ActiveState": "active" if running() else "inactive",
        "Environment": " ".join(f"{{key}}={{value}}" for key, value in unit["environment"].items()),
        "EnvironmentFiles": "", "User": "",
    }}
    print(values[options[0].partition("=")[2]])
elif action == "start":
    # systemd starts a unit that is stopping after its end.
    while stopping.exists():
        time.sleep(0.02)
    if running():
        sys.exit()
    environment = {{key: value for key, value in os.environ.items() if not key.startswith("KATA_")}} | unit["environment"]
    with (folder / (name + ".log")).open("ab") as log:
        child = subprocess.Popen([unit["command"], "serve"], env=environment, stdout=log, stderr=log, start_new_session=True)
    pid_file.write_text(str(child.pid))
elif action == "stop" and (pid := running()):
    stopping.touch()
    os.kill(pid, signal.SIGINT)
    limit = time.monotonic() + 60
    while running():
        if time.monotonic() > limit:
            os.killpg(pid, signal.SIGKILL)
        time.sleep(0.02)
    stopping.unlink()
'''
_KILLED: Final = """
import os, signal, sys, threading, time

EVENTS = {"os.rename", "os.symlink", "os.mkdir", "subprocess.Popen", "shutil.rmtree", "os.link"}
number, delay_s, count_file = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3]
seen = 0
# Written as a whole: the kill may come at any time.
count = os.open(count_file, os.O_WRONLY)
# Modules that were changed since their last import would be written, which would count as changes of the update.
sys.dont_write_bytecode = True


def kill():
    os.killpg(0, signal.SIGKILL)


def hook(event, arguments):
    global seen
    if event not in EVENTS:
        return
    seen += 1
    os.pwrite(count, b"%06d" % seen, 0)
    if seen == number:
        threading.Timer(delay_s, kill).start() if delay_s else kill()


sys.argv = ["kata", *sys.argv[4:]]
from kata_release import main

sys.addaudithook(hook)
main()
"""
"""Kills itself and its children just before, or some time after, the change with this number."""


class UpdateClinic:
    """One computer with one or several simulated stations."""

    def __init__(self, folder: Path, stations: int = 1) -> None:
        self.folder, self.root = folder, folder / "opt"
        self._systemd = folder / "systemd"
        self._systemd.mkdir()
        self.units = [f"kata{n}" if n else "kata" for n in range(stations)]
        self.ports = [free_port() for _ in self.units]
        self._private = Ed25519PrivateKey.generate()
        self.key = folder / "key.pem"
        self.key.write_bytes(self._private.public_key().public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo))
        self._write_units()
        self._install_first()

    def data(self, unit: str = "kata") -> Path:
        """Return the data folder of a unit."""
        return self.folder / f"data-{unit}"

    @property
    def in_use(self) -> str:
        """Return the version that the link names."""
        return (self.root / "current").resolve().name

    def seed(self, unit: str = "kata") -> None:
        """Create the database with a patient who was treated once. ``kata seed`` would take six seconds of processor time."""
        database = Database(upgraded_file(self.data(unit) / "kata.db"))
        with database.write() as session:
            treat(session, runs=1)
        database.close()

    def open_session(self) -> None:
        """Leave a session of the station open, without its patient."""
        newest = "id = (SELECT max(id) FROM sessions)"
        self._change(f"UPDATE sessions SET ended_at = NULL, station = 'Station 1' WHERE {newest}")

    def end_session(self) -> None:
        """End the open session."""
        self._change("UPDATE sessions SET ended_at = started_at WHERE ended_at IS NULL")

    def bundle(self, version: str, kind: Literal["good", "broken"] = "good") -> Path:
        """Return the signed bundle of a release that changes the schema. A broken one migrates the database and ends."""
        out = self.folder / f"kata-{version}.bundle"
        write_bundle(out, version, [self._wheel(version, broken=kind == "broken")], self._private)
        return out

    def update(self, *options: str) -> subprocess.CompletedProcess[str]:
        """Run ``kata update`` of the version in use."""
        return self.kata(self.in_use, *self._command(options), check=False)

    def update_killed(self, number: int, delay_s: float, *options: str) -> int:
        """Run ``kata update``, killed at its change ``number``. Return how many changes it made."""
        count = self.folder / "changes"
        count.write_text("0")
        python = self.root / "versions" / self.in_use / "bin/python"
        subprocess.run(
            [python, "-c", _KILLED, str(number), str(delay_s), str(count), *self._command(options)],
            env=self._environment(), start_new_session=True, capture_output=True, timeout=170, check=False,
        )  # fmt: skip
        return int(count.read_text())

    def kata(self, version: str, *arguments: str, check: bool = True) -> subprocess.CompletedProcess[str]:
        """Run the command of an installed version."""
        done = subprocess.run(
            [self.root / "versions" / version / "bin/kata", *arguments],
            env=self._environment(), capture_output=True, text=True, timeout=170, check=False,
        )  # fmt: skip
        assert not check or done.returncode == 0, done.stderr
        return done

    def systemctl(self, action: str, unit: str = "kata") -> None:
        """Start or stop a unit."""
        subprocess.run([self._systemd / "systemctl", action, unit], check=True, timeout=120)

    def is_ready(self, unit: str = "kata") -> str:
        """Wait until the service answers that it is ready; return its version."""
        before = os.environ["PATH"]
        os.environ["PATH"] = self._environment()["PATH"]
        try:
            ServiceUnit(unit).wait_until_ready(self.in_use, _READY_WITHIN_S)
        finally:
            os.environ["PATH"] = before
        return self.in_use

    def schema(self, unit: str = "kata") -> str:
        """Return the revision of the database's schema."""
        return str(self._query("SELECT version_num FROM alembic_version", unit))

    def patients(self, unit: str = "kata") -> int:
        """Return the number of patients in an undamaged database."""
        assert self._query("PRAGMA integrity_check", unit) == "ok"
        return int(str(self._query("SELECT count(*) FROM patients", unit)))

    def close(self) -> None:
        """Stop all services."""
        for unit in self.units:
            self.systemctl("stop", unit)

    def _query(self, query: str, unit: str) -> object:
        with closing(sqlite3.connect(self.data(unit) / "kata.db")) as connection:
            return connection.execute(query).fetchone()[0]

    def _change(self, statement: str) -> None:
        with closing(sqlite3.connect(self.data() / "kata.db")) as connection, connection:
            connection.execute(statement)

    def _command(self, options: Sequence[str]) -> list[str]:
        units = [word for unit in self.units for word in ("--unit", unit)]
        return ["update", *options, "--key", str(self.key), *units, "--ready-within-s", str(_READY_WITHIN_S)]

    def _environment(self) -> dict[str, str]:
        environment = {
            name: value for name, value in os.environ.items() if not name.startswith(("KATA_", "PYTHON", "COV_"))
        }
        return environment | {"PATH": f"{self._systemd}:{os.environ['PATH']}"}

    def _write_units(self) -> None:
        for unit, port in zip(self.units, self.ports, strict=True):
            environment = {
                "KATA_DATA": str(self.data(unit)), "KATA_SIMULATE": "true", "KATA_PORT": str(port),
                "KATA_REAL_TIME": "false", "KATA_BACKUP_TIME": "never",
            }  # fmt: skip
            content = {"environment": environment, "command": str(self.root / "current/bin/kata")}
            (self._systemd / f"{unit}.json").write_text(json.dumps(content))
        program = self._systemd / "systemctl"
        program.write_text(SYSTEMCTL.format(python=sys.executable, folder=self._systemd))
        program.chmod(0o755)

    def _install_first(self) -> None:
        folder = self.root / "versions" / FIRST
        folder.parent.mkdir(parents=True)
        # The version in use needs no pip of its own, whose installation takes seconds.
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
        wheel = self._wheel(FIRST, broken=False)
        subprocess.run(
            [sys.executable, "-m", "pip", "--quiet", "--python", folder, "install", "--no-index", "--no-deps", wheel],
            check=True,
            env=self._environment() | {"PIP_CONFIG_FILE": os.devnull},
        )
        (folder / "complete").touch()
        (self.root / "current").symlink_to(Path("versions") / FIRST)

    def _wheel(self, version: str, *, broken: bool) -> Path:
        """Return a wheel that runs the checkout's program as another version."""
        migrations = self._migrations(version)
        module = _RELEASE.format(version=version, migrations=migrations, broken=broken)
        paths = f"{ROOT / 'backend'}\n{sysconfig.get_path('purelib')}\n"
        return small_wheel(self.folder, version, {"kata_release.py": module, "kata_release.pth": paths})

    def _migrations(self, version: str) -> Path:
        """Return the checkout's migrations with those of the releases up to this one in addition."""
        folder = self.folder / f"migrations-{version}"
        shutil.copytree(ROOT / "migrations", folder, dirs_exist_ok=True)
        before = max(path.name[:4] for path in (folder / "versions").glob("0*.py"))
        for number in range(1, int(version.rpartition(".")[2]) + 1):
            revision = f"test{number:04d}"
            (folder / "versions" / f"{revision}.py").write_text(_MIGRATION.format(revision=revision, before=before))
            before = revision
        return folder
