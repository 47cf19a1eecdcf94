"""Messages about backups. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

BACKUP_RUNNING: Final = message("backup_running", "Another backup is being made.")
WAIT_FOR_BACKUP: Final = message("wait_for_backup", "Wait until the backup appears in the list.")
