"""Checks that the campaign finds known defects: ``python -m tests.campaign.reverts [number ...]``.

Each fix of the outside review's defects is reverted in a copy of the package. The campaign runs on the copy until it fails. Prints the
table of docs/explanation/campaigns.md: how many sequences that took.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

ROOT: Final = Path(__file__).parents[2]
DEVICE: Final = Path("backend/kata/device")
Finder = Literal["sequences", "crossings", "configurations", "pushes"]
BUDGET: Final[dict[Finder, int]] = {"sequences": 10_000, "crossings": 2_000, "configurations": 1_000, "pushes": 100}
"""Number of examples of each part of the campaign in ``make campaign``."""


@dataclass(frozen=True)
class Edit:
    """One change of the package."""

    file: str
    """File in :data:`DEVICE`."""
    now: str
    """The original text, which occurs once."""
    then: str

    def problem(self, package: Path) -> str:
        """Return why the change cannot be made, or an empty text."""
        count = (package / self.file).read_text().count(self.now)
        return "" if count == 1 else f"{self.file} has this {count} times: {self.now}"

    def make(self, package: Path) -> None:
        """Change the file in a copy of :data:`DEVICE`."""
        path = package / self.file
        path.write_text(path.read_text().replace(self.now, self.then))


@dataclass(frozen=True)
class Revert:
    """A reverted fix."""

    defect: int
    """Its number in the review; above 9: found later."""
    what: str
    edits: tuple[Edit, ...]
    finder: Finder = "sequences"


def _one(defect: int, what: str, file: str, now: str, then: str, finder: Finder = "sequences") -> Revert:
    return Revert(defect, what, (Edit(file, now, then),), finder)


_COMPARED: Final = Edit("bus/verification.py", "        if mismatches:\n", "        if False:\n")
_NO_LIMITS_TIGHTEN: Final = Edit(
    "run_limits.py", "        self.now_deg = tuple(\n            (max(low, min(tight_low", "        _ = tuple(\n            (max(low, min(tight_low"
)  # fmt: skip

REVERTS: Final = (
    Revert(
        1,
        "drives are configured when the port is opened, and never compared again",
        (
            _COMPARED,
            Edit("loop.py", "            self._bus.open()\n", "            self._bus.open()\n            self._bus.configure(range(5))\n"),
        ),
    ),
    _one(
        1,
        "the registers outside the status block are not read again",
        "bus/verification.py",
        "self._next_of_rotation() if self._cycle >= self._every else self._next_unread()",
        "self._next_unread()",
    ),
    _one(
        1,
        "a mismatch is no fault",
        "faults.py",
        "return (n for n, lost in enumerate(state.settings_lost) if lost)",
        "return ()",
    ),
    _one(
        1,
        "a stop is acknowledged before the drives are configured again",
        "state_machine.py",
        "return not_yet_cleared(self.stop, still_stopping=still_stopping) or not_verified(state, self.drive_problem)",
        "return not_yet_cleared(self.stop, still_stopping=still_stopping) if not state.settings_lost else None",
    ),
    _one(2, "a Stop does nothing in ready", "state_machine.py", " or self._teaching or self._run):", " or self._teaching):"),
    _one(
        2,
        "the stop counter of a command is not compared",
        "late_command.py",
        "    if seen_stops != stops:\n",
        "    if False:\n",
    ),
    _one(
        2, "the expiry of a command is not compared", "late_command.py", "    if t_ns > expires_ns:\n", "    if False:\n"
    ),
    Revert(
        2,
        "a Stop overtakes the commands before it and leaves them in the queue",
        (
            Edit("ipc.py", "        while self._commands:\n", "        while False:\n"),
            Edit("ipc.py", "        if taken.stop_requests != self.stop_requests:\n", "        if False:\n"),
        ),
        "crossings",
    ),
    _one(
        3,
        "without a port torque is shown off",
        "cycle_state.py",
        '                self._torque[n] = "unknown"\n',
        '                self._torque[n] = "off"\n',
    ),
    Revert(
        3,
        "torque is switched off as soon as the port is there again",
        (
            Edit("loop.py", "                if machine.torque_inherited:\n                    return\n", ""),
            Edit("state_machine.py", "            self.torque_inherited = True\n        elif", "            self.torque_inherited = False\n        elif"),
        ),
    ),
    _one(
        4,
        "resistance counts above 2 deg/s only",
        "resistance.py",
        "    if torque_nm * speed_deg_s > 0:\n        return True\n    return abs(speed_deg_s) < SLOW_DEG_S and np.sign(torque_nm) * ahead_deg > -_COUNT_DEG",
        "    return abs(speed_deg_s) >= 2.0 and torque_nm * speed_deg_s > 0",
        "pushes",
    ),
    _one(
        4,
        "resistance counts while a recording plays forwards only",
        "state_machine.py",
        "        axis = run.detect_resistance(state, moves_back=moves_back)\n        if axis is None:\n",
        '        axis = run.detect_resistance(state, moves_back=moves_back)\n        if axis is None or self.mode != "playing" or run.resisting_axis is not None:\n',
        "pushes",
    ),
    _one(
        4,
        "a setpoint held against the patient does not yield",
        "state_machine.py",
        "            self._yield(run, movement, state)\n",
        "",
        "pushes",
    ),
    _one(
        5,
        "numbers are compared with < only, which NaN passes",
        "config_rules.py",
        "        return self.low <= value <= self.high and ",
        "        return not (value < self.low or value > self.high) and ",
        "configurations",
    ),
    _one(
        5,
        "numbers have no ranges",
        "config_rules.py",
        "            if value is not None and not accepted.accepts(value):\n",
        "            if False:\n",
        "configurations",
    ),
    _one(
        5,
        "rules across fields are not checked",
        "config_rules.py",
        "    return found or [message for rule in rules_of(config.protocol) for message in rule.broken(config)]\n",
        "    return found\n",
        "configurations",
    ),
    _one(
        6,
        "references are built in the I/O thread",
        "ipc.py",
        "        loading.complete = part.last\n",
        "        loading.complete = part.last\n        if part.last:\n            from kata.device import references\n\n"
        "            references.build(loading.request.command, self._config)\n",
        "crossings",
    ),
    _one(
        6,
        "journals are written in the I/O thread",
        "ipc.py",
        "            self._take_load_results()\n            self._send(outgoing)\n",
        "            self._journal_set.write()\n            self._take_load_results()\n            self._send(outgoing)\n",
        "crossings",
    ),
    _one(
        6,
        "the mode is checked when the recording has been",
        "ipc.py",
        '        refusal_in_mode = self._latest_snapshot.refusals.get("load") if self._latest_snapshot else None\n',
        "        refusal_in_mode = None\n",
        "crossings",
    ),
    Revert(
        7,
        "limits stay as wide as they were for the approach",
        (
            _NO_LIMITS_TIGHTEN,
            Edit("run_limits.py", "        self.now_deg, self.beyond_deg = self.tight_deg, 0.0\n        return True", "        return True"),
            Edit("run.py", "        self.return_to_deg = np.array(self._held(inside_deg, self._lowest_deg, self._highest_deg))\n", "        self.return_to_deg = here_deg\n"),
        ),
    ),
    _one(
        8,
        "the turn is taken as the drive says it",
        "bus/dynamixel/answers.py",
        "zero_count(axis) - nearest_turn(axis, position)",
        "zero_count(axis)",
    ),
    _one(
        9,
        "a watchdog that is not armed is not noticed",
        "bus/dynamixel/answers.py",
        '            return ()\n        return ("bus watchdog",)',
        "            return ()\n        return ()",
    ),
    Revert(
        9,
        "the alert bit is not looked at, and each cycle looks at the status of one drive",
        (
            Edit("cycle_state.py", "or int(drive is not None and drive.alert)", "or 0"),
            Edit("bus/dynamixel/driver.py", "        size = next(self._block_lengths)\n", "        turn = next(self._next_status)\n        size = next(self._block_lengths)\n"),
            Edit("bus/dynamixel/driver.py", "            statuses[axis] = self._block_status(axis, t_ns, block, data)\n", "            status = self._block_status(axis, t_ns, block, data)\n            if axis == turn:\n                statuses[axis] = status\n"),
        ),
    ),
    _one(
        10,
        "a lost port is opened again before a cycle has seen its loss",
        "loop.py",
        "        if self._loss_unseen or self._now_ns()",
        "        if self._now_ns()",
    ),
    _one(
        11,
        "a start takes the angles of drives that do not answer",
        "refusals.py",
        "    if all(state.unbroken):\n",
        "    if True:\n",
    ),
    _one(
        12,
        "a setpoint does not brake before a limit",
        "run.py",
        "            setpoint = self._brake.setpoint(setpoint, lowest, highest)\n",
        "            pass\n",
    ),
    _one(
        13,
        "a Pause does not count as a stop does",
        "loop.py",
        "        if isinstance(taken.command, Pause):\n",
        "        if False:\n",
    ),
    _one(
        14,
        "a Modbus drive need not acknowledge its goal before torque",
        "bus/modbus/driver.py",
        "            self._set_goal(motor, axis, angle)\n",
        "            goal = self._position(axis, angle)\n"
        "            self._transact(axis.id, WRITE, self._written(self._map.goal_position, goal), _WRITTEN_BYTES)\n",
    ),
    _one(
        15,
        "a push is ignored for a second after a reversal, also when the arm no longer moves back",
        "resistance.py",
        "(moves_back and self._is_subsiding(n, state))",
        "self._is_subsiding(n, state)",
        "pushes",
    ),
    _one(
        16,
        "a resting motor's resistance does not stop the way back of an end-feel test",
        "run.py",
        "(rests or speed_deg_s * state.torque_nm[axis] > 0.0)",
        "speed_deg_s * state.torque_nm[axis] > 0.0",
        "pushes",
    ),
    _one(
        17,
        "a paused end-feel test does not give way",
        "state_machine.py",
        '        elif self.mode in ("playing", "paused"):\n            run.retreat_in_test()',
        '        elif self.mode == "playing":\n            run.retreat_in_test()',
        "pushes",
    ),
    _one(
        18,
        "the PWM limit of a drive is neither configured nor compared",
        "bus/dynamixel/registers.py",
        '    yield Register("PWM limit", _PWM_LIMIT, struct.pack("<H", _WHOLE_PWM))\n',
        "",
    ),
    _one(
        19,
        "a suspension of the computer counts neither as lateness nor as a pause",
        "loop.py",
        "        slept_ns = self._suspension.take_ns()\n",
        "        slept_ns = 0\n",
    ),
    _one(
        20,
        "the control program ends after one torque-off that no drive has confirmed",
        "loop.py",
        "        return not (needless or self._last_torque_off.is_done(state))\n",
        "        return False\n",
    ),
    _one(
        21,
        "a loaded recording does not expire",
        "state_machine_base.py",
        "        if state.t_ns >= self._ready_until_ns:\n",
        "        if False:\n",
    ),
    _one(
        22,
        "a late Modbus answer passes for the newest one",
        "bus/modbus/requests.py",
        "        if slave in self._overdue:\n",
        "        if False:\n",
    ),
    Revert(
        23,
        "a Dynamixel answer that is two cycles late passes for the newest one",
        (
            Edit("bus/dynamixel/driver.py", "range(PRESENT_BYTES, PRESENT_BYTES + 7)", "range(PRESENT_BYTES, PRESENT_BYTES + 2)"),
            Edit("bus/dynamixel/driver.py", "        first = turns % max(1, len(answering))\n", "        first = 0\n"),
        ),
    ),
    _one(
        24,
        "drives that held an arm from before the connection are judged by reports from before its release",
        "loop.py",
        "        if torque_was_inherited and not machine.torque_inherited:\n",
        "        if False:\n",
    ),
    _one(
        25,
        "a limit that follows the arm inwards does not leave the setpoint its way to stop",
        "run.py",
        "            stop_deg = setpoint_deg if self.zero_order_hold else self._brake.stop_deg.tolist()\n",
        "            stop_deg = setpoint_deg\n",
    ),
)  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("defect", nargs="*", type=int, help="only these")
    parser.add_argument("--what", default="", help="only fixes with this text in their description")
    given = parser.parse_args()
    _say("| Defect | Taken back | Found by | After |\n|---|---|---|---|")
    for revert in REVERTS:
        if given.what in revert.what and (not given.defect or revert.defect in given.defect):
            after = found_after(revert)
            examples = f"{after} of {BUDGET[revert.finder]}" if after else f"**not found in {BUDGET[revert.finder]}**"
            _say(f"| {revert.defect} | {revert.what} | {revert.finder} | {examples} |")


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def found_after(revert: Revert) -> int | None:
    """Return how many examples the campaign needed to fail without a fix; None where its budget did not suffice."""
    with tempfile.TemporaryDirectory() as folder:
        package = Path(folder) / DEVICE
        shutil.copytree(ROOT / "backend/kata", package.parent, ignore=shutil.ignore_patterns("__pycache__"))
        _make(revert.edits, package)
        searched = subprocess.run(
            [sys.executable, "-m", "tests.campaign.search", revert.finder],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": os.pathsep.join([str(package.parents[1]), str(ROOT)])},
            capture_output=True,
            text=True,
            check=False,
        )
    if searched.returncode:
        raise RuntimeError(searched.stderr)
    return int(searched.stdout.split()[-1]) or None


def _make(edits: Iterable[Edit], package: Path) -> None:
    for edit in edits:
        if problem := edit.problem(package):
            raise ValueError(problem)
        edit.make(package)


if __name__ == "__main__":
    main()
