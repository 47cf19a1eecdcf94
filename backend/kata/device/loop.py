"""Runs the control loop: wait for the deadline, read, evaluate faults, step, write, publish. Halfway to the next cycle it
polls the emergency stop.

Deadlines are absolute. A missed deadline is skipped and counted. The loop waits for no other thread: journal, commands
and telemetry pass through queues to the I/O thread (:mod:`kata.device.ipc`).
"""

import gc
import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from msgspec import structs

from kata.device import texts
from kata.device.bus.bandwidth import max_cycle_hz
from kata.device.bus.interface import Bus, BusError, BusSample, OtherAdapterError
from kata.device.config import StationConfig
from kata.device.cycle_state import CycleState, CycleStateBuilder, LoopContext
from kata.device.faults import MAX_OVERRUN_MS, evaluate_faults
from kata.device.ipc import QueuedCommand, ServiceLink
from kata.device.ipc_messages import Guarded, Pause, Reply
from kata.device.late_command import STOPPED_MEANWHILE, out_of_date
from kata.device.loop_telemetry import LoopTelemetry
from kata.device.pedal import UsbPedal
from kata.device.refusals import ANGLES_NOT_CURRENT
from kata.device.setpoint_gate import SetpointGate
from kata.messages import text_of
from kata.system.realtime import Granted
from kata.system.suspension import SuspensionClock

log = logging.getLogger(__name__)

_RECONNECT_NS: Final = 250_000_000
"""Time between two attempts to open the port or to configure a drive."""
_WAIT_FOR_ANGLES_NS: Final = 500_000_000
"""A start waits so long for answers and status of all drives. At 20 Hz the statuses of five drives take 250 ms."""
_LAST_TORQUE_OFF_NS: Final = 500_000_000
"""Longest time for which torque-off is repeated before the process ends. A status of each drive comes within 250 ms."""


class LastTorqueOff:
    """The end of the process: torque-off is repeated until the drives confirm it, because a message may be lost, and no other process
    would repeat it.
    """

    def __init__(self) -> None:
        """Prepare for the end."""
        self._end_by_ns: int | None = None

    def is_done(self, state: CycleState) -> bool:
        """Return True if the drives report no torque. A drive that does not report it delays the end by :data:`_LAST_TORQUE_OFF_NS`."""
        if self._end_by_ns is None:
            self._end_by_ns = state.t_ns + _LAST_TORQUE_OFF_NS
        return all(reported is False for reported in state.torque_reported) or state.t_ns >= self._end_by_ns


