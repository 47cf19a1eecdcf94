"""Self-paced assistance on simulated arms whose effort is known: ``python -m kata.evaluation.self_paced``.

Each case: a patient's arm on a recording there and back, moved by the control loop that treats patients, on virtual time. The patient's muscles add a
known torque along the path. docs/explanation/self-paced-figures.md has the figures.
"""

import argparse
import itertools
import json
import logging
import math
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, Final, Literal, get_args

import numpy as np
from rich.console import Console

from kata.commissioning.direct_station import PlaybackError
from kata.device.config import StationConfig, simulated, simulated_with_load
from kata.device.ipc_messages import Approach, Load, Mode, Play
from kata.device.journal import PHASE_PLAYING, PHASE_REVERSING
from kata.device.self_pacing import NEAR_END_DEG, SLOW_SHARE
from kata.evaluation.end_feel import BALANCER_KG
from kata.evaluation.excitation import identified
from kata.evaluation.station import VirtualStation
from kata.motion.axes import CANONICAL_SIDE, N_AXES, Side
from kata.motion.linkage import Floats
from kata.motion.trajectory import Trajectory
from kata.simulator.effort import steady_push
from kata.simulator.mechanics import MakeMechanics, Mechanics, PlantName
from kata.simulator.parameters import REST_DEG, TURNED
from kata.simulator.plant import Plant

Patient = Literal["nothing", "helps", "strong", "resists", "trembles", "lets_go", "alternates", "stiff", "session"]
Arm = Literal["identified", "other"]
"""The arm with which the station was identified, or an arm of another weight."""
Way = Literal["flexion", "combined"]

WAYS_DEG: Final[dict[Way, tuple[float, ...]]] = {
    "flexion": (0.0, 0.0, 50.0, 0.0, 0.0),
    "combined": (6.0, -5.0, 40.0, 25.0, -20.0),
}
"""How far each motor moves from rest."""
WAY_S: Final = 6.0
"""Time from rest to the far end."""
HELP_NM: Final = 2.5
STRONG_NM: Final = 3.0
RESISTS_NM: Final = -2.0
TREMOR_NM: Final = 2.0
LETS_GO_S: Final = 3.0
STIFF_NM_RAD: Final = 25.0
STIFF_NM_S: Final = 1.0
STIFF_DEG_S: Final = 8.0
STIFF_MOST_NM: Final = 6.0
PUSHES_BACK_S: Final = 7.0
"""Time at which the patient of a session begins to push back."""
PUSHES_BACK_NM: Final = -4.2
LEVEL: Final = 25
"""Resistance level: 3.9 Nm at motors 1 to 4. A push against the path above it takes the arm back."""
OBSERVED_S: Final = 14.0
_STEP_S: Final = 0.01
_ROWS: Final = 601
_WINDOW: Final = 5
"""The pace is the mean over this number of samples."""


@dataclass(frozen=True)
class PacedCase:
    """One self-paced playback of one patient."""

    plant: PlantName
    patient: Patient
    arm: Arm = "identified"
    way: Way = "flexion"
    seed: int | None = None
    """Seed of apparatus and arm; None: the nominal simple plant, whose load is known without an identification."""
    side: Side = CANONICAL_SIDE


@dataclass(frozen=True)
class PacedFigures:
    """Figures of a playback; None where the case has none."""

    case: PacedCase
    outcome: str
    """playing, completed, resistance, or the reason of a stop."""
    moved_deg: float
    """Longest way of the arm from the start."""
    top_pace: float
    """Highest pace, as a share of the recording's speed."""
    mean_pace: float
    faster_near_end_deg_s: float
    """Largest rise of the speed in the last 10 deg before the far end, above a fifth of the recording's speed."""
    swings: int
    """Number of times that the speed rises and falls again by a tenth of the recording's highest speed."""
    rest_after_s: float | None
    """Time from letting go until the pace is 0; None if the patient does not let go."""
    moves_on_deg: float | None
    """Way of the arm after letting go."""
    taken_back_after_s: float | None
    """Time from the begin of a resistance above the level until the reference moves back; None without one."""
    given_j: float
    """Largest work of the apparatus on the patient's muscles since the start."""
    true_work_j: float
    """Work of the patient's muscles on the arm while it was played forwards."""
    stored_work_j: float


