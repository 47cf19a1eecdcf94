"""Accuracy of a stretch on simulated shoulders whose true torque is known: ``python -m kata.evaluation.stretch``.

Each case: a baseline with a test weight, then a patient's arm that is stretched, both by the control loop that treats patients, on virtual time.
docs/explanation/stretch.md has the figures.
"""

import argparse
import json
import logging
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from random import Random
from typing import Final, Literal, get_args

import numpy as np
from rich.console import Console

from kata.commissioning.direct_station import PlaybackError
from kata.device.ipc_messages import Load
from kata.device.journal import PHASE_PLAYING, Journal
from kata.evaluation.end_feel import CHOSEN_NM, EndFeelCase, PatientStation, during_run, requested, station_config
from kata.motion.end_feel import STATED_SHARE
from kata.simulator.independent.patients import PatientName
from kata.simulator.mechanics import PlantName

HOLD_S: Final = 15.0
REPETITIONS: Final = 2
_CYCLE_S: Final = 0.01
_BACKWARD_DEG: Final = 1e-4
_ANSWER_WITHIN_S: Final = 1.0
_OVER_NM: Final = 0.1
_STRETCHED_SHARE: Final = 0.5
"""Share of the chosen torque above which the patient acts."""

Patient = Literal["relaxed", "guarding", "cough", "lets_go"]


@dataclass(frozen=True)
class StretchCase:
    """One stretch of one patient."""

    plant: PlantName
    seed: int
    motor: int
    patient: Patient
    stage: PatientName = "frozen"


@dataclass(frozen=True)
class StretchFigures:
    """Figures of a stretch; None without a result."""

    case: StretchCase
    outcome: str
    peak_over_nm: float | None = None
    """Largest torque between apparatus and shoulder above the chosen one, with what the patient's muscles push."""
    capsule_over_nm: float | None = None
    """The same without the patient's muscles."""
    held_nm: float | None = None
    """Median torque in the counted time, below the chosen one."""
    true_s: float | None = None
    counted_s: float | None = None
    """Time with at least 60 % of the chosen torque."""
    answers_ms: tuple[float, ...] = ()
    """Times from a torque of 0.1 Nm above the chosen one to the first setpoint that is nearer to rest."""


class SuddenPush:
    """Random events of a patient: the torque that the muscles add to the arm, outwards. They begin while the shoulder is stretched."""

    def __init__(
        self, patient: Patient, chosen_nm: float, station: PatientStation, random: Random, longest_s: float = 6.0
    ) -> None:
        """``chosen_nm``: torque of the test or stretch. Half of it stretches the shoulder. ``longest_s``: longest time with a stretched
        shoulder before the first event.
        """
        self._random = random
        self._patient = patient
        self._station = station
        self._stretched_nm = _STRETCHED_SHARE * chosen_nm
        self._goal_nm = self._strength_nm = 0.0
        self._share = 1.0
        self._until_s, self._rest_s = 0.0, self._random.uniform(min(0.5, longest_s / 10), longest_s)

    def at(self, time_s: float) -> float:
        """Return the torque at a time, Nm. Call it every 10 ms."""
        if time_s < self._until_s:
            pass
        elif self._goal_nm:
            # The patient lets go.
            self._goal_nm, self._share = 0.0, _CYCLE_S / 0.05
            self._rest_s = self._random.uniform(3.0, 8.0)
        elif self._rest_s <= 0.0:
            self._begin(time_s)
        elif self._station.against_nm[-1] > self._stretched_nm:
            self._rest_s -= _CYCLE_S
        self._strength_nm += (self._goal_nm - self._strength_nm) * self._share
        return self._strength_nm

    def _begin(self, time_s: float) -> None:
        draw = self._random.uniform
        if self._patient == "guarding":
            self._goal_nm, lasts_s, rise_s = -draw(0.5, 2.0), draw(0.5, 2.5), 0.3
        elif self._patient == "cough":
            self._goal_nm, lasts_s, rise_s = self._random.choice((-1, 1)) * draw(0.5, 2.0), draw(0.1, 0.3), 0.05
        else:
            # The patient helps the apparatus, and lets go at once.
            self._goal_nm, lasts_s, rise_s = draw(0.3, 1.0), draw(1.0, 3.0), 0.5
        self._until_s, self._share = time_s + lasts_s, _CYCLE_S / rise_s


