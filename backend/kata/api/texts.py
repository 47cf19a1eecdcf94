"""Messages of the REST interface itself. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

DATABASE_UNANSWERED: Final = message("database_unanswered", "The database does not answer.")
PAUSED_BY_CONTRAINDICATION: Final = message(
    "paused_by_contraindication",
    "The playback was paused, and the arm is held. {reason:text}",
)
STATION_MOVES: Final = message("station_moves", "The motors of this station have torque, or a commissioning runs.")
WHAT_GOES_ON_CONTINUES: Final = message("what_goes_on_continues", "Running operations continue.")
DATABASE_UNAVAILABLE: Final = message(
    "database_unavailable",
    "The database does not answer. No data is lost: this computer stores what happens at the apparatus.",
)
TRY_AGAIN_STOP_WORKS: Final = message(
    "try_again_stop_works", "Try again in a moment. Running operations continue, and Stop works."
)
RESTARTS_AUTOMATICALLY: Final = message("restarts_automatically", "It restarts automatically.")
INTERNAL_ERROR: Final = message("internal_error", "An internal error occurred in the service.")
REPORT_WITH_LOG: Final = message(
    "report_with_log", "Try again. If it happens again, report it to an administrator, with the log."
)
NO_SUPPORT_BUNDLE: Final = message("no_support_bundle", "The support bundle could not be made.")
RUN_SUPPORT_COMMAND: Final = message(
    "run_support_command", "Run kata support-bundle on the station's computer; it says what went wrong."
)
NOT_JSON: Final = message("not_json", "The request is not JSON in UTF-8.")
HAND_WAIT: Final = message("hand_wait", "Wait, or release the arm first.")
NOT_SIMULATING: Final = message("not_simulating", "This station has a real apparatus.")
USE_REAL_INPUTS: Final = message("use_real_inputs", "Use the pedal and the switch of the apparatus.")
MOTION_NOT_FOUND: Final = message("motion_not_found", "There is no such motion.")
CHOOSE_FROM_LIST: Final = message("choose_from_list", "Choose one from the list.")
MOTION_FILE_UNUSABLE: Final = message("motion_file_unusable", "{file:name} cannot be used: {reason:text}.")
LIMITS_CHANGED_MEANWHILE: Final = message(
    "limits_changed_meanwhile", "The doctor's limits were changed while this recording was checked."
)
LOAD_AGAIN: Final = message("load_again", "Load the recording again.")
LIMITS_CHANGED_SINCE_LOAD: Final = message(
    "limits_changed_since_load", "The doctor's limits were changed after this recording was loaded."
)
RETURN_AND_LOAD_AGAIN: Final = message("return_and_load_again", "Return the arm, then load the recording again.")
NOT_SIGNED_IN: Final = message("not_signed_in", "You are not signed in.")
SIGN_IN_FIRST: Final = message("sign_in_first", "Sign in first.")
TOKEN_UNKNOWN: Final = message("token_unknown", "This is not an access token of this service.")
COPY_WHOLE_TOKEN: Final = message("copy_whole_token", "Copy the whole token, or create another one under My account.")
TOKEN_ONLY_READS: Final = message("token_only_reads", "An access token only reads records and the state of stations.")
SIGN_IN_AT_THE_PAGE: Final = message("sign_in_at_the_page", "Sign in on the page to do this.")
SCREEN_LOCKED: Final = message("screen_locked", "The screen is locked.")
GIVE_PASSWORD_STOP_WORKS: Final = message("give_password_stop_works", "Enter your password. Stop works without it.")
SECOND_FACTOR_MISSING: Final = message("second_factor_missing", "Your account needs a second factor.")
SET_UP_SECOND_FACTOR: Final = message("set_up_second_factor", "Set up a second factor; this takes about a minute.")
ROLE_NOT_ALLOWED: Final = message("role_not_allowed", "Your role does not allow this.")
ASK_PERMITTED_PERSON: Final = message("ask_permitted_person", "Ask a person whose role allows it, or an administrator.")
OTHER_STATION: Final = message("other_station", "You are not assigned to this station.")
USE_OWN_STATION: Final = message(
    "use_own_station", "Use your own station, or ask an administrator to assign you to this one."
)
RECORD_RESTRICTED: Final = message("record_restricted", "This record is restricted to its care team.")
OPEN_IN_EMERGENCY: Final = message(
    "open_in_emergency", "In an emergency you can open the record: enter the reason. An administrator reviews it."
)
PATIENT_SETS_PACE: Final = message("patient_sets_pace", "the patient's effort sets the pace")
PLAYED_PAPER: Final = message("played_paper", "as in the paper, at 10 Hz")
PLAYED_LEARNED_NOTHING: Final = message("played_learned_nothing", "learned method, no earlier playbacks yet")
PLAYED_LEARNED: Final = message("played_learned", "learned from earlier playbacks")
END_FEEL_BASELINE: Final = message("end_feel_baseline", "baseline of the end-feel test, with a test weight")
END_FEEL_TEST: Final = message("end_feel_test", "end-feel test up to {torque_nm:.1f} Nm")
STRETCHED: Final = message("stretched", "stretch at {torque_nm:.1f} Nm for {hold_s:g} s, {repetitions:d} times")
NO_STATION_FILE: Final = message("no_station_file", "The service runs without a station's file.")
START_WITH_STATION_FILE: Final = message("start_with_station_file", "Start it with kata serve --station FILE.toml.")
SETTINGS_INVALID: Final = message("settings_invalid", "The station's file is not accepted: {problems:name}.")
CORRECT_STATION_FILE: Final = message("correct_station_file", "Correct the file and import it again.")
OTHER_STATIONS_FILE: Final = message(
    "other_stations_file", "The file is for the station {given:name}, not for {station:name}."
)
STATION_FILE_NOT_WRITTEN: Final = message(
    "station_file_not_written", "The station's file could not be written: {reason:name}."
)
COPY_STATION_FILE: Final = message(
    "copy_station_file", "Let an administrator of the computer copy the file to its place and restart the service."
)
ALLOW_WRITING_STATION_FILE: Final = message(
    "allow_writing_station_file",
    "Let an administrator of the computer allow the service to write to this folder, or run kata commission in a terminal.",
)
SETTINGS_UNREADABLE: Final = message(
    "settings_unreadable",
    "Version {number:d} of the configuration was made by another version of Kata and cannot be shown by field.",
)
SESSION_OPEN: Final = message("session_open", "A session of this station is open.")
END_SESSION_FIRST: Final = message("end_session_first", "End the session first.")
OTHER_INSTRUCTION: Final = message("other_instruction", "The instruction on the screen has changed.")
READ_INSTRUCTION_AGAIN: Final = message("read_instruction_again", "Read the instruction again.")
GAINS_REFUSED: Final = message("gains_refused", "These gains are outside the limits of the next measurement.")
CHOOSE_WITHIN_LIMITS: Final = message("choose_within_limits", "Enter gains within the limits that the page shows.")
CHECK_IMPOSSIBLE: Final = message("check_impossible", "The station is not commissioned, so it cannot be checked.")
COMMISSION_FIRST: Final = message("commission_first", "Commission the station first.")
STEPS_MISSING: Final = message("steps_missing", "The steps before this one have not passed.")
BEGIN_EARLIER: Final = message("begin_earlier", "Begin with an earlier step.")
COMMISSIONING_NOT_STARTED: Final = message("commissioning_not_started", "The commissioning could not be started.")
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
