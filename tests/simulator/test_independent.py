"""The independent plant: its physics by hand calculation, its parts, its patients, and that it stays out of a clinic."""

import math
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import mujoco
import numpy as np
import pytest
from typer.testing import CliRunner

from kata.cli.main import app
from kata.commissioning.direct_station import PlaybackError
from kata.device.config import simulated
from kata.device.ipc_messages import Load
from kata.evaluation.falls import fall
from kata.evaluation.station import VirtualStation
from kata.motion.linkage import LINKAGE
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.independent.parameters import IndependentParameters, entries, independent_parameters
from kata.simulator.independent.patients import PATIENTS, PassiveShoulder, PatientName
from kata.simulator.independent.plant import IndependentPlant
from kata.simulator.mechanics import MakeMechanics
from kata.simulator.parameters import SLOW_STEPS
from kata.simulator.plant import Plant

NO_TORQUE = (0.0,) * 5


def weightless(patient: PatientName = "healthy") -> IndependentPlant:
    plant = IndependentPlant(patient=patient, balancer_kg=0.0)
    plant.model.opt.gravity[:] = 0.0
    plant._constant[:] = [0.0] * 3
    return plant


def run(plant: IndependentPlant, steps: int, torques: tuple[float, ...] = NO_TORQUE) -> None:
    for n in range(steps):
        if n % SLOW_STEPS == 0:
            plant.update_slow_loads()
        plant.step(torques)


def push(plant: IndependentPlant, axis: int, torque_nm: float) -> None:
    """Push an arm with a constant torque."""
    plant.axes[axis].hand = (math.copysign(100.0, torque_nm), 0.0, 1000.0, 0.0, abs(torque_nm))


def test_every_number_has_a_unit_and_a_source() -> None:
    assert set(entries()) == {field.name for field in fields(IndependentParameters)}
    for name, entry in entries().items():
        assert set(entry) <= {"value", "unit", "source", "vary"}, name
        assert entry["unit"] and entry["source"], name


def test_a_seed_varies_patient_gears_and_drives() -> None:
    nominal, one, again = independent_parameters(), independent_parameters(1), independent_parameters(1)
    assert one == again != independent_parameters(2)
    for name in ("upper_arm_kg", "backlash_deg", "rotor_coulomb_nm", "supply_v", "output_share", "goal_delay_ms"):
        assert getattr(one, name) != getattr(nominal, name), name
    assert one.shoulder_m == nominal.shoulder_m


@pytest.mark.parametrize("turned", [False, True])
def test_raised_arm_weighs_what_mass_and_lever_say(turned: bool) -> None:
    """By hand: upper arm 2.0 kg at 0.436 x 0.285 m, forearm 1.6 kg at 0.285 + 0.682 x 0.245 x cos 80 deg, links 0.8 kg at 0.1 m."""
    plant = IndependentPlant(turned=turned, balancer_kg=0.0)
    sign = -1.0 if turned else 1.0
    plant.place(3, 0.0)
    plant.place(2, sign * math.radians(90.0))
    by_hand_nm = 9.81 * (2.0 * 0.436 * 0.285 + 1.6 * (0.285 + 0.682 * 0.245 * math.cos(math.radians(80.0))) + 0.8 * 0.1)
    dof = plant.model.joint("rotor3").dofadr[0]
    assert plant.data.qfrc_bias[dof] == pytest.approx(sign * by_hand_nm, rel=1e-3)
    assert by_hand_nm == pytest.approx(8.15, abs=0.01)


def test_balancer_carries_its_weight_times_its_lever() -> None:
    """Above the raised arm its cable is nearly vertical: 2 kg at 0.285 + 0.4 x 0.245 x cos 80 deg."""
    plant = IndependentPlant()
    plant.place(3, 0.0)
    plant.place(2, math.radians(90.0))
    dof = plant.model.joint("rotor3").dofadr[0]
    lever_m = 0.285 + 0.4 * 0.245 * math.cos(math.radians(80.0))
    assert plant.data.qfrc_actuator[dof] == pytest.approx(2.0 * 9.81 * lever_m, rel=0.05)


def test_released_arm_never_gains_energy() -> None:
    plant = IndependentPlant(balancer_kg=0.0)
    plant.model.opt.enableflags |= 2  # mjENBL_ENERGY
    plant.place(3, math.radians(60.0))
    girdle = [plant.model.joint(name).qposadr[0] for name in ("phi", "psi")]
    energies = []
    for _ in range(600):
        plant.step(NO_TORQUE)
        energies.append(float(plant.data.energy.sum() - np.dot(plant._constant[:2], plant.data.qpos[girdle])))
    assert np.diff(energies).max() < 2e-3
    assert energies[-1] < energies[0] - 1.0