def judge(case: StretchCase) -> StretchFigures:
    """Run one stretch."""
    asked_of = EndFeelCase(case.plant, case.seed, case.stage, case.motor)
    station = PatientStation(asked_of, station_config(case.plant, case.seed))
    asked = requested(asked_of, station, HOLD_S, REPETITIONS)
    if case.patient != "relaxed":
        station.push = SuddenPush(case.patient, CHOSEN_NM[case.motor], station, Random(f"stretch {case}"))
    try:
        run = station.play(asked.load, REPETITIONS * (3 * asked.out.duration_s + HOLD_S))
    except PlaybackError as error:
        return StretchFigures(case, str(error))
    against = during_run(station.against_nm, station, run)
    passive = during_run(station.passive_nm, station, run)
    chosen_nm = CHOSEN_NM[case.motor]
    counts = against >= STATED_SHARE * chosen_nm
    assert run.end is not None
    return StretchFigures(
        case,
        "stretched" if np.any(counts) else "not stretched",
        float(against.max()) - chosen_nm,
        float(passive.max()) - chosen_nm,
        float(np.median(against[counts])) - chosen_nm if np.any(counts) else None,
        float(counts.sum()) * _CYCLE_S,
        run.end.held_s,
        answers_ms(station, run, asked.load, chosen_nm),
    )


def answers_ms(station: PatientStation, run: Journal, load: Load, chosen_nm: float) -> tuple[float, ...]:
    """Return the time from each torque of 0.1 Nm above the chosen one to the first setpoint nearer to rest."""
    assert load.end_feel is not None
    times = np.array(station.noted_ns)
    over = np.array(station.against_nm) >= chosen_nm + _OVER_NM
    begins = times[1:][over[1:] & ~over[:-1]]
    setpoint = run.setpoint_deg[:, load.end_feel.motor - 1]
    back = run.t_ns[1:][(np.diff(setpoint) < -_BACKWARD_DEG) & (run.phase[1:] == PHASE_PLAYING)]
    answers = []
    for begin in begins:
        later = back[back >= begin]
        if len(later) and later[0] - begin < _ANSWER_WITHIN_S * 1e9:
            answers.append(float(later[0] - begin) / 1e6)
        elif run.t_ns[0] <= begin <= run.t_ns[-1]:
            answers.append(float("inf"))
    return tuple(answers)


def main() -> None:
    """Print the figures of each case, and all figures beside the goals."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plant", choices=get_args(PlantName), default="simple")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--patients", default=",".join(get_args(Patient)))
    parser.add_argument("--motors", default="3,4,5")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    logging.disable(logging.INFO)
    results: list[StretchFigures] = []
    for seed in range(arguments.seed, arguments.seed + arguments.seeds):
        for motor in map(int, arguments.motors.split(",")):
            for patient in arguments.patients.split(","):
                results.append(judge(StretchCase(arguments.plant, seed, motor, patient)))
                Console(width=200, highlight=False).print(_line(results[-1]))
                if arguments.json:
                    arguments.json.write_text(json.dumps([asdict(figures) for figures in results], indent=1) + "\n")
    for line in summary(results):
        Console(width=200, highlight=False).print(line)


def _line(figures: StretchFigures) -> str:
    case = figures.case
    name = f"{case.plant} seed {case.seed}, motor {case.motor}, {case.patient}: {figures.outcome}"
    if figures.true_s is None or figures.counted_s is None or figures.held_nm is None:
        return name
    answers = ", ".join(f"{answer:.0f}" for answer in figures.answers_ms)
    return (
        f"{name}; peak {figures.peak_over_nm:+.2f} Nm, passive part {figures.capsule_over_nm:+.2f} Nm, held {figures.held_nm:+.2f} Nm, "
        f"true {figures.true_s:.1f} s, counted {figures.counted_s:.1f} s ({_difference(figures):+.1f} %), answers {answers} ms"
    )


def _difference(figures: StretchFigures) -> float:
    assert figures.true_s and figures.counted_s is not None
    return 100 * (figures.counted_s / figures.true_s - 1)


def summary(results: Sequence[StretchFigures]) -> list[str]:
    """Return the largest torque and error of each kind of patient, and the slowest answers."""
    lines = []
    for patient in get_args(Patient):
        group = [
            figures
            for figures in results
            if figures.case.patient == patient and figures.peak_over_nm is not None and figures.true_s
        ]
        if group:
            errors = [abs(_difference(figures)) for figures in group]
            lines.append(
                f"{patient}: {len(group)} cases; peak above at most {max(f.peak_over_nm or 0.0 for f in group):+.2f} Nm, "
                f"passive part {max(f.capsule_over_nm or 0.0 for f in group):+.2f} Nm; "
                f"count wrong by {np.median(errors):.1f} % (median), {max(errors):.1f} % (worst)"
            )
    answers = [answer for figures in results for answer in figures.answers_ms]
    if answers:
        lines.append(f"{len(answers)} answers: p50 {np.median(answers):.0f} ms, worst {max(answers):.0f} ms")
    return lines


if __name__ == "__main__":
    main()
