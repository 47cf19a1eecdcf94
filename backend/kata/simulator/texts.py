"""Messages of the simulated apparatus. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

TURN_WHILE_MOTORS_HOLD: Final = message(
    "turn_while_motors_hold", "the motors hold the arm; the apparatus can be turned only while torque is off"
)
HAND_STILL_GUIDING: Final = message("hand_still_guiding", "the hand is still guiding the arm")
GUIDE_WHILE_MOTORS_HOLD: Final = message(
    "guide_while_motors_hold", "the motors hold the arm; the hand can guide it only while torque is off"
)
MOTION_NEEDS_ROWS: Final = message("motion_needs_rows", "a motion needs at least two rows")
SIMULATOR_GAVE_NO_REASON: Final = message("simulator_gave_no_reason", "the simulator gave no reason")
MOTION_NEEDS_FIVE_ANGLES: Final = message("motion_needs_five_angles", "a motion needs five angles for each time")
MOTION_NEEDS_INCREASING_TIME: Final = message("motion_needs_increasing_time", "the time of a motion must increase")
COUNTED_FROM: Final = message("counted_from", "{reason:text} (row {row:d}, counted from the row at {first_s:g} s)")
