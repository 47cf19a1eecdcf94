"""Produce the files of an old version of Kata: database, anchor, journal, spool and backup, as ``tests/fixtures/old_clinic.tar.xz``.

This script runs in a checkout of that version, not in this one. The fixture was made by commit 7e7432c ("Allow a yielding setpoint half a
degree"), the last one before modules and names were changed to standard terms::

    git worktree add --detach ../old 7e7432c
    cd ../old
    PYTHONPATH=backend .../python .../tests/support/old_files.py .../tests/fixtures/old_clinic.tar.xz

It teaches a motion of three seconds, plays it and makes a backup. Then it plays the motion again while another connection locks the
database, and exits without a shutdown: the second run's journal and events stay on disk, undelivered.
"""

import asyncio
import importlib
import os
import shutil
import sqlite3
import subprocess
import sys
import tarfile
import time
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, Final

_CHILD: Final = "--child"


async def _work(data: Path) -> None:
    # By name: these modules have other names in today's tree.
    rehearsal: Any = importlib.import_module("kata.rehearsal")
    built_in: Any = importlib.import_module("kata.motion.builtin")
    settings: Any = importlib.import_module("kata.settings")
    commands = rehearsal.commands

    async with rehearsal.rehearsing(
        settings.Settings(data=data, simulate=True, rate_hz=20), lambda *progress: None
    ) as visit:
        recording = await visit.teach(built_in.built_in_motions()[0])
        await visit.play(recording)
        backup = [sys.executable, "-m", "kata", "backup", "--data", str(data)]
        await asyncio.to_thread(lambda: subprocess.run(backup, check=True))
        wanted = commands.LoadRequest(
            session_id=visit._visit_id, recording_id=recording.id, load_level=rehearsal.LOAD_LEVELS
        )
        run = await commands.load(visit.station, visit.database, visit._kept, visit._ahead, visit.browser, wanted)
        lock = sqlite3.connect(data / "kata.db", isolation_level=None)
        lock.execute("BEGIN IMMEDIATE")
        await commands.approach(visit.station, await visit._guard(), visit.browser)
        await visit.until_mode({"paused"}, "approach", 30.0)
        await commands.play(visit.station, await visit._guard(), visit.browser)
        await visit.until_mode({"returning", "idle"}, "play", 30.0)
        await visit.until_mode({"idle"}, "return", 30.0)
        # The spool syncs its last records, and the device process completes the journal.
        await asyncio.sleep(3.0)
        assert list((data / "journal").glob(f"*{run.id}*"))
        os._exit(0)


def _pack(data: Path, out: Path) -> None:
    """Pack the files that a new version has to read. The write-ahead log is merged into the database first."""
    database = sqlite3.connect(data / "kata.db")
    database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    database.close()
    with tarfile.open(out, "w:xz") as archive:
        for name in ("kata.db", "audit.anchor", "backup-key.txt", "journal", "spool", "backups", "station-in-use.toml"):
            archive.add(data / name, arcname=name)


def main() -> None:
    """Run the old version in a child process, and pack its files."""
    if sys.argv[1] == _CHILD:
        asyncio.run(_work(Path(sys.argv[2])))
    data = Path(mkdtemp(prefix="kata-old-"))
    subprocess.run([sys.executable, __file__, _CHILD, data], check=True)
    # The device process notices the end of the service.
    time.sleep(5.0)
    _pack(data, Path(sys.argv[1]))
    shutil.rmtree(data)


if __name__ == "__main__":
    main()
