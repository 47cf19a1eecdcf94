"""Tests the requirements of every driver. A driver is complete when its subclass of :class:`Conformance` passes.

The tests run the driver against simulated drives that speak its protocol, with a stepped clock
(:class:`kata.testing.world.RecordingWorld`).
"""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import pytest

from kata.device.bus.bandwidth import cycle_time_ns, max_cycle_hz
from kata.device.bus.factory import make_bus
from kata.device.bus.interface import Bus, BusError, DriveStatus
from kata.device.bus.registry import installed_drivers
from kata.device.config import StationConfig
from kata.device.config_rules import RANGES, ranges_of
from kata.simulator.drives import MakeDrives
from kata.simulator.mechanics import MakeMechanics
from kata.simulator.plant import Plant
from kata.testing.world import RecordingWorld

HOLD = (15.0, 109.0, 8.0, 0.0, 0.0)
_SLACK_S = 0.005


class _Suite:
    """The properties that a driver's author states, and the apparatus with its drives."""

    protocol: ClassVar[str]
    """Name of the driver's entry point."""
    make_drives: ClassVar[MakeDrives | None] = None
    """Makes the simulated drives (``staticmethod``). None: use the simulator's drives for this protocol."""
    make_mechanics: ClassVar[MakeMechanics] = Plant
    """Makes the simulated mechanics (``staticmethod``)."""
    settings: ClassVar[dict[str, Any]] = {}
    """Fields of the station's configuration that differ from those of the simulated station."""
    resolution_deg: ClassVar[float]
    """Resolution of a position on the bus."""
    byte_by_byte: ClassVar[bool] = False
    """True if the adapter delivers each byte separately."""
    alerts: ClassVar[bool] = False
    """True if every answer reports a hardware error at once."""
    inputs_come_with_drive: ClassVar[bool] = False
    """True if the answer of a drive contains its inputs. False: the inputs are read last."""
    reports_health: ClassVar[bool] = False
    """True if the drives report supply voltage and temperature, and their limits."""
    arming_request: ClassVar[int]
    """Number of requests of ``torque_on`` before the one that arms the watchdogs."""
    read_only: ClassVar[Mapping[str, str]] = {}
    """Registers that ``configure`` verifies but cannot write: pattern of the error message, by name."""

    def expected_registers(self, config: StationConfig, motor: int) -> Mapping[int, bytes]:
        """Return the required contents of the registers of motor 1-5, by first address, without the bus watchdog. Write it from the
        manual and not from the driver. ``config``: configuration of the apparatus on its current side.
        """
        raise NotImplementedError

    @pytest.fixture
    def world(self) -> RecordingWorld:
        """Return the apparatus and its drives at power-up."""
        suite = type(self)
        world = RecordingWorld(
            self.protocol, make_drives=suite.make_drives, make_mechanics=suite.make_mechanics, **self.settings
        )
        world.byte_by_byte = self.byte_by_byte
        return world

    @pytest.fixture
    def bus(self, world: RecordingWorld) -> Bus:
        """Return the open bus, with all drives configured and verified."""
        bus = make_bus(world.config, world.open_transport)
        bus.open()
        bus.configure(range(5))
        self.until_verified(world, bus)
        return bus

    def until_verified(self, world: RecordingWorld, bus: Bus) -> None:
        """Read until every register of every drive is verified."""
        verified = [False] * 5
        for _ in range(80):
            for status in self.cycles(world, bus, 1)[0].statuses:
                verified[status.axis] = status.verified
            if all(verified):
                return
        raise AssertionError(f"not verified: {verified}")

    @staticmethod
    def cycles(world: RecordingWorld, bus: Bus, count: int) -> list[Any]:
        """Read ``count`` times at the interval of a cycle. Return the readings."""
        readings = []
        for _ in range(count):
            began_ns = world.t_ns
            readings.append(bus.read())
            world.wait(max(0.0, (began_ns - world.t_ns) / 1e9 + 1 / world.config.cycle_hz))
        return readings


