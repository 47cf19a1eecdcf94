"""Defines the latched stop and its causes."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from kata.device.faults import FAULT_BY_CODE, Fault, FaultKey
from kata.device.ipc_messages import StopCause, StopState


@dataclass
class LatchedStop:
    """A stop from its first cause until it is acknowledged. The causes are in the order in which they occurred."""

    at_ns: int
    keys: list[FaultKey] = field(default_factory=list)
    holding: frozenset[FaultKey] = frozenset()

    def update(self, holding: Iterable[FaultKey], raised: Iterable[FaultKey]) -> list[StopCause]:
        """Add the faults that hold now and the faults that the code raised directly. Return the new causes."""
        self.holding = frozenset(holding)
        new = [key for key in (*holding, *raised) if key not in self.keys]
        self.keys += new
        return [self._cause(FAULT_BY_CODE[code], axis) for code, axis in new]

    @property
    def category(self) -> int:
        """The strictest category of all causes (0 is the strictest)."""
        return min(FAULT_BY_CODE[code].category for code, _ in self.keys)

    def causes(self) -> tuple[StopCause, ...]:
        """Return the causes for the snapshot."""
        return tuple(self._cause(FAULT_BY_CODE[code], axis) for code, axis in self.keys)

    def state(self) -> StopState:
        """Return the stop for the snapshot."""
        return StopState(causes=self.causes(), at_ns=self.at_ns)

    def _cause(self, fault: Fault, axis: int | None) -> StopCause:
        motor = None if axis is None else axis + 1
        message = fault.message(**({"motor": motor} if fault.message.params else {}))
        next_step = fault.next_step()
        return StopCause(
            code=fault.code,
            category=fault.category,
            message=str(message),
            next_step=str(next_step),
            axis=motor,
            cleared=(fault.code, axis) not in self.holding,
            message_key=message.key,
            next_step_key=next_step.key,
        )
