"""Accuracy of the end-feel test on simulated shoulders whose true values are known: ``kata evaluate --end-feel``.

``python -m kata.evaluation.end_feel`` judges single motors and kinds of patients. Each case: a test weight in the fixers (the day's baseline), then a patient's arm with the three repetitions, both by the control loop that
treats patients, on virtual time. docs/explanation/end-feel-figures.md has the figures.
"""

import argparse
import json
import logging
import math
import multiprocessing
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import Any, Final, Literal, Protocol, get_args

import numpy as np
from rich.console import Console
from rich.table import Table

from kata.commissioning.direct_station import PlaybackError
from kata.device.config import StationConfig, simulated
from kata.device.ipc_messages import EndFeel, Load
from kata.device.journal import PHASE_PLAYING, Journal
from kata.evaluation.excitation import identified
from kata.evaluation.station import VirtualStation
from kata.motion.edit import Motion
from kata.motion.end_feel import (
    SPEED_DEG_S,
    EndFeelResult,
    Figures,
    GuardingError,
    TooFewWaysError,
    TorqueAngleCurve,
    arm_growth,
    baseline_curve,
    curves,
    figures_of,
    measured,
    way_out,
)
from kata.motion.linkage import Floats
from kata.simulator.effort import steady_push
from kata.simulator.independent.patients import DUMMY, PATIENTS, PatientName, SimulatedPatient
from kata.simulator.mechanics import Mechanics, PlantName
from kata.simulator.parameters import REST_DEG
from kata.simulator.plant import Plant

STAGES: Final[tuple[PatientName, ...]] = ("frozen", "freezing", "thawing", "healthy")
BALANCER_KG: Final = 3.0
"""With the paper's 2 kg most arms of the independent plant leave the drives too little torque for a test."""
CHOSEN_NM: Final = {3: 2.0, 4: 2.0, 5: 1.0}
"""Chosen torque of each motor's test."""
ENDS_DEG: Final = {3: 118.0, 4: 188.0, 5: 38.0}
"""Farthest angle of each motor's way, just within the apparatus' range."""
STARTS_DEG: Final = {3: 8.0, 4: 0.0, 5: -40.0}
_FELT_NM: Final = 0.5
"""At this passive torque a therapist feels the first resistance and ends the taught motion."""
_FREE_SHARE: Final = 0.5
"""The arm is weighed on this share of the taught range."""
_EXPECTED_ROWS: Final = 400
_REST_MARGIN_DEG: Final = 20.0
"""The simple plant's stiff shoulder moves this far from rest before its capsule is stretched to the end."""
_BASELINE_SHARE: Final = 0.9
"""Share of the drive's torque that the baseline may use, because a test weight feels no pain."""
_PERSONS_DIFFER_DEG: Final = 8.0
_PERSONS_SOFTER: Final = 1.25
"""Persons of one stage on the independent plant differ by up to these values. They are our assumption."""
_WEIGHT_DIFFERS: Final = 0.1
"""A test weight chosen by the patient's body mass differs from the arm by up to this share. It is our assumption."""
_GUARD_SHARE: Final = 0.01 / 0.3
"""A patient's torque rises and falls with a time constant of 0.3 s."""

Kind = Literal["relaxed", "guarding"]


@dataclass(frozen=True)
class EndFeelCase:
    """One test of one patient."""

    plant: PlantName
    seed: int
    patient: PatientName
    motor: int
    kind: Kind = "relaxed"
    speed_deg_s: float = SPEED_DEG_S
    person: int | None = None
    """Chooses the capsule of the simple plant's patient; None: the seed does."""
    refit_deg: float = 0.0
    """Angle by which the arm is fastened elsewhere in the fixers: the arm's angle minus the usual one."""


@dataclass(frozen=True)
class EndFeelErrors:
    """Errors of the test compared with the true values: measured minus true; None if not measured."""

    case: EndFeelCase
    outcome: str
    """measured, guarding, torque_not_reached, resistance_from_start, or the refusal of the station."""
    peak_over_nm: float | None = None
    """Largest torque between apparatus and shoulder above the chosen one."""
    range_error_deg: float | None = None
    onset_error_deg: float | None = None
    stiffness_error: float | None = None
    """As a share of the truth."""
    last_third_error: float | None = None
    interval_deg: float | None = None
    disagreement_nm: float | None = None