class Opening(_Suite):
    """Requirements of the installation and of opening a port."""

    def test_the_driver_is_installed_under_its_name(self) -> None:
        assert self.protocol in installed_drivers()

    def test_every_field_has_one_accepted_range(self) -> None:
        """The driver must define ranges for fields that depend on the protocol, such as ids and baud rates."""
        fields = {row.field for row in RANGES}
        ranged = [row.field for row in ranges_of(self.protocol) if row.field in fields]
        assert sorted(ranged) == sorted(fields)

    def test_opening_changes_no_torque(self, world: RecordingWorld, bus: Bus) -> None:
        bus.torque_on(HOLD)
        self.cycles(world, bus, 2)
        assert all(world.torque)
        opened_ns = world.t_ns
        second_bus = make_bus(world.config, world.open_transport)
        second_bus.open()
        self.cycles(world, second_bus, 10)
        assert all(world.torque)
        assert [access for access in world.seen if access.t_ns > opened_ns] == []

    def test_a_drive_that_is_missing_is_named(self, world: RecordingWorld) -> None:
        bus = make_bus(world.config, world.open_transport)
        bus.open()
        world.fault("silent", 3)
        with pytest.raises(BusError, match=r"motor 3 \(id 3\) does not answer"):
            bus.configure(range(5))

    def test_two_drives_with_one_id_are_named(self, world: RecordingWorld) -> None:
        bus = make_bus(world.config, world.open_transport)
        bus.open()
        world.fault("duplicate_id", 4)
        with pytest.raises(BusError, match=r"motor 4.*two drives share this id"):
            bus.configure(range(5))


