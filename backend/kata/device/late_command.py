"""Refuses a command whose sender did not see the newest stop, or that has expired. Reasons: decision 0019."""

from typing import Final

from kata.device import texts
from kata.device.ipc_messages import Refusal

STOPPED_MEANWHILE: Final = Refusal.of(
    code="stopped_meanwhile",
    message=texts.STOPPED_MEANWHILE(),
    next_step=texts.LOOK_AT_ARM_AND_TRY_AGAIN(),
)
"""Refusal of a command whose sender did not know the newest stop."""


def out_of_date(seen_stops: int, expires_ns: int, *, stops: int, t_ns: int) -> Refusal | None:
    """Refuse a command whose sender has not seen the newest stop, or that has expired. ``stops``: the present counter."""
    if seen_stops != stops:
        return STOPPED_MEANWHILE
    if t_ns > expires_ns:
        return Refusal.of(
            code="expired",
            message=texts.COMMAND_EXPIRED(),
            next_step=texts.LOOK_AT_ARM_AND_TRY_AGAIN(),
        )
    return None