class _Muscles:
    """The torque of a patient along the path."""

    def __init__(self, case: PacedCase) -> None:
        self._case = case
        self._target: float | None = None

    def at(self, since_s: float, along_rad: float, speed_rad_s: float) -> float:
        """Return the torque in Nm. Call it every 10 ms. ``along_rad``: angle of the arm along the path since the last turn."""
        match self._case.patient:
            case "helps":
                return HELP_NM
            case "strong":
                return STRONG_NM
            case "resists":
                return RESISTS_NM
            case "trembles":
                # From 4 to 12 Hz.
                return TREMOR_NM * math.sin(2 * math.pi * (4.0 + 8.0 * min(since_s / OBSERVED_S, 1.0)) * since_s)
            case "lets_go":
                return HELP_NM if since_s < LETS_GO_S else 0.0
            case "alternates":
                return HELP_NM if since_s % 3.0 < 1.5 else -HELP_NM / 2
            case "stiff":
                return self._stiff_nm(along_rad, speed_rad_s)
            case "session":
                return self._session_nm(since_s)
        return 0.0

    def _session_nm(self, since_s: float) -> float:
        """Return the torque of a patient who does one thing after another, and at last pushes back."""
        if since_s < 1.0 or 3.0 <= since_s < 4.0:
            return 0.0
        if since_s < 3.0:
            return HELP_NM
        if since_s < 5.0:
            return TREMOR_NM * math.sin(2 * math.pi * 5.0 * since_s)
        return STRONG_NM if since_s < PUSHES_BACK_S else PUSHES_BACK_NM

    def _stiff_nm(self, along_rad: float, speed_rad_s: float) -> float:
        """Return the torque of a patient who moves with an own speed, like a spring that ends at the arm."""
        lead_rad = STIFF_MOST_NM / STIFF_NM_RAD
        target = along_rad if self._target is None else self._target + math.radians(STIFF_DEG_S) * _STEP_S
        self._target = min(target, along_rad + lead_rad)
        own = math.radians(STIFF_DEG_S)
        return STIFF_NM_RAD * (self._target - along_rad) + STIFF_NM_S * (own - speed_rad_s)

    def turn(self) -> None:
        """Begin to move the other way."""
        self._target = None


class PacedStation(VirtualStation):
    """A station with a patient whose effort along the path is noted in every cycle."""

    def __init__(self, case: PacedCase, config: StationConfig) -> None:
        self.mechanics: Any = None
        self.muscles: _Muscles | None = None
        # Angles of the mechanics are those of the drives, some of which turn the other way on the other side.
        signs = np.array(TURNED if case.side != CANONICAL_SIDE else (1,) * N_AXES)
        reach = signs * np.array(WAYS_DEG[case.way])
        self._unit = reach / np.linalg.norm(reach)
        self.rows: list[tuple[float, ...]] = []
        """Time in s, effort in Nm, arm along the way out in rad, speed along the path in rad/s, and stored work in J."""
        self.began_ns = 0
        """Time at which the patient began to act."""
        self._sign = 1.0

        def make(seed: int | None = None, *, turned: bool = False) -> Mechanics:
            self.mechanics = make_arm(case)(seed, turned=turned)
            made: Mechanics = self.mechanics
            return made

        super().__init__(config, case.seed, case.side, make_mechanics=make)

    @property
    def mode(self) -> Mode:
        """Mode in the newest snapshot."""
        return self._link.mode

    @property
    def reversed_because(self) -> str:
        """Reason why the arm moved back; empty if it did not."""
        return self._link.reversal

    def begin(self, muscles: _Muscles) -> None:
        """Let the patient act from now on."""
        self.muscles, self.began_ns = muscles, self.t_ns

    def after_cycle(self) -> None:
        """Let the patient act, and note the effort."""
        super().after_cycle()
        newest = self._link.snapshot
        if self.muscles is None or newest is None or newest.run is None or newest.run.self_pacing is None:
            return
        joints = self.mechanics.joints
        arm = float(self._unit @ np.array([joint.arm_angle for joint in joints]))
        speed = float(self._unit @ np.array([joint.arm_speed for joint in joints]))
        sign = 1.0 if newest.run.position_s < WAY_S else -1.0
        if sign != self._sign:
            self._sign = sign
            self.muscles.turn()
        since_s = (self.t_ns - self.began_ns) / 1e9
        nm = self.muscles.at(since_s, sign * arm, sign * speed) if newest.mode == "playing" else 0.0
        for joint, share in zip(joints, self._unit.tolist(), strict=True):
            joint.hand = steady_push(sign * nm * share)
        self.rows.append((since_s, nm, arm, sign * speed, newest.run.self_pacing.work_j))