class Configuring(_Suite):
    """Requirements of writing and verifying registers, and of drives that lose them."""

    def wrong(self, world: RecordingWorld, motor: int) -> list[int]:
        """Return the registers of a drive that differ from the manual and the configuration."""
        expected = self.expected_registers(world.config.with_side_directions, motor)
        return [address for address, data in expected.items() if world.registers(motor, address, len(data)) != data]

    def test_configured_drives_have_every_register(self, world: RecordingWorld, bus: Bus) -> None:
        assert [self.wrong(world, motor) for motor in range(1, 6)] == [[]] * 5

    def test_an_unconfigured_drive_is_never_verified(self, world: RecordingWorld) -> None:
        bus = make_bus(world.config, world.open_transport)
        bus.open()
        statuses = [status for reading in self.cycles(world, bus, 250) for status in reading.statuses]
        assert not any(status.verified for status in statuses)

    def test_a_verified_drive_stays_verified(self, world: RecordingWorld, bus: Bus) -> None:
        bus.torque_on(HOLD)
        statuses = [status for reading in self.cycles(world, bus, 300) for status in reading.statuses]
        assert all(status.verified and not status.mismatch for status in statuses)

    @pytest.mark.parametrize("motor", [1, 5])
    def test_each_changed_register_is_found_in_two_seconds(self, world: RecordingWorld, bus: Bus, motor: int) -> None:
        for address, data in self.expected_registers(world.config.with_side_directions, motor).items():
            world.set_registers(motor, address, bytes(len(data)) if any(data) else b"\1" + data[1:])
            limit_ns = world.t_ns + 2_000_000_000
            found: list[DriveStatus] = []
            while not found:
                assert world.t_ns < limit_ns, f"register {address} of motor {motor}"
                (reading,) = self.cycles(world, bus, 1)
                found = [status for status in reading.statuses if status.axis == motor - 1 and status.mismatch]
            assert not found[0].verified
            if refusal := self.read_only.get(found[0].mismatch):
                with pytest.raises(BusError, match=refusal):
                    bus.configure([motor - 1])
                world.set_registers(motor, address, data)
            bus.configure([motor - 1])
            self.until_verified(world, bus)

    def test_a_drive_with_torque_is_not_configured(self, world: RecordingWorld, bus: Bus) -> None:
        bus.torque_on(HOLD)
        with pytest.raises(BusError, match=r"motor 2 .* has torque, so its settings are not changed"):
            bus.configure([1])
        assert world.torque == [True] * 5
        assert self.wrong(world, 2) == []

    @pytest.mark.parametrize("end", ["min_deg", "max_deg"])
    def test_power_cycle_keeps_the_shafts_angle_at_both_range_ends(
        self, world: RecordingWorld, bus: Bus, end: str
    ) -> None:
        expected_deg = [getattr(axis, end) for axis in world.config.axes]
        for motor, angle_deg in enumerate(expected_deg, start=1):
            world.place(motor, angle_deg)
            world.fault("off", motor)
        world.faults.clear()
        # Compare with the shafts' true angles, because without torque the arm sinks.
        reading = next(reading for reading in self.cycles(world, bus, 2) if all(reading.drives))
        assert [drive.position_deg for drive in reading.drives] == pytest.approx(expected_deg, abs=1.0)
        for _ in range(20):
            (reading,) = self.cycles(world, bus, 1)
            assert [drive.position_deg for drive in reading.drives] == pytest.approx(world.angles_deg, abs=3.0)

    @pytest.mark.parametrize("kind", ["off", "reboot", "exchanged"])
    def test_a_drive_that_lost_its_settings_is_found_and_configured(
        self, world: RecordingWorld, bus: Bus, kind: Any
    ) -> None:
        world.fault(kind, 2)
        world.faults.clear()
        cycles = 2 * world.config.cycle_hz
        statuses = [s for reading in self.cycles(world, bus, cycles) for s in reading.statuses if s.axis == 1]
        assert statuses[-1].mismatch
        bus.configure([1])
        self.until_verified(world, bus)
        assert self.wrong(world, 2) == []

    def test_a_lost_arming_of_the_watchdog_is_found(self, world: RecordingWorld, bus: Bus) -> None:
        world.lose_requests(1, after=self.arming_request)
        bus.torque_on(HOLD)
        cycles = 2 * world.config.cycle_hz
        mismatched = {s.axis for reading in self.cycles(world, bus, cycles) for s in reading.statuses if s.mismatch}
        assert mismatched == {0, 1, 2, 3, 4}
        bus.torque_off()

    @pytest.mark.parametrize(
        ("fault", "pressed", "reads_open", "disagree"),
        [
            (None, False, False, False),
            (None, True, True, False),
            ("estop_wire_broken", False, True, True),
            ("contact_welded", True, True, True),
            ("contact_welded", False, False, False),
            ("second_wire_broken", True, True, True),
            ("second_wire_broken", False, False, False),
        ],
    )
    def test_either_contact_stops_and_equal_contacts_disagree(
        self, world: RecordingWorld, bus: Bus, fault: Any, pressed: bool, reads_open: bool, disagree: bool
    ) -> None:
        if fault:
            world.fault(fault)
        world.apparatus.press_estop(pressed)
        inputs = bus.read().inputs
        assert inputs is not None
        assert (inputs.estop_open, inputs.contacts_disagree) == (reads_open, disagree)

    def test_the_rated_torque_is_written_to_the_drives(self, world: RecordingWorld, bus: Bus) -> None:
        bus.torque_on(HOLD)
        bus.write_setpoints([angle + 40.0 for angle in HOLD])
        for _ in range(200):
            bus.read()
            bus.write_setpoints([angle + 40.0 for angle in HOLD])
            world.wait(0.01)
            for drive, axis in zip(world.apparatus.drives, world.config.axes, strict=True):
                assert abs(drive.torque_nm) <= axis.max_torque_nm * 1.01


