"""Configurations for the campaign, drawn from the space that a station accepts."""

from typing import Any, Final

from hypothesis import reject
from hypothesis import strategies as st
from msgspec import structs

from kata.device.bus.bandwidth import max_cycle_hz
from kata.device.config import NO_REGISTER, ConfigError, Inputs, ModbusMap, StationConfig, simulated
from kata.motion.axes import Side

SIDES: Final[tuple[Side, ...]] = ("right", "left")
_ANY_ZERO: Final = st.integers(0, 4095)
_CYCLE_RATES: Final = (100, 100, 50, 40, 20)
_FAST_RATES: Final = (200, 400, 500)
_FAST_OF: Final = 10
"""One station of so many has a fast rate. The cost of a sequence grows with the rate."""
_LONGEST_INPUT_AGE_MS: Final = 300
_FACTORY_DELAY_US: Final = 500
"""Delay of a simulated Modbus drive that has no register for it."""
_WITHOUT: Final[tuple[dict[str, Any], ...]] = (
    {},
    {},
    # Without a register that clears a tripped watchdog, a station may not arm it.
    {"watchdog_ms": NO_REGISTER, "clear": NO_REGISTER},
    {"watchdog_ms": NO_REGISTER, "clear": NO_REGISTER},
    {"torque_limit": NO_REGISTER},
    {"position_limits": NO_REGISTER},
    {"response_delay_us": NO_REGISTER},
)
"""Registers that Modbus drives may lack."""


@st.composite
def stations(draw: st.DrawFn) -> StationConfig:
    """Return a station for the simulated apparatus: it has the simulator's ids, ranges and wiring."""
    config = draw(_drives())
    fast = draw(st.integers(1, _FAST_OF)) == _FAST_OF
    fastest_hz = max_cycle_hz(config)
    rates = [rate for rate in _FAST_RATES if fast and rate <= fastest_hz]
    cycle_hz = draw(st.sampled_from(rates or [rate for rate in _CYCLE_RATES if rate <= fastest_hz]))
    two_cycles_ms = 2000 / cycle_hz
    try:
        return structs.replace(
            config,
            side=draw(st.sampled_from(SIDES)),
            cycle_hz=cycle_hz,
            rate_hz=draw(st.sampled_from([cycle_hz, cycle_hz, 10])),
            inputs=draw(_inputs(cycle_hz)),
            silence_ms=draw(st.sampled_from([100, 200, 300])),
            bus_watchdog_ms=draw(st.sampled_from([ms for ms in (100, 160, 200) if ms >= two_cycles_ms + 4.0])),
            approach_speed_deg_s=draw(st.sampled_from([15.0, 30.0, 5.0])),
            following_error_ms=draw(st.sampled_from([250, 250, 500])),
            reversal_s=draw(st.sampled_from([2.0, 0.5, 5.0])),
            limit_tolerance_deg=draw(st.sampled_from([4.0, 2.0])),
        )
    except ConfigError:
        reject()


@st.composite
def _drives(draw: st.DrawFn) -> StationConfig:
    """Return a slow station with any drives and bus."""
    protocol = draw(st.sampled_from(["dynamixel", "dynamixel", "modbus"]))
    modbus, delay_us = ModbusMap(), draw(st.sampled_from([0, 0, 100]))
    if protocol == "modbus":
        modbus = ModbusMap(function_23=draw(st.booleans()), **draw(st.sampled_from(_WITHOUT)))
        delay_us = _FACTORY_DELAY_US if modbus.response_delay_us == NO_REGISTER else delay_us
    config = simulated("memory")
    axes = tuple(structs.replace(axis, **draw(_axis(protocol))) for axis in config.axes)
    return structs.replace(
        config,
        protocol=protocol,
        modbus=modbus,
        baud=draw(st.sampled_from([1_000_000, 1_000_000, 2_000_000, 4_000_000])),
        return_delay_us=delay_us,
        axes=axes,
        inputs=structs.replace(config.inputs, max_age_cycles=2),
        cycle_hz=20,
        rate_hz=20,
    )


@st.composite
def _axis(draw: st.DrawFn, protocol: str) -> dict[str, Any]:
    zeros = [st.just(2048), _ANY_ZERO] if protocol == "dynamixel" else [st.none(), st.sampled_from([12_345, -500_000])]
    return {
        "max_torque_nm": draw(st.sampled_from([4.0, 2.0])),
        "zero_count": draw(st.one_of(zeros)),
        "direction": draw(st.sampled_from([1, 1, -1])),
    }


@st.composite
def _inputs(draw: st.DrawFn, cycle_hz: int) -> Inputs:
    return Inputs(
        estop_second_port=draw(st.sampled_from([3, 3, None])),
        contacts_disagree_ms=draw(st.sampled_from([ms for ms in (50, 100, 200) if ms >= 2000 / cycle_hz])),
        max_age_cycles=draw(
            st.sampled_from([n for n in (2, 5, 10, 30) if n * 1000 <= _LONGEST_INPUT_AGE_MS * cycle_hz])
        ),
    )
