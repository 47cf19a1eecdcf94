"""Messages of the REST interface itself. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

DATABASE_UNANSWERED: Final = message("database_unanswered", "The database does not answer.")
WHAT_GOES_ON_CONTINUES: Final = message("what_goes_on_continues", "Running operations continue.")
DATABASE_UNAVAILABLE: Final = message(
    "database_unavailable",
    "The database does not answer. This computer stores what happens at the apparatus; nothing is lost.",
)
TRY_AGAIN_STOP_WORKS: Final = message(
    "try_again_stop_works", "Try again in a moment. Running operations continue, and Stop works."
)
RESTARTS_AUTOMATICALLY: Final = message("restarts_automatically", "It restarts automatically.")
INTERNAL_ERROR: Final = message("internal_error", "Something went wrong in the service.")
REPORT_WITH_LOG: Final = message("report_with_log", "Try again. If it happens again, report it with the log.")
NOT_JSON: Final = message("not_json", "The request is not JSON in UTF-8.")
HAND_WAIT: Final = message("hand_wait", "Wait, or release the arm first.")
NOT_SIMULATING: Final = message("not_simulating", "This station has a real apparatus.")
USE_REAL_INPUTS: Final = message("use_real_inputs", "Use its own pedal and switch.")
MOTION_NOT_FOUND: Final = message("motion_not_found", "There is no such motion.")
CHOOSE_FROM_LIST: Final = message("choose_from_list", "Choose one from the list.")
MOTION_FILE_UNUSABLE: Final = message("motion_file_unusable", "{file:name} cannot be used: {reason:text}.")
LIMITS_CHANGED_MEANWHILE: Final = message(
    "limits_changed_meanwhile", "The doctor's limits were changed while this recording was checked."
)
LOAD_AGAIN: Final = message("load_again", "Load it again.")
NOT_SIGNED_IN: Final = message("not_signed_in", "You are not signed in.")
SIGN_IN_FIRST: Final = message("sign_in_first", "Sign in first.")
SCREEN_LOCKED: Final = message("screen_locked", "The screen is locked.")
GIVE_PASSWORD_STOP_WORKS: Final = message("give_password_stop_works", "Enter your password. Stop works without it.")
SECOND_FACTOR_MISSING: Final = message("second_factor_missing", "Your account needs a second factor.")
SET_UP_SECOND_FACTOR: Final = message("set_up_second_factor", "Set it up; it takes a minute.")
ROLE_NOT_ALLOWED: Final = message("role_not_allowed", "Your role does not allow this.")
ASK_PERMITTED_PERSON: Final = message("ask_permitted_person", "Ask a person whose role allows it, or an administrator.")
OTHER_STATION: Final = message("other_station", "You are not assigned to this station.")
USE_OWN_STATION: Final = message(
    "use_own_station", "Use your own station, or ask an administrator to assign you to this one."
)
RECORD_RESTRICTED: Final = message("record_restricted", "This record is restricted to its care team.")
OPEN_IN_EMERGENCY: Final = message(
    "open_in_emergency", "In an emergency you can open it: give the reason. An administrator will read it."
)
PLAYED_PAPER: Final = message("played_paper", "as in the paper, at 10 Hz")
PLAYED_LEARNED_NOTHING: Final = message("played_learned_nothing", "learned, without earlier playbacks yet")
PLAYED_LEARNED: Final = message("played_learned", "learned from earlier playbacks")
SENTENCE: Final = message("sentence", "{clause:text}.")
FIELD_PROBLEM: Final = message("field_problem", "{field:text} {problem:text}")
INVALID_INPUT: Final = message("invalid_input", "Please check what was entered: {fields:texts}.")
UNKNOWN_HOST: Final = message("unknown_host", "The request uses a name that this service does not accept.")
USE_PRINTED_ADDRESS: Final = message(
    "use_printed_address", "Use the address that Kata prints when it starts, or add this name to KATA_ALLOWED_HOSTS."
)
FOREIGN_ORIGIN: Final = message("foreign_origin", "The request came from another site's page.")
OPEN_OWN_PAGE: Final = message("open_own_page", "Open Kata's own page.")
TOO_MANY_PARTS: Final = message("too_many_parts", "The request has more than {limit:d} values.")
TOO_MUCH_SENT: Final = message("too_much_sent", "The request is larger than {limit:d} bytes.")
ADDRESS_NOT_FOUND: Final = message("address_not_found", "There is no such address.")
FILE_NOT_FOUND: Final = message("file_not_found", "There is no such file.")
PATH_NOT_FOUND: Final = message("path_not_found", "Not Found.")
METHOD_NOT_ALLOWED: Final = message("method_not_allowed", "Method Not Allowed.")