@pytest.mark.parametrize("theta_deg", [(-10.0, 100.0), (35.0, 100.0), (0.0, 122.0), (35.0, 122.0)])
def test_linkage_closes_and_agrees_with_the_papers_equations(theta_deg: tuple[float, float]) -> None:
    plant = IndependentPlant()
    opened_m = 0.0
    for axis in (0, 1):
        plant.place(axis, math.radians(theta_deg[axis]))
        opened_m = max(opened_m, plant.closure_error_m())
    assert opened_m < 1e-4
    arm_deg = [math.degrees(plant.axes[axis].arm_angle) for axis in (0, 1)]
    assert arm_deg == pytest.approx(theta_deg, abs=1.0)
    found = [math.degrees(plant.data.qpos[plant.model.joint(name).qposadr[0]]) for name in ("phi", "psi")]
    assert found == pytest.approx(LINKAGE.forward_deg(arm_deg).tolist(), abs=0.05)


def test_gear_has_the_play_of_its_data_sheet() -> None:
    plant = weightless()
    plant.jam(2, jammed=True)
    gaps = {}
    for torque in (1.0, -1.0, 4.0, -4.0):
        push(plant, 2, torque)
        run(plant, 300)
        gaps[torque] = math.degrees(plant.data.qpos[plant.model.joint("gap3").qposadr[0]])
    assert gaps[1.0] - gaps[-1.0] == pytest.approx(0.25, abs=0.05)
    # Under 4 Nm the flanks give way by 4 / 3000 rad on each side.
    assert gaps[4.0] - gaps[-4.0] == pytest.approx(0.25 + 2 * math.degrees(4.0 / 3000.0), abs=0.05)
    assert abs(math.degrees(plant.axes[2].speed)) < 0.01


def test_shaft_sticks_below_its_friction_and_moves_above_it() -> None:
    friction_nm = independent_parameters().rotor_coulomb_nm[3]
    moved = []
    for torque in (0.8 * friction_nm, friction_nm + 0.5):
        plant = weightless()
        before = plant.axes[3].angle
        run(plant, 300, (0.0, 0.0, 0.0, torque, 0.0))
        moved.append(math.degrees(plant.axes[3].angle - before))
    assert abs(moved[0]) < 0.05
    assert moved[1] > 1.0


def test_arm_slips_in_the_cuff_only_above_its_limit() -> None:
    slipped = []
    for torque in (1.5, 4.0):
        plant = weightless()
        plant.jam(4, jammed=True)
        push(plant, 4, torque)
        run(plant, 300)
        slipped.append(math.degrees(plant.data.qpos[plant.model.joint("slip5").qposadr[0]]))
    assert abs(slipped[0]) < 0.3
    assert slipped[1] > 3.0


@pytest.mark.parametrize(("axis", "peak_deg"), [(2, 98.4), (3, 116.9), (4, 4.5)])
def test_frozen_shoulder_gives_way_up_to_the_published_angles(axis: int, peak_deg: float) -> None:
    """Rundquist et al. 2003. A hand pushes with the torque that belongs to a peak; friction carries some of it."""
    plant = weightless("frozen")
    plant.place(axis, math.radians(peak_deg - 12.0))
    push(plant, axis, plant.parameters.peak_torque_nm)
    run(plant, 1500)
    assert math.degrees(plant.axes[axis].arm_angle) == pytest.approx(peak_deg, abs=3.0)


def test_stages_differ_in_end_feel() -> None:
    """Torque 5 deg before the peak, as a share of the torque at the peak: hard is small."""
    shares = {}
    for name in ("freezing", "frozen", "thawing"):
        patient = PATIENTS[name]
        shoulder = PassiveShoulder(patient, 3.0, (1, 1, 1))
        peak = math.radians(patient.peaks_deg[0][1])
        shares[name] = shoulder.passive_nm(0, peak - math.radians(5.0), 0.0) / shoulder.passive_nm(0, peak, 0.0)
    assert shares["frozen"] < shares["thawing"] < shares["freezing"]


def test_only_a_patient_in_pain_guards_more_at_speed() -> None:
    def guarding_nm(name: PatientName, angle_deg: float, speed_deg_s: float) -> float:
        shoulder = PassiveShoulder(PATIENTS[name], 3.0, (1, 1, 1))
        angles = [math.radians(angle_deg), 0.0, math.radians(-25.0)]
        return [
            shoulder.update_guarding(angles, math.radians(speed_deg_s), math.radians(20.0), 0.03) for _ in range(200)
        ][-1]

    calm, slow, fast = (guarding_nm("freezing", *how) for how in ((60.0, 40.0), (98.0, 2.0), (98.0, 40.0)))
    assert calm == 0.0
    assert 0.3 < slow < fast
    assert guarding_nm("healthy", 119.0, 40.0) == 0.0


def test_same_seed_gives_the_same_motion_and_another_seed_another() -> None:
    def end(seed: int) -> list[float]:
        plant = IndependentPlant(seed)
        plant.place(3, math.radians(60.0))
        run(plant, 200)
        return [axis.arm_angle for axis in plant.axes]

    assert end(1) == end(1)
    assert end(1) != end(2)