# -- patients ---------------------------------------------------------------------------------------------------------


class StiffPlant(Plant):
    """The simple plant with a capsule that ends a motion earlier: torque grows with the square of the way."""

    def __init__(
        self,
        seed: int | None = None,
        *,
        turned: bool = False,
        dummy: bool = False,
        motor: int = 3,
        person: int | None = None,
    ) -> None:
        """``dummy``: a test weight of the nominal arm instead of the patient. ``person``: :attr:`EndFeelCase.person`."""
        super().__init__(seed, turned=turned)
        self._arm_nm = [joint.parameters.weight_nm for joint in self.joints]
        draw = Random(f"stiff {seed if person is None else person} {motor}").uniform
        for joint, nominal in zip(self.joints, Plant().joints, strict=True):
            if dummy:
                weight_nm = nominal.parameters.weight_nm
                joint.parameters = replace(joint.parameters, stiffness_nm=0.0, tone_nm=0.0, weight_nm=weight_nm)
        joint = self.joints[motor - 1]
        low, high = joint.rom
        if not dummy:
            stiffness_nm = draw(1.5, 3.0) * CHOSEN_NM[motor]
            far_deg = math.degrees(high) - _REST_MARGIN_DEG - REST_DEG[motor - 1]
            joint.rom = (low, high - math.radians(draw(15.0, min(60.0, far_deg))))
            joint.parameters = replace(joint.parameters, stiffness_nm=stiffness_nm)

    def choose_weight(self, share: float) -> None:
        """Put a test weight with this share of the arm's mass into the fixers."""
        for joint, arm_nm in zip(self.joints, self._arm_nm, strict=True):
            joint.parameters = replace(joint.parameters, weight_nm=share * arm_nm)

    def refit(self, motor: int, refit_deg: float) -> None:
        """Fasten the arm elsewhere (:attr:`EndFeelCase.refit_deg`)."""
        joint = self.joints[motor - 1]
        low, high = joint.rom
        joint.rom = (low - math.radians(refit_deg), high - math.radians(refit_deg))


class PatientPush(Protocol):
    """What a patient's muscles do."""

    def at(self, time_s: float) -> float:
        """Return the outward torque on the arm at a time, Nm. Call it every 10 ms."""


class _Guarding:
    """Bursts of a patient who works with or against the apparatus, at random times and with random strength."""

    def __init__(self, case: EndFeelCase) -> None:
        self._random = Random(f"guarding {case}")
        self._next_s: float | None = None
        self._until_s = 0.0
        self.strength_nm = 0.0
        self._goal_nm = 0.0

    def at(self, time_s: float) -> float:
        """Return the torque at a time; call it every 10 ms."""
        draw = self._random.uniform
        if self._next_s is None:
            self._next_s = time_s + draw(1.0, 4.0)
        elif time_s >= self._next_s:
            self._goal_nm = self._random.choice((-1, 1)) * draw(0.5, 2.0)
            self._until_s = time_s + draw(0.5, 2.5)
            self._next_s = self._until_s + draw(1.0, 5.0)
        elif time_s >= self._until_s:
            self._goal_nm = 0.0
        self.strength_nm += (self._goal_nm - self.strength_nm) * _GUARD_SHARE
        return self.strength_nm


