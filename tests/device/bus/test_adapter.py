"""A port that comes back is opened only if it belongs to the same USB adapter as before."""

import os
import tty
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from kata.device.bus.adapter import SameAdapter, UsbAdapter, connected_adapters
from kata.device.bus.interface import BusError, OtherAdapterError
from kata.device.bus.serial_transport import port_of
from kata.device.config import simulated

OURS = UsbAdapter("/dev/ttyUSB0", "0403:6014", "FT1", "1-1")
OTHERS = structs.replace(OURS, device="/dev/ttyUSB1", serial_number="FT2", location="1-2")


def in_place(adapter: UsbAdapter) -> UsbAdapter:
    """Return the adapter at the path of ours."""
    return structs.replace(adapter, device=OURS.device)


def opened(*connections: list[UsbAdapter]) -> list[bool]:
    """Return, for each opening of our path, whether it succeeds with these connected adapters."""
    present: list[UsbAdapter] = []
    same = SameAdapter(lambda: present)
    results = []
    for connected in connections:
        present[:] = connected
        try:
            same.check(OURS.device)
            results.append(True)
        except OtherAdapterError:
            results.append(False)
    return results


def test_another_apparatus_at_the_same_path_is_refused() -> None:
    assert opened([OURS, OTHERS], [in_place(OTHERS)], [OURS, OTHERS]) == [True, False, True]


def test_adapter_with_a_serial_number_may_change_its_socket() -> None:
    assert opened([OURS], [structs.replace(OURS, location="3-4")]) == [True, True]


@pytest.mark.parametrize("serial_number", ["", "0001"])
def test_adapters_without_own_serial_number_are_told_by_socket(serial_number: str) -> None:
    """Adapters without one, and adapters of which each has the same."""
    ours = structs.replace(OURS, serial_number=serial_number)
    others = structs.replace(OTHERS, serial_number=serial_number)
    moved = structs.replace(ours, location="3-4")
    assert opened([ours, others], [in_place(others)], [moved], [ours]) == [True, False, False, True]


def test_second_adapter_with_the_same_serial_number_comes_later() -> None:
    twin = structs.replace(OURS, location="1-2")
    assert opened([OURS], [structs.replace(OURS, device="/dev/ttyUSB1"), twin]) == [True, False]


def test_other_kind_of_adapter_is_refused() -> None:
    assert opened([OURS], [structs.replace(OURS, kind="1a86:7523")]) == [True, False]


def test_adapter_that_cannot_be_identified_any_more_is_refused() -> None:
    assert opened([OURS], [], [OURS]) == [True, False, True]


def test_port_without_usb_adapter_is_not_compared() -> None:
    assert opened([], []) == [True, True]
    assert opened([OTHERS], [OTHERS]) == [True, True]


@given(
    st.lists(st.sampled_from(["", "A", "B"]), min_size=2, max_size=3),
    st.lists(st.tuples(st.integers(0, 2), st.booleans(), st.booleans()), min_size=2, max_size=8),
)
def test_no_replug_reaches_another_apparatus(serial_numbers: list[str], replugs: list[tuple[int, bool, bool]]) -> None:
    """Any adapter gets our path, alone or with the others. Adapters change their socket only if their serial numbers differ.

    Two adapters with the same serial number that are never connected together cannot be told from one that changes its socket.
    """
    twins = any(name and serial_numbers.count(name) > 1 for name in serial_numbers)
    adapters = [UsbAdapter(f"/dev/ttyUSB{n}", "0403:6014", name, f"1-{n}") for n, name in enumerate(serial_numbers)]
    told_by_serial = len(set(serial_numbers)) == len(serial_numbers) and "" not in serial_numbers
    first = replugs[0][0] % len(adapters)
    connections = []
    for which, alone, moves in replugs:
        which %= len(adapters)
        here = structs.replace(in_place(adapters[which]), location="2-1" if moves and told_by_serial else f"1-{which}")
        away = [structs.replace(other, device=f"/dev/ttyUSB{n + 5}") for n, other in enumerate(adapters) if n != which]
        connections.append([here, *([] if alone and not twins else away)])
    results = opened(*connections)
    assert results == [which % len(adapters) == first for which, _, _ in replugs]


def port_info(device: str, **fields: object) -> ListPortInfo:
    info = ListPortInfo(device)
    for name, value in fields.items():
        setattr(info, name, value)
    return info


def test_adapters_are_read_from_the_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    usb = port_info("/dev/ttyUSB0", vid=0x0403, pid=0x6014, serial_number="FT1", location="1-1")
    bare = port_info("/dev/ttyUSB1", vid=0x1A86, pid=0x7523, serial_number=None, location=None)
    monkeypatch.setattr(list_ports, "comports", lambda: [usb, port_info("/dev/ttyS0"), bare])
    assert connected_adapters() == [OURS, UsbAdapter("/dev/ttyUSB1", "1a86:7523", "", "?")]


def test_unreadable_adapters_at_the_first_opening_admit_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """pyserial raises this while an adapter is pulled out. The adapter would not be remembered."""

    def pulled_out() -> list[ListPortInfo]:
        raise TypeError("int() can't convert non-string with explicit base")

    monkeypatch.setattr(list_ports, "comports", pulled_out)
    same = SameAdapter()
    with pytest.raises(BusError, match="/dev/ttyUSB0 cannot be identified"):
        same.check(OURS.device)


@pytest.fixture
def terminal() -> Iterator[str]:
    drives, port = os.openpty()
    tty.setraw(port)
    yield os.ttyname(port)
    os.close(port)
    os.close(drives)


def test_refused_port_is_closed_and_named(terminal: str) -> None:
    present = [structs.replace(OURS, device=terminal)]
    open_port = port_of(simulated(terminal), lambda: present)
    open_port(terminal, 1_000_000).close()
    present[0] = structs.replace(OTHERS, device=terminal)
    with pytest.raises(BusError, match=r"is the adapter FT2 \(0403:6014\); before, it was FT1 \(0403:6014\)"):
        open_port(terminal, 1_000_000)
    present[0] = structs.replace(OURS, device=terminal)
    # The port is exclusive: the refused opening has closed it.
    open_port(terminal, 1_000_000).close()
