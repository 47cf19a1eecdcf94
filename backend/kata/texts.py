"""Messages that several packages send. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

CHECK_LIST_AGAIN: Final = message("check_list_again", "Go back to the list; it may have changed.")
EDITED_MEANWHILE: Final = message("edited_meanwhile", "Another user has changed this record in the meantime.")
RELOAD_AND_CHANGE_AGAIN: Final = message("reload_and_change_again", "Reload it, and make your change again.")
FIELD_NUMBERED: Final = message("field_numbered", "{field:text} {number:d}")
FIELD_WITHIN: Final = message("field_within", "{outer:text}, {inner:text}")
FIELD_WITH_UNIT: Final = message("field_with_unit", "{field:text} ({unit:text})")
WHOLE_REQUEST: Final = message("whole_request", "the request")
WINDOW_ENDS_BEFORE_START: Final = message("window_ends_before_start", "The end of the range is before its start.")
GIVE_END_AFTER_START: Final = message("give_end_after_start", "Choose an end after the start.")
LIST_POSITION_UNREADABLE: Final = message("list_position_unreadable", "The position in the list cannot be read.")
BEGIN_LIST_ANEW: Final = message("begin_list_anew", "Load the list from its beginning.")
