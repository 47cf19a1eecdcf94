"""Random sequences of events of people, browsers, cables, drives, computers and clocks, checked by :mod:`tests.campaign.judge`.

The control loop, its driver and the check of a load are the real ones. Drives and mechanics are simulated, and time is stepped.
Commands are delayed: any number arrives in one cycle, each may be delayed, and a Stop may overtake or follow any of them.
"""

import heapq
import itertools
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import lru_cache
from pathlib import Path
from typing import Any, Final
from unittest import mock

import msgspec
import numpy as np
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from kata.device.bus.factory import make_bus
from kata.device.bus.verification import ROUND_S
from kata.device.config import StationConfig
from kata.device.ipc_messages import (
    Acknowledge,
    Approach,
    Command,
    CommandName,
    EndFeel,
    FinishTeaching,
    Guarded,
    Load,
    Pause,
    Play,
    ReduceRange,
    ReleaseTorque,
    Return,
    Snapshot,
    Teach,
    Unload,
)
from kata.device.journal import read
from kata.device.loop import ControlLoop
from kata.motion.axes import Side
from kata.motion.reach import ArmLimits
from kata.simulator.adapter import AdapterLatency
from kata.simulator.fault_injector import FaultKind
from kata.system.realtime import Granted
from kata.testing.world import RecordingWorld
from tests.campaign.judge import COMMAND_LIFE_NS, Judge, Start
from tests.campaign.stations import SIDES, stations
from tests.support.stepped import SteppedServiceLink

_NOTICED_NS: Final = 15_000_000
"""Added to the cycles that an input may be old: the transmission time of a cycle."""
_REOPENED_NS: Final = 800_000_000
"""A returned port is tried four times a second; then the drives are configured and verified."""
_PEDAL_LATE_NS: Final = 80_000_000
"""A released pedal is read after a cycle and accepted after 20 ms; missing inputs may be ten cycles old."""
_RECOVERS_S: Final = 4.0
"""After all faults are cleared: the port is open, the drives are configured and every register has been read."""

_FOUND_S: Final = 4.0
"""The verification has read a lost setting, and a controlled stop has ended."""
_LATE_S: Final = 0.25
"""A longer suspension stops the arm."""
_ENDS_S: Final = 3.0
"""Without its service the control program ends within this time: after the ramp and at most half a second of repeated torque-off."""
_LATE_CYCLES: Final = 8
"""So long answers are late. More missing answers are a fault."""
_LED_DEG: Final = 2.0
"""The hand leads a motor on by so much in each cycle."""
_ON_THE_WIRE_S: Final = 0.005
"""The last sent bytes still reach the drives."""

_DRIVE_FAULTS: Final[list[FaultKind]] = [
    "off", "silent", "stuck", "frozen", "garbage", "wrong_crc", "delayed", "intermittent", "hardware_error",
]  # fmt: skip
_RESETS: Final[list[FaultKind]] = ["off", "reboot", "exchanged", "exchanged_id", "exchanged_model"]
"""Faults after which the drive has other than the configured registers."""
_BUS_FAULTS: Final[list[FaultKind]] = [
    "noise", "echo", "estop_wire_broken", "second_wire_broken", "contact_welded", "inputs_silent",
]  # fmt: skip
_UNREAD_INPUTS: Final[list[FaultKind]] = ["off", "silent", "garbage", "wrong_crc", "delayed", "intermittent", *_RESETS]
"""Faults of the inputs' drive after which the emergency stop may not be read."""
_VALUES: Final = {"delayed": 15.0, "intermittent": 0.5, "hardware_error": 4.0, "exchanged_id": 17.0}
_POWERLESS: Final[frozenset[FaultKind]] = frozenset({"hardware_error", *_RESETS})

_START_DEG: Final = np.array([17.0, 107.0, 12.0, 2.0, -2.0])
"""Close to the arm's rest pose, for a short approach."""
_REACH_DEG: Final = np.array([-10.0, 8.0, 30.0, 40.0, -30.0])
_TIGHT_DEG: Final = ((6.0, 18.0), (106.0, 116.0), (11.0, 43.0), (1.0, 43.0), (-33.0, -1.0))
"""A doctor's limits that contain the whole recording, but not the arm's rest pose."""
_LOW_ARM: Final = ArmLimits(side_deg=54.0, front_deg=54.0)
"""A doctor's limits of the pose, just above the wave's highest elevation of 52.4 deg."""
_TESTED: Final = 4
"""The motor of the end-feel tests."""


def _wave(duration_s: float, samples: int) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    times = np.linspace(0.0, duration_s, samples)
    return times, _START_DEG + _REACH_DEG * (1 - np.cos(2 * np.pi * times / duration_s))[:, None] / 2


def _steps(duration_s: float) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    times = np.array([0.0, duration_s])
    return times, np.array([_START_DEG, _START_DEG + 0.02 * np.sign(_REACH_DEG)])