class ControlLoop(LoopTelemetry):
    """Controls one apparatus."""

    def __init__(
        self,
        config: StationConfig,
        bus: Bus,
        link: ServiceLink,
        granted: Granted,
        *,
        now_ns: Callable[[], int],
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Prepare the loop. ``now_ns`` and ``sleep``: the clock, real or simulated. ``granted``: privileges shown in the snapshots."""
        super().__init__(config, bus, link, granted, first_stops=now_ns() // 1_000_000)
        self._now_ns = now_ns
        self._sleep = sleep
        self._suspension = SuspensionClock()
        self._state_builder = CycleStateBuilder(config)
        usb = config.inputs.usb_pedal
        self._pedal = UsbPedal(Path(usb), now_ns) if usb else None
        self._connected = False
        self._other_adapter = False
        """True if the last attempt to open the port found another adapter."""
        self._loss_unseen = False
        """True from a loss of the connection until a cycle has run without it. Until then the port is not opened again, because no
        cycle would see the loss.
        """
        self._try_open_at_ns = 0
        self._try_configure_at_ns = 0
        self._deadline_ns = now_ns()
        self._deadline_void = False
        """True after the port was opened or drives were configured, until the next deadline is set from the clock. Both
        actions take many cycles and happen only without commanded torque.
        """
        self._period_ns = 1_000_000_000 // config.cycle_hz
        self._polls_estop = max_cycle_hz(config) >= 2 * config.cycle_hz
        """True if the bus has enough spare time for the extra poll."""
        self._waiting: QueuedCommand | None = None
        """A start that waits until every drive answers again, or a newer command arrives."""
        self._taken_ns = 0
        """Time of the last cycle in which no start waited."""
        self._heartbeats_seen = 0
        self._run_id_mismatches = 0
        self._last_torque_off = LastTorqueOff()
        self._setpoint_gate = SetpointGate()

    def run(self) -> None:
        """Run until the service is gone and every run and teaching has ended. Torque is off on return."""
        self._deadline_ns = self._now_ns()
        try:
            while self.tick():
                pass
        finally:
            self._torque_off_on_exit()

    def tick(self) -> bool:
        """Run one cycle at its deadline, poll the emergency stop halfway, and sleep until the next deadline. Return the same
        value as :meth:`cycle`.
        """
        if not self._connected:
            self._open()
        now_ns = self._now_ns()
        if self._deadline_void:
            self._deadline_ns = now_ns
            self._deadline_void = False
        late_ns = now_ns - self._deadline_ns
        missed = max(0, late_ns // self._period_ns)
        self._overruns += missed
        self._deadline_ns += missed * self._period_ns
        if not self.cycle(self._deadline_ns, (late_ns + self._take_suspension_ns()) / 1e6):
            return False
        self._deadline_ns += self._period_ns
        if self._polls_estop and self._sleep_until(self._deadline_ns - self._period_ns // 2):
            self.poll_estop()
        self._sleep_until(self._deadline_ns)
        if not self._deadline_void:
            self._latency.add(self._now_ns() - self._deadline_ns)
        return True

    def _take_suspension_ns(self) -> int:
        """Return the time for which the computer was suspended since the last cycle. A long one invalidates earlier commands to start."""
        slept_ns = self._suspension.take_ns()
        if slept_ns > MAX_OVERRUN_MS * 1e6:
            log.warning("the computer was suspended for %.1f s", slept_ns / 1e9)
            self._pauses += 1
        return slept_ns

    def cycle(self, t_ns: int, late_ms: float) -> bool:
        """Run one cycle. Return False when the service is gone and every run and teaching has ended."""
        self._cycles += 1
        sample = self._read()
        self._loss_unseen &= sample is not None
        state = self._state_builder.build(t_ns, sample, self._loop_context(t_ns, late_ms))
        torque_was_on, torque_was_inherited = self._machine.torque_on, self._machine.torque_inherited
        try:
            self._machine.step(state, evaluate_faults(state, self._config), self._link.take_stop())
            self._execute_command(state)
        except Exception:
            log.exception("internal error in the control program")
            self._machine.abort(state, [("unexpected_error", None)])
        self._setpoint_gate.check(self._machine, state)
        self._write(torque_was_on, state)
        machine = self._machine
        self._state_builder.record_command(t_ns, machine.torque_on, machine.setpoint_deg, machine.setpoint_t_ns)
        if torque_was_inherited and not machine.torque_inherited:
            self._state_builder.record_release(t_ns)
        self._update_verified_since(state)
        self._publish(state)
        self._link.wake()
        self._configure(state)
        if not (self._link.closing and machine.close()):
            return True
        needless = not self._connected or machine.torque_inherited
        return not (needless or self._last_torque_off.is_done(state))

    def poll_estop(self) -> None:
        """Read the emergency stop halfway between two cycles. If it is open, switch torque off at once.

        The next cycle latches the stop, as it does for every fault.
        """
        if not (self._connected and self._machine.torque_on):
            return
        try:
            inputs = self._bus.read_inputs()
            if inputs:
                self._state_builder.record_polled_inputs(inputs)
                if inputs.estop_open:
                    self._bus.torque_off()
        except BusError as error:
            self._connection_lost(error)

    def _sleep_until(self, t_ns: int) -> bool:
        """Sleep until ``t_ns``. Return True if there was time left to sleep."""
        left_ns = t_ns - self._now_ns()
        self._sleep(max(0, left_ns) / 1e9)
        return left_ns > 0

    def _loop_context(self, t_ns: int, late_ms: float) -> LoopContext:
        count, expected_run_id = self._link.heartbeats
        if count != self._heartbeats_seen:
            self._heartbeats_seen = count
            agrees = expected_run_id is None or expected_run_id == self._machine.active_id
            self._run_id_mismatches = 0 if agrees else self._run_id_mismatches + 1
        return LoopContext(
            late_ms=late_ms,
            service_age_ms=self._link.service_age_ms(t_ns),
            run_id_mismatches=self._run_id_mismatches,
            journal_ok=self._link.journal_ok and self._machine.journal_ok,
            limits_deg=self._machine.limits_deg,
            rate_hz=self._machine.rate_hz,
            torque_inherited=self._machine.torque_inherited,
            other_adapter=self._other_adapter,
        )

    # -- the bus --------------------------------------------------------------------------------------------------

    def _open(self) -> None:
        if self._loss_unseen or self._now_ns() < self._try_open_at_ns:
            return
        self._deadline_void = True
        # Automatic garbage collection is off (see :mod:`kata.system.realtime`). Collect now, while no cycle is due.
        gc.collect()
        try:
            self._bus.open()
        except BusError as error:
            self._connection_lost(error)
            return
        self._connected = True
        self._connection_problem, self._other_adapter = "", False
        log.info("connected to %s", self._config.port)

    def _configure(self, state: CycleState) -> None:
        """Configure the drives that have lost their settings, but only if every drive that answers reports no torque.

        The inputs' drive only has to be without torque itself. While others hold an arm, the emergency stop must be readable.
        """
        machine = self._machine
        if not self._connected or machine.torque_on or self._now_ns() < self._try_configure_at_ns:
            return
        answering = [n for n, age_ms in enumerate(state.drive_age_ms) if age_ms <= self._config.silence_ms]
        wanted = [n for n in answering if state.mismatch[n]]
        if machine.torque_inherited or any(state.torque[n] != "off" for n in answering):
            wanted = [n for n in wanted if n == self._config.inputs_axis and state.torque[n] == "off"]
        if not wanted:
            return
        self._deadline_void = True
        problem = ""
        for n in wanted:
            try:
                self._bus.configure([n])
            except BusError as error:
                problem = problem or text_of(error)
        if problem and problem != machine.drive_problem:
            log.warning("a drive cannot be configured: %s", problem)
        machine.drive_problem = problem
        # The drives must be read again before their registers are compared again.
        self._try_configure_at_ns = self._now_ns() + _RECONNECT_NS

    def _update_verified_since(self, state: CycleState) -> None:
        """Update the time since which the connection is unbroken and all settings are verified."""
        if not state.bus_ok or any(state.settings_lost):
            self._verified_since_ns = None
        elif self._verified_since_ns is None and all(state.verified):
            self._verified_since_ns = state.t_ns
            self._machine.drive_problem = ""
            self._machine.emit("verified", texts.SETTINGS_VERIFIED())

    def _connection_lost(self, error: BusError) -> None:
        self._bus.close()
        self._connected = False
        self._loss_unseen = True
        self._other_adapter = isinstance(error, OtherAdapterError)
        self._try_open_at_ns = self._now_ns() + _RECONNECT_NS
        if str(error) != self._connection_problem:
            self._connection_problem = text_of(error)
            log.warning("not connected: %s", error)

    def _read(self) -> BusSample | None:
        if not self._connected:
            return None
        try:
            sample = self._bus.read()
            for axis in sample.corrupt | sample.timed_out:
                self._drive_errors[axis] += 1
            if sample.health:
                for warning in self._health.update(sample.health):
                    self._machine.emit("drive_warning", warning)
            return self._with_pedal(sample)
        except BusError as error:
            self._connection_lost(error)
            return None

    def _with_pedal(self, sample: BusSample) -> BusSample:
        if self._pedal is None or sample.inputs is None:
            return sample
        return structs.replace(sample, inputs=structs.replace(sample.inputs, pedal_down=self._pedal.down()))

    def _write(self, torque_was_on: bool, state: CycleState) -> None:
        machine = self._machine
        if not self._connected:
            return
        try:
            if not machine.torque_on:
                if machine.torque_inherited:
                    return
                # Send torque off until each drive itself reports no torque.
                if torque_was_on or any(reported is not False for reported in state.torque_reported):
                    self._bus.torque_off()
            elif not torque_was_on:
                self._bus.torque_on(machine.setpoint_deg)
            elif machine.setpoint_due:
                self._bus.write_setpoints(machine.setpoint_deg)
        except BusError as error:
            self._connection_lost(error)

    def _torque_off_on_exit(self) -> None:
        try:
            if self._connected and not self._machine.torque_inherited:
                self._bus.torque_off()
        except BusError as error:
            log.error("torque could not be switched off: %s", error)
        self._bus.close()
        if self._pedal:
            self._pedal.close()

    # -- the service ----------------------------------------------------------------------------------------------

    def _execute_command(self, state: CycleState) -> None:
        newer = self._link.take_command()
        if newer and self._waiting:
            # A newer command, such as Pause, ends the wait.
            self._link.reply(Reply(id=self._waiting.id, refusal=STOPPED_MEANWHILE))
        taken, self._waiting = newer or self._waiting, None
        if taken is None:
            self._taken_ns = state.t_ns
            return
        refusal = taken.refusal
        if refusal is None and isinstance(taken.command, Guarded):
            # The I/O thread counts a Stop before it queues a later command. A command therefore has an older count if its
            # sender did not know the newest Stop.
            refusal = out_of_date(taken.command.stops, taken.command.expires_ns, stops=self._stops, t_ns=state.t_ns)
        refusal = refusal or self._machine.command(taken.command, taken.trajectory, state, taken.correction)
        if refusal and refusal.code == ANGLES_NOT_CURRENT and state.t_ns - self._taken_ns < _WAIT_FOR_ANGLES_NS:
            self._waiting = taken
            return
        self._taken_ns = state.t_ns
        if isinstance(taken.command, Pause):
            # A start that was sent before this Pause and arrives after it is refused, even if the Pause had nothing to pause.
            self._pauses += 1
        self._link.reply(Reply(id=taken.id, refusal=refusal))
