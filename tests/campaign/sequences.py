"""Random sequences of what people, cables, computers and clocks do, judged by what the simulated drives saw on the wire.

The control loop and its driver are the real ones, the drives and mechanics the simulator's; only time is stepped. Nothing
here asks the loop what it thinks of itself, but for the answers that it gives to commands.
"""

import tempfile
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, Final
from unittest import mock

import numpy as np
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from kata.device.bus.drivers import make_bus
from kata.device.exchange import Taken
from kata.device.journal import read
from kata.device.loop import ControlLoop
from kata.device.messages import (
    Acknowledge,
    Approach,
    Command,
    FinishTeaching,
    Less,
    Load,
    Pause,
    Play,
    Return,
    Teach,
    Unload,
)
from kata.motion.trajectory import Trajectory
from kata.simulator.script import Kind
from tests.device.stepped import SteppedExchange
from tests.device.world import World

_PERIOD_NS: Final = 10_000_000
_NOTICED_NS: Final = 45_000_000
"""Within this, a pressed switch has cut the torque: a cycle, its bytes, and the two cycles that an input may be old."""
_REOPENED_NS: Final = 400_000_000
"""A port that is there again is tried four times a second, and the drives are set up anew."""
_PEDAL_LATE_NS: Final = 80_000_000
"""A lifted foot is seen after a cycle, and believed after 20 ms; inputs may be ten cycles old, but only if they stay away."""

_COMMANDS: Final[list[Callable[[str], Command]]] = [
    lambda identity: Teach(teaching_id=identity),
    lambda identity: FinishTeaching(),
    lambda identity: Load(run_id=identity, recording_id="a", times_s=b"", angles_deg=b""),
    lambda identity: Load(run_id=identity, recording_id="a", times_s=b"", angles_deg=b"", load_level=3),
    lambda identity: Unload(),
    lambda identity: Approach(),
    lambda identity: Play(),
    lambda identity: Pause(),
    lambda identity: Less(),
    lambda identity: Return(),
    lambda identity: Acknowledge(),
]
_DRIVE_FAULTS: Final[list[Kind]] = [
    "off", "silent", "stuck", "frozen", "garbage", "wrong_crc", "delayed", "intermittent", "hardware_error",
]  # fmt: skip
_BUS_FAULTS: Final[list[Kind]] = ["noise", "echo", "gone", "estop_wire_broken", "inputs_silent"]
_VALUES: Final = {"delayed": 15.0, "intermittent": 0.5, "hardware_error": 4.0}


def _recording() -> Trajectory:
    times = np.linspace(0.0, 3.0, 301)
    start = np.array([20.0, 105.0, 20.0, 10.0, -10.0])
    reach = np.array([-10.0, 8.0, 30.0, 40.0, -30.0])
    return Trajectory(times, start + reach * (1 - np.cos(2 * np.pi * times / 3.0))[:, None] / 2)