class PatientStation(VirtualStation):
    """A station with a patient whose torque on one axis is noted in every cycle."""

    def __init__(self, case: EndFeelCase, config: StationConfig) -> None:
        self._axis = case.motor - 1
        self.push: PatientPush | None = _Guarding(case) if case.kind == "guarding" else None
        self.against_nm: list[float] = []
        """True torque between apparatus and shoulder in each cycle."""
        self.passive_nm: list[float] = []
        """The part that the patient's push does not cause."""
        self.noted_ns: list[int] = []
        self.mechanics: Any = None

        def make(seed: int | None = None, *, turned: bool = False) -> Mechanics:
            self.mechanics = _mechanics(case, dummy=False)(seed, turned=turned)
            made: Mechanics = self.mechanics
            return made

        super().__init__(config, case.seed, make_mechanics=make)

    def after_cycle(self) -> None:
        """Note the torque between apparatus and shoulder, and let the patient guard."""
        super().after_cycle()
        joint = self.mechanics.joints[self._axis]
        hand_nm = 0.0
        if self.push:
            hand_nm = self.push.at(self.t_ns / 1e9)
            joint.hand = steady_push(hand_nm)
        if isinstance(self.mechanics, Plant):
            tone_nm = joint.parameters.tone_nm * 0.5 * math.tanh(joint.arm_speed / math.radians(5.0))
            shoulder_nm = -joint.stiffness_nm() + tone_nm
        else:
            tone_nm = joint.resistance_nm * math.tanh(joint.arm_speed / self.mechanics._tone_speed)
            passive_nm = self.mechanics.shoulder.passive_nm(self._axis - 2, joint.arm_angle, joint.arm_speed)
            shoulder_nm = -passive_nm + tone_nm
        self.passive_nm.append(shoulder_nm)
        self.against_nm.append(shoulder_nm - hand_nm)
        self.noted_ns.append(self.t_ns)

    def elastic_nm(self, angles_deg: Floats) -> Floats:
        """Return the true elastic torque at angles of the arm."""
        if isinstance(self.mechanics, Plant):
            joint = self.mechanics.joints[self._axis]
            was, torques_nm = joint.arm_angle, []
            for angle in angles_deg:
                joint.arm_angle = math.radians(angle)
                torques_nm.append(-joint.stiffness_nm())
            joint.arm_angle = was
            return np.array(torques_nm)
        shoulder = self.mechanics.shoulder
        return np.array([-shoulder.passive_nm(self._axis - 2, math.radians(angle), 0.0) for angle in angles_deg])


def _mechanics(case: EndFeelCase, *, dummy: bool) -> Callable[..., Mechanics]:
    if case.plant == "simple":
        return partial(_stiff, case, dummy)
    from kata.simulator.independent.plant import IndependentPlant

    weight = replace(DUMMY, arm_scale=_weight_share(case.seed) ** (1 / 3))
    return partial(IndependentPlant, patient=weight if dummy else _shoulder_of(case), balancer_kg=BALANCER_KG)


def _weight_share(seed: int | None) -> float:
    """Return the mass of the test weight as a share of that of the arm."""
    return 1.0 + Random(f"test weight {seed}").uniform(-_WEIGHT_DIFFERS, _WEIGHT_DIFFERS)


def _stiff(case: EndFeelCase, dummy: bool, seed: int | None = None, *, turned: bool = False) -> StiffPlant:
    plant = StiffPlant(seed, turned=turned, dummy=dummy, motor=case.motor, person=case.person)
    if dummy:
        plant.choose_weight(_weight_share(case.seed))
    else:
        plant.refit(case.motor, case.refit_deg)
    return plant


def _shoulder_of(case: EndFeelCase) -> SimulatedPatient:
    """Return the shoulder of the case's stage. Persons differ in the ends of the range and in the end-feel."""
    usual = PATIENTS[case.patient]
    further_deg, softer = -case.refit_deg, 1.0
    if case.person is not None:
        draw = Random(f"shoulder {case.person}").uniform
        further_deg += draw(-_PERSONS_DIFFER_DEG, _PERSONS_DIFFER_DEG)
        softer = draw(1 / _PERSONS_SOFTER, _PERSONS_SOFTER)
    one, two, three = ((low + further_deg, high + further_deg) for low, high in usual.peaks_deg)
    return replace(usual, peaks_deg=(one, two, three), end_feel_deg=softer * usual.end_feel_deg)


@cache
def station_config(plant: PlantName, seed: int) -> StationConfig:
    """Return the station as after its commissioning, whose weight is a nominal arm."""
    config = simulated("virtual")
    if plant == "simple":
        return config
    from kata.simulator.independent.plant import IndependentPlant

    return identified(config, seed, partial(IndependentPlant, balancer_kg=BALANCER_KG, dummy=True))


