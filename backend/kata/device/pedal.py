"""Reads a pedal that the computer sees as a keyboard, such as the RI-PF1BK (Section 2.1 of the paper), through the
kernel's evdev interface.

The kernel reports only changes and disconnection. The state of a missing pedal is unknown, which counts as up.
"""

import contextlib
import fcntl
import logging
import os
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Final

log = logging.getLogger(__name__)

_EVENT: Final = struct.Struct("@llHHi")
"""Format of struct input_event: seconds, microseconds, type, code, value."""
_EV_SYN: Final = 0
_EV_KEY: Final = 1
_SYN_DROPPED: Final = 3
_KEYS: Final = 0x2FF
_KEY_BYTES: Final = (_KEYS + 7) // 8
_EVIOCGKEY: Final = 2 << 30 | _KEY_BYTES << 16 | ord("E") << 8 | 0x18
_EVIOCGRAB: Final = 1 << 30 | 4 << 16 | ord("E") << 8 | 0x90
_REOPEN_AFTER_NS: Final = 1_000_000_000


class UsbPedal:
    """Reads the pedal once a cycle; never waits."""

    def __init__(self, path: Path, now_ns: Callable[[], int]) -> None:
        """Prepare the pedal. It is opened when ``path`` (/dev/input/by-id/...-event-kbd) appears, also after a disconnection."""
        self._path = path
        self._now_ns = now_ns
        self._file: int | None = None
        self._look_at_ns = 0
        self._down: set[int] | None = None
        """Keys that are held; None if unknown."""

    def down(self) -> bool | None:
        """Return True if any key is held; None if unknown."""
        if self._file is None and not self._open():
            return None
        try:
            while data := os.read(self._file or 0, 64 * _EVENT.size):
                for _, _, kind, code, value in _EVENT.iter_unpack(data[: len(data) // _EVENT.size * _EVENT.size]):
                    self._take(kind, code, value)
            self._lose("it was hung up")
        except BlockingIOError:
            pass
        except OSError as error:
            self._lose(error.strerror or "gone")
        return None if self._down is None else bool(self._down)

    def close(self) -> None:
        """Release the device."""
        if self._file is not None:
            os.close(self._file)
        self._file = self._down = None

    def _take(self, kind: int, code: int, value: int) -> None:
        if kind == _EV_KEY:
            held = self._down or set()
            # Value 2 is the keyboard's own key repeat.
            self._down = held | {code} if value else held - {code}
        elif kind == _EV_SYN and code == _SYN_DROPPED:
            self._down = self._held()

    def _open(self) -> bool:
        now_ns = self._now_ns()
        if now_ns < self._look_at_ns:
            return False
        self._look_at_ns = now_ns + _REOPEN_AFTER_NS
        try:
            self._file = os.open(self._path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError:
            return False
        # The pedal's key presses must not reach other programs.
        with contextlib.suppress(OSError):
            fcntl.ioctl(self._file, _EVIOCGRAB, 1)
        self._down = self._held()
        log.info("the pedal is connected: %s", self._path)
        return True

    def _held(self) -> set[int] | None:
        """Return the keys that the kernel reports as held now."""
        keys = bytearray(_KEY_BYTES)
        try:
            fcntl.ioctl(self._file or 0, _EVIOCGKEY, keys)
        except OSError:
            return None
        return {code for code in range(_KEYS) if keys[code // 8] >> code % 8 & 1}

    def _lose(self, why: str) -> None:
        log.warning("the pedal was disconnected (%s): %s", self._path, why)
        self.close()
