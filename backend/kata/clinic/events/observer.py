"""Turn the device's telemetry into rows for events, alarms and tests of the emergency stop."""

from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Final, Literal
from uuid import UUID, uuid4

from kata.clinic import texts
from kata.database.base import utc_now
from kata.messages import MessageKey, Text, sent_key, with_key
from kata.station.schemas import EventLive, Live, TextKey
from kata.station.snapshot_tracker import Occupation

ESTOP_TESTED: Final = "estop_tested"
"""Code of the event that the emergency stop was pressed and released, and that every contact has switched."""
_ONE_CONTACT_ONLY: Final = "contacts_disagree"
_REPORTED_AS_ALARM: Final = "fault"
"""Code of the device's event for a fault. It is skipped, because the live state reports the same fault with category, motor and end."""


@dataclass(frozen=True, kw_only=True)
class NewDeviceEvent:
    """A new row of ``device_events``. Its id is generated here, so that a repeated write stores the row only once."""

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
    """Acknowledgement of alarms."""

    ids: tuple[UUID, ...]
    at: datetime


class Observer:
    """Observes one station. It uses no database and never blocks."""

    def __init__(self, station: str) -> None:
        """``station`` is the station's name."""
        self._station = station
        self._occupation: Occupation | None = None
        self._run_id: UUID | None = None
        self._alarms: dict[tuple[str, int | None], UUID] = {}
        self._pressed = False

    def observe_event(self, event: EventLive) -> list[NewDeviceEvent]:
        """Return the rows for one event of the device."""
        if event.code == _REPORTED_AS_ALARM:
            return []
        return [self._new_event(event.at, "event", event.code, _text(event.message, event.message_key))]

    def observe_state(self, live: Live, occupation: Occupation | None) -> list[NewDeviceEvent | AlarmsEnded]:
        """Return the rows for new alarms and tests in the state. Call it with every state."""
        if live.device != "running":
            # The alarms ended with their control program. The next control program reports its own alarms.
            self._pressed = False
            return self._end_alarms()
        self._attribute(live, occupation)
        return [*self._alarms_of(live), *self._estop_of(live)]

    def _attribute(self, live: Live, occupation: Occupation | None) -> None:
        """Attribute a stop to the session that used the apparatus when it occurred, although the stop ended the session's run."""
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
        alarms_ended = AlarmsEnded(tuple(self._alarms.values()), utc_now())
        self._alarms = {}
        return [alarms_ended]

    def _estop_of(self, live: Live) -> list[NewDeviceEvent | AlarmsEnded]:
        if live.estop == "pressed":
            self._pressed = True
        elif live.estop == "released" and self._pressed:
            self._pressed = False
            if live.stop and any(cause.code == _ONE_CONTACT_ONLY for cause in live.stop.causes):
                # Only one of the two contacts has switched. The test must find this, and so does not count.
                return []
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
