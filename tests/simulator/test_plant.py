"""The loads of a drive: weight by pose, stiffness, backlash, friction, supplies; and the effect of a seed."""

import math
import struct

import numpy as np
import pytest

from kata.device.config import StationConfig
from kata.motion.builtin import built_in_motions
from kata.motion.linkage import motor_angles_deg
from kata.simulator import parameters
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.bus import ServoBus
from kata.simulator.drive import Drive, share_supply
from kata.simulator.hand import GuidedMotion
from kata.simulator.parameters import DRIVES, HAND, JOINTS, SLOW_STEPS, STOPS_DEG, VARIATION, VARIED
from kata.simulator.plant import Joint, Plant, step_axis
from kata.simulator.servo_motion import D_NM_S_RAD, I_NM_RAD_S, P_NM_RAD

COUNT_DEG = 360 / 4096


def a_drive(motor: int) -> Drive:
    """Return a drive with its own gains, limited to its rated torque."""
    own = DRIVES[motor - 1]
    drive = Drive(motor, own, lambda *_: None)
    drive.tune(own.p_nm_rad, own.i_nm_rad_s, own.d_nm_s_rad, own.rated_nm)
    return drive


def put(plant: Plant, angles_deg: list[float]) -> None:
    """Put the arm into a pose, at rest."""
    for joint, angle in zip(plant.joints, angles_deg, strict=True):
        joint.angle = joint.arm_angle = math.radians(angle)
        joint.speed = joint.arm_speed = 0.0


def loads(angles_deg: list[float], *, turned: bool = False) -> list[float]:
    """Return the arm's load at rest in a pose."""
    plant = Plant(turned=turned)
    put(plant, angles_deg)
    plant.update_slow_loads()
    return [joint.load_nm for joint in plant.joints]


# -- the patient -------------------------------------------------------------------------------------------------------


def test_gravity_torque_is_the_derivative_of_the_arms_height() -> None:
    weight = JOINTS[3].weight_nm
    # Raised forward, its weight loads flexion; raised sideways, abduction.
    assert loads([15, 109, 20, 90, 0])[3] == pytest.approx(-weight * math.cos(math.radians(20)))
    assert loads([15, 109, 90, 0, 0])[2] == pytest.approx(-weight)
    # Raised sideways, motor 4 moves it in the horizontal plane, where the weight has no effect.
    assert loads([15, 109, 90, 60, 0])[3] == pytest.approx(0.0, abs=1e-9)
    # The further it moves forward there, the smaller is the load of motor 3.
    assert loads([15, 109, 90, 60, 0])[2] == pytest.approx(-weight / 2)


def test_other_side_mirrors_the_weight_on_motors_3_and_4() -> None:
    here = loads([15, 109, 50, 70, -30])
    there = loads([15, 109, -50, -70, -30], turned=True)
    assert there[2:4] == pytest.approx([-here[2], -here[3]])
    assert there[4] == pytest.approx(here[4])


def test_girdle_weight_loads_motors_1_and_2_at_the_side() -> None:
    rest = list(parameters.REST_DEG)
    here, there = loads(rest), loads(rest, turned=True)
    assert abs(here[0]) == pytest.approx(JOINTS[0].weight_nm)
    assert there[:2] == pytest.approx([-here[0], -here[1]])


def test_capsule_resistance_grows_towards_the_end_of_range() -> None:
    at = [loads([15, 109, 90, angle, 0])[3] for angle in (170.0, 180.0, 185.0, 190.0)]
    assert at[0] == pytest.approx(0.0, abs=1e-9)
    assert at[3] == pytest.approx(-JOINTS[3].stiffness_nm)
    assert at[1] - at[2] < at[2] - at[3]
    assert loads([15, 109, 90, -20, 0])[3] == pytest.approx(JOINTS[3].stiffness_nm)


def test_tone_resists_movement_and_never_helps() -> None:
    plant = Plant(1)
    joint = plant.joints[2]
    resists = []
    for _ in range(3000):
        put(plant, [15, 109, 60, 0, 0])
        joint.arm_speed = 1.0
        plant.update_slow_loads()
        moving = joint.load_nm
        joint.arm_speed = 0.0
        weight = -joint.parameters.weight_nm * math.sin(math.radians(60))
        resists.append(weight - moving)
    assert min(resists) >= 0.0
    assert max(resists) <= joint.parameters.tone_nm
    assert np.ptp(resists) > joint.parameters.tone_nm / 2
    assert np.abs(np.diff(resists)).max() < joint.parameters.tone_nm / 20