class Reading(_Suite):
    """Requirements of measurements, statuses and inputs."""

    def test_reading_returns_what_drives_measured_and_when(self, world: RecordingWorld, bus: Bus) -> None:
        began_ns = world.t_ns
        (reading,) = self.cycles(world, bus, 1)
        angles_deg = [drive.position_deg for drive in reading.drives]
        assert angles_deg == pytest.approx(world.angles_deg, abs=self.resolution_deg)
        times = [drive.t_ns for drive in reading.drives]
        if self.inputs_come_with_drive:
            assert reading.inputs.t_ns == times[world.config.inputs.drive_id - 1]
        else:
            times.append(reading.inputs.t_ns)
        assert times == sorted(times)
        assert began_ns < times[0]
        assert times[-1] < began_ns + 2 * cycle_time_ns(world.config)
        assert bus.errors == 0

    def test_speed_and_torque_have_the_sign_of_the_motion(self, world: RecordingWorld, bus: Bus) -> None:
        bus.torque_on(HOLD)
        began_ns = world.t_ns
        fastest = hardest = 0.0
        while (since_s := (world.t_ns - began_ns) / 1e9) < 0.6:
            bus.write_setpoints([*HOLD[:3], HOLD[3] + 30.0 * since_s, HOLD[4]])
            reading = bus.read()
            world.wait(0.001)
            assert reading.drives[3] is not None
            fastest = max(fastest, reading.drives[3].speed_deg_s)
            hardest = max(hardest, reading.drives[3].torque_nm)
        assert fastest == pytest.approx(30.0, rel=0.6)
        assert hardest > 0.3

    def test_every_drive_reports_its_status_within_eight_cycles(self, world: RecordingWorld, bus: Bus) -> None:
        axes = {status.axis for reading in self.cycles(world, bus, 8) for status in reading.statuses}
        assert axes == {0, 1, 2, 3, 4}

    def test_each_drive_reports_its_health_once_a_second(self, world: RecordingWorld, bus: Bus) -> None:
        health_by_drive = {
            health.axis: health
            for reading in self.cycles(world, bus, world.config.cycle_hz)
            for health in reading.health
        }
        assert sorted(health_by_drive) == (list(range(5)) if self.reports_health else [])
        for health in health_by_drive.values():
            assert (health.voltage_v, health.temperature_c) == pytest.approx(
                world.drives[health.axis].environment, abs=0.1
            )
            assert health.min_voltage_v is not None and health.max_voltage_v is not None
            assert health.min_voltage_v < health.voltage_v < health.max_voltage_v
            assert health.max_temperature_c is not None and health.temperature_c < health.max_temperature_c

    def test_hot_drive_and_sagging_supply_are_reported(self, world: RecordingWorld, bus: Bus) -> None:
        if not self.reports_health:
            pytest.skip("these drives report neither")
        world.fault("hot", 2, 70.0)
        world.fault("supply_voltage", 4, world.drives[3].environment[0] - 1.5)
        health_by_drive = {
            health.axis: health
            for reading in self.cycles(world, bus, world.config.cycle_hz)
            for health in reading.health
        }
        assert [health_by_drive[n].temperature_c == 70.0 for n in range(5)] == [False, True, False, False, False]
        sagging_v = [
            health_by_drive[n].voltage_v == pytest.approx(health_by_drive[0].voltage_v - 1.5, abs=0.06)
            for n in range(5)
        ]
        assert sagging_v == [False, False, False, True, False]

    def test_the_emergency_stop_and_the_pedal(self, world: RecordingWorld, bus: Bus) -> None:
        assert (bus.read().inputs.estop_open, bus.read().inputs.pedal_down) == (False, False)  # type: ignore[union-attr]
        world.apparatus.press_estop(True)
        world.apparatus.step_on_pedal(True)
        assert (bus.read().inputs.estop_open, bus.read().inputs.pedal_down) == (True, True)  # type: ignore[union-attr]
        world.apparatus.press_estop(False)
        assert bus.read().inputs.estop_open is False  # type: ignore[union-attr]
        world.fault("estop_wire_broken")
        assert bus.read().inputs.estop_open is True  # type: ignore[union-attr]

    def test_the_inputs_can_be_asked_alone(self, world: RecordingWorld, bus: Bus) -> None:
        world.apparatus.press_estop(True)
        inputs = bus.read_inputs()
        assert inputs is not None
        assert inputs.estop_open
        world.fault("inputs_silent")
        assert bus.read_inputs() is None

    def test_missing_inputs_are_reported_absent_and_drives_are_read(self, world: RecordingWorld, bus: Bus) -> None:
        world.fault("inputs_silent")
        readings = self.cycles(world, bus, 5)
        assert [reading.inputs for reading in readings] == [None] * 5
        # A drive whose answer contains the inputs is then silent, and delays the others by one cycle.
        for reading in readings[1 if self.inputs_come_with_drive else 0 :]:
            assert all(reading.drives[1:])


