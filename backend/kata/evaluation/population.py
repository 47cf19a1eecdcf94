"""End-feel tests of many random patients, and of patients whose arm is fastened again: ``python -m kata.evaluation.population``.

Each patient has an own shoulder, on one of a few simulated apparatus whose baselines are measured once. Some patients guard, cough, or help the
apparatus and let go while the shoulder is stretched. docs/explanation/end-feel-figures.md has the figures.
"""

import argparse
import json
import logging
import multiprocessing
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from random import Random
from typing import Final, get_args

import numpy as np
from rich.console import Console

from kata.commissioning.direct_station import PlaybackError
from kata.evaluation.end_feel import (
    CHOSEN_NM,
    STAGES,
    EndFeelCase,
    PatientStation,
    during_run,
    judge_run,
    requested,
    station_config,
)
from kata.evaluation.stretch import Patient, SuddenPush, answers_ms
from kata.motion.linkage import Floats
from kata.simulator.mechanics import PlantName

APPARATUS: Final = 10
"""Number of simulated apparatus."""
REFIT_DEG: Final = 1.0
"""Standard deviation of the angle at which an arm is fastened again. It is that of the assumed slip after one minute
(:data:`kata.motion.patient_angle.SLIP_DEG_PER_ROOT_MIN`).
"""
_FIRST_WITHIN_S: Final = 2.0
"""An event begins at the latest after this time with a stretched shoulder. A test stretches it for a few seconds."""
_CASES_A_TASK: Final = 10


@dataclass(frozen=True)
class RandomPatient:
    """One test of one patient."""

    case: EndFeelCase
    acts: Patient


@dataclass(frozen=True)
class PatientFigures:
    """Figures of a test; None without one."""

    patient: RandomPatient
    outcome: str
    """measured, the reason why there are no figures, or the refusal of the station."""
    peak_over_nm: float | None = None
    """Largest torque between apparatus and shoulder above the chosen one, with what the patient's muscles push."""
    capsule_over_nm: float | None = None
    """The same without the patient's muscles."""
    range_deg: float | None = None
    stiffness_nm_deg: float | None = None
    answers_ms: tuple[float, ...] = ()
    """Times from a torque of 0.1 Nm above the chosen one to the first setpoint that is nearer to rest."""
    took_s: float = 0.0
    """Processor time."""


def random_patients(plant: PlantName, numbers: Iterable[int]) -> list[RandomPatient]:
    """Return the patients with these numbers. A number determines apparatus, motor, shoulder and what the patient does."""
    found = []
    for number in numbers:
        random = Random(f"patient {number}")
        stage = random.choice(STAGES) if plant == "mujoco" else "healthy"
        motor, seed = random.choice(list(CHOSEN_NM)), random.randrange(APPARATUS)
        acts: Patient = random.choice(get_args(Patient))
        found.append(RandomPatient(EndFeelCase(plant, seed, stage, motor, person=number), acts))
    return found


def refitted_patients(plant: PlantName, numbers: Iterable[int], refits: int) -> list[RandomPatient]:
    """Return relaxed patients whose arms are fastened ``refits`` times."""
    found = []
    for number in numbers:
        random = Random(f"refit {number}")
        stage = random.choice(STAGES[:3]) if plant == "mujoco" else "healthy"
        motor, seed = random.choice([3, 4]), random.randrange(APPARATUS)
        for _ in range(refits):
            refit_deg = random.gauss(0.0, REFIT_DEG)
            case = EndFeelCase(plant, seed, stage, motor, person=number, refit_deg=refit_deg)
            found.append(RandomPatient(case, "relaxed"))
    return found


def judge(patient: RandomPatient) -> PatientFigures:
    """Run one test."""
    begun_s = time.process_time()
    case, chosen_nm = patient.case, CHOSEN_NM[patient.case.motor]
    station = PatientStation(case, station_config(case.plant, case.seed))
    asked = requested(case, station)
    if patient.acts != "relaxed":
        random = Random(f"acts {case}")
        station.push = SuddenPush(patient.acts, chosen_nm, station, random, _FIRST_WITHIN_S)
    try:
        run = station.play(asked.load, 6 * asked.out.duration_s)
    except PlaybackError as error:
        return PatientFigures(patient, str(error), took_s=time.process_time() - begun_s)
    outcome, figures = judge_run(case, asked, run)
    return PatientFigures(
        patient,
        outcome,
        float(during_run(station.against_nm, station, run).max()) - chosen_nm,
        float(during_run(station.passive_nm, station, run).max()) - chosen_nm,
        figures.range_deg if figures else None,
        figures.stiffness_nm_deg if figures else None,
        answers_ms(station, run, asked.load, chosen_nm),
        time.process_time() - begun_s,
    )