# -- gear and friction -------------------------------------------------------------------------------------------------


def test_backlash_delays_the_arm_when_a_motor_reverses() -> None:
    """The encoder does not measure the backlash."""
    joint, drive = Joint(4, JOINTS[4], turned=False), a_drive(5)
    drive.switch(on=True)

    def go_to(angle_deg: float) -> float:
        begins = math.degrees(drive.goal)
        for n in range(100):
            drive.set_goal(math.radians(begins + (angle_deg - begins) * (n + 1) / 100))
            step_axis(drive, joint, 10)
        step_axis(drive, joint, 2000)
        assert math.degrees(joint.angle) == pytest.approx(angle_deg, abs=2 * COUNT_DEG)
        return math.degrees(joint.angle - joint.arm_angle)

    there, back = go_to(20.0), go_to(10.0)
    play = JOINTS[4].play_deg
    assert there == pytest.approx(play / 2, abs=0.1)
    assert back == pytest.approx(-play / 2, abs=0.1)


def test_friction_holds_smaller_forces() -> None:
    joint, drive = Joint(2, JOINTS[2], turned=False), a_drive(3)
    began = joint.arm_angle
    joint.load_nm = 0.9 * JOINTS[2].arm_coulomb_nm
    step_axis(drive, joint, 2000)
    assert joint.arm_angle == began
    joint.load_nm = 1.1 * (JOINTS[2].arm_coulomb_nm + JOINTS[2].rotor_coulomb_nm)
    step_axis(drive, joint, 2000)
    assert joint.arm_angle > began + math.radians(1)
    assert joint.angle > began


