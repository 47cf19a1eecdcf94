"""What the device tells, made into rows to write down: its events, what stopped it, and that its emergency stop was tried."""

from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Final, Literal
from uuid import UUID, uuid4

from kata.clinic import texts
from kata.database.base import utc_now
from kata.messages import MessageKey, Text, sent_key, with_key
from kata.station.schemas import EventLive, Live, TextKey
from kata.station.station import Occupation

ESTOP_TESTED: Final = "estop_tested"
"""The emergency stop was pressed, and released again."""
_TOLD_AS_ALARM: Final = "fault"
"""The device's event for what the live state tells with category, motor and when it is over."""


@dataclass(frozen=True, kw_only=True)
class Happening:
    """A row of ``device_events``; its id is made here, so that however often it is tried it is written once."""

    id: UUID = field(default_factory=uuid4)
    station: str
    at: datetime
    kind: Literal["alarm", "event"]
    code: str
    message: str
    message_key: dict[str, Any] | None = None
    category: int | None = None
    axis: int | None = None
    patient_id: UUID | None = None
    session_id: UUID | None = None
    run_id: UUID | None = None


@dataclass(frozen=True)
class Ended:
    """These alarms were acknowledged."""

    ids: tuple[UUID, ...]
    at: datetime


class Observer:
    """Looks at one station. No database, no waiting."""

    def __init__(self, station: str) -> None:
        """``station`` is its name."""
        self._station = station
        self._whose: Occupation | None = None
        self._run_id: UUID | None = None
        self._alarms: dict[tuple[str, int | None], UUID] = {}
        self._pressed = False

    def hear(self, event: EventLive) -> list[Happening]:
        """One of the device's events."""
        if event.code == _TOLD_AS_ALARM:
            return []
        return [self._happening(event.at, "event", event.code, _text(event.message, event.message_key))]

    def look(self, live: Live, occupation: Occupation | None) -> list[Happening | Ended]:
        """What is new in the state, seen again and again."""
        if live.device != "running":
            # What was latched has gone with its control program; whatever the next one finds is told again.
            self._pressed = False
            return self._end_alarms()
        self._attribute(live, occupation)
        return [*self._alarms_of(live), *self._estop_of(live)]

    def _attribute(self, live: Live, occupation: Occupation | None) -> None:
        """A stop belongs to whoever was on the apparatus when it came, although it has ended their run."""
        going_on = live.run or live.teaching
        if going_on:
            self._whose = occupation
            self._run_id = live.run.run_id if live.run else None
        elif live.mode != "stopped":
            self._whose = self._run_id = None

    def _alarms_of(self, live: Live) -> list[Happening | Ended]:
        if live.stop is None:
            return self._end_alarms()
        new: list[Happening | Ended] = []
        for cause in live.stop.causes:
            key = (cause.code, cause.axis)
            if key not in self._alarms:
                alarm = self._happening(
                    utc_now(),
                    "alarm",
                    cause.code,
                    _text(cause.message, cause.message_key),
                    cause.category,
                    cause.axis,
                )
                self._alarms[key] = alarm.id
                new.append(alarm)
        return new

    def _end_alarms(self) -> list[Happening | Ended]:
        if not self._alarms:
            return []
        ended = Ended(tuple(self._alarms.values()), utc_now())
        self._alarms = {}
        return [ended]

    def _estop_of(self, live: Live) -> list[Happening | Ended]:
        if live.estop == "pressed":
            self._pressed = True
        elif live.estop == "released" and self._pressed:
            self._pressed = False
            message = texts.ESTOP_TESTED()
            return [self._happening(utc_now(), "event", ESTOP_TESTED, message)]
        elif live.estop == "closed":
            self._pressed = False
        return []

    def _happening(
        self,
        at: datetime,
        kind: Literal["alarm", "event"],
        code: str,
        message: Text,
        category: int | None = None,
        axis: int | None = None,
    ) -> Happening:
        return Happening(
            station=self._station,
            at=at,
            kind=kind,
            code=code,
            message=str(message),
            message_key=sent_key(message),
            category=category,
            axis=axis,
            patient_id=self._whose.patient.id if self._whose else None,
            session_id=self._whose.session_id if self._whose else None,
            run_id=self._run_id,
        )


def _text(message: str, key: TextKey | None) -> Text:
    return with_key(message, MessageKey(key.code, key.model_dump()["params"]) if key else None)
