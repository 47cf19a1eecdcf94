"""Decodes the answers of Dynamixel drives and compares their registers with the configuration."""

import struct
from collections.abc import Callable
from typing import Final

from kata.device.bus.dynamixel.configuration import DynamixelConfiguration
from kata.device.bus.dynamixel.cycle_block import AT, GAINS_LENGTH, CycleBlock, voltage_and_temperature
from kata.device.bus.dynamixel.registers import (
    BLOCKS,
    BLOCKS_WITH_STATUS,
    BUS_WATCHDOG,
    DEG_PER_COUNT,
    GAINS,
    MAP_BLOCKS,
    MAP_NAMES,
    PORTS_BLOCK,
    STATUS,
    TORQUE_ENABLE,
    HealthLimits,
    configured_registers,
    health_limits,
    nearest_turn,
    nm_per_unit,
    port_mode,
    zero_count,
)
from kata.device.bus.dynamixel.requests import ALERT
from kata.device.bus.interface import DriveHealth, DriveSample, DriveStatus
from kata.device.bus.serial_transport import Transport
from kata.device.bus.verification import Verification
from kata.device.config import StationConfig

_HARDWARE_ERROR_AT: Final = 70 - TORQUE_ENABLE
_WATCHDOG_AT: Final = BUS_WATCHDOG - TORQUE_ENABLE
_WATCHDOG_STEP_MS: Final = 20
_WATCHDOG_TRIPPED: Final = 0xFF
_DEG_S_A_UNIT: Final = 0.229 * 6
_ARMING_LIMIT_NS: Final = 5_000_000
"""The write that arms the watchdogs takes effect within this time. Before that, a status may still show an unarmed
watchdog.
"""
_PRESENT_FORMAT: Final = struct.Struct("<hii")


