"""Makes the reference page that leads from the paper (Sun et al., Robotics 2025, 14, 12) to code and tests.

``tests/repo_checks/test_paper_page.py`` holds that each section, equation, figure and table appears once, and that everything named exists.
"""

from dataclasses import dataclass
from typing import Final, Literal

Status = Literal["built", "in part", "hardware", "not published", "text only"]


@dataclass(frozen=True)
class Place:
    """One part of the paper. ``code`` and ``tests`` are ``path::name``; a name may have a dot."""

    parts: str
    """``Equations 1-2``, ``Figures 11-18, A1-A14`` and so on."""
    what: str
    status: Status
    code: tuple[str, ...] = ()
    tests: tuple[str, ...] = ()
    note: str = ""


_LINKAGE: Final = "backend/kata/motion/linkage.py"
_TEST_LINKAGE: Final = "tests/motion/test_linkage.py"
_CASES: Final = "backend/kata/evaluation/cases.py::paper_cases"
_TEST_CASES: Final = "tests/evaluation/test_evaluate.py::test_fourteen_cases_are_the_papers_with_motors_of_its_figures"

PLACES: Final = (
    Place("Section 1", "introduction", "text only"),
    Place("Section 2.1; Figure 1", "anatomy of the shoulder complex", "text only"),
    Place(
        "Figure 2",
        "six basic motions with their reference range",
        "built",
        ("backend/kata/motion/axes.py::BASIC_MOTIONS", "backend/kata/motion/builtin.py::built_in_motions"),
        ("tests/motion/test_axes.py::test_apparatus_reaches_the_reference_where_the_paper_does",),
    ),
    Place(
        "Section 2.2; Figure 3",
        "five motors, turned by 180 deg for the other shoulder; pedal, emergency stop, motors that yield",
        "built",
        (
            "backend/kata/motion/sides.py::mirrored_deg",
            "backend/kata/device/teaching.py::Teaching",
            "backend/kata/device/faults.py::FAULTS",
            "backend/kata/device/resistance.py::ResistanceMonitor",
        ),
        (
            "tests/motion/test_sides.py::test_signs_follow_from_rotation_matrices",
            "tests/device/test_teaching.py::test_records_only_while_the_pedal_is_down",
            "tests/device/test_stops.py::test_emergency_stop_cuts_torque_in_the_cycle_that_reads_it",
            "tests/device/test_resistance.py::test_resistance_above_the_patients_level_reverses_the_stroke_and_waits",
        ),
        "the mechanism of the turn is in the paper's references",
    ),
    Place(
        "Table 1",
        "motors, supplies, ball joints of +-30 deg, foot switch, tool balancer of 1 to 2 kg",
        "in part",
        (
            "backend/kata/simulator/motors.py::MOTORS",
            "backend/kata/simulator/independent/parameters.py::IndependentParameters",
            "backend/kata/motion/reach.py::reachable_set",
            "backend/kata/motion/reach.py::nearest",
            "backend/kata/device/pedal.py::UsbPedal",
        ),
        (
            "tests/simulator/test_motors.py::test_motor_stalls_and_idles_as_its_data_sheet_says",
            "tests/simulator/test_independent.py::test_balancer_carries_its_weight_times_its_lever",
            "tests/motion/test_reach.py::test_ball_joints_exceed_their_limit_only_in_the_corners",
            "tests/motion/test_reach.py::test_margin_is_how_far_the_arm_may_still_turn",
            "tests/device/test_pedal.py::test_configured_pedal_records",
        ),
        "motor 5 is not published; the ball joints' cone limits what is accepted and its margin is shown, the simulated mechanics do not have it",
    ),
    Place(
        "Figure 4",
        "a PC and five motors on RS-485, position control, 10 Hz",
        "built",
        ("backend/kata/device/bus/factory.py::make_bus", "backend/kata/motion/trajectory.py::ZeroOrderHold"),
        ("tests/device/test_methods.py::test_ten_hertz_station_plays_the_paper_method_at_its_rate",),
        "the protocol of PX-320 is not public; Dynamixel and Modbus RTU are spoken",
    ),
    Place(
        "Sections 3.1, 3.1.1; Figure 5",
        "parallel links of the scapula",
        "built",
        (f"{_LINKAGE}::Linkage", "backend/kata/simulator/independent/model.py::linkage_geometry"),
        ("tests/simulator/test_independent.py::test_linkage_closes_and_agrees_with_the_papers_equations",),
        "the link lengths are not published; ours",
    ),
    Place(
        "Section 3.1.2; Figures 6-7",
        "serial links of the shoulder joint, pinion and spur gear around the upper arm",
        "built",
        ("backend/kata/motion/shoulder.py::humerus_direction", "backend/kata/simulator/independent/model.py::mjcf"),
        ("tests/motion/test_shoulder.py::test_direction_matches_the_links_turned_one_after_another",),
    ),
    Place(
        "Figures 8-9",
        "arm fixers and elbow fixers by motion and mode",
        "built",
        ("backend/kata/clinic/sessions/checklist.py::playback_fixtures",),
        ("tests/clinic/test_checklist.py::test_fixer_follows_teaching_or_else_the_rotation",),
    ),
    Place(
        "Section 3.2; Figure 10; Equations 1-12",
        "geometry and loop closure of the scapula's links",
        "built",
        (f"{_LINKAGE}::Leg",),
        (f"{_TEST_LINKAGE}::test_the_loops_close_over_the_whole_region",),
        "two misprints of Equations 1 and 2 are mended: they contradict Equations 15 to 20",
    ),
    Place(
        "Equations 13-20",
        "inverse kinematics; ours in closed form, and forward kinematics",
        "built",
        (f"{_LINKAGE}::Linkage.inverse_deg", f"{_LINKAGE}::Linkage.forward_deg"),
        (
            f"{_TEST_LINKAGE}::test_both_ways_agree_over_the_whole_region",
            f"{_TEST_LINKAGE}::test_linkage_has_no_singularity_within_its_reach",
        ),
    ),
    Place(
        "Sections 4, 4.1; Table 2",
        "range of motion of the apparatus",
        "built",
        ("backend/kata/motion/axes.py::POSE_RANGE_DEG", "backend/kata/evaluation/tables.py::rom_reached"),
        ("tests/motion/test_reach.py::test_rows_of_the_table_are_reachable_to_their_ends_only",),
        "rows 3, 5 and 6 are damaged in our copy of the paper",
    ),
    Place(
        "Sections 4.2-4.7; Figures 11-16",
        "teaching and playback of the six basic motions, error of each motor",
        "built",
        (_CASES, "backend/kata/evaluation/page.py::as_html", "backend/kata/evaluation/paper.py::ERRORS"),
        (_TEST_CASES, "tests/evaluation/test_evaluate.py::test_report_is_self_contained_and_says_it_is_simulated"),
        "simulated; no figure of a real apparatus exists",
    ),
    Place(
        "Section 4.8; Figures 17-18",
        "the arbitrary motion; slip between arm and cuff as a limit of the method",
        "built",
        (
            _CASES,
            "backend/kata/simulator/independent/model.py::mjcf",
            "backend/kata/motion/patient_angle.py::PatientAngleEstimator",
        ),
        (
            _TEST_CASES,
            "tests/simulator/test_independent.py::test_arm_slips_in_the_cuff_only_above_its_limit",
            "tests/motion/test_patient_angle.py::test_uncertainty_covers_patients_with_slip_up_to_the_stated_rate",
        ),
        "simulated. The patient's angle is estimated from goniometer readings; the rate of slip is assumed",
    ),
    Place(
        "Section 5",
        "what the authors name as open",
        "in part",
        (),
        (),
        "the 10 Hz rate, the start and motor 5 are worked on",
    ),
    Place("Figures A1-A14", "snapshots of the fourteen cases", "built", (_CASES,), (_TEST_CASES,)),
)
"""Every section, equation, figure and table, each once."""


def paper() -> str:
    """Return the page docs/reference/paper.md."""
    rows = "\n".join(
        f"| {place.parts} | {place.what} | {_names(place.code)} | {_names(place.tests)} "
        f"| {place.status}{f': {place.note}' if place.note else ''} |"
        for place in PLACES
    )
    return f"""# From the paper to the code

This page is generated by `python -m docs.generate`. Do not edit it.
The source is `PLACES` in `docs/paper.py`. The paper is Sun et al., Robotics 2025, 14, 12 (doi 10.3390/robotics14020012). Its data were not
published; Kata was tested against simulations only.

| Paper | What | Code | Tests | Status |
|---|---|---|---|---|
{rows}
"""


def _names(names: tuple[str, ...]) -> str:
    return "<br>".join(f"`{name}`" for name in names)
