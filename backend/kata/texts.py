"""Messages that several packages send. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

CHECK_LIST_AGAIN: Final = message("check_list_again", "Go back to the list; it may have changed.")
EDITED_MEANWHILE: Final = message("edited_meanwhile", "Another user has changed this record in the meantime.")
RELOAD_AND_CHANGE_AGAIN: Final = message("reload_and_change_again", "Reload it, and make your change again.")
