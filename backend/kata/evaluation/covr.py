"""Steps after the titles of COVR's protocols for rehabilitation robots, on simulated arms: ``python -m kata.evaluation.covr``.

The true angle of the simulated arm takes the place of the marker system, and the simulated hand that of the instrumented limb. The procedures
of the protocols were not read: loads, speeds and repetitions are the project's own. docs/reference/validation-protocols.md has the figures.
"""

import argparse
import logging
import math
from collections import Counter
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from kata.commissioning.direct_station import PlaybackError, RefusedPlayError
from kata.device.config import StationConfig, simulated
from kata.device.ipc_messages import RESISTANCE_LEVELS, Approach, Load, Mode, Play
from kata.evaluation.end_feel import BALANCER_KG
from kata.evaluation.excitation import identified
from kata.evaluation.station import VirtualStation
from kata.motion.linkage import Floats
from kata.simulator.mechanics import MakeMechanics, PlantName, mechanics_named
from kata.simulator.parameters import REST_DEG

Skill = Literal["robot_in_control", "human_pushes", "human_holds"]
"""The robot moves to the limit; a hand pushes the arm outwards at the limit; a hand holds the arm against the motion."""

MOTORS: Final = (3, 4)
"""Motors that move in the recordings and are pushed."""
REACH_DEG: Final = 30.0
WAYS_S: Final = (2.0, 4.0, 8.0)
"""Times from rest to the far end; the highest speeds are 24, 12 and 6 deg/s."""
PUSHES_DEG_S: Final = (10.0, 60.0)
STRENGTHS_NM: Final = (6.0, 20.0)
"""Largest torque of the hand."""
LEVELS: Final = (20, RESISTANCE_LEVELS)
SEEDS: Final = (1, 2, 3)
"""Repetitions, each with another arm and other gears."""
BEYOND_DEG: Final = 0.5
"""Distance beyond the limit of a recording that must be refused."""
AFTER_S: Final = 1.0
"""Time for which the arm is observed after a stop. The hand lets go at the stop."""
_STIFF_NM_RAD: Final = 200.0
_DAMPED_NM_S: Final = 5.0
_ROWS_HZ: Final = 50


@dataclass(frozen=True)
class CovrCase:
    """One repetition under one condition."""

    skill: Skill
    plant: PlantName
    motor: int
    seed: int
    way_s: float = 4.0
    push_deg_s: float = 0.0
    strength_nm: float = 0.0
    """Largest torque of the hand."""
    level: int = RESISTANCE_LEVELS


@dataclass(frozen=True)
class CovrFigures:
    """Figures of a repetition."""

    case: CovrCase
    outcome: str
    """completed, reversed, or the message of the stop."""
    beyond_deg: float
    """Farthest true angle of the arm beyond the limit until the end or the answer; below 0: inside the limit."""
    after_deg: float
    """The same until a second after the answer."""
    over_nm: float
    """Largest torque of the motor above the level, by the drive's own estimate; below 0: below the level."""
    over_s: float
    """Longest time for which this torque was above the level."""


def _mechanics(plant: PlantName) -> MakeMechanics:
    return mechanics_named(plant, balancer_kg=BALANCER_KG)


@cache
def _config(plant: PlantName, seed: int) -> StationConfig:
    """Return the station as after its commissioning with this arm."""
    return identified(simulated("virtual"), seed, _mechanics(plant))


class CovrStation(VirtualStation):
    """A station whose arm a hand pushes or holds when it reaches a place on the way out."""

    def __init__(self, case: CovrCase) -> None:
        self._case = case
        self._acts = False
        self.rows: list[tuple[float, float, float]] = []
        """Time in s, true angle in deg and torque in Nm by the drive's estimate, of the moved axis, in each cycle since the load."""
        super().__init__(_config(case.plant, case.seed), case.seed, make_mechanics=_mechanics(case.plant))

    @property
    def mode(self) -> Mode:
        """Mode in the newest snapshot."""
        return self._link.mode

    @property
    def reversed_because(self) -> str:
        """Reason why the arm moved back; empty if it did not."""
        return self._link.reversal

    def after_cycle(self) -> None:
        """Let the hand act once, in the middle of the way out or near its end."""
        super().after_cycle()
        case, newest = self._case, self._link.snapshot
        here_deg = self._world.apparatus.arm_deg[case.motor - 1]
        if newest is not None and newest.run is not None:
            self.rows.append((self.t_ns / 1e9, here_deg, abs(newest.axes[case.motor - 1].torque_nm)))
        share = 0.5 if case.skill == "human_holds" else 0.9
        if self._acts or case.skill == "robot_in_control" or self.mode != "playing":
            return
        if here_deg - REST_DEG[case.motor - 1] >= share * REACH_DEG:
            self._acts = True
            step_rad = np.radians(case.push_deg_s) / 1000
            hand = (float(np.radians(here_deg)), float(step_rad), _STIFF_NM_RAD, _DAMPED_NM_S, case.strength_nm)
            self._world.apparatus.hold(case.motor, hand)

    def observe(self, seconds: float) -> None:
        """Let the hand go, and run the control loop for a time. A latched stop does not end it."""
        self._world.apparatus.hold(self._case.motor, None)
        until_ns = self.t_ns + int(seconds * 1e9)
        while self.t_ns < until_ns:
            self._loop.tick()
            self.after_cycle()