class Writing(_Suite):
    """Requirements of torque, setpoints and the bus watchdog."""

    def test_torque_comes_on_where_the_arm_is(self, world: RecordingWorld, bus: Bus) -> None:
        before_ns = world.t_ns
        bus.torque_on(HOLD)
        self.cycles(world, bus, 1)
        assert all(world.torque)
        for motor in range(1, 6):
            on_ns = next(s.t_ns for s in world.seen if s.what == "torque" and s.value == 1 and s.motor == motor)
            for goal in world.goals(motor, before_ns):
                assert goal == pytest.approx(HOLD[motor - 1], abs=0.2)
            assert on_ns > before_ns

    def test_a_setpoint_reaches_its_drive_by_the_next_reading(self, world: RecordingWorld, bus: Bus) -> None:
        bus.torque_on(HOLD)
        goals_deg = [angle + 1.0 for angle in HOLD]
        bus.write_setpoints(goals_deg)
        self.cycles(world, bus, 1)
        for motor, angle in enumerate(goals_deg, start=1):
            assert world.goals(motor)[-1] == pytest.approx(angle, abs=self.resolution_deg)

    def test_torque_off_reaches_all_drives_and_setpoints_stop_after_it(self, world: RecordingWorld, bus: Bus) -> None:
        bus.torque_on(HOLD)
        self.cycles(world, bus, 3)
        bus.write_setpoints([angle + 1.0 for angle in HOLD])
        bus.torque_off()
        off_ns = world.t_ns
        self.cycles(world, bus, 5)
        assert not any(world.torque)
        offs = [
            write.t_ns for write in world.seen if write.what == "torque" and write.value == 0 and write.t_ns > off_ns
        ]
        # A hundred bytes are the setpoints already on the bus and the frame itself.
        assert max(offs) - off_ns < 100 * 10e9 / world.config.baud + 1e6
        assert not any(world.goals(motor, max(offs)) for motor in range(1, 6))
        assert {s.torque_on for r in self.cycles(world, bus, 5) for s in r.statuses} == {False}

    def test_watchdog_stops_an_unheard_drive_and_the_start_clears_it(self, world: RecordingWorld, bus: Bus) -> None:
        bus.torque_on(HOLD)
        self.cycles(world, bus, 2)
        world.wait(0.5)
        statuses = [status for reading in self.cycles(world, bus, 5) for status in reading.statuses]
        assert {status.watchdog_tripped for status in statuses} == {True}
        bus.torque_off()
        bus.torque_on(HOLD)
        statuses = [status for reading in self.cycles(world, bus, 8) for status in reading.statuses]
        assert {(status.watchdog_tripped, status.torque_on) for status in statuses} == {(False, True)}