def _way_out() -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return the way out of an end-feel test: 30 deg of motor 4 with 10 deg/s."""
    times = np.linspace(0.0, 3.0, 151)
    angles = np.tile(_START_DEG, (len(times), 1))
    angles[:, _TESTED - 1] += 10.0 * times
    return times, angles


def _sharp_end() -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Motor 5 turns with 90 deg/s and stops within 0.1 s."""
    times = np.linspace(0.0, 2.0, 201)
    angles = np.tile(_START_DEG, (len(times), 1))
    angles[:, 4] -= np.cumsum(90.0 * np.clip(np.minimum(times / 0.3, (0.8 - times) / 0.1), 0.0, 1.0)) * 0.01
    return times, angles


_RECORDINGS: Final = {
    "way out": _way_out(),
    "sharp end": _sharp_end(),
    "wave": _wave(3.0, 301),
    "slow wave": _wave(60.0, 601),
    "a millisecond": _steps(0.001),
    "a tenth": _steps(0.1),
    "no numbers": (np.array([0.0, 1.0]), np.full((2, 5), 1e308)),
}


def _limits_of(recording: str, angles_deg: np.ndarray[Any, Any]) -> tuple[tuple[float, float], ...]:
    """Return a doctor's limits: 0.2 deg beyond a sharp end, else the same for all recordings."""
    if recording != "sharp end":
        return _TIGHT_DEG
    return (*_TIGHT_DEG[:4], (float(angles_deg[:, 4].min()) - 0.2, -1.0))


@lru_cache(maxsize=256)
def _load(recording: str, level: int, limits: bool, method: str) -> Load:
    times, angles = _RECORDINGS[recording]
    return Load(
        run_id="",
        recording_id=recording,
        times_s=times.astype("<f8").tobytes(),
        angles_deg=angles.astype("<f8").tobytes(),
        resistance_level=level,
        limits_deg=_limits_of(recording, angles) if limits else (),
        method=method,  # type: ignore[arg-type]
    )


def _with_settings(load: Load, speed_deg_s: float | None, low_arm: bool, repetition_s: float, bend_deg: float) -> Load:
    """Return the load with a patient's further limits, or as a learned run whose correction swings by ``bend_deg``."""
    settings: dict[str, Any] = {
        "max_speed_deg_s": speed_deg_s,
        "arm_limits": _LOW_ARM if low_arm else None,
        "repetition_s": repetition_s,
    }
    if bend_deg and load.method == "smooth":
        rows = np.sin(np.linspace(0.0, 9.0, 31))[:, None] * np.full(5, bend_deg)
        times = np.frombuffer(load.times_s)
        settings |= {"method": "learned", "correction_deg": rows.astype("<f8").tobytes()}
        settings["correction_step_s"] = float(times[-1]) / 30
    return msgspec.structs.replace(load, **settings)


def _test(
    level: int, limits: bool, torque_nm: float, carried_nm: float, repetitions: int, weighed: bool, hold_s: float
) -> Load:
    """Return the load of an end-feel test, or with ``hold_s`` of a stretch, which is refused unless the arm is weighed.

    ``carried_nm``: torque at the end of the way without a shoulder.
    """
    growth = tuple(np.linspace(0.0, carried_nm, 20).tolist())
    test = EndFeel(
        motor=_TESTED,
        torque_nm=torque_nm,
        expected_nm=growth,
        arm_nm=(tuple(np.linspace(0.1, 0.6, 20).tolist()),) if weighed else (),
        weighed_s=(0.2, 1.0) if weighed else (0.0, 0.0),
        repetitions=repetitions,
        back_nm=growth if hold_s else (),
        hold_s=hold_s,
    )
    return msgspec.structs.replace(_load("way out", level, limits, "smooth"), end_feel=test)


_plays = st.builds(
    _load,
    st.sampled_from(["wave", "wave", "wave", "sharp end", "slow wave", "a millisecond", "a tenth", "no numbers"]),
    st.sampled_from([25, 25, 10, 3, 1]),
    st.booleans(),
    st.sampled_from(["smooth", "smooth", "paper"]),
)
_plays_with_settings = st.builds(
    _with_settings,
    _plays,
    st.sampled_from([None, 70.0, 45.0, 20.0]),
    st.booleans(),
    st.sampled_from([0.0, 1.0, 3.0]),
    st.sampled_from([0.0, 0.0, 1.0, 2.9]),
)
_tests = st.builds(
    _test,
    st.sampled_from([25, 25, 12]),
    st.booleans(),
    st.sampled_from([0.5, 1.0, 1.9]),
    st.sampled_from([0.0, 0.5, 1.0]),
    st.sampled_from([1, 3]),
    st.booleans(),
    st.sampled_from([0.0, 0.0, 1.0, 5.0]),
)
_loads = st.one_of(_plays, _plays, _plays_with_settings, _tests)
_commands = st.one_of(
    _loads,
    st.sampled_from(
        [
            Teach(teaching_id=""),
            FinishTeaching(),
            Unload(),
            Approach(),
            Approach(),
            Play(),
            Pause(),
            ReduceRange(),
            Return(),
            ReleaseTorque(),
            Acknowledge(),
        ]
    ),
)
_STOP: Final = "stop"
_delays_s = st.sampled_from([0.0, 0.0, 0.0, 0.02, 0.5, 1.5, 2.5])


@dataclass
class _Browser:
    """One page with the stop counter that it shows."""

    stops: int = 0


