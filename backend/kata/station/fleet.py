"""The clinic's stations as one of them knows the others. Pure: it is told what came, and the time.

What another station says counts from the moment it arrived here, by this computer's clock: nobody's clocks need to agree. One that has
not been heard for a while is silent; what it said last is told no more, because it may have changed.
"""

from dataclasses import dataclass
from datetime import datetime
from typing import Final
from uuid import UUID

from pydantic import Field

from kata.device.messages import EstopState, Mode, TorqueState
from kata.station.lease import Moment
from kata.station.schemas import DeviceState, Live, PatientRef, StationInfo, StopCauseLive, _Schema

SILENT_AFTER_S: Final = 3.0
"""Each station speaks at least every second: one word may be lost, and another be late."""
LONGEST: Final = 7900
"""Bytes of what a station says at once; PostgreSQL takes fewer than 8000."""
_CAUSES: Final = 5


class PlaybackProgress(_Schema):
    """How far a playback is."""

    position_s: float = Field(ge=0, description="Place on the recording, seconds.")
    duration_s: float = Field(ge=0, description="Its length as it is played, seconds.")
    left_s: float = Field(description="Of the approach or return while those go on, else of the recording; seconds.")
    reversing: bool = Field(description="The arm is being taken back from resistance.")


class StationReport(_Schema):
    """What a station says of itself to all the others."""

    station: str = Field(max_length=100, examples=["Station 1"])
    service: UUID = Field(description="Of this start of its service.")
    simulated: bool
    device: DeviceState
    mode: Mode
    torque: TorqueState
    estop: EstopState
    causes: list[StopCauseLive] = Field(description="Of the stop that is latched, the first one first.")
    arm_held: bool
    operator: str | None = Field(description="Who operates it.")
    patient: PatientRef | None = Field(description="Null too where the record is not for whoever asks.")
    recording_name: str | None
    progress: PlaybackProgress | None
    take_s: float | None = Field(description="While teaching: length of the present or last take, seconds.")

    @property
    def steady(self) -> "StationReport":
        """Without what moves on all the time: another one is worth telling at once."""
        progress = (
            PlaybackProgress(position_s=0, duration_s=0, left_s=0, reversing=self.progress.reversing)
            if self.progress
            else None
        )
        return self.model_copy(update={"progress": progress, "take_s": None if self.take_s is None else 0.0})


class StationStatus(_Schema):
    """One station, as far as it is known here."""

    name: str
    here: bool = Field(description="It is the one that this service belongs to.")
    heard_at: datetime | None = Field(description="When it last said anything; null: not since this service began.")
    silent: bool = Field(description="It has said nothing for seconds: what it does is not known.")
    doubled: bool = Field(description="Two services call themselves so: one of them has to be given another name.")
    state: StationReport | None = Field(description="Null while it is silent.")


def state_of(info: StationInfo, live: Live, service: UUID) -> StationReport:
    """What a station has to say."""
    going_on = live.run or live.teaching
    return StationReport(
        station=info.name,
        service=service,
        simulated=info.simulated,
        device=live.device,
        mode=live.mode,
        torque=live.torque,
        estop=live.estop,
        causes=live.stop.causes[:_CAUSES] if live.stop else [],
        arm_held=live.stop is not None and live.stop.arm_held,
        operator=live.lease.holder,
        patient=going_on.patient if going_on else None,
        recording_name=live.run.recording_name if live.run else None,
        progress=PlaybackProgress.model_validate(live.run, from_attributes=True) if live.run else None,
        take_s=live.teaching.take_s if live.teaching else None,
    )


def encoded(state: StationReport) -> str:
    """As JSON, short enough: causes after the first, and what names only, go before it would be too long."""
    for told in (state, state.model_copy(update={"causes": state.causes[:1]}), state.model_copy(update={"causes": []})):
        text = told.model_dump_json()
        if len(text.encode()) <= LONGEST:
            return text
    return state.model_copy(update={"causes": [], "recording_name": None, "patient": None}).model_dump_json()


@dataclass(slots=True)
class _Heard:
    state: StationReport
    at: Moment
    before: UUID | None = None
    """The service of the same name that spoke before this one."""
    doubled_s: float | None = None
    """When one spoke that had spoken before the last: two take turns. A service that was started anew does not come back."""


class Roster:
    """Who is there, and what they said last."""

    def __init__(self, here: str) -> None:
        """``here``: the name of the station whose service this is."""
        self._here = here
        self._heard: dict[str, _Heard | None] = {here: None}

    def register(self, names: list[str]) -> None:
        """There are these stations, whether they are heard or not."""
        for name in names:
            self._heard.setdefault(name, None)

    def take(self, state: StationReport, now: Moment) -> None:
        """A station has said this, and it has arrived now."""
        before = self._heard.get(state.station)
        heard = self._heard[state.station] = _Heard(state, now)
        if before:
            heard.before, heard.doubled_s = before.before, before.doubled_s
            if before.state.service != state.service:
                heard.before = before.state.service
                if state.service == before.before:
                    heard.doubled_s = now.s

    def shown(self, now: Moment) -> list[StationStatus]:
        """All of them, by name; this one first."""
        names = sorted(self._heard, key=lambda name: (name != self._here, name))
        return [self._shown(name, now) for name in names]

    def _shown(self, name: str, now: Moment) -> StationStatus:
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