def make_arm(case: PacedCase, *, at_commissioning: bool = False) -> MakeMechanics:
    """Return the function that makes the mechanics with the patient's arm, or with the arm of the commissioning."""
    other = case.arm == "other" and not at_commissioning
    if case.plant == "simple":
        return partial(_simple_arm, heavier=1.3 if other else 1.0)
    from kata.simulator.independent.plant import IndependentPlant

    if at_commissioning and case.arm == "other":
        return partial(IndependentPlant, balancer_kg=BALANCER_KG, dummy=True)
    return partial(IndependentPlant, balancer_kg=BALANCER_KG)


def _simple_arm(seed: int | None = None, *, turned: bool = False, heavier: float = 1.0) -> Plant:
    plant = Plant(seed, turned=turned)
    for joint in plant.joints:
        joint.parameters = replace(joint.parameters, weight_nm=heavier * joint.parameters.weight_nm)
    return plant


@cache
def _config(plant: PlantName, arm: Arm, seed: int | None) -> StationConfig:
    if plant == "simple" and seed is None:
        return simulated_with_load("virtual")
    case = PacedCase(plant, "nothing", arm, seed=seed)
    return identified(simulated("virtual"), seed, make_arm(case, at_commissioning=True))


def recording(way: Way) -> Trajectory:
    """Return a motion from rest to the far end and back."""
    times = np.linspace(0.0, 2 * WAY_S, round(2 * WAY_S / 0.02) + 1)
    share = (1 - np.cos(np.pi * times / WAY_S)) / 2
    return Trajectory(times, np.array(REST_DEG) + np.outer(share, WAYS_DEG[way]))


def play(case: PacedCase, observed_s: float = OBSERVED_S) -> tuple[PacedStation, str]:
    """Play a recording with a patient for some time. Return the station and the outcome."""
    trajectory = recording(case.way)
    times = np.linspace(0.0, trajectory.duration_s, _ROWS)
    station = PacedStation(case, _config(case.plant, case.arm, case.seed))
    load = Load(
        run_id="run",
        recording_id="recording",
        times_s=times.tobytes(),
        angles_deg=trajectory.along(times).tobytes(),
        side=case.side,
        self_paced=True,
        resistance_level=LEVEL,
    )
    station.send(load)
    station.send(Approach())
    station.until(lambda: station.mode == "paused", "the start is not reached", 30.0)
    station.send(Play())
    station.begin(_Muscles(case))
    until_ns = station.t_ns + int(observed_s * 1e9)
    try:
        station.until(lambda: station.t_ns >= until_ns or station.mode != "playing", "", observed_s)
    except PlaybackError as error:
        return station, str(error)
    if station.reversed_because:
        return station, "resistance"
    return station, "playing" if station.mode == "playing" else "completed"