class Sequences(RuleBasedStateMachine):
    """One apparatus from its power-up, two browsers, and all faults."""

    def __init__(self) -> None:
        super().__init__()
        self._folder = tempfile.TemporaryDirectory()
        self._wall = mock.patch("kata.device.state_machine_base.datetime", wraps=datetime)
        self._wall_shift_h = 0
        self._wall.start().now.side_effect = lambda tz: datetime.now(tz) + timedelta(hours=self._wall_shift_h)
        # The loop collects garbage when it opens a port, which here would walk through all objects of hypothesis.
        self._collecting = mock.patch("kata.device.loop.gc.collect")
        self._collecting.start()
        self._suspended_ns = 0
        self._delivered: dict[int, int] = {}
        """Real time of each command's delivery."""
        self._commanded_ns = 0
        """Real time of the delivery of the last command that was answered."""
        self._browsers = [_Browser(), _Browser()]
        self._numbers = itertools.count()
        self._travelling: list[tuple[int, int, Command | str, int]] = []
        """Heap of arrival, order, command and time of the press."""
        self._sent: dict[int, tuple[Command, int]] = {}
        """Delivered commands by number, with the time of the press."""
        self._answered = self._events_seen = 0
        self._estop_pressed_ns: int | None = None
        self._pedal: list[tuple[int, bool]] = [(0, False)]
        self._blind_ns = 0
        self._disturbed = False
        """True if there was a fault or loss since all faults were cleared."""
        self._journals: list[Any] = []

    @initialize(config=stations(), seed=st.integers(0, 1000), pressed=st.booleans(), unknown=st.booleans())
    def switch_on(self, config: StationConfig, seed: int, pressed: bool, unknown: bool) -> None:
        self.world = RecordingWorld.of(config, seed=seed)
        self.judge = Judge(self.world, config)
        self._rest_deg = self.world.angles_deg
        self._period_ns = 1_000_000_000 // config.cycle_hz
        self._deadline_ns = self.world.t_ns
        if pressed:
            self.press()
        if unknown:
            self.world.fault("inputs_silent")
        self._start_device()
        self._run(0.3)

    def _start_device(self) -> None:
        self.link = SteppedServiceLink(Path(self._folder.name))
        self._answered = self._events_seen = 0
        self._sent.clear()
        self.loop = ControlLoop(
            self.world.config,
            make_bus(self.world.config, self.world.open_transport),
            self.link,
            Granted(scheduling=False, memory_lock=False),
            now_ns=lambda: self.world.t_ns,
        )
        suspension = self.loop._suspension
        suspension._counted_ns = self._suspended_ns
        suspension.read_ns = lambda: self._suspended_ns  # type: ignore[method-assign]
        self.judge.device_started()

    # -- rules ------------------------------------------------------------------------------------------------------

    @rule(seconds=st.sampled_from([0.01, 0.05, 0.12, 0.3]))
    def time_passes(self, seconds: float) -> None:
        self._run(seconds)

    @rule(
        browser=st.integers(0, 1),
        what=st.lists(st.tuples(st.one_of(_commands, st.just(_STOP)), _delays_s), min_size=1, max_size=4),
        seconds=st.sampled_from([0.0, 0.01, 0.1]),
    )
    def press_buttons(self, browser: int, what: list[tuple[Command | str, float]], seconds: float) -> None:
        """Send any number of commands, each with its own delay."""
        for command, delay_s in what:
            self._press(browser, command, delay_s)
        self._run(seconds)

    @rule(browser=st.integers(0, 1))
    def a_browser_looks(self, browser: int) -> None:
        """A page receives the newest snapshot."""
        self._look(browser)

    @rule(
        load=_loads, end=st.sampled_from(["approaching", "start", "playing", "playing", "paused"]), mended=st.booleans()
    )
    def go(self, load: Load, end: str, mended: bool) -> None:
        """Do the steps of a playback in order, which random commands seldom reach. ``mended``: without the earlier faults."""
        if mended:
            self._recover()
            if end in ("playing", "paused"):
                self._lead_to_rest()
        self._make_ready(load)
        self._look(0)
        self._press(0, Approach(), 0.0)
        self._run(0.02)
        if end == "approaching":
            return
        self._until(lambda: self._snapshot.mode != "approaching")
        if end == "start":
            return
        self._look(0)
        self._press(0, Play(), 0.0)
        self._run(0.3)
        if end == "paused":
            self._press(0, Pause(), 0.0)
            self._run(0.3)

    @rule(
        load=_loads,
        motor=st.integers(1, 5),
        kind=st.one_of(st.none(), st.sampled_from(_DRIVE_FAULTS)),
        strength_nm=st.sampled_from([0.5, 1.5, 3.5]),
        after_s=st.sampled_from([0.0, 0.5, 1.5]),
    )
    def something_happens_while_playing(
        self, load: Load, motor: int, kind: FaultKind | None, strength_nm: float, after_s: float
    ) -> None:
        """A healthy apparatus plays. Then a drive fails, or the patient resists."""
        self.go(load, "playing", mended=True)
        self._run(after_s)
        if kind is None:
            # A second press of Play arrives when the arm may have been taken back.
            self._press(0, Play(), 1.5)
            self.the_patient_resists(motor, strength_nm, 1.8)
        else:
            self.a_drive_fails(kind, motor)
            self._run(0.1)

    @rule(
        load=_tests,
        events=st.lists(
            st.tuples(
                st.sampled_from(["turn", "pause", "play", "pedal", "resist", "reduce"]),
                st.sampled_from([0.1, 0.3, 1.0, 3.0]),
            ),
            max_size=8,
        ),
    )
    def the_end_feel_is_tested(self, load: Load, events: list[tuple[str, float]]) -> None:
        """A healthy apparatus tests a shoulder. Therapist and patient act until the test ends; each action is followed by some
        seconds.

        "turn": they wait until the arm is on its way back.
        """
        self.go(load, "playing", mended=True)
        for what, seconds in events:
            if self._snapshot.mode not in ("playing", "paused"):
                return
            match what:
                case "pause":
                    self._press(0, Pause(), 0.0)
                case "play":
                    self._look(0)
                    self._press(0, Play(), 0.0)
                case "reduce":
                    self._press(0, ReduceRange(), 0.0)
                case "pedal":
                    self.pedal(True)
                    self._run(0.2)
                    self.pedal(False)
                case "resist":
                    self.the_patient_resists(_TESTED, 1.5, 0.3)
                case _:
                    self._until(lambda: self.judge.test_goes_back or self._snapshot.mode != "playing")
            self._run(seconds)

    @rule(
        load=_loads,
        delay_s=st.sampled_from([0.5, 1.5, 2.5]),
        meanwhile=st.sampled_from(["nothing", "stop", "pause", "load"]),
    )
    def a_start_arrives_late(self, load: Load, delay_s: float, meanwhile: str) -> None:
        """The command to start is delayed. "stop": meanwhile the arm is stopped and made ready again. "pause": Pause is pressed. "load": the
        recording is loaded again.
        """
        self._make_ready(load)
        self._look(0)
        self._press(0, Approach(), delay_s)
        if meanwhile == "pause":
            self._press(0, Pause(), 0.0)
        if meanwhile == "load":
            self._press(0, Unload(), 0.0)
            self._run(0.05)
            self._make_ready(load)
        if meanwhile == "stop":
            self._press(0, _STOP, 0.0)
            self._run(0.3)
            self._make_ready(load)
        self._run(delay_s)

    @rule(
        load=_plays,
        what=st.sampled_from([Play(), Return()]),
        delay_s=st.sampled_from([0.02, 0.5, 1.5]),
        pause=st.booleans(),
    )
    def a_movement_arrives_late(self, load: Load, what: Play | Return, delay_s: float, pause: bool) -> None:
        """At the start of a recording a command to move is delayed. ``pause``: meanwhile Pause is pressed, and has nothing to pause."""
        self.go(load, "start", mended=True)
        self._look(0)
        self._press(0, what, delay_s)
        if pause:
            self._press(0, Pause(), 0.0)
        self._run(delay_s + 0.1)

    @rule(
        load=_loads,
        motor=st.integers(1, 5),
        seconds=st.sampled_from([0.02, 0.08, 0.25]),
        turned_deg=st.sampled_from([-20.0, 0.0, 20.0]),
        kind=st.sampled_from(["silent", "off", "reboot", "exchanged"]),
    )
    def a_start_while_a_drive_is_silent(
        self, load: Load, motor: int, seconds: float, turned_deg: float, kind: FaultKind
    ) -> None:
        """A drive does not answer, a hand leads its motor on, and the approach is pressed. Then the drive answers again."""
        self._recover()
        self._lead_to_rest()
        self._make_ready(load)
        self._fault(kind, motor)
        self._run(seconds)
        self._lead_on(motor, turned_deg)
        self._look(0)
        self._press(0, Approach(), 0.0)
        self._run(0.02)
        self.it_is_mended()
        self._run(0.3)

    @rule(
        load=_loads,
        after=st.integers(0, 15),
        seconds=st.sampled_from([0.1, 1.8]),
        motor=st.integers(1, 5),
        turned_deg=st.sampled_from([0.0, -20.0, 20.0]),
    )
    def a_start_loses_a_request(self, load: Load, after: int, seconds: float, motor: int, turned_deg: float) -> None:
        """One of the requests around the start does not reach the drives, such as a drive's goal or the one that arms their watchdogs.

        A Modbus station sends up to eight requests in the cycle before its first goal. Before that, a hand leads one motor away from its last goal.
        """
        self._recover()
        self._lead_on(motor, turned_deg)
        self._make_ready(load)
        self._look(0)
        self._disturb()
        self.world.lose_requests(1, after)
        self._press(0, Approach(), 0.0)
        self._run(seconds)

    @rule(delay_s=_delays_s)
    def stop(self, delay_s: float) -> None:
        self._press(0, _STOP, delay_s)
        self._run(0.01)

    @rule()
    def press(self) -> None:
        if self._estop_pressed_ns is None:
            self._estop_pressed_ns = self.world.t_ns
        self.judge.released = True
        self.world.apparatus.press_estop(True)

    @rule()
    def release(self) -> None:
        self._estop_pressed_ns = None
        self.world.apparatus.press_estop(False)

    @rule(down=st.booleans())
    def pedal(self, down: bool) -> None:
        self.world.apparatus.step_on_pedal(down)
        self._pedal.append((self.world.t_ns, down))
        self.judge.pedal_since_ns = self.world.t_ns if down else None

    @rule(kind=st.sampled_from(_DRIVE_FAULTS), motor=st.integers(1, 5))
    def a_drive_fails(self, kind: FaultKind, motor: int) -> None:
        self._fault(kind, motor)

    @rule(kind=st.sampled_from(_RESETS), motor=st.integers(1, 5), back=st.booleans())
    def a_drive_loses_its_settings(self, kind: FaultKind, motor: int, back: bool) -> None:
        """``back``: the drive returns at once, as after a voltage dip."""
        self._fault(kind, motor)
        if back:
            self.it_is_mended()

    @rule(motor=st.integers(1, 5), which=st.integers(0, 9), seconds=st.sampled_from([0.0, 0.0, _FOUND_S]))
    def a_drive_loses_one_setting(self, motor: int, which: int, seconds: float) -> None:
        """A register outside the status block gets its factory value; only the periodic verification reads it.

        ``seconds``: nothing else happens for so long while torque is on. Random rules seldom leave an arm its torque until the
        verification is due.
        """
        registers = self.judge.rotated_registers(motor)
        if registers and not self.world.faults.has("exchanged_id", motor):
            self._disturb()
            self.world.set_registers(motor, *registers[which % len(registers)])
        self._until(lambda: not any(self.world.torque), seconds)

    @rule(kind=st.sampled_from(_BUS_FAULTS))
    def the_bus_fails(self, kind: FaultKind) -> None:
        if kind in ("estop_wire_broken", "second_wire_broken", "contact_welded"):
            self.judge.released = True
        self._disturb()
        self.world.fault(kind)

    @rule(packets=st.integers(1, 3), after=st.integers(0, 6))
    def requests_are_lost(self, packets: int, after: int) -> None:
        """Some of the next requests do not reach the drives."""
        self._disturb()
        self.world.lose_requests(packets, after)

    @rule(seconds=st.sampled_from([0.05, 0.4]))
    def the_adapter_is_pulled_out(self, seconds: float) -> None:
        self._disturb()
        self.world.wait(_ON_THE_WIRE_S)
        self.world.fault("gone")
        self.judge.port_lost(pressed=self._looks_pressed)
        self._run(seconds)

    @rule(seconds=st.sampled_from([0.02, 0.3, 0.6]))
    def the_connection_fails_while_the_computer_stands_still(self, seconds: float) -> None:
        """The adapter is pulled out between two cycles. The computer stands still, and the adapter is back before the next cycle."""
        if not (self.loop._connected and self.loop._machine.torque_on):
            # The control program does not use the port then, and cannot notice.
            return
        self._disturb()
        self.world.wait(_ON_THE_WIRE_S)
        self.world.fault("gone")
        self.judge.port_lost(pressed=self._looks_pressed)
        self.loop.poll_estop()
        self.world.wait(seconds)
        self.it_is_mended()
        self._run(0.05)
        causes = {cause.code for cause in self._snapshot.stop.causes} if self._snapshot.stop else set()
        assert "bus_lost" in causes, "a lost connection was not noticed"

    @rule()
    def it_is_mended(self) -> None:
        # An unseen press or failure counts from now, or from the opening of the port if it was gone. An inputs' drive without its
        # settings is configured and verified before its inputs count.
        reset = self.judge.a_setting_of_the_inputs_differs
        self._blind_ns = self.world.t_ns + (_REOPENED_NS if self.world.faults.has("gone") or reset else 0)
        for motor in range(1, 6):
            # The exchange back cuts the power too. A Modbus station cannot refuse another model: it may have torque until now.
            if self.world.faults.has("exchanged_id", motor) or self.world.faults.has("exchanged_model", motor):
                self.judge.power_lost(motor)
        self.world.faults.clear()
        self._disturb()
        self._disturbed = False
        if self._estop_pressed_ns is not None:
            self._estop_pressed_ns = self.world.t_ns

    @rule(
        motor=st.integers(1, 5), strength_nm=st.sampled_from([0.5, 1.5, 3.5]), seconds=st.sampled_from([0.3, 0.3, 1.8])
    )
    def the_patient_resists(self, motor: int, strength_nm: float, seconds: float) -> None:
        """The patient resists the movement."""
        self.world.apparatus.hold_against(motor, strength_nm)
        self._run(seconds)
        self.world.apparatus.hold_against(motor, 0.0)

    @rule(motor=st.integers(1, 5), share=st.floats(0.0, 1.0))
    def the_arm_is_led_by_hand(self, motor: int, share: float) -> None:
        """Move the arm without torque to any place in its range."""
        if not any(self.world.torque):
            axis = self.world.config.axes[motor - 1]
            self.world.place(motor, axis.min_deg + share * (axis.max_deg - axis.min_deg))

    @rule(silent_ms=st.sampled_from([0.0, 300.0, 700.0]))
    def the_service_hangs(self, silent_ms: float) -> None:
        """Stop the control loop, as by SIGSTOP and SIGCONT."""
        self.link.service_silent_ms = silent_ms

    @rule(naming=st.sampled_from([None, "", "another"]))
    def the_service_believes(self, naming: str | None) -> None:
        self.link.naming = naming

    @rule()
    def the_device_process_restarts(self) -> None:
        """Kill the device process, as by SIGKILL: nothing is switched off, and a new process finds the drives as they are."""
        self._restart(self.world.config.side)

    @rule(side=st.sampled_from(SIDES), empty=st.booleans())
    def the_apparatus_is_turned(self, side: Side, empty: bool) -> None:
        """Turn the apparatus for a shoulder while no drive has torque. The device process restarts for the new side.

        ``empty``: earlier faults are mended and no motion is loaded. Else commands for the former side may still arrive.
        """
        if empty:
            self._recover()
        if not any(self.world.torque):
            self._restart(side)

    def _restart(self, side: Side, settle_s: float = 0.3) -> None:
        self._disturb()
        self._journals += self.link.journals
        self.world.wait(_ON_THE_WIRE_S)
        self.judge.port_lost(pressed=self._looks_pressed)
        self.world.wait(0.3)
        if side != self.world.config.side:
            self.world.turn(side)
            self.judge.turned()
        self._blind_ns = self.world.t_ns + _REOPENED_NS
        self._deadline_ns = self.world.t_ns
        if self._estop_pressed_ns is not None:
            self._estop_pressed_ns = self.world.t_ns
        self._start_device()
        self._run(settle_s)

    @rule(ok=st.booleans())
    def the_disk(self, ok: bool) -> None:
        self.link.journal_ok = ok

    @rule(milliseconds=st.sampled_from([15, 120, 400]))
    def the_computer_stands_still(self, milliseconds: int) -> None:
        self._disturb()
        self.world.wait(milliseconds / 1000)
        self._blind_ns = max(self._blind_ns, self.world.t_ns)
        if self._estop_pressed_ns is not None:
            self._estop_pressed_ns = self.world.t_ns
        self._run(0.01)

    @rule(seconds=st.sampled_from([0.1, 0.4, 60.0, 700.0]))
    def the_computer_is_suspended(self, seconds: float) -> None:
        """The computer sleeps, and its monotonic clock stands still. So do the drives here: no watchdog notices it."""
        stops = seconds > _LATE_S and self.loop._machine.torque_on and self.loop._connected
        if seconds > _LATE_S:
            self.judge.suspended(seconds)
        self._suspended_ns += int(seconds * 1e9)
        self._run(0.02)
        causes = {cause.code for cause in self._snapshot.stop.causes} if self._snapshot.stop else set()
        assert not stops or "overrun" in causes, "a suspended computer went on with its motion"

    @rule(load=_loads, seconds=st.sampled_from([60.0, 700.0]))
    def a_loaded_recording_waits(self, load: Load, seconds: float) -> None:
        """A recording is loaded, the computer sleeps, and the start is pressed."""
        self._recover()
        self._make_ready(load)
        self.the_computer_is_suspended(seconds)
        self._look(0)
        self._press(0, Approach(), 0.0)
        self._run(0.1)

    @rule(load=_loads, lost=st.integers(0, 4))
    def the_service_ends(self, load: Load, lost: int) -> None:
        """The service is gone while a healthy apparatus plays. The first messages that switch torque off do not reach the drives."""
        self.go(load, "playing", mended=True)
        bus, left = self.loop._bus, iter(range(lost))
        torque_off = bus.torque_off

        def lose_first() -> None:
            if next(left, None) is not None:
                self.world.lose_requests(1, 0)
            torque_off()

        bus.torque_off = lose_first  # type: ignore[method-assign]
        self.link.closing, self.link.service_silent_ms = True, 1e9
        limit_ns = self.world.t_ns + int(_ENDS_S * 1e9)
        while self._cycle():
            assert self.world.t_ns < limit_ns, "the control program does not end"
        self.loop._torque_off_on_exit()
        self.world.wait(_ON_THE_WIRE_S)
        assert not any(self.world.torque), "the control program ended, and a motor has torque"
        self._restart(self.world.config.side)

    @rule(
        late_ms=st.sampled_from([11.0, 15.0, 20.5, 29.0, 41.0]),
        motor=st.one_of(st.none(), st.integers(1, 5)),
        restarted=st.booleans(),
    )
    def answers_come_late_while_a_hand_leads_the_arm(self, late_ms: float, motor: int | None, restarted: bool) -> None:
        """``motor``: only its drive answers late; None: the adapter delivers all bytes late. ``restarted``: before, the control program has
        restarted, and its first cycles read the registers one after the other.
        """
        self._recover()
        if restarted:
            self._restart(self.world.config.side, settle_s=0.05)
        self._disturb()
        if motor is None:
            self.world.latency = AdapterLatency(late_ms)
        else:
            self.world.fault("delayed", motor, late_ms)
        for n in range(_LATE_CYCLES):
            self._lead_on(motor or 1, _LED_DEG if n < _LATE_CYCLES / 2 else -_LED_DEG)
            self._run(0.0)
        self.world.latency = AdapterLatency()
        self._blind_ns = max(self._blind_ns, self.world.t_ns)
        self.it_is_mended()

    @rule(hours=st.sampled_from([-1, 0, 1]))
    def the_wall_clock_is_set(self, hours: int) -> None:
        self._wall_shift_h = hours

    # -- further safety rules -----------------------------------------------------------------------------------------

    @invariant()
    def a_pressed_switch_has_cut_the_torque(self) -> None:
        if not hasattr(self, "world") or self._estop_pressed_ns is None or self.world.faults.has("gone"):
            return
        if not self._a_contact_tells:
            return
        inputs = self.world.config.inputs
        noticed_ns = (inputs.max_age_cycles + 2) * self._period_ns + _NOTICED_NS
        if self.world.t_ns - max(self._estop_pressed_ns, self._blind_ns) > 3 * noticed_ns:
            reached = [
                drive.torque_on
                for motor, drive in enumerate(self.world.apparatus.drives, start=1)
                if not self.world.faults.has("off", motor)
                and not self.world.faults.has("exchanged_id", motor)
                # An arm that was held when the port was lost is let go by a known press or a confirmation only.
                and not (self._inputs_may_be_unread and self.judge.holds_since_loss(motor))
            ]
            assert not any(reached), "torque with the switch pressed"

    def teardown(self) -> None:
        try:
            if hasattr(self, "world"):
                self._every_state_can_be_left()
                self._nothing_was_recorded_with_the_pedal_up()
        finally:
            self._wall.stop()
            self._collecting.stop()
            self._folder.cleanup()

    def _every_state_can_be_left(self) -> None:
        self._recover()
        assert self._snapshot.mode == "idle", self._snapshot
        assert not any(self.world.torque)

    def _recover(self) -> None:
        """Clear the faults, release and acknowledge. The apparatus should then be idle without torque."""
        self._travelling.clear()
        self.it_is_mended()
        self.release()
        self.world.lose_requests(0, 0)
        self.pedal(False)
        self.link.service_silent_ms, self.link.naming, self.link.journal_ok = 0.0, None, True
        # The verification finds lost settings of a drive within one round.
        self._run(ROUND_S if self.judge.a_setting_differs else 0.1)
        self._until(lambda: self._snapshot.torque != "unknown" and self._snapshot.mode != "offline")
        self._press(0, _STOP, 0.0)
        self._run(0.1)
        self._until(lambda: self._snapshot.mode in ("idle", "stopped") and self._may_go_on("release_torque"))
        for command in (ReleaseTorque(), Acknowledge(), Unload(), FinishTeaching()):
            if isinstance(command, Acknowledge):
                self._until(lambda: self._may_go_on("acknowledge"))
            self._look(0)
            self._press(0, command, 0.0)
            self._run(0.02)
        self._until(lambda: self._snapshot.mode == "idle" and not any(self.world.torque))

    def _nothing_was_recorded_with_the_pedal_up(self) -> None:
        for writer in self._journals + self.link.journals:
            writer.write()
            journal = read(writer.path)
            if journal.kind != "teaching":
                continue
            for t_ns in journal.t_ns.tolist():
                recent = [down for at, down in self._pedal if t_ns - _PEDAL_LATE_NS <= at <= t_ns]
                before = [down for at, down in self._pedal if at < t_ns - _PEDAL_LATE_NS]
                assert any(recent) or before[-1], f"a sample at {t_ns} with the pedal up"

    @property
    def _snapshot(self) -> Snapshot:
        return self.link.snapshots[-1]

    def _may_go_on(self, command: CommandName) -> bool:
        """Return True if a command is accepted or has nothing to do."""
        refusal = self._snapshot.refusals.get(command)
        return refusal is None or refusal.code in ("no_torque_found", "is_idle", "not_stopped")

    def _until(self, condition: Callable[[], bool], seconds: float = _RECOVERS_S) -> None:
        """Let time pass until a condition holds, at most ``seconds``."""
        limit_ns = self._deadline_ns + int(seconds * 1e9)
        while not condition() and self._deadline_ns < limit_ns:
            self._run(0.05)

    # -- parts --------------------------------------------------------------------------------------------------------

    def _lead_to_rest(self) -> None:
        """Lead the arm by hand to its rest pose. From a distant place a slow approach takes longer than it is waited for, and then
        nothing plays.
        """
        if not any(self.world.torque):
            for motor, angle_deg in enumerate(self._rest_deg, start=1):
                self.world.place(motor, angle_deg)
            self._run(0.02)

    def _lead_on(self, motor: int, turned_deg: float) -> None:
        """Lead one motor by hand within its range, if there is no torque."""
        if not any(self.world.torque):
            axis = self.world.config.axes[motor - 1]
            angle_deg = self.world.angles_deg[motor - 1] + turned_deg
            self.world.place(motor, min(max(angle_deg, axis.min_deg), axis.max_deg))

    def _make_ready(self, load: Load) -> None:
        """Release the arm, acknowledge a stop and load a recording."""
        for command in (ReleaseTorque(), Acknowledge(), load):
            self._look(0)
            self._press(0, command, 0.0)
            self._run(0.3 if isinstance(command, ReleaseTorque) and any(self.world.torque) else 0.02)

    def _fault(self, kind: FaultKind, motor: int) -> None:
        alone = kind == "hardware_error" and not self._disturbed
        self._disturb()
        if kind in _POWERLESS:
            self.judge.power_lost(motor)
        self.world.fault(kind, motor, _VALUES.get(kind))
        if alone and self.world.config.protocol == "dynamixel":
            self.judge.error_since_ns = self.world.t_ns

    @property
    def _real_ns(self) -> int:
        """The time with all suspensions of the computer."""
        return self.world.t_ns + self._suspended_ns

    @property
    def _a_contact_tells(self) -> bool:
        """True if at least one wired contact follows the switch; with both broken its state is unknown."""
        second = self.world.config.inputs.estop_second_port is not None
        return not self.world.faults.has("contact_welded") or (
            second and not self.world.faults.has("second_wire_broken")
        )

    @property
    def _inputs_may_be_unread(self) -> bool:
        """True if a fault can keep both contacts from being read."""
        faults, drive = self.world.faults, self.world.config.inputs.drive_id
        return faults.has("inputs_silent") or any(faults.has(kind, drive) for kind in _UNREAD_INPUTS)

    @property
    def _looks_pressed(self) -> bool:
        """True if either contact of the emergency stop reads as pressed."""
        broken = any(
            self.world.faults.has(kind) for kind in ("estop_wire_broken", "second_wire_broken", "contact_welded")
        )
        return broken or self._estop_pressed_ns is not None

    def _disturb(self) -> None:
        self._disturbed = True
        self.judge.error_since_ns = self.judge.pedal_since_ns = None

    def _look(self, browser: int) -> None:
        self._browsers[browser].stops = self._snapshot.stops

    def _press(self, browser: int, what: Command | str, delay_s: float) -> None:
        """Press a button: the command carries the state that the page shows, and arrives later."""
        number = next(self._numbers)
        if isinstance(what, Guarded):
            expires_ns = self.world.t_ns + COMMAND_LIFE_NS
            what = msgspec.structs.replace(what, stops=self._browsers[browser].stops, expires_ns=expires_ns)
        elif isinstance(what, Load):
            what = msgspec.structs.replace(what, run_id=str(number), side=self.world.config.side)
        elif isinstance(what, Teach):
            what = msgspec.structs.replace(what, teaching_id=str(number), side=self.world.config.side)
        heapq.heappush(self._travelling, (self.world.t_ns + int(delay_s * 1e9), number, what, self.world.t_ns))

    def _deliver(self) -> None:
        """Deliver the arrived commands in order."""
        while self._travelling and self._travelling[0][0] <= self.world.t_ns:
            _, number, what, pressed_ns = heapq.heappop(self._travelling)
            if isinstance(what, str):
                self.judge.last_stop_ns = self.world.t_ns
                self.link.request_stop("operator_stop")
            else:
                self._sent[number] = (what, pressed_ns)
                self._delivered[number] = self._real_ns
                self.link.request(number, what, self.world.config)

    def _run(self, seconds: float) -> None:
        until_ns = self._deadline_ns + int(seconds * 1e9)
        while True:
            assert self._cycle()
            if self._deadline_ns >= until_ns:
                return

    def _cycle(self) -> bool:
        """Run one cycle. Return False if the control program has ended."""
        if not self.loop._connected:
            self.loop._open()
        self._deadline_ns += self._period_ns
        late_ns = max(0, self.world.t_ns - self._deadline_ns)
        self._deadline_ns += late_ns // self._period_ns * self._period_ns
        self.world.t_ns = max(self.world.t_ns, self._deadline_ns)
        self._deliver()
        goes_on = self.loop.cycle(self._deadline_ns, (late_ns + self.loop._take_suspension_ns()) / 1e6)
        self._note_answers()
        self.judge.check(self.link.snapshots)
        half_ns = self._deadline_ns + self._period_ns // 2
        if self.world.t_ns < half_ns:
            self.world.wait((half_ns - self.world.t_ns) / 1e9)
            self.loop.poll_estop()
        return goes_on

    def _note_answers(self) -> None:
        for reply in self.link.replies[self._answered :]:
            before_ns, self._commanded_ns = self._commanded_ns, self._delivered.get(reply.id, self._commanded_ns)
            if isinstance(self._sent.get(reply.id, (None,))[0], Pause):
                self.judge.last_pause_ns = self._deadline_ns
            if reply.refusal is not None or reply.id not in self._sent:
                continue
            command, pressed_ns = self._sent[reply.id]
            if isinstance(command, Guarded):
                self.judge.accepted(command, pressed_ns)
            match command:
                case Approach():
                    self.judge.loaded_for(self._commanded_ns - before_ns)
                    self.judge.start = Start(self._deadline_ns, pressed_ns, self.judge.last_stop_ns)
                case Load():
                    self.judge.begun_ns = self.world.t_ns
                    self.judge.loaded_ns = self._deadline_ns
                    self.judge.loaded(command)
                case Teach():
                    self.judge.begun_ns = self.world.t_ns
                case ReleaseTorque() | Acknowledge():
                    self.judge.released = True
                case _:
                    pass
        self._answered = len(self.link.replies)
        for event in self.link.events[self._events_seen :]:
            if event.code == "load_reversal":
                self.judge.reversed(self._deadline_ns)
        self._events_seen = len(self.link.events)
