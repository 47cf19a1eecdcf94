"""Messages about import and export. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

ERASURE_ALREADY_REQUESTED: Final = message(
    "erasure_already_requested", "An earlier erasure request of this patient has not been decided yet."
)
DECIDE_THAT_REQUEST: Final = message("decide_that_request", "Decide on the earlier request first.")
CLINIC_NUMBER_WRONG: Final = message("clinic_number_wrong", "This is not the patient's clinic number.")
COMPARE_NAME_AND_NUMBER: Final = message(
    "compare_name_and_number", "Check the name, and type the number as shown in the record."
)
CLINIC_NUMBER_WRONG_FIELD: Final = message("clinic_number_wrong_field", "does not belong to this patient")
PATIENT_SESSION_OPEN: Final = message("patient_session_open", "A session of this patient is still open.")
ERASURE_DECIDED: Final = message("erasure_decided", "This request has already been decided.")
RELOAD_PAGE: Final = message("reload_page", "Reload the page to see the decision.")
ROWS_FAR_APART: Final = message(
    "rows_far_apart", "most rows are {step_s:g} s apart; time_s is in seconds, but these values look like milliseconds"
)
MOTION_LONGER_THAN_AN_HOUR: Final = message(
    "motion_longer_than_an_hour", "from this row on, the motion is longer than an hour"
)
GAP_BEFORE: Final = message(
    "gap_before", "there is a gap of {gap_s:.1f} s before this row; the longest allowed gap is {longest_s:g} s"
)
MORE_THAN_A_TURN: Final = message("more_than_a_turn", "{angle_deg:g}° is more than a whole turn")
LOOKS_LIKE_RADIANS: Final = message(
    "looks_like_radians", "the largest angle is {angle_deg:g}; this looks like radians, but degrees are needed"
)
FILE_UTF16: Final = message("file_utf16", "the file is in UTF-16; save it as CSV in UTF-8")
LINE_NOT_UTF8: Final = message("line_not_utf8", "line {line:d} is not text in UTF-8; is this a CSV file?")
LINE_SHIFT_JIS: Final = message("line_shift_jis", "line {line:d} is in Shift-JIS; save the file as CSV in UTF-8")
IMPORT_REFUSED: Final = message("import_refused", "This cannot be imported: {reasons:texts}.")
FHIR_UNREADABLE: Final = message("fhir_unreadable", "This is not a JSON object in UTF-8.")
FHIR_TOO_MANY_PARTS: Final = message("fhir_too_many_parts", "The file has more than {limit:d} values.")
FHIR_TOO_DEEP: Final = message("fhir_too_deep", "The values in the file are nested too deeply.")
FHIR_NAME_TWICE: Final = message("fhir_name_twice", "An object of the file has two elements of the same name.")
FHIR_NOT_A_NUMBER: Final = message(
    "fhir_not_a_number", "The file has a number that JSON or this service does not know."
)
FILE_REFUSED: Final = message("file_refused", "This file cannot be used: {reason:text}.")
NOTHING_MEASURED: Final = message("nothing_measured", "Nothing was measured in this playback.")
NOTHING_TO_DOWNLOAD: Final = message("nothing_to_download", "There is nothing to download.")
RECORD_WITHOUT_PATIENT: Final = message("record_without_patient", "This record was erased; its patient is unknown.")
DOWNLOAD_ONE_BY_ONE: Final = message("download_one_by_one", "Recordings and runs can still be downloaded one by one.")
FHIR_NOT_PATIENT: Final = message("fhir_not_patient", "must be Patient, or Bundle with Patients in it")
FHIR_PATIENT_COUNT: Final = message("fhir_patient_count", "must contain at least one Patient and at most {most:d}")
FHIR_ONE_OF: Final = message("fhir_one_of", "must be one of {choices:name}")
FHIR_DECEASED: Final = message("fhir_deceased", "says that this patient has died")
FHIR_INACTIVE: Final = message("fhir_inactive", "says that this record is inactive")
FHIR_UNKNOWN_ELEMENT: Final = message("fhir_unknown_element", "is not an element of a Patient in FHIR R4")
FHIR_CLINIC_NUMBER_NEEDED: Final = message("fhir_clinic_number_needed", "must contain the patient's clinic number")
FHIR_NOT_TEXT: Final = message("fhir_not_text", "must be a text")
FHIR_NAME_NEEDED: Final = message("fhir_name_needed", "must have a name")
FHIR_NOT_TEXTS: Final = message("fhir_not_texts", "must consist of texts")
FHIR_NOT_OBJECTS: Final = message("fhir_not_objects", "must be a list of objects")
FHIR_NOT_DATE: Final = message("fhir_not_date", "must be a whole date such as 1968-04-12, not {given:name}")
PLACE_PROBLEM: Final = message("place_problem", "{place:name} {problem:text}")
IMPORTED_PLACE: Final = message("imported_place", "{place:name}: {problem:sentence}")
FHIR_MAY_CHANGE_MEANING: Final = message(
    "fhir_may_change_meaning", "may change the meaning of the other elements, and is not supported"
)
FHIR_OTHER_LINK: Final = message("fhir_other_link", "refers to another record of this patient; import the valid record")
FHIR_NUMBER_AMBIGUOUS: Final = message(
    "fhir_number_ambiguous", "several numbers; mark the clinic's number with type MR"
)
ERASURE_REQUEST_NOT_FOUND: Final = message("erasure_request_not_found", "There is no such request.")
IMPORTED_FROM_CSV: Final = message("imported_from_csv", "imported from a CSV file")
