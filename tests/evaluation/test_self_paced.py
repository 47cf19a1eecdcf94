"""Self-paced assistance by the real control loop, on simulated arms whose effort is known."""

import math
from itertools import pairwise
from typing import get_args

import numpy as np
import pytest

from kata.device.config import read, simulated_with_load
from kata.device.journal import PHASE_PLAYING, PHASE_REVERSING
from kata.evaluation.self_paced import PacedCase, PacedStation, Patient, judge, play
from kata.motion.linkage import Floats
from kata.simulator.effort import PatientEffort
from kata.simulator.mechanics import PlantName
from tests.support.paths import ROOT

BEGINS_S, LETS_GO_S, TREMBLES_S, STRONG_S, PUSHES_BACK_S, ENDS_S = 1.0, 3.0, 4.0, 5.0, 7.0, 8.0
"""Times at which the patient of a session changes the effort."""
JITTER = 1.01
"""The clock of a sample differs from the nominal one by up to this factor."""


@pytest.fixture(scope="module")
def session() -> PacedStation:
    """Return a station whose patient does nothing, helps, lets go, trembles, helps strongly, and pushes back."""
    station, outcome = play(PacedCase("simple", "session"), ENDS_S)
    assert outcome == "resistance" or station.mode == "playing", outcome
    return station


def places(station: PacedStation) -> tuple[Floats, Floats]:
    """Return times since the patient began, and places on the recording, of the samples that were played."""
    run = station.journal()
    played = (run.t_ns >= station.began_ns) & (run.phase == PHASE_PLAYING)
    return (run.t_ns[played] - station.began_ns) / 1e9, run.path_s[played]


def way_s(station: PacedStation, begins_s: float, ends_s: float) -> float:
    """Return the part of the recording that was played between two times."""
    t_s, place_s = places(station)
    part = place_s[(t_s >= begins_s) & (t_s <= ends_s)]
    return float(part[-1] - part[0])


def test_arm_moves_only_with_lasting_effort(session: PacedStation) -> None:
    assert way_s(session, 0.0, BEGINS_S) == 0.0
    assert way_s(session, BEGINS_S, LETS_GO_S) > 0.5
    assert way_s(session, LETS_GO_S + 0.5, TREMBLES_S) == 0.0
    assert way_s(session, TREMBLES_S, STRONG_S) == 0.0
    assert way_s(session, STRONG_S, PUSHES_BACK_S) > 1.0


def test_pace_is_never_above_the_recordings_and_never_negative(session: PacedStation) -> None:
    _, place_s = places(session)
    # A setpoint leads the movement. Its lead falls with the pace.
    assert np.diff(place_s).min() > -0.001
    assert (place_s[5:] - place_s[:-5]).max() <= JITTER * 0.05


def test_stronger_effort_gives_a_higher_pace(session: PacedStation) -> None:
    helped = way_s(session, LETS_GO_S - 0.5, LETS_GO_S) / 0.5
    strong = way_s(session, PUSHES_BACK_S - 0.5, PUSHES_BACK_S) / 0.5
    assert 0.3 < helped < strong <= JITTER


def test_arm_does_not_move_on_after_letting_go(session: PacedStation) -> None:
    rows = np.array(session.rows)
    arm_deg = np.degrees(rows[(rows[:, 0] >= LETS_GO_S) & (rows[:, 0] < TREMBLES_S), 2])
    assert abs(arm_deg - arm_deg[0]).max() < 2.0


def test_patient_who_pushes_back_is_taken_back(session: PacedStation) -> None:
    run = session.journal()
    back_s = (run.t_ns[run.phase == PHASE_REVERSING] - session.began_ns) / 1e9
    assert PUSHES_BACK_S + 0.1 <= back_s[0] < PUSHES_BACK_S + 0.5


def test_stored_work_is_that_of_the_patient(session: PacedStation) -> None:
    """The tremor moves the arm within its softness while the path rests. The stored work does not contain this."""
    rows = np.array(session.rows)
    true_j = np.cumsum(rows[:, 1] * rows[:, 3]) * 0.01
    played = rows[(rows[:, 0] > STRONG_S + 0.5) & (rows[:, 0] < PUSHES_BACK_S)]
    expected_j = np.sum(played[:, 1] * played[:, 3]) * 0.01
    assert played[-1, 4] - played[0, 4] == pytest.approx(expected_j, rel=0.15)
    assert true_j.min() > -0.01


def test_the_station_file_for_trying_is_evaluated() -> None:
    assert read(ROOT / "docs/how-to/simulated-with-load.toml") == simulated_with_load("simulated")


@pytest.mark.campaign
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("plant", get_args(PlantName))
def test_every_patient_on_both_plants(plant: PlantName) -> None:
    found = {patient: judge(PacedCase(plant, patient, seed=0)) for patient in get_args(Patient)}
    for patient, figures in found.items():
        assert figures.outcome in ("playing", "completed") or patient == "session", figures
        assert figures.top_pace <= JITTER
        assert figures.faster_near_end_deg_s < 1.0
        assert figures.given_j < 0.05
        assert figures.swings <= 6
    for patient in ("nothing", "resists", "trembles"):
        assert found[patient].top_pace == 0.0
        assert found[patient].moved_deg < 1.0
    assert found["helps"].stored_work_j == pytest.approx(found["helps"].true_work_j, rel=0.2)
    rested_s = found["lets_go"].rest_after_s
    assert rested_s is not None and rested_s < 1.0
    slower, faster = (found[patient].mean_pace for patient in ("helps", "strong"))
    assert slower <= faster


def test_effort_of_the_simulated_patient_follows_the_movement() -> None:
    patient = PatientEffort()
    outwards = [[0.0, 0.0, math.radians(0.05 * n), 0.0, 0.0] for n in range(200)]
    assert all(patient.hands(goals) is None for goals in outwards[:50])
    patient.effort_nm = 2.0
    *_, hands = (patient.hands(goals) for goals in outwards[50:])
    assert hands is not None and hands[2][0] > 0
    assert hands[2][4] == pytest.approx(2.0)
    patient.effort_nm = -2.0
    hands = patient.hands(outwards[-1])
    assert hands is not None and hands[2][0] < 0
    # A patient who helps an arm that rests tries the other direction.
    patient.effort_nm = 2.0
    signs = [hands[2][0] > 0 for _ in range(600) if (hands := patient.hands(outwards[-1]))]
    assert any(before != after for before, after in pairwise(signs))
