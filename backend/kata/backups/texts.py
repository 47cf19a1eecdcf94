"""Messages about backups. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

BACKUP_RUNNING: Final = message("backup_running", "A backup is being made already.")
WAIT_FOR_BACKUP: Final = message("wait_for_backup", "Wait until it is done; it is in the list then.")