def judge(case: PacedCase, observed_s: float = OBSERVED_S) -> PacedFigures:
    """Play, and compare the pace with the effort."""
    station, outcome = play(case, observed_s)
    since_s, effort_nm, arm_rad, speed_rad_s, stored_j = np.array(station.rows).T
    run = station.journal()
    shown = run.t_ns >= station.began_ns
    t_s, place_s, phase = (run.t_ns[shown] - station.began_ns) / 1e9, run.path_s[shown], run.phase[shown]
    pace = np.zeros(len(place_s))
    pace[_WINDOW:] = (place_s[_WINDOW:] - place_s[:-_WINDOW]) / (t_s[_WINDOW:] - t_s[:-_WINDOW])
    top_deg_s = math.pi / 2 / WAY_S * float(np.linalg.norm(WAYS_DEG[case.way]))
    own_deg_s = top_deg_s * np.abs(np.sin(np.pi * place_s / WAY_S))
    deg_s = pace * own_deg_s
    power_w = effort_nm * speed_rad_s
    lets_go = case.patient == "lets_go"
    forwards = np.interp(since_s, t_s, pace) > 0.0
    return PacedFigures(
        case,
        outcome,
        math.degrees(float(np.abs(arm_rad - arm_rad[0]).max())),
        float(pace.max()),
        float(pace.mean()),
        _faster_near_end(case, place_s, deg_s, own_deg_s),
        _swings(deg_s[phase == PHASE_PLAYING], top_deg_s),
        float(t_s[pace > 0.0][-1]) - LETS_GO_S if lets_go else None,
        math.degrees(float(np.abs((arm_rad - arm_rad[since_s <= LETS_GO_S][-1])[since_s > LETS_GO_S]).max()))
        if lets_go
        else None,
        _taken_back_after_s(since_s, effort_nm, t_s[phase == PHASE_REVERSING]),
        max(0.0, -float(np.cumsum(power_w).min()) * _STEP_S),
        float(power_w[forwards].sum()) * _STEP_S,
        float(stored_j[-1]),
    )


def _faster_near_end(case: PacedCase, place_s: Floats, deg_s: Floats, own_deg_s: Floats) -> float:
    reach_deg = float(np.max(np.abs(WAYS_DEG[case.way])))
    left_deg = reach_deg * (1 + np.cos(np.pi * place_s / WAY_S)) / 2
    near = (place_s < WAY_S) & (left_deg < NEAR_END_DEG)
    if not np.any(near):
        return 0.0
    allowed = np.maximum(np.minimum.accumulate(deg_s[near]), SLOW_SHARE * own_deg_s[near])
    return float(np.max(deg_s[near] - allowed))


def _swings(deg_s: Floats, top_deg_s: float) -> int:
    from scipy.signal import find_peaks

    return len(find_peaks(deg_s, prominence=top_deg_s / 10)[0])


def _taken_back_after_s(since_s: Floats, effort_nm: Floats, reversing_s: Floats) -> float | None:
    if not len(reversing_s):
        return None
    pushes = since_s[(since_s < reversing_s[0]) & (effort_nm > PUSHES_BACK_NM / 2)]
    return float(reversing_s[0] - pushes[-1])


def main() -> None:
    """Print the figures of each case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plant", choices=get_args(PlantName), default="simple")
    parser.add_argument("--arm", choices=get_args(Arm), default="identified")
    parser.add_argument("--way", choices=get_args(Way), default="flexion")
    parser.add_argument("--side", choices=get_args(Side), default=CANONICAL_SIDE)
    parser.add_argument("--seed", type=int, help="first seed; default: the nominal apparatus")
    parser.add_argument("--seeds", type=int, default=1, help="number of seeds, with --seed")
    parser.add_argument("--patients", default=",".join(get_args(Patient)))
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    logging.disable(logging.INFO)
    results: list[PacedFigures] = []
    seeds = [None] if arguments.seed is None else range(arguments.seed, arguments.seed + arguments.seeds)
    for seed, patient in itertools.product(seeds, arguments.patients.split(",")):
        case = PacedCase(arguments.plant, patient, arguments.arm, arguments.way, seed, arguments.side)
        results.append(judge(case))
        Console(width=200, highlight=False).print(_line(results[-1]))
        if arguments.json:
            arguments.json.write_text(json.dumps([asdict(figures) for figures in results], indent=1) + "\n")


def _line(figures: PacedFigures) -> str:
    case = figures.case
    name = f"{case.plant} seed {case.seed}, {case.side}, {case.way}, {case.arm} arm, {case.patient}"
    parts = [f"{name}: {figures.outcome}"]
    for name, value in asdict(figures).items():
        if name not in ("case", "outcome") and value is not None:
            parts.append(f"{name} {value:.3g}")
    return "; ".join(parts)


if __name__ == "__main__":
    main()
