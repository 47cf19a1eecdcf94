"""Combines the five simulated drives of a protocol: their bus, their faults and their registers."""

from collections.abc import Callable, Mapping, Sequence
from typing import Final, NamedTuple

from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.bus import ServoBus
from kata.simulator.fault_injector import DriveRegisters, FaultInjector
from kata.simulator.lines import BusLine, DynamixelLine, ModbusLine
from kata.simulator.modbus_bus import SimulatedModbusBus


class SimulatedDrives(NamedTuple):
    """The drives of an apparatus with their protocol."""

    line: BusLine
    faults: FaultInjector
    registers: Sequence[DriveRegisters]
    """Registers of the drives, in motor order."""


MakeDrives = Callable[[SimulatedApparatus, int], SimulatedDrives]
"""Makes the drives of an apparatus at a baud rate."""


def dynamixel_drives(apparatus: SimulatedApparatus, baud: int) -> SimulatedDrives:
    """Return X-series servos."""
    servos = ServoBus(apparatus, baud)
    return SimulatedDrives(DynamixelLine(servos), servos.faults, servos.servos)


def modbus_drives(apparatus: SimulatedApparatus, baud: int) -> SimulatedDrives:
    """Return Modbus RTU drives."""
    bus = SimulatedModbusBus(apparatus, baud)
    return SimulatedDrives(ModbusLine(bus), bus.faults, bus.drives)


SIMULATED_DRIVES: Final[Mapping[str, MakeDrives]] = {"dynamixel": dynamixel_drives, "modbus": modbus_drives}
"""Functions that make the drives, by protocol."""