def test_resting_axes_move_on_as_if_stepped() -> None:
    """The plant leaves out the steps of resting axes. A hand, a jam and torque must still move or hold them as every step does."""

    def angles(*, leave_out: bool) -> list[float]:
        plant, drives = Plant(3), [a_drive(motor) for motor in range(1, 6)]
        put(plant, [15, 109, 60, 20, 0])
        passed = []
        for n in range(600):
            joint, drive = plant.joints[n // 100 % 5], drives[n // 100 % 5]
            if n % 100 == 20:
                joint.hand = (joint.arm_angle + 0.1, 0.0, 60.0, 1.0, 3.0)
            elif n % 100 == 40:
                joint.hand = None
                plant.jam(n // 100 % 5, jammed=True)
            elif n % 100 == 50:
                plant.jam(n // 100 % 5, jammed=False)
            elif n % 100 == 60:
                drive.switch(on=True)
                drive.set_goal(joint.angle + 0.1)
            elif n % 100 == 80:
                drive.switch(on=False)
            plant.update_slow_loads()
            if leave_out:
                plant.advance(drives, SLOW_STEPS)
            else:
                for each, own in zip(drives, plant.joints, strict=True):
                    step_axis(each, own, SLOW_STEPS)
            passed += [value for own in plant.joints for value in (own.angle, own.arm_angle, own.arm_speed)]
        return passed

    assert angles(leave_out=True) == angles(leave_out=False)


def test_the_mechanism_ends_at_its_stops() -> None:
    joint, drive = Joint(2, JOINTS[2], turned=False), a_drive(3)
    drive.switch(on=True)
    drive.set_goal(math.radians(200.0))
    step_axis(drive, joint, 3000)
    assert math.degrees(joint.arm_angle) == pytest.approx(STOPS_DEG[2][1], abs=1.5)
    assert drive.torque_nm == pytest.approx(DRIVES[2].rated_nm)


def test_jammed_shaft_stays_while_its_drive_pulls_at_full_torque() -> None:
    plant, drive = Plant(), a_drive(4)
    joint = plant.joints[3]
    drive.switch(on=True)
    drive.set_goal(0.5)
    plant.jam(3, jammed=True)
    step_axis(drive, joint, 500)
    assert joint.angle == joint.arm_angle == 0.0
    assert drive.torque_nm == DRIVES[3].rated_nm
    plant.jam(3, jammed=False)
    step_axis(drive, joint, 500)
    assert joint.angle > 0.1


@pytest.mark.parametrize("seed", [None, 0, 1, 2, 3])
def test_built_in_motions_need_at_most_half_the_rated_torque(seed: int | None) -> None:
    """A greater torque is a patient's resistance for the resistance level."""
    apparatus = SimulatedApparatus(seed, 0)
    for drive, own in zip(apparatus.drives, DRIVES, strict=True):
        drive.tune(own.p_nm_rad, own.i_nm_rad_s, own.d_nm_s_rad, own.rated_nm)
        drive.switch(on=True)
    now_ms = 0
    highest = np.zeros(5)
    for motion in (built_in_motions()[4], built_in_motions()[6]):
        for angles in motor_angles_deg(motion.poses_deg):
            for drive, angle in zip(apparatus.drives, angles, strict=True):
                drive.set_goal(math.radians(angle))
            now_ms += 10
            apparatus.advance(now_ms * 1_000_000)
            if now_ms > 1000:  # The first goal is a jump.
                highest = np.maximum(highest, [abs(drive.torque_nm) for drive in apparatus.drives])
    assert np.all(highest <= [0.5 * own.rated_nm for own in DRIVES])
    assert highest[3] > 0.5


# -- drives ------------------------------------------------------------------------------------------------------------


def test_station_sets_the_specified_gains_of_the_drives() -> None:
    for axis, own in zip(StationConfig().axes, DRIVES, strict=True):
        assert axis.position_p_gain * P_NM_RAD == pytest.approx(own.p_nm_rad)
        assert axis.position_i_gain * I_NM_RAD_S == pytest.approx(own.i_nm_rad_s)
        assert axis.position_d_gain * D_NM_S_RAD == pytest.approx(own.d_nm_s_rad)
        assert axis.max_torque_nm == own.rated_nm


def test_warm_winding_gives_rated_torque_and_a_cold_one_maximal() -> None:
    drive = a_drive(1)
    drive.tune(200.0, 0.0, 8.0, 20.0)
    drive.torque_nm = 10.0
    drive.supply(1.0, 0.01)
    assert drive.limit_nm == DRIVES[0].maximum_nm
    for _ in range(600):
        drive.supply(1.0, 0.01)
    assert drive.limit_nm == DRIVES[0].rated_nm


def test_voltage_just_drives_maximal_torque_at_the_highest_speed() -> None:
    drive = a_drive(1)
    drive.tune(200.0, 0.0, 8.0, 20.0)
    drive.speed = 75 * math.tau / 60
    drive.supply(1.0, 0.01)
    assert drive.limit_nm == DRIVES[0].maximum_nm
    drive.speed *= 1.25
    drive.supply(1.0, 0.01)
    assert drive.limit_nm < DRIVES[0].maximum_nm


def test_two_motors_share_the_current_of_their_supply() -> None:
    pair = [a_drive(1), a_drive(2)]
    for drive in pair:
        drive.tune(200.0, 0.0, 8.0, 20.0)
        drive.torque_nm, drive.speed = 10.0, 8.0
    taken_w = sum(drive.power_w for drive in pair)
    assert taken_w > parameters.SUPPLY_W
    share_supply(pair, 0.01)
    assert [drive.limit_nm for drive in pair] == pytest.approx([10.0 * parameters.SUPPLY_W / taken_w] * 2)
    share_supply(pair[:1], 0.01)
    assert pair[0].limit_nm > pair[1].limit_nm


def test_braking_motor_takes_nothing_from_its_supply() -> None:
    drive = a_drive(1)
    drive.torque_nm, drive.speed = -4.0, 5.0
    assert drive.power_w == 0.0


# -- seeds -------------------------------------------------------------------------------------------------------------


def test_seed_varies_every_parameter_within_thirty_percent_reproducibly() -> None:
    for name in VARIED:
        shares = [
            getattr(joint, name) / getattr(nominal, name)
            for seed in range(50)
            for joint, nominal in zip(parameters.joints(seed), JOINTS, strict=True)
            if getattr(nominal, name)
        ]
        assert 1 - VARIATION <= min(shares) < 1 - 0.8 * VARIATION
        assert 1 + 0.8 * VARIATION < max(shares) <= 1 + VARIATION
    assert parameters.joints(7) == parameters.joints(7)
    assert parameters.joints(None) == JOINTS


def test_factory_parameters_of_a_drive_do_not_vary() -> None:
    drives = [SimulatedApparatus(seed, 0).drives for seed in (None, 1)]
    assert [drive.limit_nm for drive in drives[0]] == [drive.limit_nm for drive in drives[1]]


def sunk_to_deg(seed: int | None) -> float:
    """Return the angle of an arm half a second after its release at 80 deg."""
    plant, drive = Plant(seed), a_drive(4)
    put(plant, [15, 109, 0, 80, 0])
    for _ in range(50):
        plant.update_slow_loads()
        step_axis(drive, plant.joints[3], SLOW_STEPS)
    return math.degrees(plant.joints[3].arm_angle)


def test_seed_gives_a_different_reproducible_apparatus() -> None:
    assert sunk_to_deg(1) == sunk_to_deg(1)
    assert len({sunk_to_deg(seed) for seed in (None, 1, 2)}) == 3


def test_step_size_does_not_change_the_result() -> None:
    def end(step_ms: int) -> list[float]:
        apparatus = SimulatedApparatus(3, 0)
        servos = ServoBus(apparatus).servos
        for servo in servos:
            servo.write(80, struct.pack("<HHH", 144, 120, 120))
            servo.write(64, b"\1")
            servo.write(116, struct.pack("<i", 2048))
        for now_ms in range(step_ms, 2101, step_ms):
            apparatus.advance(now_ms * 1_000_000)
        return [axis.angle_deg for axis in apparatus.state().axes]

    assert end(1) == end(7) == end(300)


# -- the hand ----------------------------------------------------------------------------------------------------------


def held_still(seed: int | None, seconds: float = 20.0) -> np.ndarray:
    """Return motor angles (n, 5) at 100 Hz of an arm that a hand holds still."""
    apparatus = SimulatedApparatus(seed, 0)
    motion = GuidedMotion()
    motion.add([0.0, seconds], [[0.0, 0.0, 50.0, 50.0, 0.0]] * 2)
    apparatus.guide("still", motion, pedal=False)
    now_ms, rows = 0, []
    while apparatus.state().hand.phase != "away":
        now_ms += 10
        apparatus.advance(now_ms * 1_000_000)
        if apparatus.state().hand.phase == "tracing":
            rows.append([math.degrees(joint.arm_angle) for joint in apparatus._plant.joints])
    return np.array(rows)


def test_hand_trembles_at_8_to_12_hz_and_drifts_slowly() -> None:
    held = held_still(None)[:, 2]
    spectrum = np.abs(np.fft.rfft(held - held.mean())) ** 2
    hz = np.fft.rfftfreq(len(held), 0.01)
    tremor, wander = spectrum[(hz >= 7) & (hz <= 13)].sum(), spectrum[hz <= 0.5].sum()
    assert tremor + wander > 0.95 * spectrum.sum()
    # Parseval, for a one-sided spectrum. Friction suppresses part of such a small movement.
    rms = math.sqrt(2 * tremor) / len(held)
    assert 0.3 * HAND.tremor_deg < rms < 1.2 * HAND.tremor_deg
    assert 0.1 < np.ptp(held) < 6 * HAND.wander_deg


def test_seed_gives_a_different_reproducible_hand() -> None:
    assert np.array_equal(held_still(1, 2.0), held_still(1, 2.0))
    assert not np.array_equal(held_still(1, 2.0), held_still(2, 2.0))


def test_hand_traces_the_mirrored_motion_on_the_other_side() -> None:
    motion = built_in_motions()[6]
    ends = []
    for turned in (False, True):
        apparatus = SimulatedApparatus(None, 0, turned=turned)
        rows = GuidedMotion()
        rows.add(motion.times_s.tolist(), motion.poses_deg.tolist())
        apparatus.guide("m", rows, pedal=True)
        seen, now_ms = [], 0
        while apparatus.state().hand.phase != "away":
            now_ms += 10
            apparatus.advance(now_ms * 1_000_000)
            if apparatus.state().hand.phase == "tracing":
                seen.append([axis.angle_deg for axis in apparatus.state().axes])
        ends.append(np.array(seen))
    here, there = ends
    n = min(len(here), len(there))
    assert np.abs(there[:n, 2:4] + here[:n, 2:4]).max() < 2.0
    assert np.abs(there[:n, 4] - here[:n, 4]).max() < 1.0
    wanted = motor_angles_deg(motion.poses_deg, "left")[:, :2]
    n = min(len(there), len(wanted))
    assert np.abs(there[:n, :2] - wanted[:n]).max() < 1.5
