"""``kata update``: the part of the command around :mod:`kata.system.update`."""

import os
import signal
import sys
from pathlib import Path
from typing import Final

import typer

from kata import __version__
from kata.backups import before_update
from kata.backups.key import BackupError
from kata.settings import Settings
from kata.system.console import fail
from kata.system.update import Update, UpdateError, root_of
from kata.system.update_bundle import BundleError

_NOT_IN_VERSIONS: Final = (
    "This Kata is not installed in a folder of versions, such as /opt/kata/versions/{version}, so it cannot replace itself. "
    "How to install it so: docs/how-to/deploy.md"
)


def update(bundle: Path | None, installed: str, public_key: Path, units: list[str], ready_within_s: float) -> None:
    """Update to the bundle's version or to an installed one. Without either, finish or undo an interrupted update.

    :raises SystemExit: with a sentence when the update is refused or undone.
    """
    root = root_of(Path(sys.prefix))
    if root is None:
        fail(_NOT_IN_VERSIONS.format(version=__version__))
    # The settings of the units apply instead of those of this terminal.
    for name in [name for name in os.environ if name.startswith("KATA_")]:
        del os.environ[name]
    # A closed terminal or Ctrl-C must not interrupt the steps.
    for number in (signal.SIGHUP, signal.SIGINT):
        signal.signal(number, signal.SIG_IGN)
    running = Update(root, units, ready_within_s, typer.echo)
    try:
        if bundle:
            version = running.run(bundle, public_key)
        else:
            version = running.run_installed(installed) if installed else running.resume()
    except (UpdateError, BundleError) as error:
        fail(str(error))
    except OSError as error:
        fail(f"{error.strerror or error}{f': {error.filename}' if error.filename else ''}.")
    typer.echo(f"Kata {version} is in use.")


def data_before_update(step: str, settings: Settings) -> None:
    """Save the data before an update, or put them back."""
    try:
        if step == "save":
            before_update.save(settings)
        else:
            before_update.put_back(settings)
    except BackupError as error:
        fail(str(error))
    except OSError as error:
        fail(f"{error.strerror}: {error.filename}.")
