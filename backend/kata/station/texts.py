"""Messages about operating a station. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

OPERATED_ELSEWHERE: Final = message(
    "operated_elsewhere", "{operator:name} operates the apparatus from another browser."
)
WATCH_OR_TAKE_OVER: Final = message(
    "watch_or_take_over",
    "You can watch, ask {operator:name} to stop operating, or take over. Stop works from here too.",
)
OPERATOR_NEEDED: Final = message("operator_needed", "The motors move or hold the arm: the apparatus needs an operator.")
OPERATOR_NEEDED_UNKNOWN: Final = message(
    "operator_needed_unknown", "It is unknown whether the motors hold the arm: the apparatus needs an operator."
)
CHECK_ARM_OR_HAND_OVER: Final = message(
    "check_arm_or_hand_over", "Check the arm and the connection to the apparatus, or let another user take over."
)
MOVE_BACK_OR_HAND_OVER: Final = message(
    "move_back_or_hand_over", "First move the arm back or stop, or let another user take over."
)
MAY_HOLD_ARM: Final = message("may_hold_arm", "The motors hold an arm, or may be holding one.")
SUPPORT_UNTIL_TORQUE_OFF: Final = message(
    "support_until_torque_off", "Support the arm, and wait until the apparatus shows that its torque is off."
)
COMMAND_OUTDATED: Final = message(
    "command_outdated", "The command arrived more than 2 s after the page had shown the state of the apparatus."
)
LOOK_AND_TRY_AGAIN: Final = message("look_and_try_again", "Check the apparatus and the page, then try again.")
COMMAND_IN_FUTURE: Final = message("command_in_future", "The command refers to a future state of the apparatus.")
RELOAD_AND_TRY_AGAIN: Final = message("reload_and_try_again", "Reload the page, then try again.")
TURN_ONLY_WHEN_IDLE: Final = message(
    "turn_only_when_idle", "The apparatus can be set up for the other side only while it is idle."
)
END_OR_ACKNOWLEDGE_FIRST: Final = message(
    "end_or_acknowledge_first", "End teaching or playback, or acknowledge the stop, before you do this."
)
DEVICE_OFFLINE: Final = message("device_offline", "The apparatus' control program is not running.")
WAIT_FOR_RESTART: Final = message("wait_for_restart", "It restarts automatically; wait a moment.")
NO_ANSWER: Final = message("no_answer", "The apparatus' control program did not answer.")
LOOK_BEFORE_TRYING_AGAIN: Final = message(
    "look_before_trying_again",
    "Check the apparatus before you try again: the command may already have been carried out.",
)
COMMISSIONING_RUNS: Final = message("commissioning_runs", "The station is being commissioned.")
WAIT_FOR_COMMISSIONING: Final = message(
    "wait_for_commissioning", "No patient can be treated here until the commissioning has ended."
)
FILE_NOT_WRITTEN: Final = message("file_not_written", "The station's file cannot be written: {error:name}.")
FREE_SPACE_OR_ASK: Final = message(
    "free_space_or_ask", "Free space on the disk of this computer, or ask the administrator, then try again."
)