@pytest.mark.parametrize("make", [Plant, IndependentPlant])
def test_both_plants_hold_their_position_under_the_same_drives(make: MakeMechanics) -> None:
    """Through registers, bus and control loop: a started station holds the commanded angles."""
    station = VirtualStation(simulated("virtual"), 1, make_mechanics=make)
    apparatus = station._world.apparatus
    for drive in apparatus.drives:
        drive.set_goal(drive.angle)
        drive.switch(on=True)
    before = apparatus.arm_deg
    apparatus.advance(station.t_ns + 1_000_000_000)
    assert apparatus.arm_deg == pytest.approx(before, abs=1.0)


def test_held_drive_reports_its_limit_whatever_its_magnets_give() -> None:
    """A drive measures its current. Weak magnets show at the arm, not in the report."""
    apparatus = SimulatedApparatus(0, 0, make_mechanics=IndependentPlant)
    plant = apparatus._plant
    assert isinstance(plant, IndependentPlant)
    drive, share = apparatus.drives[3], plant.parameters.output_share[3]
    assert share < 0.95
    drive.tune(160.0, 400.0, 7.2, 4.0)
    drive.switch(on=True)
    apparatus.jam(4, jammed=True)
    drive.set_goal(drive.angle + 0.5)
    apparatus.advance(500_000_000)
    assert drive.torque_nm == pytest.approx(4.0)
    assert plant.data.ctrl[3] == pytest.approx(share * 4.0)


def test_station_names_resistance_of_a_drive_with_weak_magnets() -> None:
    """At its limit this drive gives 3.7 Nm of the nominal 4 Nm. The report of its current must still show the limit."""
    station = VirtualStation(simulated("virtual"), 0, make_mechanics=IndependentPlant)
    station._world.apparatus.hold_against(4, 15.0)
    rest = np.array([axis.angle_deg for axis in station._world.apparatus.state().axes])
    raised = rest + np.array([0.0, 0.0, 0.0, 60.0, 0.0])
    load = Load(
        run_id="run",
        recording_id="recording",
        times_s=np.array([0.0, 1.0]).tobytes(),
        angles_deg=np.array([raised, raised]).tobytes(),
        method="smooth",
    )
    with pytest.raises(PlaybackError, match="Motor 4 met resistance while the arm moved to the start"):
        station.play(load, 1.0)


def test_independent_apparatus_turns_to_the_other_side() -> None:
    apparatus = SimulatedApparatus(1, 0, make_mechanics=IndependentPlant)
    right = apparatus.arm_deg
    apparatus.turn(turned=True)
    assert apparatus.arm_deg[2] == pytest.approx(-right[2])


@pytest.mark.parametrize(("side", "down"), [("right", -1), ("left", 1)])
def test_printed_model_is_the_plants(tmp_path: Path, side: str, down: int) -> None:
    file = tmp_path / "apparatus.xml"
    assert CliRunner().invoke(app, ["mjcf", "--side", side, "--seed", "3", "--out", str(file)]).exit_code == 0
    printed, plant = mujoco.MjModel.from_xml_path(str(file)), IndependentPlant(3, turned=side == "left").model
    assert printed.opt.gravity[2] == pytest.approx(down * 9.81)
    for name in ("body_mass", "body_inertia", "jnt_range", "dof_frictionloss", "dof_damping", "eq_data"):
        assert getattr(printed, name) == pytest.approx(getattr(plant, name)), name


def test_a_clinic_never_imports_mujoco() -> None:
    code = (
        "import sys, kata.cli.serve, kata.device.process, kata.simulator.process, kata.evaluation.commands; "
        "sys.exit('mujoco' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0


def test_a_released_arm_falls_and_a_balancer_slows_it() -> None:
    raised = (0.0, 0.0, 90.0, 0.0, 0.0)
    alone, balanced = fall(raised, balancer_kg=0.0), fall(raised, balancer_kg=2.0)
    assert alone.fastest_deg_s > 200.0
    assert alone.after_reaction_deg > 20.0
    assert balanced.fastest_deg_s < 0.8 * alone.fastest_deg_s


def test_hands_hold_a_heavy_arm_until_its_drives_have_torque() -> None:
    """Without hands, this arm falls to the end of its range while the drives are configured and verified."""
    apparatus = SimulatedApparatus(1, 0, make_mechanics=IndependentPlant)
    apparatus.support()
    before = apparatus.arm_deg
    apparatus.advance(3_000_000_000)
    assert apparatus.arm_deg == pytest.approx(before, abs=1.0)
    for drive in apparatus.drives:
        drive.set_goal(drive.angle)
        drive.switch(on=True)
    apparatus.advance(3_100_000_000)
    assert [joint.hand for joint in apparatus._plant.joints] == [None] * 5
    for drive in apparatus.drives:
        drive.switch(on=False)
    apparatus.advance(3_200_000_000)
    assert None not in [joint.hand for joint in apparatus._plant.joints]
