"""Teaching and playing back through the service, without a browser.

Everything is the real thing: the service with its database, the device process, and the apparatus, or the simulated one behind a
pseudo-terminal, whose hand then does what a therapist would.
"""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from typing import Any, Final, TypeVar
from uuid import UUID, uuid4

import numpy as np
from fastapi import FastAPI
from sqlalchemy.orm import Session as DatabaseSession

from kata.api import station_router as commands
from kata.api.app import create_app
from kata.api.services import Services
from kata.clinic.episodes import service as episodes
from kata.clinic.episodes.schemas import EpisodeCreate
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow, TeachingRow
from kata.clinic.sessions import checks, runs
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.checklist import Checked, CheckName
from kata.clinic.sessions.schemas import CheckTick, Run
from kata.database.base import utc_now
from kata.device.journal import Journal, JournalEnd, not_written
from kata.device.messages import LOAD_LEVELS, Mode
from kata.errors import ProblemError
from kata.motion.axes import CANONICAL_SIDE, Side
from kata.motion.linkage import Floats
from kata.motion.method import Method
from kata.motion.taught import Taught
from kata.settings import Settings
from kata.simulator.apparatus import State
from kata.station.guard import Guard
from kata.station.lease import Browser
from kata.station.schemas import Live

_SPARE_S: Final = 30.0
"""Every wait ends this long after it should have been over."""

_WHO: Final = "Rehearsal"
_SWITCH_S: Final = 120.0
"""So long somebody at a real apparatus has for pressing the emergency stop and releasing it."""

_Checklist = Callable[[DatabaseSession, checks.Apparatus], tuple[Checked, ...]]
Show = Callable[[str, float, float], None]
"""Is told what goes on, how long it takes in all, and how long it still does, in seconds; 0 left: it is over."""


_Found = TypeVar("_Found")


class RehearsalError(Exception):
    """It could not go on; the message says why."""


