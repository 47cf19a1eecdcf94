"""Recognizes the USB adapter of a port. After a replug ``/dev/ttyUSB0`` may be the adapter of another apparatus, whose drives have the same ids."""

import os
from collections.abc import Callable, Sequence
from typing import Final

from msgspec import Struct
from serial.tools import list_ports

from kata.device import texts
from kata.device.bus.interface import BusError, OtherAdapterError

_UNKNOWN: Final = "?"


class UsbAdapter(Struct, frozen=True):
    """A USB adapter as the computer sees it."""

    device: str
    """Its path without links, such as /dev/ttyUSB0."""
    kind: str
    """Vendor and product, such as 0403:6014."""
    serial_number: str
    """Empty if it has none."""
    location: str
    """Its USB socket, such as 1-2.1. One of several ports of an adapter also has the number of its interface."""

    @property
    def named_by_serial(self) -> tuple[str, str]:
        """Kind and serial number."""
        return self.kind, self.serial_number

    def __str__(self) -> str:
        """Return its serial number or its socket, as a technician sees it with ``lsusb`` and ``dmesg``."""
        return f"{self.serial_number or self.location} ({self.kind})"


def connected_adapters() -> list[UsbAdapter]:
    """Return every USB adapter with a serial port.

    :raises OSError, TypeError, ValueError: by pyserial, while any adapter is being pulled out.
    """
    return [
        UsbAdapter(port.device, f"{port.vid:04x}:{port.pid:04x}", port.serial_number or "", port.location or _UNKNOWN)
        for port in list_ports.comports()
        if port.vid is not None and port.pid is not None
    ]


class SameAdapter:
    """Remembers the adapter at the first opening of a port, and refuses another one from then on.

    Serial numbers are compared. If the adapter has none, or if another connected adapter has the same, the USB sockets are compared,
    because only they differ. A port that belongs to no USB adapter is not compared.
    """

    def __init__(self, connected: Callable[[], Sequence[UsbAdapter]] = connected_adapters) -> None:
        """Know no adapter yet. ``connected`` returns the present adapters."""
        self._connected = connected
        self._known: UsbAdapter | None = None
        self._by_socket = False
        """True if serial numbers do not tell the known adapter from others."""

    def check(self, port: str) -> None:
        """Check the adapter of a port that has just been opened.

        :raises OtherAdapterError: when it is another one than at the first opening, or is not known.
        :raises BusError: when the adapters cannot be read now. Without this, the adapter of the first opening would not be remembered.
        """
        try:
            adapters = self._connected()
        except (OSError, TypeError, ValueError) as error:
            raise BusError(texts.ADAPTER_NOT_IDENTIFIED(port=port)) from error
        device = os.path.realpath(port)
        present = next((adapter for adapter in adapters if adapter.device == device), None)
        if present is None and self._known is None:
            return
        if present is not None and (self._known is None or present.named_by_serial == self._known.named_by_serial):
            alike = [adapter for adapter in adapters if adapter.named_by_serial == present.named_by_serial]
            self._by_socket = self._by_socket or not present.serial_number or len(alike) > 1
        if self._known is None:
            self._known = present
        elif present is None or not self._is_known(present):
            raise OtherAdapterError(
                texts.PORT_IS_OTHER_ADAPTER(port=port, found=present or _UNKNOWN, known=self._known)
            )

    def _is_known(self, present: UsbAdapter) -> bool:
        assert self._known is not None
        same_socket = not self._by_socket or present.location == self._known.location
        return present.named_by_serial == self._known.named_by_serial and same_socket