class DynamixelAnswers(DynamixelConfiguration):
    """Decodes the answers of the drives and verifies their registers."""

    def __init__(self, config: StationConfig, open_transport: Callable[[str, int], Transport]) -> None:
        """Prepare the driver without opening the port. ``open_transport`` opens a port at a baud rate."""
        super().__init__(config, open_transport)
        self._axes = {axis.id: axis for axis in config.axes}
        self._zeros = {axis.id: zero_count(axis) for axis in config.axes}
        """Position in counts that each drive (by id) reports at motor angle 0, whole turns included."""
        self._nm_per_unit = {axis.id: nm_per_unit(axis) for axis in config.axes}
        self._registers = [configured_registers(config, axis) for axis in config.axes]
        self._ports = (config.inputs_axis, PORTS_BLOCK)
        """Index of the drive and of the block that contain the modes of the input ports."""
        self._port_modes = frozenset(port_mode(port) for port in config.inputs.ports)
        self._verification = Verification(
            len(self._ids), len(BLOCKS), config.cycle_hz, urgent=self._ports, with_status=BLOCKS_WITH_STATUS
        )
        self._registers_of = [
            [tuple(register for register in registers if register.address in block) for block in BLOCKS]
            for registers in self._registers
        ]
        """Configured registers by axis and block."""
        self._health_limits: list[HealthLimits | None] = [None] * len(config.axes)
        self._armed_ns: int | None = None
        """Time at which the bus watchdogs were armed; None while torque is off."""

    @property
    def _watchdog(self) -> int:
        return self._config.bus_watchdog_ms // _WATCHDOG_STEP_MS

    def _is_mapped(self, axis: int) -> bool:
        """Return True if a drive's Indirect Addresses are verified."""
        return all(self._verification.registers_match(axis, block, MAP_NAMES) for block in MAP_BLOCKS)

    @property
    def _inputs_are_verified(self) -> bool:
        """True if the input ports are verified as inputs. Until then their values have no meaning. Only these registers are
        checked, so that a mismatch of another register does not hide a pressed switch.
        """
        return self._verification.registers_match(*self._ports, self._port_modes)

    def _decode_drive(self, found: dict[int, DriveSample], drive_id: int, t_ns: int, error: int, data: bytes) -> None:
        """Decode an answer as soon as it arrives, while the next drive's answer is still on the wire."""
        if error & ~ALERT:
            return
        axis = self._axes[drive_id]
        current, velocity, position = _PRESENT_FORMAT.unpack_from(data)
        if self._armed_ns is None:
            # A drive that lost power may have lost whole turns. With torque on, the count of turns does not change.
            self._zeros[drive_id] = zero_count(axis) - nearest_turn(axis, position)
        found[drive_id] = DriveSample(
            t_ns=t_ns,
            position_deg=axis.direction * (position - self._zeros[drive_id]) * DEG_PER_COUNT,
            speed_deg_s=axis.direction * velocity * _DEG_S_A_UNIT,
            torque_nm=axis.direction * current * self._nm_per_unit[drive_id],
            alert=error & ALERT != 0,
        )

    def _block_status(self, axis: int, t_ns: int, block: CycleBlock, data: bytes) -> DriveStatus:
        watchdog = self._watchdog_mismatch(t_ns, torque=block.torque_on, watchdog=block.watchdog)
        self._compare(axis, STATUS, lambda address: data[AT[address] :], *watchdog)
        if len(data) >= GAINS_LENGTH:
            self._compare(axis, GAINS, lambda address: data[AT[address] :])
        return self._drive_status(axis, t_ns, block.torque_on, block.hardware_error, block.watchdog)

    def _drive_health(self, axis: int, t_ns: int, data: bytes) -> DriveHealth | None:
        """Return voltage and temperature if the answer of a drive contains them."""
        found = voltage_and_temperature(data)
        if found is None:
            return None
        limits = self._health_limits[axis]
        return (
            DriveHealth(t_ns, axis, *found)
            if limits is None
            else DriveHealth(t_ns, axis, *found, limits.min_voltage_v, limits.max_voltage_v, limits.max_temperature_c)
        )

    def _note_limits(self, axis: int, block: int, data: bytes) -> None:
        if block == PORTS_BLOCK:
            self._health_limits[axis] = health_limits(data)

    def _register_status(self, axis: int, t_ns: int, data: bytes) -> DriveStatus:
        """Decode a drive's status block and compare its registers. Return the status."""
        watchdog = self._watchdog_mismatch(t_ns, torque=data[0] != 0, watchdog=data[_WATCHDOG_AT])
        self._compare(axis, STATUS, lambda address: data[address - TORQUE_ENABLE :], *watchdog)
        self._compare(axis, GAINS, lambda address: data[address - TORQUE_ENABLE :])
        return self._drive_status(axis, t_ns, data[0] != 0, data[_HARDWARE_ERROR_AT], data[_WATCHDOG_AT])

    def _drive_status(self, axis: int, t_ns: int, torque_on: bool, hardware_error: int, watchdog: int) -> DriveStatus:
        return DriveStatus(
            t_ns=t_ns,
            axis=axis,
            torque_on=torque_on,
            hardware_error=hardware_error,
            watchdog_tripped=watchdog == _WATCHDOG_TRIPPED,
            verified=self._verification.verified(axis),
            mismatch=self._verification.mismatch(axis),
        )

    def _compare(self, axis: int, block: int, data_at: Callable[[int], bytes], *mismatches: str) -> None:
        """Compare a block with the configuration. ``data_at`` returns the bytes from an address on."""
        differing = [
            register.name
            for register in self._registers_of[axis][block]
            if not data_at(register.address).startswith(register.data)
        ]
        self._verification.found(axis, block, [*mismatches, *differing])

    def _watchdog_mismatch(self, t_ns: int, *, torque: bool, watchdog: int) -> tuple[str, ...]:
        """Return the watchdog's name if a drive has torque and an unarmed watchdog. No drive confirms the write that arms it."""
        armed = self._armed_ns is not None and t_ns > self._armed_ns + _ARMING_LIMIT_NS
        if not armed or not torque or watchdog in (self._watchdog, _WATCHDOG_TRIPPED):
            return ()
        return ("bus watchdog",)
