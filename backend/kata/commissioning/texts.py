"""Messages of commissioning: steps, instructions to the technician, and faults. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

# -- steps: title, and what the step does -------------------------------------------------------------------------------

STEP_IDS: Final = message("step_ids", "Find the drives and give them their ids")
STEP_IDS_DOES: Final = message(
    "step_ids_does",
    "Kata searches at every baud rate and id. Each drive is connected alone; Kata writes its id and its baud rate and reads both back.",
)
STEP_REGISTERS: Final = message("step_registers", "Write and check the registers")
STEP_REGISTERS_DOES: Final = message(
    "step_registers_does",
    "Kata checks model, firmware, supply voltage, temperature and the bus, writes every configured register, and reads it back.",
)
STEP_INPUTS: Final = message("step_inputs", "Check emergency stop and pedal")
STEP_INPUTS_DOES: Final = message(
    "step_inputs_does",
    "Kata watches both contacts of the emergency stop while it is pressed, released and unplugged, and the pedal. No motor has torque.",
)
STEP_AXES: Final = message("step_axes", "Find motor and direction of each axis")
STEP_AXES_DOES: Final = message(
    "step_axes_does",
    "The technician moves one axis after the other by hand. Kata checks that the drive with this motor's id moved, and learns its direction.",
)
STEP_TORQUE: Final = message("step_torque", "Check the sign of torque")
STEP_TORQUE_DOES: Final = message(
    "step_torque_does",
    "Each motor moves by 3° with half of its torque. Then all motors hold, and the technician pushes one after the other. Torque, push "
    "and motion must have matching signs.",
)
STEP_ZERO: Final = message("step_zero", "Find the zero of each motor")
STEP_ZERO_DOES: Final = message(
    "step_zero_does",
    "The fixture holds the arm in two reference poses, on both sides. Kata takes up the play in both directions, calculates the zeros, "
    "and compares the weight of the arm with gravity.",
)
STEP_RANGE: Final = message("step_range", "Find the range of each motor")
STEP_RANGE_DOES: Final = message(
    "step_range_does",
    "The technician moves each axis to both ends by hand. Kata proposes limits inside the ends, and restarts the drives to check that "
    "each position is unambiguous.",
)
STEP_STOPS: Final = message("step_stops", "Check that the motors stop")
STEP_STOPS_DOES: Final = message(
    "step_stops_does",
    "Kata switches torque on and checks torque-off, the drives' watchdog, and the emergency stop with torque.",
)
STEP_GAINS: Final = message("step_gains", "Tune the position gains of each motor")
STEP_GAINS_DOES: Final = message(
    "step_gains_does",
    "Each motor moves by one step of 2°, with the test weight and empty. Kata measures rise time, overshoot and the remaining error, "
    "and proposes other gains where a figure is poor. The technician may try other gains.",
)
STEP_LAGS: Final = message("step_lags", "Identify lag and friction of each motor")
STEP_LAGS_DOES: Final = message(
    "step_lags_does",
    "All motors swing slowly and fast for half a minute. Kata identifies lag and friction and refuses a poor fit. Playback compensates them.",
)
STEP_ACCEPTANCE: Final = message("step_acceptance", "Play the six motions")
STEP_ACCEPTANCE_DOES: Final = message(
    "step_acceptance_does",
    "The control program plays the six motions of the paper, with the test weight and empty, as it plays them for patients. Kata compares "
    "the error of each motor with the paper's.",
)

# -- instructions -----------------------------------------------------------------------------------------------------

CONNECT_ONLY: Final = message(
    "connect_only",
    "Connect only the drive of motor {motor:d} to the bus and to power. Its positive direction: {motion:text}.",
)
CONNECT_ALL: Final = message("connect_all", "Connect all five drives, the emergency stop and the pedal.")
MOVE_AXIS: Final = message("move_axis", "Move motor {motor:d} by hand in its positive direction by 20°: {motion:text}.")
RAISE_SCAPULA_FORWARD: Final = message("raise_scapula_forward", "turn the scapula board inwards (adduction)")
ROTATE_SCAPULA_DOWN: Final = message("rotate_scapula_down", "turn the scapula board downwards (downward rotation)")
LIFT_ARM_SIDEWAYS: Final = message("lift_arm_sideways", "lift the arm sideways (abduction)")
LIFT_ARM_FORWARD: Final = message("lift_arm_forward", "lift the arm forward (flexion)")
TURN_FOREARM_OUT: Final = message("turn_forearm_out", "turn the forearm outwards (external rotation)")
PUSH_AXIS: Final = message(
    "push_axis", "Motor {motor:d} holds its position. Push it gently in its positive direction: {motion:text}."
)
RELEASE_ESTOP: Final = message("release_estop", "Release the emergency stop.")
PRESS_ESTOP: Final = message("press_estop", "Press the emergency stop.")
UNPLUG_ESTOP: Final = message("unplug_estop", "Unplug the cable of the emergency stop.")
PLUG_IN_ESTOP: Final = message("plug_in_estop", "Plug the cable of the emergency stop in again.")
PRESS_PEDAL: Final = message("press_pedal", "Step on the pedal.")
RELEASE_PEDAL: Final = message("release_pedal", "Take the foot off the pedal.")
STAND_CLEAR: Final = message(
    "stand_clear",
    "The motors will move now. Keep everyone away from the apparatus, and hold the emergency stop in your hand.",
)
SUPPORT_ARM: Final = message(
    "support_arm",
    "Motor {motor:d} has torque and may hold an arm. Support the arm, then confirm: all motors are switched off.",
)
FIT_POSE: Final = message(
    "fit_pose",
    "Lock the apparatus in reference pose {pose:d} with the fixture: scapula abduction {scapula_abduction:.0f}°, scapula rotation "
    "{scapula_rotation:.0f}°, abduction {abduction:.0f}°, flexion {flexion:.0f}°, rotation {rotation:.0f}°. "
    "Take your hands away before you confirm: the motors press against the fixture.",
)
FREE_ARM: Final = message("free_arm", "Remove the fixture and put the test weight into the arm fixer.")
HANG_WEIGHT: Final = message("hang_weight", "Put the test weight into the arm fixer.")
EMPTY_ARM: Final = message("empty_arm", "Take the test weight out of the arm fixer.")
TURN_TO_LEFT: Final = message("turn_to_left", "Turn the apparatus to the left shoulder.")
TURN_TO_RIGHT: Final = message("turn_to_right", "Turn the apparatus to the right shoulder.")
SWEEP_AXIS: Final = message(
    "sweep_axis",
    "Move motor {motor:d} slowly by hand to both ends of its range. Its positive direction: {motion:text}. Confirm after both ends.",
)
TUNE_GAINS: Final = message(
    "tune_gains",
    "Compare the step responses. Keep the gains, or measure again with other gains. The motors move during the measurement.",
)
ADVICE_DAMP: Final = message("advice_damp", "It overshoots: more damping.")
ADVICE_FASTER: Final = message("advice_faster", "It is slow: more proportional gain.")
ADVICE_INTEGRATE: Final = message("advice_integrate", "An error remains: more integral gain.")

# -- faults -------------------------------------------------------------------------------------------------------------

ONLY_DYNAMIXEL: Final = message("only_dynamixel", "Only stations with Dynamixel drives can be commissioned.")
NO_DRIVE_FOUND: Final = message(
    "no_drive_found", "No drive answers for motor {motor:d}. Check its power and its cable."
)
SEVERAL_DRIVES_FOUND: Final = message(
    "several_drives_found", "{drives:d} drives answer. Connect only the drive of motor {motor:d}."
)
DRIVES_ANSWER_TOGETHER: Final = message(
    "drives_answer_together", "Several drives answer to id {drive_id:d}. Connect only the drive of motor {motor:d}."
)
ID_NOT_TAKEN: Final = message("id_not_taken", "The drive of motor {motor:d} did not accept its id and baud rate.")
BUS_NOISE: Final = message(
    "bus_noise",
    "{damaged_percent:.0f} % of the answers of motor {motor:d} are damaged. Check shielding, termination and ground of the bus.",
)
DRIVES_SWAPPED: Final = message(
    "drives_swapped",
    "Motor {motor:d} was moved, but the drive with the id of motor {moved:d} reported the movement. Assign the ids of the drives again.",
)
NO_MOVEMENT_SEEN: Final = message("no_movement_seen", "No drive reported a movement of motor {motor:d}.")
VOLTAGE_LOW: Final = message(
    "voltage_low", "Motor {motor:d} has {volt:.1f} V; it needs at least {least:.1f} V. Check its power supply."
)
VOLTAGE_HIGH: Final = message(
    "voltage_high", "Motor {motor:d} has {volt:.1f} V; it accepts at most {most:.1f} V. Check its power supply."
)
DRIVE_TOO_WARM: Final = message(
    "drive_too_warm", "Motor {motor:d} is at {celsius:d} °C although it has not been used yet."
)
HARDWARE_ERROR_FOUND: Final = message("hardware_error_found", "Motor {motor:d} reports hardware error {code:d}.")
ESTOP_WIRE_BROKEN: Final = message(
    "estop_wire_broken", "The normally closed contact of the emergency stop is open: its wire is broken."
)
SECOND_WIRE_BROKEN: Final = message(
    "second_wire_broken", "The normally open contact of the emergency stop does not close: its wire is broken."
)
CONTACT_WELDED: Final = message(
    "contact_welded", "The normally closed contact of the emergency stop does not open: it is welded or bridged."
)
ESTOP_NOT_SEEN: Final = message("estop_not_seen", "No change of the emergency stop was detected. Check its wiring.")
PEDAL_NOT_SEEN: Final = message("pedal_not_seen", "No change of the pedal was detected. Check its wiring.")
USB_PEDAL_NOT_SEEN: Final = message(
    "usb_pedal_not_seen", "No change of the pedal at {path:name} was detected. Check that it is plugged in."
)
AXIS_STUCK: Final = message(
    "axis_stuck",
    "Motor {motor:d} moved {moved_deg:.1f} of {wanted_deg:.1f}°. Something blocks it, or its torque is too low.",
)
AXIS_REVERSED: Final = message(
    "axis_reversed",
    "Motor {motor:d} turns in the wrong direction. Repeat the step that finds the directions of the axes.",
)
TORQUE_SIGN_WRONG: Final = message("torque_sign_wrong", "Motor {motor:d} reports torque with the wrong sign.")
PUSH_NOT_SEEN: Final = message("push_not_seen", "No push was detected at motor {motor:d}.")
POSE_DIFFERS: Final = message(
    "pose_differs",
    "Motor {motor:d} is {off_deg:.1f}° from reference pose {pose:d}. Check that the fixture sits correctly.",
)
GRAVITY_CONTRADICTS: Final = message(
    "gravity_contradicts",
    "The torque of motor {motor:d} does not match the weight of the arm. Repeat the step that finds the zeros.",
)
RANGE_TOO_SMALL: Final = message(
    "range_too_small",
    "Motor {motor:d} moved by only {span_deg:.0f}°; the apparatus needs {needed_deg:.0f}°. Something blocks it.",
)
RANGE_AMBIGUOUS: Final = message(
    "range_ambiguous",
    "The range of motor {motor:d} is {span_deg:.0f}°: after power-up its position would be ambiguous.",
)
POSITION_AFTER_RESTART: Final = message(
    "position_after_restart", "After its restart, motor {motor:d} reports a position that differs by {off_deg:.1f}°."
)
TORQUE_STAYS_ON: Final = message("torque_stays_on", "Motor {motor:d} still has torque after torque-off.")
WATCHDOG_SILENT: Final = message(
    "watchdog_silent", "The watchdog of motor {motor:d} did not stop it when the bus fell silent."
)
OVERSHOOT_TOO_LARGE: Final = message(
    "overshoot_too_large", "Motor {motor:d} overshoots by {overshoot_percent:.0f} % of a step. Its gains are too high."
)
MOTOR_UNSTABLE: Final = message(
    "motor_unstable", "Motor {motor:d} moved too far away from its goal. Its gains are unstable. Its torque is off."
)
STEADY_ERROR_LARGE: Final = message(
    "steady_error_large",
    "Motor {motor:d} stays {error_deg:.1f}° away from its goal. Its gains are too low, or it is stiff.",
)
NOT_IDENTIFIABLE: Final = message("not_identifiable", "Lag and friction cannot be identified: {reason:name}.")
POOR_FIT: Final = message(
    "poor_fit",
    "Lag and friction of motor {motor:d} explain only {explained_percent:.0f} % of the variance of its distance from the setpoint ({residual_deg:.1f}° remain). Check the motor for play and stiffness.",
)
LAG_UNCERTAIN: Final = message(
    "lag_uncertain",
    "The lag of motor {motor:d} is uncertain: {lag_s:.3g} s, and with 95 % confidence up to {uncertainty_s:.3g} s more or less. Do not touch the arm during the movement, and check the motor for play and stiffness.",
)
MOTION_FAILED: Final = message("motion_failed", "Motion {motion:d} was not played to its end: {reason:name}")
TRACKING_POOR: Final = message(
    "tracking_poor",
    "The error of motor {motor:d} reached {peak_deg:.1f}° in motion {motion:d}; the limit is {limit_deg:.0f}°.",
)
NOT_COMMISSIONED: Final = message("not_commissioned", "The station is not commissioned: {reason:text}.")
RUN_COMMISSION: Final = message(
    "run_commission",
    "Do not treat patients at this station. A technician must commission it on the page “Station settings and commissioning”.",
)
NO_RECORD: Final = message("no_record", "there is no commissioning record")
RECORD_CHANGED: Final = message("record_changed", "its record was changed or cannot be read")
COMMISSIONING_UNFINISHED: Final = message("commissioning_unfinished", "its commissioning is not finished")
CONFIGURATION_CHANGED: Final = message("configuration_changed", "its configuration was changed after commissioning")
CHECK_FAILED: Final = message("check_failed", "its last periodic check found a fault")
TECHNICIAN_STOPPED: Final = message("technician_stopped", "The technician ended the step.")
ESTOP_DURING_STEP: Final = message("estop_during_step", "The emergency stop was pressed.")
NOTHING_HAPPENED: Final = message("nothing_happened", "The instruction was not followed within {seconds:d} s.")
CONFIGURATION_REFUSED: Final = message("configuration_refused", "The configuration would be invalid: {reason:name}")