def icc(measured: Floats) -> float:
    """Return the intraclass correlation ICC(1,1) of values ``(patients, repetitions)``: the share of their variance that patients explain."""
    patients, repetitions = measured.shape
    means = measured.mean(axis=1)
    between = repetitions * np.sum((means - measured.mean()) ** 2) / (patients - 1)
    within = np.sum((measured - means[:, None]) ** 2) / (patients * (repetitions - 1))
    return float((between - within) / (between + (repetitions - 1) * within))


def summary(results: Sequence[PatientFigures]) -> list[str]:
    """Return the outcomes and the torques above the chosen one for each kind of patient, and the slowest answers."""
    lines = []
    for acts in get_args(Patient):
        group = [figures for figures in results if figures.patient.acts == acts]
        if not group:
            continue
        outcomes = Counter(figures.outcome[:40] for figures in group)
        line = f"{acts}: {', '.join(f'{count} {outcome}' for outcome, count in outcomes.most_common())}"
        for name, field in (("torque above", "peak_over_nm"), ("passive part", "capsule_over_nm")):
            values = np.array([value for figures in group if (value := getattr(figures, field)) is not None])
            if len(values):
                above = 100 * float(np.mean(values > 0.2))
                line += f"; {name} p50 {np.median(values):+.2f}, p99 {np.quantile(values, 0.99):+.2f}, max {values.max():+.2f} Nm, {above:.1f} % above 0.2"
        lines.append(line)
    answers = np.array([answer for figures in results for answer in figures.answers_ms])
    if len(answers):
        p50, p999 = np.quantile(answers, [0.5, 0.999], method="higher")
        lines.append(f"{len(answers)} answers: p50 {p50:.0f} ms, p99.9 {p999:.0f} ms")
    lines.append(f"{np.mean([figures.took_s for figures in results]):.1f} s of a processor for each test")
    return lines


def refit_summary(results: Sequence[PatientFigures], refits: int) -> list[str]:
    """Return the ICC of range and stiffness over patients of whom every test was measured."""
    lines = []
    for field in ("range_deg", "stiffness_nm_deg"):
        rows = [
            [getattr(figures, field) for figures in results[n : n + refits]] for n in range(0, len(results), refits)
        ]
        complete = np.array([row for row in rows if None not in row])
        found = f"{icc(complete):.3f}" if len(complete) > 1 else "unknown"
        lines.append(f"ICC of {field}: {found}, {len(complete)} of {len(rows)} patients, {refits} fittings each")
    return lines


def judge_many(patients: Sequence[RandomPatient], processes: int, json_out: Path | None) -> list[PatientFigures]:
    """Run the tests. The JSON file has the tests that have ended."""
    results: list[PatientFigures] = []
    spawning = multiprocessing.get_context("spawn")
    quiet = partial(logging.disable, logging.INFO)
    with ProcessPoolExecutor(processes, mp_context=spawning, initializer=quiet) as pool:
        for figures in pool.map(judge, patients, chunksize=_CASES_A_TASK if len(patients) > 100 else 1):
            results.append(figures)
            if json_out:
                with json_out.open("a") as file:
                    file.write(json.dumps(asdict(figures)) + "\n")
    return results


def main() -> None:
    """Print the figures of the patients."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plant", choices=get_args(PlantName), default="simple")
    parser.add_argument("--first", type=int, default=0, help="number of the first patient")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--refits", type=int, default=0, help="fasten each patient's arm so often, and print the ICC")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--json", type=Path, help="append one line for each test")
    arguments = parser.parse_args()
    numbers = range(arguments.first, arguments.first + arguments.count)
    patients = (
        refitted_patients(arguments.plant, numbers, arguments.refits)
        if arguments.refits
        else random_patients(arguments.plant, numbers)
    )
    results = judge_many(patients, arguments.processes, arguments.json)
    lines = summary(results)
    if arguments.refits:
        lines += refit_summary(results, arguments.refits)
    for line in lines:
        Console(width=240, highlight=False).print(line)


if __name__ == "__main__":
    main()
