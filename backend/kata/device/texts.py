"""Messages of the device process: faults, refusals and events. See :mod:`kata.messages`."""

from typing import Final

from kata.messages import message

ESTOP_PRESSED: Final = message("estop_pressed", "The emergency stop was pressed.")
ESTOP_UNKNOWN: Final = message("estop_unknown", "The emergency stop's state is unknown.")
CONTACTS_DISAGREE: Final = message("contacts_disagree", "The two contacts of the emergency stop contradict each other.")
BUS_LOST: Final = message("bus_lost", "The connection to the motors is lost.")
OTHER_ADAPTER: Final = message("other_adapter", "Another RS-485 adapter is connected in place of the motors' adapter.")
TORQUE_FOUND: Final = message("torque_found", "Motor {motor:d} already had torque when the connection came back.")
DRIVE_RESET: Final = message("drive_reset", "Motor {motor:d} has lost its settings.")
DRIVE_SILENT: Final = message("drive_silent", "Motor {motor:d} does not answer.")
DRIVE_GARBLED: Final = message("drive_garbled", "Motor {motor:d} sends damaged answers.")
DRIVE_ERROR: Final = message("drive_error", "Motor {motor:d} reports a hardware error.")
DRIVE_WATCHDOG: Final = message("drive_watchdog", "Motor {motor:d} stopped because it received no messages.")
DRIVE_HOT: Final = message(
    "drive_hot", "Motor {motor:d} has reached {temperature_c:.0f} °C. It switches off above {limit_c:.0f} °C."
)
SUPPLY_LOW: Final = message(
    "supply_low", "The supply of motor {motor:d} has {voltage_v:.1f} V. The motor switches off below {limit_v:.1f} V."
)
SUPPLY_HIGH: Final = message(
    "supply_high", "The supply of motor {motor:d} has {voltage_v:.1f} V. The motor switches off above {limit_v:.1f} V."
)
TORQUE_LOST: Final = message("torque_lost", "Motor {motor:d} has switched its torque off.")
TORQUE_REMAINS: Final = message("torque_remains", "Motor {motor:d} still has torque although it was switched off.")
POSITION_JUMP: Final = message("position_jump", "Motor {motor:d} reported a position that it cannot have reached.")
POSITION_FROZEN: Final = message("position_frozen", "Motor {motor:d} does not move, or its encoder has stopped.")
OVERTORQUE: Final = message("overtorque", "Motor {motor:d} exceeded its rated torque.")
OVERACCELERATION: Final = message("overacceleration", "Motor {motor:d} moved too abruptly.")
POSITION_LIMIT: Final = message("position_limit", "Motor {motor:d} left its range.")
OVERSPEED: Final = message("overspeed", "Motor {motor:d} moved too fast.")
FOLLOWING_ERROR: Final = message(
    "following_error", "Motor {motor:d} could not follow its setpoint: something blocks the arm."
)
SETPOINT_STEP: Final = message("setpoint_step", "The next setpoint of motor {motor:d} would have caused a jump.")
SETPOINT_LIMIT: Final = message("setpoint_limit", "The next setpoint of motor {motor:d} was beyond its limit.")
SETPOINT_ACCELERATION: Final = message(
    "setpoint_acceleration", "The next setpoint of motor {motor:d} would have caused a jerk."
)
SETPOINT_FROZEN: Final = message("setpoint_frozen", "The control program has stopped planning the movement.")
OVERRUN: Final = message("overrun", "The control computer was too slow.")
SERVICE_SILENT: Final = message("service_silent", "The control computer lost its connection to the clinic service.")
OTHER_RUN: Final = message("other_run", "The service and the control computer have different playbacks loaded.")
JOURNAL_FAULT: Final = message("journal_fault", "Measurements can no longer be written to the disk.")
RESISTANCE_REPEATED: Final = message("load_repeated", "Motor {motor:d} met resistance twice at the same place.")
RESISTANCE_ON_APPROACH_OR_RETURN: Final = message(
    "load_on_the_way", "Motor {motor:d} met resistance while the arm moved to the start or back."
)
ARM_TOO_HEAVY: Final = message(
    "arm_too_heavy",
    "Motor {motor:d} reached the torque of the resistance level before the arm had moved: the arm is too heavy, or the patient resists.",
)
RESISTANCE_WHILE_HELD: Final = message("load_while_held", "Motor {motor:d} met resistance while the arm was held.")
OPERATOR_STOP: Final = message("operator_stop", "Stopped by the operator.")
BROWSER_LOST: Final = message("browser_lost", "The browser that operated the apparatus was disconnected for too long.")
UNEXPECTED_ERROR: Final = message("unexpected_error", "The control program had an internal error.")
RELEASE_SWITCH: Final = message(
    "release_switch", "Support the arm and check the patient. Release the switch, then acknowledge."
)
CHECK_SWITCH_CABLE: Final = message(
    "check_switch_cable", "Support the arm. Check the switch's cable and its drive's power, then acknowledge."
)
HAVE_SWITCH_CHECKED: Final = message(
    "have_switch_checked",
    "Support the arm. Have the switch and its wires checked, test the emergency stop, then acknowledge.",
)
CHECK_ADAPTER_AND_POWER: Final = message(
    "check_adapter_and_power",
    "Support the arm: the motors may still hold it. Check the RS-485 adapter and the power supplies; the connection is restored automatically.",
)
CONNECT_FORMER_ADAPTER: Final = message(
    "connect_former_adapter",
    "Support the arm: the motors may still hold it. Connect the former adapter, in the USB socket where it was. If it has been exchanged, an administrator must restart Kata.",
)
SUPPORT_AND_RELEASE_TORQUE: Final = message("support_and_release_torque", "Support the arm, then release the torque.")
WAIT_FOR_SET_UP: Final = message(
    "wait_for_set_up",
    "Support the arm. Wait until the motor is set up again, test the emergency stop, then acknowledge.",
)
CHECK_MOTOR_CABLE: Final = message(
    "check_motor_cable",
    "Support the arm: this motor may still hold it. Check its cable and power supply, then acknowledge.",
)
CHECK_BUS_CABLE: Final = message(
    "check_bus_cable",
    "Support the arm. Check the bus cable's shield and terminators, and that no two motors share an address; then acknowledge.",
)
LET_MOTOR_COOL: Final = message(
    "let_motor_cool", "Support the arm. Let the motor cool down, switch its power supply off and on, then acknowledge."
)
END_AND_LET_COOL: Final = message(
    "end_and_let_cool",
    "End the motion and let the motor cool down. If it stays warm, check whether the arm pushes against something.",
)
HAVE_SUPPLY_CHECKED: Final = message(
    "have_supply_checked", "End the motion. Have the power supply and its cables checked before the next patient."
)
CHECK_PATIENT_AND_ARM: Final = message(
    "check_patient_and_arm", "Support the arm and check the patient, then acknowledge."
)
CHECK_MOTOR_POWER: Final = message(
    "check_motor_power", "Support the arm. Check the motor's power supply, then acknowledge."
)
SUPPORT_AND_SWITCH_OFF: Final = message(
    "support_and_switch_off", "Support the arm, then switch the power supplies off."
)
HAVE_ENCODER_CHECKED: Final = message(
    "have_encoder_checked", "Support the arm. Have the motor's encoder checked, then acknowledge."
)
LOOK_WHETHER_ARM_IS_HELD: Final = message(
    "look_whether_arm_is_held",
    "Support the arm. Check whether something blocks it. If not, have the encoder checked. Then acknowledge.",
)
HAVE_LIMITS_CHECKED: Final = message(
    "have_limits_checked",
    "Support the arm and check the patient. Have the motor's limits checked, then acknowledge.",
)
REPORT_IMPOSSIBLE: Final = message(
    "report_impossible", "Support the arm, then acknowledge. Report this to an administrator: it should never happen."
)
ACKNOWLEDGE_AND_LOAD_AGAIN: Final = message(
    "acknowledge_and_load_again", "Support the arm, then acknowledge. Load the recording again."
)
MAKE_ROOM_ON_DISK: Final = message("make_room_on_disk", "Support the arm. Free up space on the disk, then acknowledge.")
SUPPORT_THEN_ACKNOWLEDGE: Final = message(
    "support_then_acknowledge", "The motors hold the arm. Support it, then acknowledge: torque is then switched off."
)
ACKNOWLEDGE_WHEN_SAFE: Final = message(
    "acknowledge_when_safe", "Support the arm. Acknowledge when it is safe to continue."
)
CHECK_PATIENT: Final = message("check_patient", "Support the arm. Check the patient, then acknowledge.")
REPORT_WITH_DEVICE_LOG: Final = message(
    "report_with_device_log", "Support the arm, then acknowledge. Report this to an administrator, with the log."
)
PORT_NOT_OPEN: Final = message("port_not_open", "{port:name} is not open")
PORT_GONE: Final = message("port_gone", "{port:name} was disconnected: {error:name}")
PORT_CANNOT_BE_OPENED: Final = message("port_cannot_be_opened", "{port:name} cannot be opened: {error:name}")
RTS_DIRECTION_REFUSED: Final = message(
    "rts_direction_refused",
    "the adapter at {port:name} cannot be switched between sending and receiving by RTS: {error:name}. If it switches by itself, set rts_direction to off; otherwise use another adapter",
)
DRIVE_ANSWERS_DAMAGED: Final = message(
    "drive_answers_damaged",
    "the answers of motor {motor:d} (id {drive_id:d}) are damaged; check whether two drives share this id",
)
NOT_PLAYABLE_PAPER_RATE: Final = message(
    "not_playable_paper_rate", "this station's cycle rate is not a multiple of the paper's 10 Hz"
)
NOT_PLAYABLE_PAPER_STEP: Final = message(
    "not_playable_paper_step",
    "motor {motor:d} moves by {step_deg:.1f}° in one step at {at_s:.1f} s; the paper's method allows {largest_deg:.0f}°",
)
NOT_PLAYABLE_RESISTANCE_LEVEL: Final = message(
    "not_playable_load_level", "its resistance level must be 1 to {levels:d}"
)
NOT_PLAYABLE_SOME_LIMITS: Final = message("not_playable_some_limits", "it has limits for some motors only")
NOT_PLAYABLE_CORRECTION_METHOD: Final = message(
    "not_playable_correction_method", "a correction belongs to the learned method only"
)
NOT_PLAYABLE_CORRECTION_CUT: Final = message("not_playable_correction_cut", "its learned correction is incomplete")
NOT_PLAYABLE_CORRECTION_LENGTH: Final = message(
    "not_playable_correction_length", "its learned correction and the recording differ in length"
)
NOT_PLAYABLE_CORRECTION_LARGE: Final = message(
    "not_playable_correction_large", "its learned correction exceeds {largest_deg:g}°"
)
NOT_PLAYABLE_END_FEEL_CUT: Final = message(
    "not_playable_end_feel_cut", "the settings of its end-feel test are incomplete"
)
NOT_PLAYABLE_END_FEEL_WAY: Final = message(
    "not_playable_end_feel_way",
    "in an end-feel test motor {motor:d} must move in one direction, by at least {least_deg:g}°, at {slowest:g} to {fastest:g}°/s",
)
NOT_PLAYABLE_END_FEEL_TORQUE: Final = message(
    "not_playable_end_feel_torque",
    "the arm and the test need {needed_nm:.1f} Nm of motor {motor:d}, but the patient's level allows only {limit_nm:.1f} Nm",
)
NOT_PLAYABLE_STRETCH_BASELINE: Final = message(
    "not_playable_stretch_baseline",
    "a stretch needs the baseline of motor {motor:d} on both ways, and the weight of an arm",
)
NOT_PLAYABLE_STRETCH_HOLD: Final = message(
    "not_playable_stretch_hold",
    "a stretch holds its torque for {least_s:g} to {most_s:g} s, at most {repetitions:d} times",
)
SELF_PACED_WITHOUT_LOAD: Final = message(
    "self_paced_without_load",
    "The patient cannot set the pace: the load of the station is not identified, so the patient's effort is unknown.",
)
SELF_PACED_WITH_METHOD: Final = message(
    "self_paced_with_method", "The patient can set the pace of a playback with the smooth method only."
)
PLAY_WITHOUT_SELF_PACE: Final = message("play_without_self_pace", "Play the recording with its own pace.")
STRETCH_IS_LEAST: Final = message(
    "stretch_is_least", "The torque of the stretch is at its minimum, {target_nm:.1f} Nm."
)
LESS_TORQUE_REQUESTED: Final = message(
    "less_torque_requested", "The torque of the stretch was reduced to {target_nm:.1f} Nm at {at_s:.1f} s."
)
RANGE_IS_MEASURED: Final = message(
    "range_is_measured", "This playback measures the range, so its range cannot be reduced."
)
TOO_MANY_COMMANDS: Final = message("too_many_commands", "Too many commands are waiting.")
WAIT_A_MOMENT: Final = message("wait_a_moment", "Wait a moment.")
NOT_PLAYABLE_SAMPLES_CUT: Final = message("not_playable_samples_cut", "its samples are incomplete")
RECORDING_NOT_PLAYABLE: Final = message("recording_not_playable", "This recording cannot be played: {reason:text}.")
LOOK_AT_ARM_AND_TRY_AGAIN: Final = message(
    "look_at_arm_and_try_again", "Check the arm and the patient, then try again."
)
CHECKING_ANOTHER_RECORDING: Final = message("checking_another_recording", "Another recording is being checked.")
WAIT_THEN_LOAD_AGAIN: Final = message("wait_then_load_again", "Wait a moment, then load it again.")
CHECKING_PROGRAM_FAILED: Final = message(
    "checking_program_failed", "This recording could not be checked: the program that checks recordings has failed."
)
LOAD_RECORDING_AGAIN: Final = message("load_recording_again", "Load the recording again.")
NOT_PLAYABLE_CHECK_FAILED: Final = message("not_playable_check_failed", "its check failed ({error:name})")
NOT_PLAYABLE_TOO_LONG: Final = message("not_playable_too_long", "it is too long for the apparatus")
NOT_PLAYABLE_REPETITION: Final = message("not_playable_repetition", "its repetition must be 0 s or longer")
NOT_PLAYABLE_LIMITS_CROSSED: Final = message(
    "not_playable_limits_crossed", "each of its limits must be a lower and a higher angle"
)
NOT_PLAYABLE_PATIENT_SPEED_LOW: Final = message(
    "not_playable_patient_speed_low", "the patient's speed limit is below the lowest speed of the apparatus"
)
NOT_PLAYABLE_PATIENT_SPEED_ZERO: Final = message(
    "not_playable_patient_speed_zero", "the patient's speed limit must be above 0°/s"
)
REFERENCE_TOO_SHORT: Final = message(
    "reference_too_short", "it lasts {duration_ms:.0f} ms; it must last at least {shortest_ms:.0f} ms"
)
TEACH_AGAIN_MORE_SLOWLY: Final = message(
    "teach_again_more_slowly", "Teach the motion again, within the range and more slowly."
)
MAKE_ARM_LIGHTER: Final = message(
    "make_arm_lighter",
    "Let the balancer carry more of the arm, raise the resistance level, or use a smaller or slower motion.",
)
SUPPORT_AND_MAKE_LIGHTER: Final = message(
    "support_and_make_lighter",
    "The motors hold the arm. Support it, then acknowledge: torque is then switched off. Let the balancer carry more of the arm.",
)
METHOD_NOT_PLAYABLE: Final = message("method_not_playable", "This method cannot play the recording: {reason:text}.")
CHOOSE_ANOTHER_METHOD: Final = message("choose_another_method", "Choose another method.")
NOT_CONNECTED_BECAUSE: Final = message("not_connected_because", "The apparatus is not connected: {reason:text}.")
SWITCH_ON_AND_CHECK_ADAPTER: Final = message(
    "switch_on_and_check_adapter", "Switch it on and check the RS-485 adapter."
)
DRIVE_DOES_NOT_ANSWER: Final = message("drive_does_not_answer", "motor {motor:d} (id {drive_id:d}) does not answer")
LOAD_EXPIRED: Final = message(
    "load_expired", "The recording was unloaded, because no command came for {minutes:d} minutes."
)
TORQUE_ON: Final = message("torque_on", "Torque is on.")
TORQUE_OFF: Final = message("torque_off", "Torque is being switched off.")
TAKE_ENDED: Final = message("take_ended", "Take {take:d} has ended after {take_s:.1f} s.")
TAKE_STARTED: Final = message("take_started", "Take {take:d} is being recorded.")
FAULT_EVENT: Final = message("fault_event", "{fault:sentence} (stop category {category:d})")
RESISTANCE_MET: Final = message(
    "resistance_met", "Motor {motor:d} met resistance at {at_s:.1f} s; the arm is moved back."
)
ALREADY_PAUSING: Final = message("already_pausing", "It is already pausing.")
WAIT_UNTIL_IT_STANDS: Final = message("wait_until_it_stands", "Wait until it has stopped.")
LESS_RANGE_REQUESTED: Final = message("less_range_requested", "The range was reduced at {at_s:.1f} s.")
TORQUE_RELEASED_BY_HAND: Final = message("torque_released_by_hand", "Torque is released: the arm is supported.")
SETTINGS_VERIFIED: Final = message("settings_verified", "Every motor has its settings.")
IS_OFFLINE: Final = message("is_offline", "The apparatus is not connected.")
IS_IDLE: Final = message("is_idle", "No recording is loaded.")
LOAD_RECORDING_FIRST: Final = message("load_recording_first", "Load a recording first.")
IS_TEACHING: Final = message("is_teaching", "Teaching is in progress.")
FINISH_TEACHING_FIRST: Final = message("finish_teaching_first", "Finish teaching first.")
IS_READY: Final = message("is_ready", "A recording is loaded, and the arm is not at its start yet.")
APPROACH_OR_UNLOAD: Final = message("approach_or_unload", "Move to the start, or unload the recording.")
IS_APPROACHING: Final = message("is_approaching", "The arm is moving to the start.")
WAIT_OR_STOP: Final = message("wait_or_stop", "Wait until the arm has arrived, or stop.")
IS_PLAYING: Final = message("is_playing", "The recording is playing.")
PAUSE_OR_STOP_FIRST: Final = message("pause_or_stop_first", "Pause first, or stop.")
IS_PAUSED: Final = message("is_paused", "The playback is paused, and the arm is held.")
PLAY_RETURN_OR_STOP: Final = message("play_return_or_stop", "Resume, return, or stop.")
IS_RETURNING: Final = message("is_returning", "The arm is moving back.")
IS_STOPPED: Final = message("is_stopped", "The apparatus has been stopped.")
ACKNOWLEDGE_FIRST: Final = message("acknowledge_first", "Acknowledge the stop first.")
STOPPED_MEANWHILE: Final = message(
    "stopped_meanwhile",
    "After this command was sent, the apparatus was stopped or paused, the arm was moved back, or a motion was loaded.",
)
NOT_STOPPED: Final = message("not_stopped", "The apparatus is not stopped.")
NOTHING_TO_DO: Final = message("nothing_to_do", "No action is needed.")
NOT_TEACHING: Final = message("not_teaching", "No teaching is in progress.")
OTHER_SIDE: Final = message(
    "other_side",
    "This is for the {wanted:text} shoulder, but the apparatus is set up for the {stands_for:text} shoulder.",
)
TURN_APPARATUS_OR_CHOOSE: Final = message(
    "turn_apparatus_or_choose", "Turn the apparatus and confirm its side, or choose a recording for its present side."
)
RANGE_IS_LEAST: Final = message("range_is_least", "The range cannot be less than {least_percent:.0f} %.")
PAUSE_OR_STOP: Final = message("pause_or_stop", "Pause, or stop.")
STILL_STOPPING: Final = message("still_stopping", "The arm is slowing down.")
PATH_LEAVES_LIMITS: Final = message(
    "way_leaves_limits",
    "The straight way to the start of the recording leads {outwards_deg:.1f}° beyond the limits of the arm's pose.",
)
MOVE_CLOSER_BY_HAND: Final = message(
    "move_closer_by_hand", "Move the arm by hand closer to the start of the recording."
)
MOTOR_DID_NOT_ANSWER: Final = message("motor_did_not_answer", "Motor {motor:d} did not answer just now.")
OUTSIDE_RANGE: Final = message("outside_range", "Motor {motor:d} is at {angle_deg:.0f}°, outside its range.")
MOVE_BACK_BY_HAND: Final = message("move_back_by_hand", "Move the arm back by hand.")
TOO_FAR_FROM_START: Final = message(
    "too_far_from_start",
    "Motor {motor:d} is {distance_deg:.0f}° from the start of the recording; this method would move there in one step.",
)
MOVE_WITHIN_OR_OTHER_METHOD: Final = message(
    "move_within_or_other_method", "Move the arm to within {within_deg:g}° by hand, or choose another method."
)
MOTOR_CANNOT_BE_SET_UP: Final = message("motor_cannot_be_set_up", "A motor cannot be set up: {reason:text}.")
HAVE_IT_CHECKED: Final = message("have_it_checked", "Have the apparatus checked.")
SETTINGS_BEING_CHECKED: Final = message("settings_being_checked", "The motors' settings are being checked.")
COMMAND_EXPIRED: Final = message("command_expired", "The command arrived too late.")
NO_TORQUE_FOUND: Final = message("no_torque_found", "No motor had torque when the apparatus was connected.")
ACKNOWLEDGE_STOP: Final = message("acknowledge_stop", "Acknowledge the stop.")
DRIVE_HAS_TORQUE: Final = message(
    "drive_has_torque", "motor {motor:d} (id {drive_id:d}) has torque, so its settings are not changed"
)
DRIVE_SETTING_REFUSED: Final = message(
    "drive_setting_refused", "motor {motor:d} (id {drive_id:d}) does not accept its {setting:name}"
)
DRIVE_OTHER_MODEL: Final = message(
    "drive_other_model",
    "motor {motor:d} (id {drive_id:d}) is model {model:d}; the station's file requires {wanted:name}",
)
DRIVE_UNKNOWN_MODEL: Final = message(
    "drive_unknown_model",
    "motor {motor:d} (id {drive_id:d}) is model {model:d}, which Kata does not know; it knows {known:name}",
)
DRIVE_OLD_FIRMWARE: Final = message(
    "drive_old_firmware",
    "motor {motor:d} (id {drive_id:d}) has firmware {firmware:d}; Kata needs {oldest:d} or newer",
)
DRIVES_SHARE_ID: Final = message("drives_share_id", "two drives answer to id {drive_id:d} of motor {motor:d}")
DRIVE_REGISTER_REFUSED: Final = message(
    "drive_register_refused", "motor {motor:d} (id {drive_id:d}) refused register {register:d} (error {error:d})"
)
DRIVE_REGISTER_EXCEPTION: Final = message(
    "drive_register_exception",
    "motor {motor:d} (id {drive_id:d}) refused register {register:d} (exception {exception:d})",
)
PORT_IS_OTHER_ADAPTER: Final = message(
    "port_is_other_adapter", "{port:name} is the adapter {found:name}; before, it was {known:name}"
)
ADAPTER_NOT_IDENTIFIED: Final = message(
    "adapter_not_identified", "the USB adapter of {port:name} cannot be identified at the moment"
)
PORT_HUNG_UP: Final = message("port_hung_up", "{port:name} was disconnected")
PORT_TAKES_NOTHING: Final = message("port_takes_nothing", "{port:name} does not accept data")