# -- one test ---------------------------------------------------------------------------------------------------------


def judge(case: EndFeelCase) -> EndFeelErrors:
    """Run one test."""
    try:
        return _evaluate(case)
    except PlaybackError as error:
        return EndFeelErrors(case, str(error))


def _evaluate(case: EndFeelCase) -> EndFeelErrors:
    station = PatientStation(case, station_config(case.plant, case.seed))
    asked = requested(case, station)
    run = station.play(asked.load, 6 * asked.out.duration_s)
    peak_over_nm = float(during_run(station.against_nm, station, run).max()) - CHOSEN_NM[case.motor]
    try:
        result = _result(case, asked, run)
    except GuardingError as error:
        return EndFeelErrors(case, "guarding", peak_over_nm, disagreement_nm=error.disagreement_nm)
    except TooFewWaysError as error:
        return EndFeelErrors(case, str(error), peak_over_nm)
    truth = station.elastic_nm(asked.grid_deg)
    return _compared(case, result, TorqueAngleCurve(asked.grid_deg, truth, truth), peak_over_nm)


def during_run(torques_nm: Sequence[float], station: PatientStation, run: Journal) -> Floats:
    """Return those of a station's noted torques that belong to the run. A shoulder can be stretched at rest, before the run begins."""
    playing_ns = run.t_ns[run.phase == PHASE_PLAYING]
    noted_ns = np.array(station.noted_ns)
    torques: Floats = np.array(torques_nm)[(noted_ns >= playing_ns[0]) & (noted_ns <= playing_ns[-1])]
    return torques


def _result(case: EndFeelCase, asked: "Requested", run: Journal) -> EndFeelResult:
    """:raises GuardingError, TooFewWaysError: as in :func:`kata.motion.end_feel.measured`."""
    ways = _curves(run, case.motor)
    return measured(ways, asked.baseline, asked.growth, asked.weighed_deg, CHOSEN_NM[case.motor])


def judge_run(case: EndFeelCase, asked: "Requested", run: Journal) -> tuple[str, Figures | None]:
    """Return ``measured`` and the figures of a test, or the reason why it has none."""
    try:
        result = _result(case, asked, run)
    except GuardingError:
        return "guarding", None
    except TooFewWaysError as error:
        return str(error), None
    return ("measured", result.figures) if result.figures else (str(result.unmeasured), None)


@dataclass(frozen=True)
class Requested:
    """A run of the apparatus along one motor's way."""

    out: Motion
    baseline: TorqueAngleCurve
    growth: Floats
    weighed_deg: tuple[float, float]
    grid_deg: Floats
    load: Load


def requested(case: EndFeelCase, station: PatientStation, hold_s: float = 0.0, repetitions: int = 3) -> Requested:
    """Return the run of a test, or with ``hold_s`` of a stretch, after its baseline."""
    motor = case.motor
    grid = np.arange(STARTS_DEG[motor], ENDS_DEG[motor], 0.1)
    truth = station.elastic_nm(grid)
    felt_deg = float(grid[np.argmax(truth > _FELT_NM)]) if truth[-1] > _FELT_NM else float(grid[-1])
    weighed_deg = (STARTS_DEG[motor] + 4.0, STARTS_DEG[motor] + _FREE_SHARE * (felt_deg - STARTS_DEG[motor]))
    out = _way(motor, case.speed_deg_s)
    baseline = _baseline(case.plant, case.seed, motor, case.speed_deg_s)
    growth = arm_growth(_postures(motor, baseline.places_deg), motor, "right", 1.0)
    weighed_s = [(angle - STARTS_DEG[motor]) / case.speed_deg_s for angle in weighed_deg]
    test = EndFeel(
        motor=motor,
        torque_nm=CHOSEN_NM[motor],
        expected_nm=_on_path(out, motor, baseline, baseline.out_nm),
        back_nm=_on_path(out, motor, baseline, baseline.back_nm),
        arm_nm=tuple(_on_path(out, motor, baseline, column) for column in growth.T),
        weighed_s=(weighed_s[0], weighed_s[1]),
        repetitions=repetitions,
        hold_s=hold_s,
    )
    return Requested(out, baseline, growth, weighed_deg, grid, _load(out, test))