class Sequences(RuleBasedStateMachine):
    """One apparatus, from its switching on."""

    def __init__(self) -> None:
        super().__init__()
        self._folder = tempfile.TemporaryDirectory()
        self._wall = mock.patch("kata.device.modes.datetime", wraps=datetime)
        self._wall_shift_h = 0
        self._wall.start().now.side_effect = lambda tz: datetime.now(tz) + timedelta(hours=self._wall_shift_h)
        # The loop collects when a port is opened. Here that would go through all that hypothesis has, a third of the campaign's time.
        self._collecting = mock.patch("kata.device.loop.gc.collect")
        self._collecting.start()
        self._judged = 0
        self._started = [False] * 6
        """By motor: torque was asked for, and has not been taken since."""
        self._start_ns = 0
        self._lost_power = [False] * 6
        self._goal: list[tuple[int, float] | None] = [None] * 6
        self._pressed_ns: int | None = None
        self._pedal: list[tuple[int, bool]] = [(0, False)]
        self._blind_ns = 0

    @initialize(
        protocol=st.sampled_from(["dynamixel", "dynamixel", "modbus"]),
        seed=st.integers(0, 1000),
        pressed=st.booleans(),
        unknown=st.booleans(),
    )
    def switch_on(self, protocol: Any, seed: int, pressed: bool, unknown: bool) -> None:
        self.world = World(protocol, seed=seed)
        if pressed:
            self.press()
        if unknown:
            self.world.fault("inputs_silent")
        self.exchange = SteppedExchange(Path(self._folder.name))
        self.loop = ControlLoop(
            self.world.config,
            make_bus(self.world.config, self.world.open_line),
            self.exchange,
            real_time=False,
            memory_locked=False,
            now_ns=lambda: self.world.t_ns,
        )
        self._deadline_ns = self.world.t_ns
        self._run(10)

    # -- what may happen --------------------------------------------------------------------------------------------

    @rule(cycles=st.integers(1, 12))
    def time_passes(self, cycles: int) -> None:
        self._run(cycles)

    @rule(which=st.sampled_from(_COMMANDS))
    def command(self, which: Callable[[str], Command]) -> None:
        self._send(which(str(len(self.exchange.replies))))

    @rule()
    def go(self) -> None:
        """The next thing that somebody who wants to play would do: chance alone seldom gets that far."""
        identity = str(len(self.exchange.replies))
        load = Load(run_id=identity, recording_id="a", times_s=b"", angles_deg=b"")
        for command in (Acknowledge(), load, Approach()):
            self._send(command)
        self._run(60)
        self._send(Play())

    @rule()
    def stop(self) -> None:
        self.exchange.stop = True
        self._run(1)

    @rule()
    def press(self) -> None:
        if self._pressed_ns is None:
            self._pressed_ns = self.world.t_ns
        self.world.apparatus.press_estop(True)

    @rule()
    def release(self) -> None:
        self._pressed_ns = None
        self.world.apparatus.press_estop(False)

    @rule(down=st.booleans())
    def pedal(self, down: bool) -> None:
        self.world.apparatus.step_on_pedal(down)
        self._pedal.append((self.world.t_ns, down))

    @rule(kind=st.sampled_from(_DRIVE_FAULTS), motor=st.integers(1, 5))
    def a_drive_fails(self, kind: Kind, motor: int) -> None:
        self._lost_power[motor] = self._lost_power[motor] or kind in ("off", "hardware_error")
        self.world.fault(kind, motor, _VALUES.get(kind))

    @rule(kind=st.sampled_from(_BUS_FAULTS))
    def the_bus_fails(self, kind: Kind) -> None:
        self.world.fault(kind)

    @rule()
    def it_is_mended(self) -> None:
        # What was pressed or failed while nobody could see it counts from now; where the port was gone, from when it is open.
        self._blind_ns = self.world.t_ns + (_REOPENED_NS if self.world.script.has("gone") else 0)
        self.world.script.clear()
        if self._pressed_ns is not None:
            self._pressed_ns = self.world.t_ns

    @rule(silent_ms=st.sampled_from([0.0, 300.0, 700.0]))
    def the_service_hangs(self, silent_ms: float) -> None:
        """As by SIGSTOP, and SIGCONT."""
        self.exchange.service_silent_ms = silent_ms

    @rule(naming=st.sampled_from([None, "", "another"]))
    def the_service_believes(self, naming: str | None) -> None:
        self.exchange.naming = naming

    @rule(ok=st.booleans())
    def the_disk(self, ok: bool) -> None:
        self.exchange.journal_ok = ok

    @rule(milliseconds=st.sampled_from([15, 120, 400]))
    def the_computer_stands_still(self, milliseconds: int) -> None:
        self.world.wait(milliseconds / 1000)
        self._blind_ns = self.world.t_ns
        if self._pressed_ns is not None:
            self._pressed_ns = self.world.t_ns
        self._run(1)

    @rule(hours=st.sampled_from([-1, 0, 1]))
    def the_wall_clock_is_set(self, hours: int) -> None:
        self._wall_shift_h = hours

    # -- what must never happen --------------------------------------------------------------------------------------

    def _judge(self, *, start: bool) -> None:
        """What the drives have accepted in this cycle; ``start``: an approach was accepted in it."""
        if start:
            self._started = [True] * 6
            self._lost_power = [self.world.script.has("hardware_error", motor) for motor in range(6)]
            self._start_ns = self._deadline_ns
        for seen in self.world.seen[self._judged :]:
            if seen.what == "goal":
                self._judge_goal(seen.t_ns, seen.motor, seen.value)
            elif seen.value == 1:
                # What a cycle sends may be heard in the next one, and that may be missed where a reply was waited for.
                assert self._started[seen.motor], f"motor {seen.motor} got torque without a start"
                assert seen.t_ns < self._start_ns + 3 * _PERIOD_NS, f"motor {seen.motor} got torque without a new start"
            else:
                self._started[seen.motor], self._goal[seen.motor] = False, None
        self._judged = len(self.world.seen)

    def _judge_goal(self, t_ns: int, motor: int, angle: float) -> None:
        if self._lost_power[motor]:
            # Its torque went by itself, and nothing moves it; that has to be noticed first.
            return
        assert self._started[motor], f"motor {motor} got a goal without a start"
        axis = self.world.config.axes[motor - 1]
        low, high = axis.min_deg - 4.0, axis.max_deg + 4.0
        assert low <= angle <= high, f"motor {motor} was sent to {angle}"
        before, self._goal[motor] = self._goal[motor], (t_ns, angle)
        if before is not None:
            seconds = max((t_ns - before[0]) / 1e9, 1 / self.world.config.rate_hz)
            assert abs(angle - before[1]) <= 1.5 * axis.max_speed_deg_s * seconds + 1.2, (
                f"motor {motor} was sent a jump"
            )

    @invariant()
    def a_pressed_switch_has_cut_the_torque(self) -> None:
        if not hasattr(self, "world") or self._pressed_ns is None or self.world.script.has("gone"):
            return
        if self.world.t_ns - max(self._pressed_ns, self._blind_ns) > 3 * _NOTICED_NS:
            reached = [
                drive.torque_on
                for motor, drive in enumerate(self.world.apparatus.drives, start=1)
                if not self.world.script.has("off", motor)
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
        """Mended, released and acknowledged, the apparatus is idle again, without torque."""
        self.it_is_mended()
        self.release()
        self.world.apparatus.step_on_pedal(False)
        self.exchange.service_silent_ms, self.exchange.naming, self.exchange.journal_ok = 0.0, None, True
        self._run(150)
        self.exchange.stop = True
        self._run(60)
        for command in (Acknowledge(), Unload(), FinishTeaching()):
            self._send(command)
        self._run(20)
        assert self.exchange.snapshots[-1].mode == "idle", self.exchange.snapshots[-1]
        assert not any(self.world.torque)

    def _nothing_was_recorded_with_the_pedal_up(self) -> None:
        for writer in self.exchange.journals:
            writer.write()
            kept = read(writer.path)
            if kept.kind != "teaching":
                continue
            for t_ns in kept.t_ns.tolist():
                lately = [down for at, down in self._pedal if t_ns - _PEDAL_LATE_NS <= at <= t_ns]
                before = [down for at, down in self._pedal if at < t_ns - _PEDAL_LATE_NS]
                assert any(lately) or before[-1], f"a sample at {t_ns} with the pedal up"

    # -- parts --------------------------------------------------------------------------------------------------------

    def _run(self, cycles: int, *, start: bool = False) -> None:
        for _ in range(cycles):
            if not self.loop._connected:
                self.loop._open()
            self._deadline_ns += _PERIOD_NS
            late_ns = max(0, self.world.t_ns - self._deadline_ns)
            self._deadline_ns += late_ns // _PERIOD_NS * _PERIOD_NS
            self.world.t_ns = max(self.world.t_ns, self._deadline_ns)
            answered = len(self.exchange.replies)
            assert self.loop.cycle(self._deadline_ns, late_ns / 1e6)
            if self.world.t_ns < self._deadline_ns + _PERIOD_NS // 2:
                self.world.wait((self._deadline_ns + _PERIOD_NS // 2 - self.world.t_ns) / 1e9)
                self.loop.glance()
            accepted = start and any(reply.refusal is None for reply in self.exchange.replies[answered:])
            self._judge(start=accepted)

    def _send(self, command: Command) -> None:
        trajectory = _recording() if isinstance(command, Load) else None
        self.exchange.commands.append(Taken(len(self.exchange.replies), command, trajectory, None))
        self._run(1, start=isinstance(command, Approach))
