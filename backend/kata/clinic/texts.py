"""Messages about patients, sessions, recordings and their figures. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

COMMISSIONING_NOT_FOUND: Final = message("commissioning_not_found", "There is no commissioning with this id.")
PATIENT_ARCHIVED: Final = message("patient_archived", "{patient:name} is archived.")
PROGRAMME_ARCHIVED: Final = message("programme_archived", "{programme:name} is archived.")
RESTORE_PATIENT_FIRST: Final = message("restore_patient_first", "Restore the patient's record first.")
ASSESSMENT_WITHDRAWN: Final = message("assessment_withdrawn", "This assessment was withdrawn and cannot be changed.")
ENTER_NEW_ASSESSMENT: Final = message("enter_new_assessment", "Enter a new assessment instead.")
ASSESSMENT_WOULD_BE_EMPTY: Final = message("assessment_would_be_empty", "This change would leave the assessment empty.")
WITHDRAW_IF_MISTAKEN: Final = message("withdraw_if_mistaken", "Withdraw the assessment if it was entered by mistake.")
NO_OPEN_CARE_OF_SHOULDER: Final = message(
    "no_open_care_of_shoulder", "{patient:name} has no open episode of care for the {side:text} shoulder."
)
OPEN_EPISODE_FIRST: Final = message(
    "open_episode_first", "Open an episode of that shoulder on the patient's page first."
)
RESISTANCE_LEVEL_ABOVE_LIMIT: Final = message(
    "load_level_above_limit", "Resistance level {level:d} is above {highest:d}, the highest that {doctor:name} allows."
)
CHOOSE_RESISTANCE_LEVEL: Final = message("choose_load_level", "Choose level {highest:d} or lower.")
MOTION_BEYOND_HIGHEST: Final = message(
    "motion_beyond_highest",
    "Motion {number:d} ({motion:text}) would go to {angle_deg:.1f}° at {at_s:.1f} s; {doctor:name} allows no more than {highest_deg:g}°.",
)
MOTION_BELOW_LOWEST: Final = message(
    "motion_below_lowest",
    "Motion {number:d} ({motion:text}) would go to {angle_deg:.1f}° at {at_s:.1f} s; {doctor:name} allows no less than {lowest_deg:g}°.",
)
ARM_BEYOND_HIGHEST: Final = message(
    "arm_beyond_highest",
    "The {quantity:text} would be {angle_deg:.1f}° at {at_s:.1f} s; {doctor:name} allows no more than {highest_deg:.1f}° in this pose.",
)
ARM_BELOW_LOWEST: Final = message(
    "arm_below_lowest",
    "The {quantity:text} would be {angle_deg:.1f}° at {at_s:.1f} s; {doctor:name} allows no less than {lowest_deg:.1f}° in this pose.",
)
MOTOR_FASTER_THAN_ALLOWED: Final = message(
    "motor_faster_than_allowed",
    "Motor {motor:d} would move at {speed_deg_s:.1f}°/s at {at_s:.1f} s; {doctor:name} allows no more than {limit_deg_s:g}°/s.",
)
CHOOSE_LOWER_SPEED: Final = message("choose_lower_speed", "Choose a lower speed, or another recording.")
CHOOSE_LESS_RANGE: Final = message("choose_less_range", "Reduce the range, or make a recording with a smaller range.")
SCAPULA_UNKNOWN: Final = message(
    "scapula_unknown",
    "The scapula's path in this recording is unknown, so the doctor's limit cannot be checked.",
)
TEACH_AGAIN: Final = message("teach_again", "Teach the motion again.")
EPISODE_SESSION_OPEN: Final = message("episode_session_open", "A session of this episode has not ended.")
END_SESSION_THEN_CLOSE: Final = message("end_session_then_close", "End the session, then close the episode.")
STAGE_NOTED: Final = message("stage_noted", "A stage is already recorded for that day.")
REMOVE_STAGE_OR_OTHER_DAY: Final = message(
    "remove_stage_or_other_day", "Remove the recorded stage first, or choose another day."
)
EPISODE_OPEN: Final = message("episode_open", "An episode of care for the {side:text} shoulder is already open.")
CONTINUE_OR_CLOSE_EPISODE: Final = message("continue_or_close_episode", "Continue that episode, or close it first.")
TIME_ENDS_BEFORE_IT_BEGINS: Final = message("time_ends_before_it_begins", "The end of the period is before its start.")
CHOOSE_LATER_END: Final = message("choose_later_end", "Choose a later end.")
EPISODE_CLOSED: Final = message("episode_closed", "This episode is closed.")
REOPEN_FIRST: Final = message("reopen_first", "Reopen it first.")
CERTAINTY_WITHOUT_DIAGNOSIS: Final = message(
    "certainty_without_diagnosis", "A certainty was entered without a diagnosis."
)
WRITE_DIAGNOSIS: Final = message("write_diagnosis", "Choose or write the diagnosis, or clear the certainty.")
SELF_PACE_NOT_PERMITTED: Final = message(
    "self_pace_not_permitted", "The doctor has not permitted that the patient sets the pace for this shoulder."
)
ASK_DOCTOR_OR_OWN_PACE: Final = message(
    "ask_doctor_or_own_pace",
    "Play the recording with its own pace. The doctor's permission is recorded in the episode, with the doctor's limits.",
)
LIMITS_WITHOUT_DOCTOR: Final = message("limits_without_doctor", "The name of the doctor who set the limits is missing.")
WRITE_DOCTOR_NAME: Final = message("write_doctor_name", "Enter the doctor's name.")
ONSET_BEFORE_BIRTH: Final = message(
    "onset_before_birth", "The day of onset is before the patient's birth date, {birth_date:name}."
)
STAGE_BEFORE_BIRTH: Final = message(
    "stage_before_birth", "The day of the stage is before the patient's birth date, {birth_date:name}."
)
ASSESSMENT_BEFORE_BIRTH: Final = message(
    "assessment_before_birth", "The assessment is before the patient's birth date, {birth_date:name}."
)
CORRECT_DAY_OR_BIRTH_DATE: Final = message("correct_day_or_birth_date", "Correct the day, or the birth date.")
END_FIRST: Final = message("end_first", "End the session first.")
MEND_FILE: Final = message("mend_file", "Correct the file and try again.")
RECORD_ERASED: Final = message("record_erased", "This record was erased and cannot be changed.")
REGISTER_PATIENT_ANEW: Final = message("register_patient_anew", "Register the patient again if they return.")
CLINIC_NUMBER_TAKEN: Final = message(
    "clinic_number_taken", "Another patient has the clinic number {clinic_number:name}."
)
CHOOSE_ANOTHER_CLINIC_NUMBER: Final = message(
    "choose_another_clinic_number",
    "Choose another number, or search for the patient: archived patients keep their numbers.",
)
ITEM_NOT_PLAYABLE: Final = message(
    "item_not_playable", "Item {place:d} cannot be played with these settings: {reason:text}."
)
ITEM_WITHOUT_END: Final = message(
    "item_without_end",
    "end-range time of “{motion:text}” is prescribed, but the recording does not move it by {least_deg:.0f}°",
)
ITEM_BEFORE_END: Final = message(
    "item_before_end",
    "“{motion:text}” ends {short_deg:.0f}° before the recorded end, outside the prescribed band of {band_deg:g}°",
)
END_RANGE_LEVEL_TOO_LOW: Final = message(
    "end_range_level_too_low",
    "resistance level {level:d} moves the arm back before “{motion:text}” reaches the prescribed {torque_nm:g} Nm at its end; level {least:d} or "
    "higher is needed",
)
END_RANGE_TORQUE_TOO_HIGH: Final = message(
    "end_range_torque_too_high",
    "at the end of “{motion:text}” the motor cannot reach the prescribed {torque_nm:g} Nm at any resistance level",
)
CHANGE_LEVEL_OR_TORQUE: Final = message(
    "change_level_or_torque", "Choose a higher resistance level, or prescribe less torque."
)
CHANGE_END_RANGE: Final = message("change_end_range", "Prescribe another motion or band, or play more of the range.")
ITEM_SAMPLES_DAMAGED: Final = message("item_samples_damaged", "its samples are damaged")
ITEM_SELF_PACE_NOT_PERMITTED: Final = message(
    "item_self_pace_not_permitted",
    "Item {place:d}, {recording:name}: the doctor has not permitted that the patient sets the pace.",
)
ASK_DOCTOR_OR_PRESCRIBE_OWN_PACE: Final = message(
    "ask_doctor_or_prescribe_own_pace",
    "Prescribe the recording's own pace. The doctor's permission is recorded in the episode, with the doctor's limits.",
)
ITEM_SELF_PACED_WITH_METHOD: Final = message(
    "item_self_paced_with_method",
    "Item {place:d}, {recording:name}: the patient can set the pace with the smooth method only.",
)
CHOOSE_SMOOTH_OR_OWN_PACE: Final = message(
    "choose_smooth_or_own_pace", "Choose the smooth method, or prescribe the recording's own pace."
)
ITEM_OF_OTHER_PATIENT: Final = message(
    "item_of_other_patient", "Item {place:d}, {recording:name}, was taught to another patient."
)
CHOOSE_OWN_RECORDING: Final = message("choose_own_recording", "Choose a recording of this patient.")
ITEM_OF_OTHER_SIDE: Final = message(
    "item_of_other_side",
    "Item {place:d}, {recording:name}, is for the {side:text} shoulder, but the {treated:text} shoulder is treated.",
)
CHOOSE_OTHER_SHOULDER_RECORDING: Final = message(
    "choose_other_shoulder_recording", "Choose another recording, or mirror this one for the other shoulder."
)
ITEM_ARCHIVED: Final = message("item_archived", "Item {place:d}, {recording:name}, is archived.")
RESTORE_OR_CHOOSE_ANOTHER: Final = message(
    "restore_or_choose_another", "Restore it from the archive first, or choose another one."
)
ITEM_ABOVE_RESISTANCE_LEVEL: Final = message(
    "item_above_load_level",
    "Item {place:d}, {recording:name}, has resistance level {level:d}; the highest allowed is {highest:d}.",
)
ITEM_ABOVE_RESISTANCE_LEVEL_BY: Final = message(
    "item_above_load_level_by",
    "Item {place:d}, {recording:name}, has resistance level {level:d}; {doctor:name} allows at most {highest:d}.",
)
CHOOSE_LOWER_LEVEL: Final = message(
    "choose_lower_level", "Choose a lower level, or ask the doctor to change the limit."
)
TIMER_OVER: Final = message("timer_over", "The timer of this programme ({minutes:g} minutes) has run out.")
GO_ON_TO_PAIN_AFTER: Final = message(
    "go_on_to_pain_after", "Continue with the pain score; the remaining recordings can be played without the programme."
)
RESTORE_FIRST: Final = message("restore_first", "Restore it from the archive first.")
EPISODE_OF_CARE_CLOSED: Final = message("episode_of_care_closed", "This episode of care is closed.")
OPEN_NEW_EPISODE: Final = message("open_new_episode", "Open a new episode for the patient.")
NO_EPISODE: Final = message("no_episode", "This patient has no episode of care.")
OPEN_ONE_FIRST: Final = message("open_one_first", "Open an episode of care first.")
AT_SECOND: Final = message("at_second", "{reason:text}, at {at_s:.1f} s")
EDIT_REFUSED: Final = message("edit_refused", "This edit is not possible: {reason:text}.")
CHOOSE_OTHER_NUMBERS: Final = message("choose_other_numbers", "Choose other values, or trim the recording first.")
SOUND_SIDE_UNKNOWN: Final = message(
    "sound_side_unknown", "the unaffected side is unknown, because exactly one side must have episodes of care"
)
IS_SOUND_SIDE: Final = message("is_sound_side", "this is a recording of the unaffected side")
NO_SOUND_RECORDING: Final = message("no_sound_recording", "no motion of the unaffected side has been taught")
TEACH_SOUND_SIDE: Final = message(
    "teach_sound_side", "Teach the motion on the unaffected side, then edit a recording of the affected side."
)
PART_OF_OTHER: Final = message(
    "part_of_other", "the new part was not taught for this patient and shoulder on this kind of apparatus"
)
TEACH_PART: Final = message("teach_part", "Teach the part on the same shoulder, then choose its recording.")
EDITED_NOT_PLAYABLE: Final = message("edited_not_playable", "The edited recording cannot be played: {reason:text}.")
RECORDING_SAMPLES_DAMAGED: Final = message(
    "recording_samples_damaged", "This recording's samples are damaged and cannot be read."
)
RESTORE_OR_TEACH_AGAIN: Final = message(
    "restore_or_teach_again", "Restore them from a backup, or teach the motion again."
)
CARE_TEAM_WITHOUT_ACCOUNT: Final = message("care_team_without_account", "A member of this care team has no account.")
RELOAD_ACCOUNTS: Final = message("reload_accounts", "Reload the list of accounts, and choose again.")
RECORD_NOT_RESTRICTED: Final = message("record_not_restricted", "This record is open to you.")
GO_ON_AS_USUAL: Final = message("go_on_as_usual", "Open the record as usual.")
OWN_BREAK_GLASS_ACCESS: Final = message("own_emergency_access", "This is your own emergency access.")
OTHER_ADMINISTRATOR_REVIEWS: Final = message("other_administrator_reviews", "Another administrator must review it.")
BREAK_GLASS_ACCESS_REVIEWED: Final = message("emergency_access_reviewed", "This access has already been reviewed.")
RELOAD_LIST: Final = message("reload_list", "Reload the list.")
SESSION_ENDED: Final = message("session_ended", "This session has ended.")
BEGIN_NEW_SESSION: Final = message("begin_new_session", "Begin a new session.")
FIXTURES_DEPEND_ON_RECORDING: Final = message("fixtures_depend_on_recording", "The fixtures depend on the recording.")
CHOOSE_RECORDING_FIRST: Final = message("choose_recording_first", "Choose a recording first.")
CHECK_IS_AUTOMATIC: Final = message(
    "check_is_automatic", "The apparatus detects this check automatically; it cannot be confirmed by hand."
)
DO_IT_AND_IT_SHOWS: Final = message("do_it_and_it_shows", "Carry out the check; the apparatus detects it.")
CHECKS_OPEN: Final = message("checks_open", "These checks are not complete yet: {checks:texts}.")
GO_THROUGH_CHECKLIST: Final = message("go_through_checklist", "Go through the checklist first.")
PROGRAMME_OF_OTHER_EPISODE: Final = message(
    "programme_of_other_episode", "This programme does not belong to the patient's open episode of care."
)
CHOOSE_OWN_PROGRAMME: Final = message("choose_own_programme", "Choose a programme of this episode.")
RECORDING_NOT_AT_PLACE: Final = message(
    "recording_not_at_place", "The session's programme has another recording at this place."
)
RELOAD_SESSION: Final = message("reload_session", "Reload the session; its programme may have been changed.")
RECORDING_OF_OTHER_PATIENT: Final = message(
    "recording_of_other_patient", "This recording was taught to another patient."
)
RECORDING_ARCHIVED: Final = message("recording_archived", "This recording is archived.")
NOTHING_PLAYED: Final = message("nothing_played", "Nothing was played in this playback.")
NOTHING_TO_COMPARE: Final = message("nothing_to_compare", "There is nothing to compare.")
RHYTHM_NO_POSE: Final = message("rhythm_no_pose", "The rhythm cannot be calculated: {reason:text}.")
RHYTHM_CHECK_APPARATUS: Final = message(
    "rhythm_check_apparatus",
    "The angles of motors 1 and 2 do not match any position of the scapula. Teach the motion again.",
)
RUN_NOT_PLAYABLE: Final = message(
    "run_not_playable", "This recording cannot be played with these settings: {reason:text}."
)
CHOOSE_OTHER_SETTINGS: Final = message("choose_other_settings", "Choose other settings.")
SESSION_SIGNED: Final = message("session_signed", "This session is signed and cannot be changed.")
LEARNING_FELL_BACK: Final = message(
    "learning_fell_back",
    "an error grew by more than 10 %: the earlier correction of motor {motors:name} is used again, and it learns half as fast",
)
LEARNING_DISTURBED: Final = message(
    "learning_disturbed",
    "motor {motors:name} was not compared with the previous playback: for too much of the time it was paused, moved back, resisted or at a limit",
)
NOT_LEARNED_NOT_COMPLETED: Final = message(
    "not_learned_not_completed", "nothing was learned: the playback did not reach its end"
)
NOT_LEARNED_OTHER_STATION: Final = message(
    "not_learned_other_station", "nothing was learned: it was played on another station"
)
NOT_LEARNED_NO_FIT: Final = message(
    "not_learned_no_fit", "nothing was learned: the earlier correction does not fit this recording"
)
NO_APPARATUS_ANGLE: Final = message(
    "no_apparatus_angle", "The apparatus is not measuring this angle in this session at present."
)
ENTER_APPARATUS_ANGLE: Final = message("enter_apparatus_angle", "Enter the apparatus angle as well.")
READING_NOT_FOUND: Final = message("reading_not_found", "There is no goniometer reading with this id in this session.")
WRITE_ADDENDUM: Final = message("write_addendum", "Write an addendum.")
RUN_NOT_ENDED: Final = message("run_not_ended", "A playback in this session has not ended.")
END_OR_STOP_FIRST: Final = message("end_or_stop_first", "Wait until the playback has ended, or stop it.")
RUN_NOT_ARRIVED: Final = message("run_not_arrived", "The result of a playback in this session has not arrived yet.")
SIGN_AGAIN_SOON: Final = message("sign_again_soon", "Wait a moment and sign again.")
SESSION_NOT_ENDED: Final = message("session_not_ended", "This session has not ended.")
NOTE_NOT_SIGNED: Final = message("note_not_signed", "This note has not been signed.")
CHANGE_NOTE_ITSELF: Final = message("change_note_itself", "Edit the note instead.")
CHECK_IDENTITY: Final = message("check_identity", "The patient has stated two identifiers that match the record.")
IDENTITY_NOT_CONFIRMED: Final = message(
    "identity_not_confirmed", "The patient's identity has not been confirmed today by two identifiers in this session."
)
BIRTH_DATE_NOT_RECORDED: Final = message("birth_date_not_recorded", "This record has no birth date.")
COMPARE_OTHER_IDENTIFIERS: Final = message("compare_other_identifiers", "Compare name and clinic number.")
TWO_IDENTIFIERS_NEEDED: Final = message("two_identifiers_needed", "Two identifiers are needed to confirm the identity.")
COMPARE_TWO_IDENTIFIERS: Final = message(
    "compare_two_identifiers",
    "Ask the patient to state name, birth date or clinic number, and confirm two that match the record.",
)
CHECK_LEFT_SIDE: Final = message("check_left_side", "The apparatus is set to the left shoulder, and its pin is in.")
CHECK_RIGHT_SIDE: Final = message("check_right_side", "The apparatus is set to the right shoulder, and its pin is in.")
CHECK_BELT: Final = message("check_belt", "The belt holds the patient in the seat.")
CHECK_PEDAL: Final = message("check_pedal", "The foot pedal answers.")
CHECK_ESTOP: Final = message(
    "check_estop", "The emergency stop was pressed and released today, after the apparatus was connected or turned."
)
ESTOP_TESTED: Final = message("estop_tested", "The emergency stop was pressed and released.")
PLAYED_IN_ENDED_SESSION: Final = message(
    "played_in_ended_session", "Played while the database was unavailable; the session had been ended elsewhere."
)
PLAYED_ARCHIVED_RECORDING: Final = message(
    "played_archived_recording",
    "Played while the database was unavailable; the recording had been archived elsewhere.",
)
PLAYED_IN_CLOSED_EPISODE: Final = message(
    "played_in_closed_episode",
    "Played while the database was unavailable; the episode of care had been closed elsewhere.",
)
PLAYED_UNDER_OLD_LIMITS: Final = message(
    "played_under_old_limits",
    "Played while the database was unavailable; the doctor's limits had been changed elsewhere.",
)
BEGUN_BESIDE_ANOTHER: Final = message(
    "begun_beside_another",
    "Started while the database was unavailable; another session of this patient had been started elsewhere.",
)
BEGUN_WITH_OLD_PROGRAMME: Final = message(
    "begun_with_old_programme", "Started while the database was unavailable; the programme had been changed elsewhere."
)
BEGUN_IN_CLOSED_EPISODE: Final = message(
    "begun_in_closed_episode",
    "Started while the database was unavailable; the episode of care had been closed elsewhere.",
)
BEGUN_FOR_ARCHIVED_PATIENT: Final = message(
    "begun_for_archived_patient",
    "Started while the database was unavailable; the patient's record had been archived elsewhere.",
)
BEGUN_FOR_RESTRICTED_PATIENT: Final = message(
    "begun_for_restricted_patient",
    "Started while the database was unavailable; the patient's record had been restricted elsewhere.",
)
ENDED_ALREADY: Final = message(
    "ended_already",
    "Ended while the database was unavailable; the record already had an end of the session, and it was not changed.",
)
PAIN_BEFORE_DIFFERS: Final = message(
    "pain_before_differs",
    "Pain before the session, entered while the database was unavailable: {pain:name}. The session has a different score, entered elsewhere.",
)
WORST_PAIN_DIFFERS: Final = message(
    "worst_pain_differs",
    "Worst pain, entered while the database was unavailable: {pain:name}. The session has a different score, entered elsewhere.",
)
PAIN_AFTER_DIFFERS: Final = message(
    "pain_after_differs",
    "Pain after the session, entered while the database was unavailable: {pain:name}. The session has a different score, entered elsewhere.",
)
DONE_MIRRORED_LEFT: Final = message("done_mirrored_left", "mirrored for the left shoulder")
DONE_MIRRORED_RIGHT: Final = message("done_mirrored_right", "mirrored for the right shoulder")
NO_LICENSED_TEXTS: Final = message(
    "no_licensed_texts", "The clinic has not imported the licensed texts of this questionnaire."
)
IMPORT_LICENSED_TEXTS: Final = message(
    "import_licensed_texts", "An administrator imports them with “kata questionnaires import”."
)
QUESTIONNAIRE_FINISHED: Final = message("questionnaire_finished", "This questionnaire is finished already.")
GIVE_TABLET_BACK: Final = message("give_tablet_back", "Please give the tablet back.")
ANSWERS_DO_NOT_FIT: Final = message("answers_do_not_fit", "The answers do not match the questions.")
RELOAD_QUESTIONNAIRE: Final = message("reload_questionnaire", "Reload the page.")
NO_PATIENT_MODE: Final = message("no_patient_mode", "No questionnaire is open on this browser.")
FIGURE_NO: Final = message("figure_no", "no")
FIGURE_NAMED_ANGLE_HOVER: Final = message("figure_named_angle_hover", "%{{customdata}}: %{{y:.2f}}°")
FIGURE_REFERENCE: Final = message("figure_reference", "Reference")
FIGURE_BASELINE: Final = message("figure_baseline", "Baseline")
FIGURE_POINTS_CHANGED: Final = message("figure_points_changed", "{points:text} points")
FIGURE_PAIN_AT_ASSESSMENTS: Final = message("figure_pain_at_assessments", "At assessments, 0 to 10")
FIGURE_PAIN_AROUND_SESSIONS: Final = message("figure_pain_around_sessions", "Around sessions, 0 to 10")
FIGURE_PAIN_AVERAGE_SHORT: Final = message("figure_pain_average_short", "Past week")
FIGURE_PAIN_BEFORE_SHORT: Final = message("figure_pain_before_short", "Before")
FIGURE_PAIN_DURING_SHORT: Final = message("figure_pain_during_short", "During")
FIGURE_PAIN_AFTER_SHORT: Final = message("figure_pain_after_short", "After")
FIGURE_BASELINE_OF: Final = message("figure_baseline_of", "Baseline, {kind:text}")
FIGURE_OTHER_SIDE_OF: Final = message("figure_other_side_of", "Other side, {kind:text}")
FIGURE_KIND_ACTIVE: Final = message("figure_kind_active", "active")
FIGURE_KIND_PASSIVE: Final = message("figure_kind_passive", "passive")
FIGURE_ACTIVE: Final = message("figure_active", "Active")
FIGURE_PASSIVE: Final = message("figure_passive", "Passive")
FIGURE_MEASURE_DEG: Final = message("figure_measure_deg", "{measure:text}, °")
FIGURE_PAIN: Final = message("figure_pain", "Pain")
FIGURE_OF_10: Final = message("figure_of_10", "{score:text}, 0 to 10")
FIGURE_OF_100: Final = message("figure_of_100", "{score:text}, 0 to 100")
FIGURE_SPADI: Final = message("figure_spadi", "SPADI")
FIGURE_DISABILITY: Final = message("figure_disability", "Disability")
FIGURE_SPADI_SCALE: Final = message("figure_spadi_scale", "SPADI, 0 (none) to 100 (worst)")
FIGURE_BETTER_PERHAPS: Final = message(
    "figure_better_perhaps", "{points:g} points better: MCID reached, possibly measurement error"
)
FIGURE_BETTER_IMPORTANT: Final = message(
    "figure_better_important", "Over {points:g} points better: beyond measurement error"
)
FIGURE_TOTAL: Final = message("figure_total", "Total")
FIGURE_TOTAL_POINTS: Final = message("figure_total_points", "Total, points")
FIGURE_QUESTIONNAIRE: Final = message("figure_questionnaire", "Questionnaire")
FIGURE_LOWER_IS_BETTER: Final = message("figure_lower_is_better", "{lowest:g} to {highest:g} points, lower is better")
FIGURE_HIGHER_IS_BETTER: Final = message(
    "figure_higher_is_better", "{lowest:g} to {highest:g} points, higher is better"
)
FIGURE_PERHAPS_FROM_HERE: Final = message(
    "figure_perhaps_from_here", "From here on the MCID is reached, possibly measurement error"
)
FIGURE_IMPORTANT_BEYOND: Final = message("figure_important_beyond", "Beyond this line more than measurement error")
FIGURE_IMPORTANT_NOTE: Final = message(
    "figure_important_note", "Patients call a change of {least_points:g} points important (MCID)."
)
FIGURE_IMPORTANT_RANGE_NOTE: Final = message(
    "figure_important_range_note",
    "Patients call a change of {least_points:g} to {most_points:g} points important (MCID).",
)
FIGURE_DETECTABLE_NOTE: Final = message(
    "figure_detectable_note", "A change of {detectable_points:g} points or less may be measurement error (SDC)."
)
FIGURE_T_SCORE_NOTE: Final = message(
    "figure_t_score_note",
    "A T-score: 50 points are the mean of the reference population, 10 points its standard deviation.",
)
FIGURE_MEAN_RMSE: Final = message("figure_mean_rmse", "Mean RMSE, °")
FIGURE_LARGEST_ERROR: Final = message("figure_largest_error", "Largest error, °")
FIGURE_CORRECTION: Final = message("figure_correction", "Learned correction (RMS), °")
FIGURE_WEEK: Final = message("figure_week", "Week")
FIGURE_WEEK_FROM: Final = message("figure_week_from", "Week from")
FIGURE_WEEK_HOVER: Final = message("figure_week_hover", "Week from %{{x|%d %b %Y}}: %{{y}}")
FIGURE_DAY_FORMAT: Final = message("figure_day_format", "%d %b")
FIGURE_SESSIONS: Final = message("figure_sessions", "Sessions")
FIGURE_AS_PRESCRIBED: Final = message("figure_as_prescribed", "As prescribed")
FIGURE_PAIN_AT_REST: Final = message("figure_pain_at_rest", "At rest")
FIGURE_PAIN_MOVING: Final = message("figure_pain_moving", "On active movement")
FIGURE_PAIN_MOVED: Final = message("figure_pain_moved", "On passive movement")
FIGURE_PAIN_AVERAGE: Final = message("figure_pain_average", "Average over the last week")
FIGURE_PAIN_BEFORE: Final = message("figure_pain_before", "Before the session")
FIGURE_PAIN_DURING: Final = message("figure_pain_during", "During the session")
FIGURE_PAIN_AFTER: Final = message("figure_pain_after", "After the session")
FIGURE_MOTION: Final = message("figure_motion", "Motion")
FIGURE_KIND: Final = message("figure_kind", "Kind")
FIGURE_ASSESSED: Final = message("figure_assessed", "Assessed")
FIGURE_CHANGE_DEG: Final = message("figure_change_deg", "Change from baseline, °")
FIGURE_OTHER_SIDE_DEG: Final = message("figure_other_side_deg", "Other side (newest), °")
FIGURE_REFERENCE_DEG: Final = message("figure_reference_deg", "Reference, °")
FIGURE_WHEN: Final = message("figure_when", "When")
FIGURE_CHANGE_POINTS: Final = message("figure_change_points", "Change from baseline, points")
FIGURE_IMPORTANT_CHANGE: Final = message("figure_important_change", "Change of at least the MCID")
FIGURE_SESSION: Final = message("figure_session", "Session")
FIGURE_RECORDING: Final = message("figure_recording", "Recording")
FIGURE_METHOD: Final = message("figure_method", "Method")
FIGURE_PLAYBACKS: Final = message("figure_playbacks", "Playbacks")
FIGURE_REPETITIONS_PLANNED: Final = message("figure_repetitions_planned", "Repetitions planned")
FIGURE_REPETITIONS_DONE: Final = message("figure_repetitions_done", "Repetitions done")
FIGURE_SMOOTH: Final = message("figure_smooth", "smooth")
FIGURE_LEARNED: Final = message("figure_learned", "learned")
FIGURE_PAPER: Final = message("figure_paper", "paper")
FIGURE_BETTER: Final = message("figure_better", "better")
FIGURE_WORSE: Final = message("figure_worse", "worse")
FIGURE_PERHAPS_BETTER: Final = message("figure_perhaps_better", "possibly better")
FIGURE_PERHAPS_WORSE: Final = message("figure_perhaps_worse", "possibly worse")
FIGURE_RECORDING_SMOOTH: Final = message("figure_recording_smooth", "{recording:name}, smooth")
FIGURE_RECORDING_LEARNED: Final = message("figure_recording_learned", "{recording:name}, learned")
FIGURE_RECORDING_PAPER: Final = message("figure_recording_paper", "{recording:name}, paper")
ROM_FLEXION: Final = message("rom_flexion", "Flexion")
ROM_EXTENSION: Final = message("rom_extension", "Extension")
ROM_ABDUCTION: Final = message("rom_abduction", "Abduction")
ROM_ADDUCTION: Final = message("rom_adduction", "Adduction")
ROM_EXTERNAL_ROTATION_1: Final = message("rom_external_rotation_1", "External rotation, arm at the side")
ROM_INTERNAL_ROTATION_1: Final = message("rom_internal_rotation_1", "Internal rotation, arm at the side")
ROM_EXTERNAL_ROTATION_2: Final = message("rom_external_rotation_2", "External rotation, arm abducted 90°")
ROM_INTERNAL_ROTATION_2: Final = message("rom_internal_rotation_2", "Internal rotation, arm abducted 90°")
ROM_EXTERNAL_ROTATION_3: Final = message("rom_external_rotation_3", "External rotation, arm flexed 90°")
ROM_INTERNAL_ROTATION_3: Final = message("rom_internal_rotation_3", "Internal rotation, arm flexed 90°")
ROM_HORIZONTAL_FLEXION: Final = message("rom_horizontal_flexion", "Horizontal flexion")
ROM_HORIZONTAL_EXTENSION: Final = message("rom_horizontal_extension", "Horizontal extension")
ROM_SCAPULAR_FLEXION: Final = message("rom_scapular_flexion", "Scapular flexion")
ROM_SCAPULAR_EXTENSION: Final = message("rom_scapular_extension", "Scapular extension")
ROM_SCAPULAR_ELEVATION: Final = message("rom_scapular_elevation", "Scapular elevation")
ROM_SCAPULAR_DEPRESSION: Final = message("rom_scapular_depression", "Scapular depression")
CHOOSE_OTHER_SETTINGS_OR_RECORDING: Final = message(
    "choose_other_settings_or_recording", "Choose other settings, or another recording."
)
EPISODE_NOT_FOUND: Final = message("episode_not_found", "There is no such episode.")
ASSESSMENT_NOT_FOUND: Final = message("assessment_not_found", "There is no such assessment.")
STAGE_NOT_FOUND: Final = message("stage_not_found", "There is no such stage.")
PATIENT_NOT_FOUND: Final = message("patient_not_found", "There is no such patient.")
RECORDING_NOT_FOUND: Final = message("recording_not_found", "There is no such recording.")
SESSION_NOT_FOUND: Final = message("session_not_found", "There is no such session.")
PROGRAMME_NOT_FOUND: Final = message("programme_not_found", "There is no such programme.")
EPISODE_OF_PATIENT_NOT_FOUND: Final = message("episode_of_patient_not_found", "This patient has no such episode.")
BREAK_GLASS_ACCESS_NOT_FOUND: Final = message("emergency_access_not_found", "There is no such emergency access.")
RUN_NOT_FOUND: Final = message("run_not_found", "There is no such playback.")
STATION_NOT_FOUND: Final = message("station_not_found", "There is no such station.")
CHECK_FIXTURES: Final = message("check_fixtures", "The arm lies in {fixtures:text}, and all fixtures are closed.")
FIXTURES_AND: Final = message("fixtures_and", "{first:text} and {second:text}")
FIXTURE_ARM_FIXER_1: Final = message("fixture_arm_fixer_1", "arm fixer 1")
FIXTURE_ARM_FIXER_2: Final = message("fixture_arm_fixer_2", "arm fixer 2")
FIXTURE_ELBOW_FIXER_1: Final = message("fixture_elbow_fixer_1", "elbow fixer 1")
FIXTURE_ELBOW_FIXER_2: Final = message("fixture_elbow_fixer_2", "elbow fixer 2")
FIGURE_MEASURED_ANGLE_HOVER: Final = message("figure_measured_angle_hover", "%{{customdata}}: %{{y:.1~f}}°")
FIGURE_ANGLE_LEVEL_HOVER: Final = message("figure_angle_level_hover", "%{{y:.1~f}}°")
FIGURE_PAIN_HOVER: Final = message("figure_pain_hover", "%{{customdata}}: %{{y}} of 10")
FIGURE_POINTS_HOVER: Final = message("figure_points_hover", "%{{customdata}}: %{{y:.1~f}} points")
FIGURE_POINTS_LEVEL_HOVER: Final = message("figure_points_level_hover", "%{{y:.1~f}} points")

CONTRAINDICATION_FRACTURE: Final = message("contraindication_fracture", "Fracture that has not united")
CONTRAINDICATION_DISLOCATION: Final = message("contraindication_dislocation", "Dislocation, unreduced or recent")
CONTRAINDICATION_INFECTION: Final = message(
    "contraindication_infection", "Infection or acute inflammation of joint or arm"
)
CONTRAINDICATION_TUMOUR: Final = message("contraindication_tumour", "Tumour of shoulder or arm")
CONTRAINDICATION_THROMBOSIS: Final = message("contraindication_thrombosis", "Thrombosis of the arm")
CONTRAINDICATION_RECENT_REPAIR: Final = message(
    "contraindication_recent_repair", "Recent repair of tendon, ligament or capsule"
)
CONTRAINDICATION_JOINT_REPLACEMENT: Final = message(
    "contraindication_joint_replacement", "Joint replacement of the shoulder"
)
CONTRAINDICATION_NERVE_INJURY: Final = message("contraindication_nerve_injury", "Nerve injury of the arm")
CONTRAINDICATION_CRPS: Final = message("contraindication_crps", "Complex regional pain syndrome (CRPS)")
CONTRAINDICATION_OSTEOPOROSIS: Final = message("contraindication_osteoporosis", "Osteoporosis")
CONTRAINDICATION_HYPERMOBILITY: Final = message("contraindication_hypermobility", "Hypermobility or instability")
CONTRAINDICATION_ANTICOAGULATION: Final = message("contraindication_anticoagulation", "Anticoagulation")
CONTRAINDICATION_PACEMAKER: Final = message("contraindication_pacemaker", "Pacemaker or other active implant")
CONTRAINDICATION_PREGNANCY: Final = message("contraindication_pregnancy", "Pregnancy")
CONTRAINDICATION_OTHER: Final = message("contraindication_other", "Other contraindication")
SOURCE_KISNER: Final = message(
    "source_kisner",
    "Kisner and Colby, Therapeutic Exercise, 2012",
)
SOURCE_ASSET: Final = message(
    "source_asset",
    "Thigpen et al., J Shoulder Elbow Surg 2016; 25: 521-535",
)
SOURCE_CLINIC: Final = message(
    "source_clinic",
    "The clinic's decision: no publication says so for this apparatus",
)
SOURCE_STAGE: Final = message(
    "source_stage",
    "Kelley et al., JOSPT 2013; 43(5): A1-A31 and Diercks and Stevens, JSES 2004; 13: 499-502: the more pain, the gentler the treatment. The numbers are the clinic's decision.",
)
MOTION_CONTRAINDICATED: Final = message(
    "motion_contraindicated",
    "Teaching and playback are not allowed with this condition: {conditions:texts}.",
)
RESOLVE_CONTRAINDICATION: Final = message(
    "resolve_contraindication",
    "When it no longer applies, resolve it on the patient's page.",
)
SIGN_OFF_NEEDED: Final = message(
    "sign_off_needed",
    "A doctor's permission is missing: {conditions:texts}.",
)
ASK_DOCTOR_TO_SIGN_OFF: Final = message(
    "ask_doctor_to_sign_off",
    "Ask the doctor, and record the permission on the patient's page.",
)
CONTRAINDICATION_RECORDED: Final = message(
    "contraindication_recorded",
    "This contraindication is recorded already.",
)
CHECK_LIST_OF_CONTRAINDICATIONS: Final = message(
    "check_list_of_contraindications",
    "Reload the list of contraindications.",
)
NO_SIGN_OFF_FOR_THIS: Final = message(
    "no_sign_off_for_this",
    "A doctor's permission is not needed for this contraindication, or it is not sufficient.",
)
SIGNED_OFF_ALREADY: Final = message(
    "signed_off_already",
    "{doctor:name} has already allowed the treatment with this contraindication.",
)
RESOLVE_AND_RECORD_AGAIN: Final = message(
    "resolve_and_record_again",
    "To record another doctor's decision, resolve this entry with the reason and record it again.",
)
CONTRAINDICATION_NOT_FOUND: Final = message(
    "contraindication_not_found",
    "This contraindication does not exist.",
)
CONTRAINDICATION_RESOLVED: Final = message(
    "contraindication_resolved",
    "This contraindication has been resolved already.",
)
PLAYED_CONTRAINDICATED: Final = message(
    "played_contraindicated",
    "Played while the database was unavailable; a contraindication had been recorded elsewhere.",
)
TIME_ZONE_UNKNOWN: Final = message("time_zone_unknown", "This time zone does not exist.")
CHOOSE_TIME_ZONE: Final = message("choose_time_zone", "Choose a time zone from the list, such as Asia/Tokyo.")
END_FEEL_NOT_FOUND: Final = message("end_feel_not_found", "There is no end-feel test with this id.")
END_FEEL_TOO_SHORT: Final = message(
    "end_feel_too_short",
    "This recording moves no motor of the shoulder joint by {least_deg:.0f}°, so its end-feel cannot be measured.",
)
CHOOSE_WIDER_MOTION: Final = message(
    "choose_wider_motion", "Choose a recording of motion 3, 4, 5 or 6 with more range."
)
STRETCH_ANGLE_TOO_SMALL: Final = message(
    "stretch_angle_too_small",
    "The arm is weighed before it is stretched: motor {motor:d} must be allowed to reach {least_deg:.0f}°.",
)
CHOOSE_LARGER_ANGLE: Final = message("choose_larger_angle", "Choose a larger angle.")
NO_BASELINE_TODAY: Final = message(
    "no_baseline_today", "There is no baseline of this motion at this station and speed from today."
)
MEASURE_BASELINE_FIRST: Final = message(
    "measure_baseline_first", "Take the patient's arm out, put the test weight in, and measure the baseline."
)
FIGURE_THIS_TEST: Final = message("figure_this_test", "This test, mean of both ways")
FIGURE_WAY_OUT: Final = message("figure_way_out", "Way out")
FIGURE_WAY_BACK: Final = message("figure_way_back", "Way back")
FIGURE_EARLIER_TEST: Final = message("figure_earlier_test", "Earlier test, {day:name}")
FIGURE_OTHER_SIDE: Final = message("figure_other_side", "Other side")
FIGURE_APPARATUS_ANGLE: Final = message("figure_apparatus_angle", "Apparatus angle, °")
FIGURE_SHOULDER_TORQUE: Final = message("figure_shoulder_torque", "Torque between apparatus and shoulder, Nm")
FIGURE_TORQUE_HOVER: Final = message("figure_torque_hover", "%{{x:.1f}}°: %{{y:.2f}} Nm")
END_FEEL_NO_CURVE: Final = message("end_feel_no_curve", "This test has no curve.")
MEASURE_AGAIN: Final = message("measure_again", "Measure again.")
FIGURE_END_FEEL_LINE: Final = message("figure_end_feel_line", "{motion:text}, {side:text}, {torque_nm:.1f} Nm")
FIGURE_SIDE: Final = message("figure_side", "Side")
FIGURE_CHOSEN_TORQUE: Final = message("figure_chosen_torque", "Chosen torque, Nm")
FIGURE_END_FEEL_RANGE: Final = message("figure_end_feel_range", "Range at 60 % of the torque, °")
FIGURE_END_FEEL_INTERVAL: Final = message("figure_end_feel_interval", "95 % interval, ± °")
FIGURE_END_FEEL_ONSET: Final = message("figure_end_feel_onset", "Onset at 25 % of the torque, °")
FIGURE_END_FEEL_STIFFNESS: Final = message("figure_end_feel_stiffness", "Stiffness, Nm/°")
FIGURE_END_RANGE: Final = message("figure_end_range", "End-range time, min")
FIGURE_END_RANGE_SO_FAR: Final = message("figure_end_range_so_far", "Week so far, min")
FIGURE_END_RANGE_IN_WEEK: Final = message("figure_end_range_in_week", "End-range time in each week, min")
FIGURE_GAIN_OF_RANGE: Final = message("figure_gain_of_range", "Gain of passive range, °")
FIGURE_MINUTES_HOVER: Final = message("figure_minutes_hover", "%{{y:.1f}} min")
