"""Messages about motions: reasons against playing or editing one, and descriptions of edits. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import Text, message

LINE_AND_COLUMN: Final = message("line_and_column", "line {line:d}, column {column:text}")
COLUMN_AFTER: Final = message("column_after", "after {column:name}")
TWO_COLUMNS: Final = message("two_columns", "{first:name} and {second:name}")
COLUMN_AT_LINE: Final = message("column_at_line", "line {line:d}, column {column:text}: {problem:text}")
COLUMN_MISSING_WITH_OTHERS: Final = message(
    "column_missing_with_others", "line {line:d}, column {column:text}: {problem:text} (missing: {missing:name})"
)
COLUMNS_MISSING: Final = message(
    "columns_missing", "the first line must name the columns {columns:name}; missing: {missing:name}"
)
CELL_WITHOUT_COLUMN: Final = message(
    "cell_without_column", "{cell:name} is in a column without a name in the first line"
)
CELL_NOT_NUMBER: Final = message("cell_not_number", "{cell:name} is not a number")
TIME_MUST_INCREASE: Final = message(
    "time_must_increase", "the time must increase, but {time_s:g} s follows {before_s:g} s"
)
ANGLE_OUT_OF_APPARATUS: Final = message(
    "angle_out_of_apparatus",
    "{angle_deg:g}° is outside the apparatus' range of {lowest_deg:g} to {highest_deg:g}°",
)
FILE_UNREADABLE: Final = message("file_unreadable", "{file:name}: {error:name}")
FILE_NOT_TEXT: Final = message("file_not_text", "{file:name} is not a text file")
SIDE_LEFT: Final = message("side_left", "left")
SIDE_RIGHT: Final = message("side_right", "right")
COLUMN_UNIT_WRONG: Final = message("column_unit_wrong", "the unit is wrong; the column must be called {column:name}")
MOTOR_OVERLOADED: Final = message(
    "motor_overloaded",
    "motor {motor:d} would need {torque_nm:.1f} Nm at {at_s:.1f} s; its limit is {limit_nm:.1f} Nm",
)
COLUMN_TWICE: Final = message("column_twice", "this column appears twice")
COLUMN_MISSING: Final = message("column_missing", "this column is missing")
CSV_UNREADABLE: Final = message("csv_unreadable", "line {line:d} cannot be read as CSV: {error:name}")
TRIM_TOO_SHORT: Final = message(
    "trim_too_short",
    "the part from {start_s:g} s to {end_s:g} s must last at least {least_s:g} s and lie within the motion's {duration_s:.1f} s",
)
LESS_THAN_RANGE: Final = message(
    "less_than_range", "the range cannot be reduced by {deg:g}°: the motion covers only {reach_deg:.1f}°"
)
NO_MOTOR_LEFT: Final = message("no_motor_left", "at least one of motors {first:d} to {last:d} must move")
HOLD_OUTSIDE_MOTION: Final = message(
    "hold_outside_motion", "a hold of {hold_s:g} s at {at_s:g} s is not allowed; the motion lasts {duration_s:.1f} s"
)
REPETITIONS_REFUSED: Final = message(
    "repetitions_refused", "{repetitions:d} repetitions with a pause of {pause_s:g} s are not allowed"
)
REPETITIONS_TOO_LONG: Final = message(
    "repetitions_too_long",
    "{repetitions:d} repetitions of {duration_s:.0f} s with a pause of {pause_s:g} s last longer than an hour",
)
WARM_UP_REFUSED: Final = message(
    "warm_up_refused", "a warm-up by {step_deg:g}° per repetition with a pause of {pause_s:g} s is not allowed"
)
STRETCH_REFUSED: Final = message(
    "stretch_refused",
    "a stretch by {further_deg:g}° from {back_deg:g}° before the end, held for {hold_s:g} s, is not allowed",
)
STRETCH_BEYOND_RANGE: Final = message(
    "stretch_beyond_range", "motor {motor:d} moves by less than {back_deg:g}° before the end of its range"
)
RETOUCH_MARKS_REFUSED: Final = message(
    "retouch_marks_refused",
    "the part from {start_s:g} s to {end_s:g} s must last at least {least_s:g} s and lie within the motion's {duration_s:.1f} s",
)
RETOUCH_POINTS_TOO_CLOSE: Final = message(
    "retouch_points_too_close",
    "the points or marks of motor {motor:d} at {first_s:.1f} s and {second_s:.1f} s must be at least {least_s:g} s apart, and each point "
    "must be between the marks",
)
GUIDED_NOT_RAISED: Final = message(
    "guided_not_raised", "the arm is not raised or lowered by at least {least_deg:g}°, so it has no rhythm"
)
GUIDED_OTHER_PLANE: Final = message(
    "guided_other_plane", "none of the newest recordings of the unaffected side raises the arm in this plane"
)
GUIDED_TOO_HIGH: Final = message(
    "guided_too_high",
    "the arm is raised to {highest_deg:.0f}°, but only to {sound_deg:.0f}° in the unaffected side's recording {recording:name}",
)
RETAUGHT_MARKS_REFUSED: Final = message(
    "retaught_marks_refused",
    "the replaced part from {start_s:g} s to {end_s:g} s must last at least {least_s:g} s and lie within the motion's {duration_s:.1f} s",
)
RETAUGHT_TOO_FAR: Final = message(
    "retaught_too_far",
    "motor {motor:d} of the new part is {distance_deg:.0f}° from the mark at {at_s:.1f} s; at most {most_deg:g}° can be blended",
)
RANGE_PERCENT_REFUSED: Final = message(
    "range_percent_refused", "{percent:g} % of the range is not allowed; it must be {lowest:g} to {highest:g} %"
)
SPEED_PERCENT_REFUSED: Final = message(
    "speed_percent_refused", "{percent:g} % of the speed is not allowed; it must be {lowest:g} to {highest:g} %"
)
SCAPULA_UNREACHABLE: Final = message(
    "scapula_unreachable",
    "motor {motor:d} cannot reach scapular abduction {abduction_deg:.1f}° with upward rotation {rotation_deg:.1f}°",
)
NO_SCAPULA_POSITION: Final = message(
    "no_scapula_position",
    "no position of the scapula matches motor 1 at {angle_1_deg:.1f}° and motor 2 at {angle_2_deg:.1f}°",
)
MOTION_TOO_SHORT: Final = message(
    "motion_too_short", "the motion is too short: at least {least_s:g} s and two rows are needed"
)
SAMPLES_TOO_FEW: Final = message("samples_too_few", "a recording needs at least two samples of five angles each")
SAMPLES_NOT_NUMBERS: Final = message("samples_not_numbers", "the recording contains values that are not numbers")
TIME_NOT_INCREASING: Final = message("time_not_increasing", "the recording's time does not increase")
SAMPLES_TOO_CLOSE: Final = message("samples_too_close", "two samples are closer together than {shortest_ms:g} ms")
SAMPLES_MISSING: Final = message("samples_missing", "samples are missing for {gap_s:.1f} s after {at_s:.1f} s")
RECORDING_TOO_SHORT: Final = message(
    "recording_too_short", "it lasts {duration_s:g} s; it must last at least {least_s:g} s"
)
ANGLE_IMPLAUSIBLE: Final = message(
    "angle_implausible",
    "motor {motor:d} would go to {angle_deg:.3g}°; no motor goes beyond {largest_deg:g}°",
)
MOTOR_OUT_OF_RANGE: Final = message(
    "motor_out_of_range",
    "motor {motor:d} would go to {angle_deg:.1f}° at {at_s:.1f} s; its range is {lowest_deg:g} to {highest_deg:g}°",
)
POSE_OUT_OF_REACH: Final = message(
    "pose_out_of_reach",
    "motor {motor:d} would go to {angle_deg:.1f}° at {at_s:.1f} s; in this pose the {quantity:text} would be {value_deg:.1f}°, and its "
    "limit is {limit_deg:.1f}°",
)
SCAPULA_ABDUCTION: Final = message("scapula_abduction", "abduction of the scapula")
SCAPULA_ROTATION: Final = message("scapula_rotation", "upward rotation of the scapula")
BALL_JOINT_SWING: Final = message("ball_joint_swing", "swing of a ball joint")
ELEVATION_OF_ARM: Final = message("elevation_of_arm", "elevation of the upper arm")
PLANE_OF_ELEVATION: Final = message("plane_of_elevation", "plane of elevation")
FLEXION_OF_MOTOR_4: Final = message("flexion_of_motor_4", "angle of motor 4")
MOTOR_TOO_FAST: Final = message(
    "motor_too_fast",
    "motor {motor:d} would move at {speed_deg_s:.0f}°/s at {at_s:.1f} s; its limit is {limit_deg_s:g}°/s",
)
MOTOR_WOULD_JERK: Final = message("motor_would_jerk", "motor {motor:d} would jerk at {at_s:.1f} s")
WOULD_LAST_TOO_LONG: Final = message(
    "would_last_too_long", "it would last {minutes:.0f} minutes; the maximum is one hour"
)
DONE_TRIMMED: Final = message("done_trimmed", "trimmed to {start_s:.1f} s to {end_s:.1f} s")
DONE_SPEED: Final = message("done_speed", "at {percent:g} % speed")
DONE_RANGE: Final = message("done_range", "{percent:.3g} % of the range")
DONE_RANGE_OF_MOTOR: Final = message("done_range_of_motor", "{percent:.3g} % of the range of motor {motor:d}")
DONE_RANGE_OF_MOTORS: Final = message("done_range_of_motors", "{percent:.3g} % of the range of motors {motors:name}")
DONE_ISOLATED_MOTOR: Final = message("done_isolated_motor", "motor {motor:d} only")
DONE_ISOLATED_MOTORS: Final = message("done_isolated_motors", "motors {motors:name} only")
DONE_HELD: Final = message("done_held", "held for {hold_s:g} s at {at_s:.1f} s")
DONE_REPETITIONS: Final = message("done_repetitions", "{repetitions:d} repetitions")
DONE_REPETITIONS_WITH_PAUSE: Final = message(
    "done_repetitions_with_pause", "{repetitions:d} repetitions with a pause of {pause_s:g} s at each end"
)
DONE_WARM_UP: Final = message("done_warm_up", "warm-up from {less_deg:g}° less, {step_deg:g}° more per repetition")
DONE_STRETCHED: Final = message(
    "done_stretched",
    "stretched {further_deg:g}° beyond the end of motor {motor:d}'s range, from {back_deg:g}° before it",
)
DONE_RETOUCHED_MOTOR: Final = message(
    "done_retouched_motor",
    "motor {motor:d} changed by up to {change_deg:.1f}° between {start_s:.1f} s and {end_s:.1f} s",
)
DONE_RETOUCHED_MOTORS: Final = message(
    "done_retouched_motors",
    "motors {motors:name} changed by up to {change_deg:.1f}° between {start_s:.1f} s and {end_s:.1f} s",
)
DONE_GUIDED: Final = message("done_guided", "scapula guided by the unaffected side, {recording:name}")
DONE_RETAUGHT: Final = message("done_retaught", "{start_s:.1f} s to {end_s:.1f} s taught again, {recording:name}")
MOTION_1: Final = message("motion_1", "Abduction / adduction of the scapula")
MOTION_2: Final = message("motion_2", "Upward / downward rotation of the scapula")
MOTION_3: Final = message("motion_3", "Horizontal flexion / extension of the shoulder")
MOTION_4: Final = message("motion_4", "Abduction / adduction of the shoulder")
MOTION_5: Final = message("motion_5", "Flexion / extension of the shoulder")
MOTION_6: Final = message("motion_6", "External / internal rotation of the shoulder")
MOTION_7: Final = message("motion_7", "Arbitrary motion")
BUILTIN_MOTION: Final = message("builtin_motion", "{number:d} {motion:text}")

SIDES: Final[dict[str, Text]] = {"left": SIDE_LEFT(), "right": SIDE_RIGHT()}
"""Names of the sides within a sentence."""
