"""Publishes the control loop's telemetry: its snapshots and the counters in them."""

import math
from typing import Final

from kata.device import texts
from kata.device.bus.interface import Bus
from kata.device.config import StationConfig
from kata.device.cycle_state import CycleState
from kata.device.drive_health import HealthMonitor
from kata.device.ipc import ServiceLink
from kata.device.ipc_messages import AxisState, EstopState, LoopState, Refusal, Snapshot, TorqueState
from kata.device.latency_histogram import LatencyHistogram
from kata.device.state_machine import StateMachine
from kata.system.realtime import Granted

SNAPSHOT_HZ: Final = 10


class LoopTelemetry:
    """Counts cycles and errors of the loop, and publishes its snapshots to the service."""

    def __init__(
        self, config: StationConfig, bus: Bus, link: ServiceLink, granted: Granted, *, first_stops: int
    ) -> None:
        """Create the state machine and the counters. ``first_stops``: start value of the stop counter."""
        self._config = config
        self._bus = bus
        self._link = link
        self._granted = granted
        self._machine = StateMachine(config, link.open_journal, link.publish_event)
        self._connection_problem = ""
        self._verified_since_ns: int | None = None
        self._first_stops = first_stops
        """Start value of the stop counter. It is taken from the clock so that a later device process never repeats a
        value.
        """
        self._pauses = 0
        """Number of Pause commands, refused ones included, and of suspensions of the computer."""
        self._cycles = 0
        self._overruns = 0
        self._latency = LatencyHistogram()
        self._drive_errors = [0] * len(config.axes)
        self._health = HealthMonitor(len(config.axes))
        self._published: tuple[object, ...] = ()
        self._published_at_ns = 0

    @property
    def _stops(self) -> int:
        machine = self._machine
        counted = machine.stops_latched + machine.loaded_runs_and_reversals
        return self._first_stops + self._link.stop_requests + counted + self._pauses

    def _publish(self, state: CycleState) -> None:
        """Publish ten snapshots a second, and another one at once when an important value has changed."""
        machine = self._machine
        estop = self._estop(state)
        summary = (
            machine.mode,
            self._torque(state),
            self._stops,
            estop,
            machine.pedal(state),
            machine.stop and len(machine.stop.keys),
        )
        due = state.t_ns - self._published_at_ns >= 1_000_000_000 // SNAPSHOT_HZ
        if due or summary != self._published:
            self._published = summary
            self._published_at_ns = state.t_ns
            self._link.publish_snapshot(self._snapshot(state, estop))

    def _estop(self, state: CycleState) -> EstopState:
        if state.estop != "closed":
            return "pressed" if state.estop == "open" else "unknown"
        stop = self._machine.stop
        return "released" if stop and any(code == "estop_pressed" for code, _ in stop.keys) else "closed"

    def _torque(self, state: CycleState) -> tuple[TorqueState, ...]:
        """Return each drive's torque state, including torque that this cycle switches on."""
        if not self._machine.torque_on:
            return state.torque
        every: list[TorqueState] = ["on"] * len(state.torque)
        return tuple(every)

    def _snapshot(self, state: CycleState, estop: EstopState) -> Snapshot:
        machine = self._machine
        p50_ms, p99_ms, p999_ms = self._latency.percentiles_ms(50, 99, 99.9)
        refusals = machine.refusals(state)
        if machine.mode == "offline" and (problem := self._offline_problem(state)):
            offline = Refusal.of(
                code="is_offline",
                message=texts.NOT_CONNECTED_BECAUSE(reason=problem),
                next_step=texts.SWITCH_ON_AND_CHECK_ADAPTER(),
            )
            refusals = {
                name: offline if refusal.code == "is_offline" else refusal for name, refusal in refusals.items()
            }
        torque = self._torque(state)
        return Snapshot(
            t_ns=state.t_ns,
            mode=machine.mode,
            torque="on" if "on" in torque else "unknown" if "unknown" in torque else "off",
            stops=self._stops,
            verified_since_ns=self._verified_since_ns,
            estop=estop,
            pedal=machine.pedal(state),
            axes=tuple(self._axis(n, state, torque[n]) for n in range(len(self._config.axes))),
            stop=machine.stop.state() if machine.stop else None,
            run=machine.run_state(),
            teaching=machine.teaching_state(),
            refusals=refusals,
            loop=LoopState(
                cycle_hz=self._config.cycle_hz,
                rate_hz=self._config.rate_hz,
                cycles=self._cycles,
                overruns=self._overruns,
                lateness_p50_ms=p50_ms,
                lateness_p99_ms=p99_ms,
                lateness_p999_ms=p999_ms,
                lateness_max_ms=self._latency.max_ns / 1e6,
                bus_errors=self._bus.errors,
                drive_errors=tuple(self._drive_errors),
                telemetry_dropped=self._link.dropped,
                real_time=self._granted.scheduling,
                memory_locked=self._granted.memory_lock,
            ),
            warnings=self._health.warnings(state.t_ns),
        )

    def _offline_problem(self, state: CycleState) -> str:
        """Return why the apparatus is offline; empty if no problem is known."""
        missing = next((n for n, age_ms in enumerate(state.drive_age_ms) if age_ms > self._config.silence_ms), None)
        if self._connection_problem or missing is None:
            return self._connection_problem or self._machine.drive_problem
        return texts.DRIVE_DOES_NOT_ANSWER(motor=missing + 1, drive_id=self._config.axes[missing].id)

    def _axis(self, n: int, state: CycleState, torque: TorqueState) -> AxisState:
        known = math.isfinite(state.drive_age_ms[n])
        health = self._health.newest(n, state.t_ns)
        return AxisState(
            motor=n + 1,
            setpoint_deg=self._machine.setpoint_deg[n] if known else None,
            measured_deg=state.measured_deg[n] if known else None,
            speed_deg_s=state.speed_deg_s[n],
            torque_nm=state.torque_nm[n],
            torque=torque,
            age_ms=state.drive_age_ms[n] if known else None,
            voltage_v=health.voltage_v if health else None,
            temperature_c=health.temperature_c if health else None,
        )
