"""Messages of figures. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

RUN_SAMPLES_DAMAGED: Final = message("run_samples_damaged", "The samples are damaged and cannot be read.")
RESTORE_FROM_BACKUP: Final = message("restore_from_backup", "Restore them from a backup.")
FIGURE_BEFORE: Final = message("figure_before", "Before")
FIGURE_AFTER: Final = message("figure_after", "After")
FIGURE_REQUESTED: Final = message("figure_requested", "Requested")
FIGURE_PLAYBACK: Final = message("figure_playback", "Playback")
FIGURE_ERROR: Final = message("figure_error", "Error")
FIGURE_TIME: Final = message("figure_time", "Time, s")
FIGURE_TIME_PATH: Final = message("figure_time_path", "Time within the motion, s")
FIGURE_TIME_WALL: Final = message("figure_time_wall", "Real time, s")
FIGURE_ERROR_DEG: Final = message("figure_error_deg", "Error, °")
FIGURE_MOTOR: Final = message("figure_motor", "Motor {motor:d}")
FIGURE_MOTOR_DEG: Final = message("figure_motor_deg", "Motor {motor:d}, °")
FIGURE_ANGLE_HOVER: Final = message("figure_angle_hover", "%{{y:.2f}}°")
FIGURE_ANGLE: Final = message("figure_angle", "Angle, °")