class Rehearsal:
    """One patient's visit at a running service."""

    def __init__(self, app: FastAPI, show: Show) -> None:
        """``app`` has been started; see :func:`rehearsing`."""
        services: Services = app.state.services
        self.station, self.database = services.station, services.database
        self._event_spool, self._offline_cache = services.event_spool, services.offline_cache
        self.browser = Browser(uuid4(), _WHO)
        self._simulation = services.simulation
        self._hand = self._simulation.process.client() if self._simulation else None
        self._show = show
        with self.database.write() as session:
            # There may have been others in this folder.
            number = f"DEMO-{uuid4().hex[:8]}"
            wanted = PatientCreate(clinic_number=number, name="Demonstration", affected_side=CANONICAL_SIDE)
            self._patient_id = patients.create(session, wanted).id
            other: Side = "left" if CANONICAL_SIDE == "right" else "right"
            episodes.open_new(session, self._patient_id, EpisodeCreate(side=other))
            self._visit_id = sessions.begin(session, self._patient_id, _WHO, station=self.station.info.name).id

    async def stand_for(self, side: Side) -> None:
        """Say that the apparatus stands for a side; a simulated one is turned by that."""
        if self.station.config.side == side:
            return
        await commands.set_side(self.station, self._simulation, self.browser, commands.SideRequest(side=side))
        await self.until_mode({"idle"}, "Turning the apparatus", _SPARE_S)

    async def guide(self, motion: Taught, what: str, *, pedal: bool) -> None:
        """Let the simulated hand take the arm along a motion."""
        hand = self._hand
        assert hand is not None
        started: State = hand.guide(motion, pedal=pedal)
        await self._until(
            what, started.hand.left_s, lambda: hand.state().hand.left_s, lambda: hand.state().hand.phase == "away"
        )

    async def teach(self, motion: Taught, side: Side = CANONICAL_SIDE) -> RecordingRow:
        """Teach by the simulated hand and pedal."""
        await self.stand_for(side)
        # Nobody's arm lies in the simulated apparatus; something has to be named, and looked at.
        wanted = commands.TeachRequest(
            patient_id=self._patient_id, name=motion.name, side=side, fixtures={"arm_fixer_1"},
            looked_at={"side", "fixtures", "belt"},
        )  # fmt: skip
        teach = checks.Teach(self._patient_id, side, wanted.fixtures)
        await self._try_estop_once(lambda session, there: checks.teaching_checklist(session, teach, there))
        teaching = await commands.teach(self.station, self.database, self._event_spool, self.browser, wanted)
        await self.guide(motion, "Teaching by hand and pedal", pedal=True)
        await commands.finish_teaching(self.station, self.browser)

        def saved() -> RecordingRow | None:
            with self.database.read() as session:
                found = recordings.of_patient(session, self._patient_id)
            return next((one for one in found if one.teaching_id == teaching.teaching_id), None)

        return await self._saved(saved)

    def given(self, name: str, side: Side, times_s: Floats, angles_deg: Floats) -> RecordingRow:
        """A recording as if it had been taught: times ``(n,)`` from 0 and motor angles ``(n, 5)``."""
        with self.database.write() as session:
            teaching = TeachingRow(id=uuid4(), patient_id=self._patient_id, name=name, side=side, started_at=utc_now())
            session.add(teaching)
            session.flush()
            kept = recordings.keep_teaching(session, self._as_journal(teaching.id, times_s, angles_deg))
            assert kept
            return kept[0]

    async def play(self, recording: RecordingRow, method: Method = "smooth") -> Run:
        """Load it, move to its start, play it to its end, and back. ``learned`` knows what was played before."""
        await self._go_through_checklist(recording)
        wanted = commands.LoadRequest(
            session_id=self._visit_id, recording_id=recording.id, load_level=LOAD_LEVELS, method=method
        )
        run = await commands.load(
            self.station, self.database, self._event_spool, self._offline_cache, self.browser, wanted
        )
        await commands.approach(self.station, await self._guard(), self.browser)
        await self.until_mode({"paused"}, "Moving to the start", _SPARE_S)
        await commands.play(self.station, await self._guard(), self.browser)
        await self.until_mode({"returning", "idle"}, "Playing back", recording.duration_s)
        await self.until_mode({"idle"}, "Moving back", _SPARE_S)

        def ended() -> Run | None:
            with self.database.read() as session:
                row = runs.get(session, run.id)
                return runs.as_run(row) if row.ended_at else None

        return await self._saved(ended)

    def samples(self, run: Run) -> tuple[recordings.Samples, dict[str, Any]]:
        """What was taught, and the arrays of :data:`kata.clinic.sessions.tables.SAMPLE_COLUMNS` of what was played."""
        with self.database.read() as session:
            return recordings.samples(session, run.recording_id), runs.samples(session, run.id)

    def end(self) -> None:
        """The visit is over."""
        with self.database.write() as session:
            sessions.end(session, self._visit_id)

    def look_for_stop(self) -> None:
        """:raises RehearsalError: when the apparatus has been stopped, saying why."""
        live: Live = self.station.live()
        if live.stop:
            raise RehearsalError(" ".join(cause.message for cause in live.stop.causes))

    def leave(self) -> None:
        """Nobody moves the simulated hand any more."""
        if self._hand:
            self._hand.close()

    async def until_mode(self, modes: set[Mode], what: str, lasts_s: float) -> None:
        """Wait until the apparatus is in one of these modes."""

        def left() -> float:
            run = self.station.live().run
            return run.left_s if run else 0.0

        await self._until(what, lasts_s, left, lambda: self.station.live().mode in modes)

    async def _guard(self) -> Guard:
        """Return what a command carries that is based on the newest state."""
        live: Live = self.station.live()
        return await commands.guarded(self.station, commands.SeenState(stops=live.stops, seen_at=live.at))

    async def _go_through_checklist(self, recording: RecordingRow) -> None:
        """As a therapist would: first the emergency stop, once a day, then what somebody has to look at."""

        def checklist(session: DatabaseSession, there: checks.Apparatus) -> tuple[Checked, ...]:
            return checks.checklist(session, self._visit_id, recording.id, there)

        await self._try_estop_once(checklist)
        tick = CheckTick(checked_by=_WHO, recording_id=recording.id)
        there = checks.apparatus(self.station.info.name, self.station.live())
        with self.database.write() as session:
            for check in self._still_open(checklist):
                checks.tick(session, self._visit_id, check, tick, there)

    async def _try_estop_once(self, checklist: _Checklist) -> None:
        if "estop" in self._still_open(checklist):
            await self._try_estop()
            await self._until("Emergency stop", 0.0, lambda: 0.0, lambda: "estop" not in self._still_open(checklist))

    def _still_open(self, checklist: _Checklist) -> list[CheckName]:
        there = checks.apparatus(self.station.info.name, self.station.live())
        with self.database.read() as session:
            found = checklist(session, there)
        return [one.need.check for one in found if one.answer is None]

    async def _try_estop(self) -> None:
        """The simulated switch is pressed and released; a real one somebody has to."""

        async def until(what: str, done: Callable[[Live], bool]) -> None:
            await self._until(what, _SWITCH_S, lambda: 0.0, lambda: done(self.station.live()), stops=False)

        if self._hand:
            self._hand.estop(True)
        await until("Press the emergency stop", lambda live: live.estop == "pressed")
        if self._hand:
            self._hand.estop(False)
        await until("Release it", lambda live: live.estop == "released" and "acknowledge" not in live.refusals)
        await commands.acknowledge(self.station, await self._guard(), self.browser)
        await until("Acknowledged", lambda live: live.mode == "idle")

    async def _saved(self, look: Callable[[], _Found | None]) -> _Found:
        found: list[_Found] = []

        def there() -> bool:
            found[:] = [one for one in [look()] if one is not None]
            return bool(found)

        await self._until("Saving", 0.0, lambda: 0.0, there)
        return found[0]

    async def _until(
        self, what: str, lasts_s: float, left: Callable[[], float], done: Callable[[], bool], *, stops: bool = True
    ) -> None:
        """:raises RehearsalError: when it takes too long, or a stop comes where ``stops`` says that none should."""
        total = max(lasts_s, left(), 0.1)
        limit = asyncio.get_running_loop().time() + lasts_s + _SPARE_S
        while not done():
            if stops:
                self.look_for_stop()
            if asyncio.get_running_loop().time() > limit:
                raise RehearsalError(f"{what}: not over after {lasts_s + _SPARE_S:.0f} s")
            self._show(what, total, max(left(), 0.01))
            await asyncio.sleep(0.1)
        self._show(what, total, 0.0)

    def _as_journal(self, teaching_id: UUID, times_s: Floats, angles_deg: Floats) -> Journal:
        return not_written(
            "teaching",
            teaching_id,
            self.station.info.name,
            round((len(times_s) - 1) / (times_s[-1] - times_s[0])),
            datetime.now(UTC),
            times_s,
            angles_deg,
            angles_deg,
            np.zeros_like(angles_deg),
            JournalEnd(reason="finished"),
        )


@asynccontextmanager
async def rehearsing(settings: Settings, show: Show) -> AsyncIterator[Rehearsal]:
    """A service of our own, connected to its apparatus."""
    app = create_app(settings)
    async with app.router.lifespan_context(app):
        rehearsal = Rehearsal(app, show)
        try:
            with rehearsal.station.operating.listening(rehearsal.browser):
                await rehearsal.until_mode({"idle"}, "Connecting", _SPARE_S)
                yield rehearsal
        except ProblemError:
            # Refused because of a stop: why it stopped tells more.
            rehearsal.look_for_stop()
            raise
        finally:
            rehearsal.leave()
