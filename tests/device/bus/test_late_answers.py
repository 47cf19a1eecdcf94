"""An answer that comes whole cycles late is not taken for the newest one, whichever requests the driver uses."""

from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from msgspec import structs

from kata.device.bus.factory import make_bus
from kata.device.bus.interface import BusSample
from kata.device.config import ModbusMap, simulated
from kata.simulator.adapter import AdapterLatency
from kata.testing.world import RecordingWorld
from tests.support.examples import examples

_STEP_DEG = 1.0
"""The hand leads the shaft on by so much in each cycle."""
_CYCLES = 12


class LateLine:
    """Drives on a line. Answers come in time, until :meth:`begin`. A hand leads the first motor on in each cycle."""

    def __init__(
        self,
        *,
        protocol: str,
        late_ms: float,
        adapter: bool,
        cycles_before: int,
        modbus: ModbusMap | None = None,
        estop_second_port: int | None = 3,
    ) -> None:
        """Configure the drives. Run the cycles before lateness begins: after few of them the drives' settings are not verified yet.

        :param adapter: the adapter delivers all bytes late, else one drive answers late.
        """
        simulation = simulated("memory")
        self._config = structs.replace(
            simulation,
            protocol=protocol,
            modbus=modbus or ModbusMap(),
            inputs=structs.replace(simulation.inputs, estop_second_port=estop_second_port),
        )
        self.world = RecordingWorld.of(self._config, seed=1)
        self._late_ms, self._adapter = late_ms, adapter
        self._bus = make_bus(self._config, self.world.open_transport)
        self._bus.open()
        self._bus.configure(range(5))
        self._deadline_ns = self.world.t_ns
        self._led = 0
        for _ in range(cycles_before):
            self.cycle()

    def begin(self) -> None:
        """From here on answers are late."""
        if self._adapter:
            self.world.latency = AdapterLatency(self._late_ms)
        else:
            self.world.fault("delayed", 1, self._late_ms)

    def end(self) -> None:
        """From here on answers come in time."""
        self.world.latency = AdapterLatency()
        self.world.faults.clear()

    def cycle(self) -> BusSample:
        self._led += 1
        self._deadline_ns += 1_000_000_000 // self._config.cycle_hz
        self.world.wait(max(0.0, (self._deadline_ns - self.world.t_ns) / 1e9))
        self.world.place(1, _STEP_DEG * self._led)
        return self._bus.read()

    def oldest_cycles(self) -> float:
        """Return by how many cycles the oldest angle of late answers was too old."""
        self.begin()
        samples = [(self.cycle().drives[0], self._led) for _ in range(_CYCLES)]
        return max([0.0, *(led - drive.position_deg / _STEP_DEG for drive, led in samples if drive)])


def late_answers() -> st.SearchStrategy[dict[str, Any]]:
    """Return drives that are configured or not, whose answers, or the adapter's bytes, come 1.1 to 7 cycles late."""
    return st.fixed_dictionaries(
        {
            "protocol": st.sampled_from(["dynamixel", "modbus"]),
            "late_ms": st.floats(10.5, 70.0),
            "adapter": st.booleans(),
            "cycles_before": st.sampled_from([1, 5, 60]),
            "modbus": st.sampled_from([ModbusMap(), ModbusMap(function_23=False)]),
            "estop_second_port": st.sampled_from([None, 3]),
        }
    )


@given(late_answers())
@example({"protocol": "dynamixel", "late_ms": 20.5, "adapter": True, "cycles_before": 5})
@example({"protocol": "dynamixel", "late_ms": 29.0, "adapter": False, "cycles_before": 5})
@example({"protocol": "dynamixel", "late_ms": 41.0, "adapter": True, "cycles_before": 5})
@example({"protocol": "dynamixel", "late_ms": 39.5, "adapter": True, "cycles_before": 60})
@example({"protocol": "modbus", "late_ms": 11.0, "adapter": True, "cycles_before": 5})
@example({"protocol": "modbus", "late_ms": 21.0, "adapter": False, "cycles_before": 5})
@example({"protocol": "modbus", "late_ms": 50.0, "adapter": False, "cycles_before": 1})
@examples(few=20, many=200)
def test_late_answer_is_never_taken_for_the_newest(late: dict[str, Any]) -> None:
    line = LateLine(**late)
    assert line.oldest_cycles() < 0.9


@pytest.mark.parametrize(("protocol", "adapter"), [("dynamixel", True), ("modbus", True), ("modbus", False)])
def test_drives_are_read_again_soon_after_late_answers(protocol: str, adapter: bool) -> None:
    line = LateLine(protocol=protocol, late_ms=15.0, adapter=adapter, cycles_before=5)
    assert all(drive is not None for drive in line.cycle().drives), "they are read while they answer in time"
    line.begin()
    for _ in range(3):
        line.cycle()
    line.end()
    missing = [n for n in range(6) if not all(line.cycle().drives)]
    assert len(missing) <= 3, f"drives were not read in cycles {missing}"


@pytest.mark.parametrize("lost", [1, 2])
def test_lost_modbus_answers_cost_no_further_cycle(lost: int) -> None:
    line = LateLine(protocol="modbus", late_ms=0.0, adapter=False, cycles_before=5)
    line.world.fault("silent", 4)
    for _ in range(lost):
        assert line.cycle().drives[3] is None
    line.end()
    assert all(line.cycle().drives)
