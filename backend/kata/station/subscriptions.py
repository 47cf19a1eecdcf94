"""Manages the listeners of a station. A change wakes each of them, and each receives every event."""

import asyncio
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Final

import msgspec

from kata.device.ipc_messages import Snapshot

_MAX_WAITING: Final = 1000


@dataclass
class Subscription:
    """The wake-up signal of one listener, and the events that it has not read yet."""

    changed: asyncio.Event = field(default_factory=asyncio.Event)
    """Set by an item and by a change of the live state. A change of only measured values does not set it. A listener may let its own timer
    set this event or the next one.
    """
    item_arrived: asyncio.Event = field(default_factory=asyncio.Event)
    """Set by an item. A listener that sends the state at fixed times need not wake for each change."""
    waiting: deque[object] = field(default_factory=deque)
    overflown: bool = False
    """True if events were dropped because too many were waiting."""

    def put(self, item: object) -> None:
        """Queue an event or another notice."""
        if len(self.waiting) >= _MAX_WAITING:
            self.overflown = True
        else:
            self.waiting.append(item)
        self.item_arrived.set()
        self.changed.set()


class Subscriptions:
    """All subscriptions. Use this class only in the service's event loop."""

    def __init__(self) -> None:
        self.changes = 0
        """Number of changes so far."""
        self._open: list[Subscription] = []

    @contextmanager
    def subscribed(self) -> Iterator[Subscription]:
        """Subscribe during the block."""
        subscription = Subscription()
        self._open.append(subscription)
        try:
            yield subscription
        finally:
            self._open.remove(subscription)

    def put(self, item: object) -> None:
        """Queue an item for every listener."""
        for subscription in self._open:
            subscription.put(item)

    def note_change(self) -> None:
        """Count a change of the live state, and wake every listener."""
        self.note_measurement()
        for subscription in self._open:
            subscription.changed.set()

    def note_snapshot(self, before: Snapshot | None, now: Snapshot) -> None:
        """Count a new snapshot, and wake every listener if it differs in more than measured values."""
        if before is not None and _differ_only_in_measurements(before, now):
            self.note_measurement()
        else:
            self.note_change()

    def note_measurement(self) -> None:
        """Count a change of only measured values. It wakes no listener, because a station measures all the time, also while it is idle."""
        self.changes += 1


def _differ_only_in_measurements(before: Snapshot, now: Snapshot) -> bool:
    """Return True if two snapshots differ only in measured values and in the control loop's figures.

    A latched stop always counts as a difference, because its ``arm_held`` depends on the time that has passed.
    """
    return now.stop is None and now == msgspec.structs.replace(before, t_ns=now.t_ns, axes=now.axes, loop=now.loop)