def _compared(case: EndFeelCase, result: EndFeelResult, truth: TorqueAngleCurve, peak_over_nm: float) -> EndFeelErrors:
    disagreement_nm = result.disagreement_nm
    if result.figures is None or result.interval is None:
        return EndFeelErrors(case, str(result.unmeasured), peak_over_nm, disagreement_nm=disagreement_nm)
    true = figures_of(truth, result.stated_nm, result.onset_nm)
    if isinstance(true, str):
        return EndFeelErrors(case, f"measured, but {true}", peak_over_nm, disagreement_nm=disagreement_nm)
    return EndFeelErrors(
        case,
        "measured",
        peak_over_nm,
        result.figures.range_deg - true.range_deg,
        result.figures.onset_deg - true.onset_deg,
        result.figures.stiffness_nm_deg / true.stiffness_nm_deg - 1,
        result.figures.last_third_nm_deg / true.last_third_nm_deg - 1,
        result.interval.range_deg,
        disagreement_nm,
    )


@cache
def _baseline(plant: PlantName, seed: int, motor: int, speed_deg_s: float) -> TorqueAngleCurve:
    """Play the way out and back once with the test weight."""
    config = station_config(plant, seed)
    station = VirtualStation(
        config, seed, make_mechanics=_mechanics(EndFeelCase(plant, seed, "healthy", motor), dummy=True)
    )
    strong_nm = _BASELINE_SHARE * config.axes[motor - 1].max_torque_nm
    out = _way(motor, speed_deg_s)
    test = EndFeel(motor=motor, torque_nm=strong_nm, expected_nm=(0.0, 0.0), repetitions=1)
    return baseline_curve(_curves(station.play(_load(out, test), 2 * out.duration_s), motor))


def _way(motor: int, speed_deg_s: float) -> Motion:
    """Return the way from rest to the end of the apparatus' range."""
    ends = np.array([STARTS_DEG[motor], ENDS_DEG[motor]])
    out, moved = way_out(Motion(np.array([0.0, 10.0]), _postures(motor, ends)), speed_deg_s)
    assert moved == motor
    return out


def _load(out: Motion, test: EndFeel) -> Load:
    return Load(
        run_id="test",
        recording_id="recording",
        times_s=out.times_s.astype("<f8").tobytes(),
        angles_deg=out.angles_deg.astype("<f8").tobytes(),
        end_feel=test,
    )


def _curves(run: Journal, motor: int) -> list[TorqueAngleCurve]:
    playing = run.phase == PHASE_PLAYING
    return curves(
        run.path_s[playing], run.measured_deg[playing][:, motor - 1], run.torque_nm[playing][:, motor - 1], 1.0
    )


def _postures(motor: int, angles_deg: Floats) -> Floats:
    """Return the rest posture with these angles of one motor, ``(n, 5)``."""
    postures = np.tile(np.array(REST_DEG), (len(angles_deg), 1))
    postures[:, motor - 1] = angles_deg
    return postures


def _on_path(out: Motion, motor: int, baseline: TorqueAngleCurve, values: Floats) -> tuple[float, ...]:
    at = np.linspace(0.0, out.duration_s, _EXPECTED_ROWS)
    angles = np.interp(at, out.times_s, out.angles_deg[:, motor - 1])
    return tuple(np.interp(angles, baseline.places_deg, values).tolist())


# -- goals ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class EndFeelGoal:
    """A figure and the largest absolute value that it may have."""

    name: str
    field: str
    limit: float

    def size(self, value: float) -> float:
        """Return the absolute value. An excess below 0 is none."""
        return max(value, 0.0) if self.field == "peak_over_nm" else abs(value)

    def shown(self, results: Sequence[EndFeelErrors]) -> str:
        """Return the median and the worst absolute value, and the share within the goal."""
        values = [value for errors in results if (value := getattr(errors, self.field)) is not None]
        if not values:
            return ""
        sizes = np.array([self.size(value) for value in values])
        inside = np.mean(sizes <= self.limit)
        return f"{np.median(sizes):.2f}, {sizes.max():.2f}; {100 * inside:.0f} %"


