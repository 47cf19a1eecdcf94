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
_REPORTED_AS_ALARM: Final = "fault"
"""The device's event for what the live state tells with category, motor and when it is over."""


@dataclass(frozen=True, kw_only=True)
class NewDeviceEvent:
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
class AlarmsEnded:
    """These alarms were acknowledged."""

    ids: tuple[UUID, ...]
    at: datetime


class Observer:
    """Looks at one station. No database, no waiting."""

    def __init__(self, station: str) -> None:
        """``station`` is its name."""
        self._station = station
        self._occupation: Occupation | None = None
        self._run_id: UUID | None = None
        self._alarms: dict[tuple[str, int | None], UUID] = {}
        self._pressed = False

    def observe_event(self, event: EventLive) -> list[NewDeviceEvent]:
        """One of the device's events."""
        if event.code == _REPORTED_AS_ALARM:
            return []
        return [self._new_event(event.at, "event", event.code, _text(event.message, event.message_key))]

    def observe_state(self, live: Live, occupation: Occupation | None) -> list[NewDeviceEvent | AlarmsEnded]:
        """What is new in the state, seen again and again."""
        if live.device != "running":
            # What was latched has gone with its control program; whatever the next one finds is told again.
            self._pressed = False
            return self._end_alarms()
        self._attribute(live, occupation)
        return [*self._alarms_of(live), *self._estop_of(live)]

    def _attribute(self, live: Live, occupation: Occupation | None) -> None:
        """A stop belongs to whoever was on the apparatus when it came, although it has ended their run."""
        running = live.run or live.teaching
        if running:
            self._occupation = occupation
            self._run_id = live.run.run_id if live.run else None
        elif live.mode != "stopped":
            self._occupation = self._run_id = None

    def _alarms_of(self, live: Live) -> list[NewDeviceEvent | AlarmsEnded]:
        if live.stop is None:
            return self._end_alarms()
        new: list[NewDeviceEvent | AlarmsEnded] = []
        for cause in live.stop.causes:
            key = (cause.code, cause.axis)
            if key not in self._alarms:
                alarm = self._new_event(
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

    def _end_alarms(self) -> list[NewDeviceEvent | AlarmsEnded]:
        if not self._alarms:
            return []
        ended = AlarmsEnded(tuple(self._alarms.values()), utc_now())
        self._alarms = {}
        return [ended]

    def _estop_of(self, live: Live) -> list[NewDeviceEvent | AlarmsEnded]:
        if live.estop == "pressed":
            self._pressed = True
        elif live.estop == "released" and self._pressed:
            self._pressed = False
            message = texts.ESTOP_TESTED()
            return [self._new_event(utc_now(), "event", ESTOP_TESTED, message)]
        elif live.estop == "closed":
            self._pressed = False
        return []

    def _new_event(
        self,
        at: datetime,
        kind: Literal["alarm", "event"],
        code: str,
        message: Text,
        category: int | None = None,
        axis: int | None = None,
    ) -> NewDeviceEvent:
        return NewDeviceEvent(
            station=self._station,
            at=at,
            kind=kind,
            code=code,
            message=str(message),
            message_key=sent_key(message),
            category=category,
            axis=axis,
            patient_id=self._occupation.patient.id if self._occupation else None,
            session_id=self._occupation.session_id if self._occupation else None,
            run_id=self._run_id,
        )


def _text(message: str, key: TextKey | None) -> Text:
    return with_key(message, MessageKey(key.code, key.model_dump()["params"]) if key else None)
