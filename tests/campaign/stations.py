"""Configurations for the campaign, drawn from the space that a station accepts."""

from typing import Any, Final

from hypothesis import reject
from hypothesis import strategies as st
from msgspec import structs

from kata.device.config import ConfigError, Inputs, ModbusMap, StationConfig, simulated

_ANY_ZERO: Final = st.integers(0, 4095)


@st.composite
def stations(draw: st.DrawFn) -> StationConfig:
    """Return a station for the simulated apparatus: it has the simulator's ids, ranges and wiring."""
    protocol = draw(st.sampled_from(["dynamixel", "dynamixel", "modbus"]))
    modbus = ModbusMap(function_23=draw(st.booleans())) if protocol == "modbus" else ModbusMap()
    cycle_hz = draw(st.sampled_from([100, 100, 50, 40, 20]))
    rate_hz = draw(st.sampled_from([cycle_hz, cycle_hz, 10]))
    try:
        config = simulated("memory")
        axes = tuple(structs.replace(axis, **draw(_axis(protocol))) for axis in config.axes)
        return structs.replace(
            config,
            protocol=protocol,
            modbus=modbus,
            cycle_hz=cycle_hz,
            rate_hz=rate_hz,
            axes=axes,
            inputs=draw(_inputs()),
            silence_ms=draw(st.sampled_from([100, 200, 300])),
            bus_watchdog_ms=draw(st.sampled_from([100, 160, 200])),
            approach_speed_deg_s=draw(st.sampled_from([15.0, 30.0, 5.0])),
            following_error_ms=draw(st.sampled_from([250, 250, 500])),
            reversal_s=draw(st.sampled_from([2.0, 0.5, 5.0])),
            limit_tolerance_deg=draw(st.sampled_from([4.0, 2.0])),
        )
    except ConfigError:
        reject()


@st.composite
def _axis(draw: st.DrawFn, protocol: str) -> dict[str, Any]:
    changes: dict[str, Any] = {"max_torque_nm": draw(st.sampled_from([4.0, 2.0]))}
    if protocol == "dynamixel":
        changes["zero_count"] = draw(st.one_of(st.just(2048), _ANY_ZERO))
    return changes


@st.composite
def _inputs(draw: st.DrawFn) -> Inputs:
    return Inputs(
        estop_second_port=draw(st.sampled_from([3, 3, None])),
        contacts_disagree_ms=draw(st.sampled_from([50, 100, 300])),
        max_age_cycles=draw(st.sampled_from([2, 5, 10])),
    )