GOALS: Final = (
    EndFeelGoal("torque above, Nm", "peak_over_nm", 0.2),
    EndFeelGoal("range, deg", "range_error_deg", 2.0),
    EndFeelGoal("onset, deg", "onset_error_deg", 4.0),
    EndFeelGoal("stiffness", "stiffness_error", 0.1),
    EndFeelGoal("last third", "last_third_error", 0.1),
)

# -- many tests -------------------------------------------------------------------------------------------------------


def cases(plant: PlantName, seeds: Sequence[int], kinds: Sequence[Kind], motors: Sequence[int]) -> list[EndFeelCase]:
    """Return the cases: on the independent plant every stage, one motor for each seed; on the simple plant every motor."""
    if plant == "simple":
        return [
            EndFeelCase(plant, seed, "healthy", motor, kind) for seed in seeds for kind in kinds for motor in motors
        ]
    return [
        EndFeelCase(plant, seed, patient, motors[seed % len(motors)], kind)
        for seed in seeds
        for kind in kinds
        for patient in STAGES
    ]


def judge_many(chosen: Sequence[EndFeelCase], processes: int | None, json_out: Path | None) -> None:
    """Run the tests and print the figures beside the goals. The JSON file has the tests that have ended."""
    seeds = len({case.seed for case in chosen})
    results: list[EndFeelErrors] = []
    spawning = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, mp_context=spawning, initializer=_settle) as pool:
        # The cases of a seed share the station's commissioning.
        for errors in pool.map(_shown, chosen, chunksize=len(chosen) // seeds):
            results.append(errors)
            if json_out:
                json_out.write_text(json.dumps([asdict(errors_of_test) for errors_of_test in results], indent=1) + "\n")
    Console(width=120).print(summary(results))


def main() -> None:
    """Print the figures beside the goals."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plant", choices=get_args(PlantName), default="mujoco")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--kinds", default="relaxed,guarding")
    parser.add_argument("--motors", default="3,4,5")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    kinds = [kind for kind in get_args(Kind) if kind in arguments.kinds.split(",")]
    motors = [int(motor) for motor in arguments.motors.split(",")]
    chosen = cases(arguments.plant, range(arguments.seed, arguments.seed + arguments.seeds), kinds, motors)
    judge_many(chosen, arguments.processes, arguments.json)


def _settle() -> None:
    logging.disable(logging.INFO)


def _shown(case: EndFeelCase) -> EndFeelErrors:
    errors = judge(case)
    Console(stderr=True, width=200, highlight=False).print(_line(errors))
    return errors


def _line(errors: EndFeelErrors) -> str:
    figures = (
        ("over", errors.peak_over_nm, "Nm"),
        ("range", errors.range_error_deg, "deg"),
        ("onset", errors.onset_error_deg, "deg"),
        ("stiffness", errors.stiffness_error, ""),
        ("last third", errors.last_third_error, ""),
        ("repetitions differ", errors.disagreement_nm, "Nm"),
    )
    parts = ", ".join(f"{name} {value:+.2f} {unit}".rstrip() for name, value, unit in figures if value is not None)
    case = errors.case
    return f"{case.plant} seed {case.seed}, {case.patient}, motor {case.motor}, {case.kind}: {errors.outcome}; {parts}"


def summary(results: Sequence[EndFeelErrors]) -> Table:
    """Return the figures beside the goals, for each motor."""
    table = Table("motor", "tests", "outcomes", *(f"{goal.name} (goal {goal.limit:g})" for goal in GOALS))
    for motor in sorted({errors.case.motor for errors in results}):
        for kind in get_args(Kind):
            group = [errors for errors in results if (errors.case.motor, errors.case.kind) == (motor, kind)]
            if group:
                outcomes = Counter(errors.outcome[:30] for errors in group)
                counts = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.most_common())
                table.add_row(f"{motor} {kind}", str(len(group)), counts, *(goal.shown(group) for goal in GOALS))
    return table


if __name__ == "__main__":
    main()
