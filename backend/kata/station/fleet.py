"""Stores the state of all stations of the clinic as this station knows it. The caller passes the reports and the time.

A report gets the time of its arrival by this computer's clock, so the stations' clocks need not agree. A station without recent reports is
silent. Its last report is then hidden, because its state may have changed.
"""

from dataclasses import dataclass
from datetime import datetime
from typing import Final
from uuid import UUID

from pydantic import Field

from kata.device.ipc_messages import EstopState, Mode, TorqueState
from kata.station.lease import ClockReading
from kata.station.schemas import DeviceState, Live, PatientRef, StationInfo, StopCauseLive, _Schema

SILENT_AFTER_S: Final = 3.0
"""A station is silent after this time. A station reports at least every second. One report may be lost and one late."""
MAX_REPORT_BYTES: Final = 7900
"""Largest report in bytes. PostgreSQL accepts fewer than 8000."""
_MAX_CAUSES: Final = 5


class PlaybackProgress(_Schema):
    """Progress of a playback."""

    position_s: float = Field(ge=0, description="Position in the recording, seconds.")
    duration_s: float = Field(ge=0, description="Length of the playback, seconds.")
    left_s: float | None = Field(
        description="Remaining time of approach or return, else of the recording, seconds; null: it depends on the patient."
    )
    reversing: bool = Field(description="The arm moves back from resistance.")


class StationReport(_Schema):
    """A station's report of its state to the other stations."""

    station: str = Field(max_length=100, examples=["Station 1"])
    service: UUID = Field(description="Id of this start of its service.")
    simulated: bool
    device: DeviceState
    mode: Mode
    torque: TorqueState
    estop: EstopState
    causes: list[StopCauseLive] = Field(description="Causes of the latched stop, the first one first.")
    arm_held: bool
    operator: str | None = Field(description="Name of the operator.")
    patient: PatientRef | None = Field(description="Null also if the user may not see the record.")
    recording_name: str | None
    progress: PlaybackProgress | None
    take_s: float | None = Field(description="While teaching: length of the present or last take, seconds.")

    @property
    def without_progress(self) -> "StationReport":
        """Return the report without progress. If it changes, the report is sent at once."""
        progress = (
            PlaybackProgress(position_s=0, duration_s=0, left_s=0, reversing=self.progress.reversing)
            if self.progress
            else None
        )
        return self.model_copy(update={"progress": progress, "take_s": None if self.take_s is None else 0.0})


class StationStatus(_Schema):
    """A station as this service knows it."""

    name: str
    here: bool = Field(description="The station of this service.")
    heard_at: datetime | None = Field(description="Time of the last report; null: none since this service started.")
    silent: bool = Field(description="No report for seconds: its state is unknown.")
    doubled: bool = Field(description="Two services use this name: one of them needs another name.")
    state: StationReport | None = Field(description="Null while it is silent.")
    patient_hidden: bool = Field(
        default=False, description="A patient is on the apparatus whose record the user may not see."
    )


def state_of(info: StationInfo, live: Live, service: UUID) -> StationReport:
    """Return the report of this station."""
    active = live.run or live.teaching
    return StationReport(
        station=info.name,
        service=service,
        simulated=info.simulated,
        device=live.device,
        mode=live.mode,
        torque=live.torque,
        estop=live.estop,
        causes=live.stop.causes[:_MAX_CAUSES] if live.stop else [],
        arm_held=live.stop is not None and live.stop.arm_held,
        operator=live.lease.holder,
        patient=active.patient if active else None,
        recording_name=live.run.recording_name if live.run else None,
        progress=PlaybackProgress.model_validate(live.run, from_attributes=True) if live.run else None,
        take_s=live.teaching.take_s if live.teaching else None,
    )


def as_json(state: StationReport) -> str:
    """Return the report as JSON. If it is too long, omit causes, then names."""
    for shortened in (
        state,
        state.model_copy(update={"causes": state.causes[:1]}),
        state.model_copy(update={"causes": []}),
    ):
        text = shortened.model_dump_json()
        if len(text.encode()) <= MAX_REPORT_BYTES:
            return text
    return state.model_copy(update={"causes": [], "recording_name": None, "patient": None}).model_dump_json()


@dataclass(slots=True)
class _Heard:
    state: StationReport
    at: ClockReading
    before: UUID | None = None
    """Id of the previous service with the same name."""
    doubled_s: float | None = None
    """Time of the last change back to the previous service: two services report in turn. After a restart no change back happens."""


class Roster:
    """All stations with their last reports."""

    def __init__(self, here: str) -> None:
        """Start without reports. ``here``: the name of this service's station."""
        self._here = here
        self._heard: dict[str, _Heard | None] = {here: None}

    def register(self, names: list[str]) -> None:
        """Add stations that may not have sent a report yet."""
        for name in names:
            self._heard.setdefault(name, None)

    def take(self, state: StationReport, now: ClockReading) -> None:
        """Store a report that has just arrived."""
        before = self._heard.get(state.station)
        heard = self._heard[state.station] = _Heard(state, now)
        if before:
            heard.before, heard.doubled_s = before.before, before.doubled_s
            if before.state.service != state.service:
                heard.before = before.state.service
                if state.service == before.before:
                    heard.doubled_s = now.s

    def statuses(self, now: ClockReading) -> list[StationStatus]:
        """Return all stations by name, this service's own first."""
        names = sorted(self._heard, key=lambda name: (name != self._here, name))
        return [self._status(name, now) for name in names]

    def _status(self, name: str, now: ClockReading) -> StationStatus:
        heard = self._heard[name]
        silent = heard is None or now.s - heard.at.s > SILENT_AFTER_S
        return StationStatus(
            name=name,
            here=name == self._here,
            heard_at=heard.at.at if heard else None,
            silent=silent,
            doubled=heard is not None and heard.doubled_s is not None and now.s - heard.doubled_s <= SILENT_AFTER_S,
            state=None if silent or heard is None else heard.state,
        )