def load_of(case: CovrCase, beyond_deg: float = 0.0) -> Load:
    """Return a recording out and back whose far end is ``beyond_deg`` beyond the limit of the motor."""
    times = np.linspace(0.0, 2 * case.way_s, round(2 * case.way_s * _ROWS_HZ) + 1)
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, case.motor - 1] += (REACH_DEG + beyond_deg) * (1 - np.cos(np.pi * times / case.way_s)) / 2
    limits = [(-180.0, 180.0)] * len(REST_DEG)
    limits[case.motor - 1] = (-180.0, limit_deg(case))
    return Load(
        run_id="run",
        recording_id="recording",
        times_s=times.tobytes(),
        angles_deg=angles.tobytes(),
        limits_deg=tuple(limits),
        resistance_level=case.level,
    )


def limit_deg(case: CovrCase) -> float:
    """Return the limit of the motor: the far end of the recording."""
    return REST_DEG[case.motor - 1] + REACH_DEG + 0.01


def is_refused_beyond(case: CovrCase) -> bool:
    """Return whether a recording that ends :data:`BEYOND_DEG` beyond the limit is refused."""
    try:
        CovrStation(case).send(load_of(case, BEYOND_DEG))
    except RefusedPlayError:
        return True
    return False


def judge(case: CovrCase) -> CovrFigures:
    """Run one repetition."""
    station = CovrStation(case)
    outcome = "completed"
    try:
        station.send(load_of(case))
        station.send(Approach())
        station.until(lambda: station.mode == "paused", "the start is not reached", 30.0)
        station.send(Play())
        station.until(lambda: station.mode != "playing" or bool(station.reversed_because), "", 3 * case.way_s)
    except PlaybackError as error:
        outcome = str(error)
    if station.reversed_because and outcome == "completed":
        outcome = "reversed"
    if not station.rows:
        return CovrFigures(case, f"not played: {outcome}", math.nan, math.nan, math.nan, 0.0)
    answered = len(station.rows)
    if outcome != "completed":
        station.observe(AFTER_S)
    t_s, angle_deg, torque_nm = np.array(station.rows).T
    beyond_deg = angle_deg - limit_deg(case)
    over_nm = torque_nm - station.config.resistance_thresholds_nm(case.level)[case.motor - 1]
    return CovrFigures(
        case,
        outcome,
        float(beyond_deg[:answered].max()),
        float(beyond_deg.max()),
        float(over_nm.max()),
        _longest_s(t_s, over_nm >= 0.0),
    )


def _longest_s(t_s: Floats, holds: NDArray[np.bool_]) -> float:
    """Return the longest time for which the condition holds without an interruption."""
    longest_s, since_s = 0.0, None
    for at_s, held in zip(t_s.tolist(), holds.tolist(), strict=True):
        since_s = (at_s if since_s is None else since_s) if held else None
        longest_s = max(longest_s, at_s - since_s if since_s is not None else 0.0)
    return longest_s


def conditions(skill: Skill) -> list[dict[str, float]]:
    """Return the conditions of a skill: fields of :class:`CovrCase`."""
    if skill == "robot_in_control":
        return [{"way_s": way_s} for way_s in WAYS_S]
    if skill == "human_pushes":
        return [{"push_deg_s": push, "strength_nm": nm} for push, nm in product(PUSHES_DEG_S, STRENGTHS_NM)]
    return [{"level": level, "strength_nm": nm} for level, nm in product(LEVELS, STRENGTHS_NM)]


def cases(skill: Skill, plant: PlantName, condition: dict[str, float]) -> list[CovrCase]:
    """Return every repetition under a condition."""
    of: dict[str, Any] = dict(condition)
    return [CovrCase(skill, plant, motor, seed, **of) for motor, seed in product(MOTORS, SEEDS)]


def line(figures: list[CovrFigures], condition: dict[str, float]) -> str:
    """Return a row of the table: the condition, the outcomes and the largest figures of its repetitions."""
    first = figures[0].case
    outcomes = Counter(one.outcome for one in figures)
    cells = [
        first.skill,
        first.plant,
        ", ".join(f"{name} {value:g}" for name, value in condition.items()),
        "; ".join(f"{count} {outcome}" for outcome, count in sorted(outcomes.items())),
        *(
            f"{max(getattr(one, name) for one in figures):.2f}"
            for name in ("beyond_deg", "after_deg", "over_nm", "over_s")
        ),
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print a table: each row is a condition with the largest figures of its repetitions."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plants", default=",".join(get_args(PlantName)))
    parser.add_argument("--skills", default=",".join(get_args(Skill)))
    arguments = parser.parse_args()
    logging.disable(logging.INFO)
    console = Console(width=250, highlight=False)
    console.print(
        "| Skill | Plant | Condition | Outcome | beyond, deg | after, deg | above the level, Nm | above the level, s |"
    )
    for skill, plant in product(arguments.skills.split(","), arguments.plants.split(",")):
        for condition in conditions(skill):
            console.print(line([judge(case) for case in cases(skill, plant, condition)], condition))


if __name__ == "__main__":
    main()