class Faults(_Suite):
    """Requirements for silent drives, damaged and late answers, and a lost port."""

    @pytest.mark.parametrize("motor", [1, 3, 5])
    def test_silent_drive_delays_others_by_at_most_one_cycle(self, world: RecordingWorld, bus: Bus, motor: int) -> None:
        world.fault("silent", motor)
        readings = self.cycles(world, bus, 30)
        other_drives = [n for n in range(5) if n != motor - 1]
        for reading in readings[1:]:
            assert reading.drives[motor - 1] is None
            assert reading.timed_out <= {motor - 1}
            assert all(reading.drives[n] for n in other_drives)
        assert any(reading.timed_out for reading in readings)
        assert not any(reading.corrupt for reading in readings)

    def test_a_silent_drive_costs_less_than_a_millisecond_a_cycle(self, world: RecordingWorld, bus: Bus) -> None:
        def spent_s() -> float:
            began_ns, waited_s = world.t_ns, 0.0
            for _ in range(100):
                bus.read()
                world.wait(0.001)
                waited_s += 0.001
            return (world.t_ns - began_ns) / 1e9 - waited_s

        whole_s = spent_s()
        world.fault("silent", 3)
        assert spent_s() - whole_s < 100 * 0.001

    def test_silent_drive_is_read_again_soon_after_it_answers(self, world: RecordingWorld, bus: Bus) -> None:
        world.fault("silent", 2)
        self.cycles(world, bus, 50)
        world.faults.clear()
        readings = self.cycles(world, bus, 12)
        assert all(readings[-1].drives)

    @pytest.mark.parametrize("kind", ["garbage", "wrong_crc", "duplicate_id"])
    def test_corrupt_answers_are_rejected_and_reported(self, world: RecordingWorld, bus: Bus, kind: Any) -> None:
        world.fault(kind, 5)
        for reading in self.cycles(world, bus, 3):
            assert reading.drives[4] is None
            assert 4 in reading.corrupt
            assert all(reading.drives[:4])
        world.faults.clear()
        assert all(self.cycles(world, bus, 12)[-1].drives)
        assert bus.errors > 0

    def test_late_answer_is_not_taken_for_a_later_one(self, world: RecordingWorld, bus: Bus) -> None:
        # Late by 1.4 cycles. A driver may still use an answer that arrives within its own cycle.
        world.fault("delayed", 1, 1400 / world.config.cycle_hz)
        for reading in self.cycles(world, bus, 20):
            assert reading.inputs is None
            assert reading.drives[0] is None

    def test_noise_between_answers_loses_no_valid_answer(self, world: RecordingWorld, bus: Bus) -> None:
        world.fault("noise", value=3)
        # The driver may need one cycle to detect the noise.
        for reading in self.cycles(world, bus, 20)[1:]:
            assert all(reading.drives)
            assert reading.inputs is not None

    def test_an_adapter_that_echoes_changes_nothing(self, world: RecordingWorld, bus: Bus) -> None:
        world.fault("echo")
        bus.torque_on(HOLD)
        for reading in self.cycles(world, bus, 10):
            assert all(reading.drives)
            assert reading.inputs is not None
        assert all(world.torque)

    def test_lost_port_raises_and_can_be_reopened(self, world: RecordingWorld, bus: Bus) -> None:
        bus.torque_on(HOLD)
        world.fault("gone")
        calls: list[Callable[[], object]] = [
            bus.read,
            bus.torque_off,
            bus.open,
            # write_setpoints is not tested, because a driver may send setpoints with its next reading.
        ]
        for call in calls:
            with pytest.raises(BusError, match=r"gone|opened"):
                call()
        bus.close()
        world.faults.clear()
        world.wait(0.1)
        bus.open()
        assert all(world.torque)
        assert all(self.cycles(world, bus, 1)[0].drives)

    def test_drive_that_lost_power_returns_without_torque_and_reports_it(self, world: RecordingWorld, bus: Bus) -> None:
        bus.torque_on(HOLD)
        self.cycles(world, bus, 2)
        world.fault("off", 2)
        self.cycles(world, bus, 5)
        world.faults.clear()
        torque_on = {s.axis: s.torque_on for r in self.cycles(world, bus, 40) for s in r.statuses}
        assert torque_on == {0: True, 1: False, 2: True, 3: True, 4: True}

    def test_hardware_error_is_reported(self, world: RecordingWorld, bus: Bus) -> None:
        world.fault("hardware_error", 3, 4)
        assert [drive.alert for drive in self.cycles(world, bus, 1)[0].drives] == [
            False,
            False,
            self.alerts,
            False,
            False,
        ]
        errors = {s.axis: s.hardware_error for r in self.cycles(world, bus, 10) for s in r.statuses}
        assert errors == {0: 0, 1: 0, 2: 4, 3: 0, 4: 0}


class Timing(_Suite):
    """Requirements of the time of a cycle."""

    def test_cycle_lasts_as_long_as_its_bytes(self, world: RecordingWorld, bus: Bus) -> None:
        bus.torque_on(HOLD)
        self.cycles(world, bus, 2)
        began_ns = world.t_ns
        for _ in range(50):
            bus.read()
            bus.write_setpoints(HOLD)
        # The last setpoints are still being sent.
        took_ns = (world.t_ns - began_ns) / 50
        assert took_ns <= 1.02 * 1e9 / max_cycle_hz(world.config)

    def test_whatever_does_not_come_a_reading_ends_in_time(self, world: RecordingWorld, bus: Bus) -> None:
        for motor in range(1, 6):
            world.fault("silent", motor)
        for _ in range(30):
            began_ns = world.t_ns
            assert not any(bus.read().drives)
            assert world.t_ns - began_ns < cycle_time_ns(world.config) + 2 * _SLACK_S * 1e9
            world.wait(0.01)


class Conformance(Opening, Configuring, Reading, Writing, Faults, Timing):
    """All requirements of a driver."""
