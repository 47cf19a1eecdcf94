"""Teaches and plays back through the service, without a browser.

It uses the real service with its database, the device process, and the apparatus. On the simulated apparatus behind a
pseudo-terminal, the simulated hand does the therapist's work.
"""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from itertools import count
from typing import Any, Final, TypeVar
from uuid import UUID, uuid4

import numpy as np
from fastapi import FastAPI
from sqlalchemy.orm import Session as DatabaseSession

from kata.api import station_router as commands
from kata.api.app import create_app
from kata.api.run_start import RunStores
from kata.api.seen_state import SeenState, guarded
from kata.api.services import Services
from kata.clinic.episodes import service as episodes
from kata.clinic.episodes.schemas import EpisodeCreate
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow, TeachingRow
from kata.clinic.sessions import checks, runs
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.checklist import CheckName, CheckState
from kata.clinic.sessions.schemas import CheckConfirmation, Run
from kata.database.base import utc_now
from kata.device.ipc_messages import RESISTANCE_LEVELS, Mode
from kata.device.journal import Journal, JournalEnd, JournalHeader, synthetic_journal
from kata.errors import ProblemError
from kata.motion.axes import CANONICAL_SIDE, OPPOSITE, Side
from kata.motion.linkage import Floats
from kata.motion.method import Method
from kata.motion.taught import Taught
from kata.settings import Settings
from kata.simulator.apparatus import State
from kata.station.guard import Guard
from kata.station.lease import PRESENT_AFTER_SHOWN_S, Browser
from kata.station.lease_manager import ListeningPage
from kata.station.schemas import Live

_SPARE_S: Final = 30.0
"""A wait ends with an error this long after its expected end."""

_USER: Final = "Rehearsal"
_ESTOP_TEST_S: Final = 120.0
"""Time that a person at a real apparatus has to press the emergency stop, and again to release it."""

_Checklist = Callable[[DatabaseSession, checks.ApparatusState], tuple[CheckState, ...]]
Show = Callable[[str, float, float], None]
"""Callback with the present step, its duration in s and the remaining time in s (0 when the step is finished)."""


_Saved = TypeVar("_Saved")


class ServiceDriverError(Exception):
    """A step failed. The exception's message states the reason."""


class ServiceDriver:
    """One patient's session at a running service."""

    def __init__(self, app: FastAPI, show: Show) -> None:
        """Create a patient and begin a session. ``app`` must have been started; see :func:`driving_service`."""
        services: Services = app.state.services
        self.station, self.database = services.station, services.database
        self._event_spool, self._offline_sessions = services.event_spool, services.offline_sessions
        self.browser = Browser(uuid4(), _USER)
        self._simulation = services.simulation
        self._hand = self._simulation.process.client() if self._simulation else None
        self._show = show
        with self.database.write() as session:
            # The folder may contain earlier patients, so the number must be unique.
            number = f"DEMO-{uuid4().hex[:8]}"
            patient = PatientCreate(clinic_number=number, name="Demonstration", affected_side=CANONICAL_SIDE)
            self._patient_id = patients.create(session, patient).id
            episodes.open_new(session, self._patient_id, EpisodeCreate(side=OPPOSITE[CANONICAL_SIDE]))
            self._session_id = sessions.begin(session, self._patient_id, _USER, station=self.station.info.name).id

    async def set_side(self, side: Side) -> None:
        """Set the side of the apparatus. A simulated apparatus is turned."""
        if self.station.config.side == side:
            return
        await commands.set_side(self.station, self._simulation, self.browser, commands.SideRequest(side=side))
        await self.until_mode({"idle"}, "Turning the apparatus", _SPARE_S)

    async def guide(self, motion: Taught, step: str, *, pedal: bool) -> None:
        """Let the simulated hand guide the arm along a motion."""
        hand = self._hand
        assert hand is not None
        started: State = hand.guide(motion, pedal=pedal)
        await self._until(
            step, started.hand.left_s, lambda: hand.state().hand.left_s, lambda: hand.state().hand.phase == "away"
        )

    async def teach(self, motion: Taught, side: Side = CANONICAL_SIDE) -> RecordingRow:
        """Teach with the simulated hand and pedal. Return the recording."""
        await self.set_side(side)
        # The checklist requires a fixture and visual checks, although the simulated apparatus holds no real arm.
        request = commands.TeachRequest(
            patient_id=self._patient_id, name=motion.name, side=side, fixtures={"arm_fixer_1"},
            looked_at={"side", "fixtures", "belt"}, identifiers={"name", "clinic_number"},
        )  # fmt: skip
        teach = checks.TeachingRequest(self._patient_id, side, request.fixtures)
        await self._ensure_estop_tested(lambda session, apparatus: checks.teaching_checklist(session, teach, apparatus))
        teaching = await commands.teach(
            self.station, self.database, self._event_spool, self._apparatus(), self.browser, request
        )
        await self.guide(motion, "Teaching by hand and pedal", pedal=True)
        await commands.finish_teaching(self.station, self.browser)

        def saved() -> RecordingRow | None:
            with self.database.read() as session:
                newest, _ = recordings.of_patient(session, self._patient_id, limit=10, after=None)
            return next((recording for recording in newest if recording.teaching_id == teaching.teaching_id), None)

        return await self._wait_until_saved(saved)

    def save_recording(self, name: str, side: Side, times_s: Floats, angles_deg: Floats) -> RecordingRow:
        """Save times ``(n,)`` from 0 and motor angles ``(n, 5)`` as a recording, as after a teaching. Return the recording."""
        with self.database.write() as session:
            teaching = TeachingRow(id=uuid4(), patient_id=self._patient_id, name=name, side=side, started_at=utc_now())
            session.add(teaching)
            session.flush()
            rows = recordings.store_teaching(session, self._as_journal(teaching.id, times_s, angles_deg))
            assert rows
            return rows[0]

    async def play(self, recording: RecordingRow, method: Method = "smooth") -> Run:
        """Load a recording, approach its start, play it and move back. Return the run. ``learned`` uses the earlier playbacks."""
        await self._go_through_checklist(recording)
        request = commands.LoadRequest(
            session_id=self._session_id, recording_id=recording.id, resistance_level=RESISTANCE_LEVELS, method=method
        )
        stores = RunStores(self.database, self._event_spool, self._offline_sessions)
        run = await commands.load(self.station, stores, self._apparatus(), self.browser, request)
        await commands.approach(self.station, stores, await self._guard(), self.browser)
        await self.until_mode({"paused"}, "Moving to the start", _SPARE_S)
        await commands.play(self.station, stores, await self._guard(), self.browser)
        await self.until_mode({"returning", "idle"}, "Playing back", recording.duration_s)
        await self.until_mode({"idle"}, "Moving back", _SPARE_S)

        def ended() -> Run | None:
            with self.database.read() as session:
                row = runs.get(session, run.id)
                return runs.as_run(row) if row.ended_at else None

        return await self._wait_until_saved(ended)

    def samples(self, run: Run) -> tuple[recordings.Samples, dict[str, Any]]:
        """Return the samples of the recording, and of the run as arrays by :data:`kata.clinic.sessions.tables.RUN_COLUMNS`."""
        with self.database.read() as session:
            return recordings.samples(session, run.recording_id), runs.samples(session, run.id)

    def end(self) -> None:
        """End the session."""
        with self.database.write() as session:
            sessions.end(session, self._session_id)

    def raise_if_stopped(self) -> None:
        """Do nothing unless the apparatus has been stopped.

        :raises ServiceDriverError: when the apparatus has been stopped, with the causes.
        """
        live: Live = self.station.live()
        if live.stop:
            raise ServiceDriverError(" ".join(cause.message for cause in live.stop.causes))

    def close(self) -> None:
        """Close the connection to the simulated hand."""
        if self._hand:
            self._hand.close()

    async def until_mode(self, modes: set[Mode], step: str, duration_s: float) -> None:
        """Wait until the apparatus is in one of these modes."""

        def remaining_s() -> float:
            run = self.station.live().run
            return (run.left_s if run else None) or 0.0

        await self._until(step, duration_s, remaining_s, lambda: self.station.live().mode in modes)

    async def _guard(self) -> Guard:
        """Return the guard for a command, based on the newest state."""
        live: Live = self.station.live()
        return await guarded(self.station, SeenState(stops=live.stops, seen_at=live.at))

    def _apparatus(self) -> checks.ApparatusState:
        cache, station = self._offline_sessions.cache, self.station
        tested = cache.has_estop_test_since(station.verified_since_s)
        return checks.apparatus_state(station.info.name, station.live(), cache.zone, tested_since_verified=tested)

    async def _go_through_checklist(self, recording: RecordingRow) -> None:
        """Test the emergency stop if today's test is missing, and confirm the open checks, as a therapist would."""

        def checklist(session: DatabaseSession, apparatus: checks.ApparatusState) -> tuple[CheckState, ...]:
            return checks.checklist(session, self._session_id, recording.id, apparatus)

        await self._ensure_estop_tested(checklist)
        tick = CheckConfirmation(checked_by=_USER, recording_id=recording.id, identifiers={"name", "clinic_number"})
        apparatus = self._apparatus()
        with self.database.write() as session:
            for check in self._open_checks(checklist):
                checks.confirm(session, self._session_id, check, tick, apparatus)

    async def _ensure_estop_tested(self, checklist: _Checklist) -> None:
        if "estop" in self._open_checks(checklist):
            await self._test_estop()
            await self._until("Emergency stop", 0.0, lambda: 0.0, lambda: "estop" not in self._open_checks(checklist))

    def _open_checks(self, checklist: _Checklist) -> list[CheckName]:
        apparatus = self._apparatus()
        with self.database.read() as session:
            states = checklist(session, apparatus)
        return [checked.need.check for checked in states if checked.answer is None]

    async def _test_estop(self) -> None:
        """Press and release the simulated emergency stop. On a real apparatus wait until a person does it."""

        async def until(step: str, done: Callable[[Live], bool]) -> None:
            await self._until(step, _ESTOP_TEST_S, lambda: 0.0, lambda: done(self.station.live()), fail_on_stop=False)

        if self._hand:
            self._hand.estop(True)
        await until("Press the emergency stop", lambda live: live.estop == "pressed")
        if self._hand:
            self._hand.estop(False)
        await until("Release it", lambda live: live.estop == "released" and "acknowledge" not in live.refusals)
        await commands.acknowledge(self.station, await self._guard(), self.browser)
        await until("Acknowledged", lambda live: live.mode == "idle")

    async def _wait_until_saved(self, find: Callable[[], _Saved | None]) -> _Saved:
        saved: list[_Saved] = []

        def is_saved() -> bool:
            saved[:] = [result for result in [find()] if result is not None]
            return bool(saved)

        await self._until("Saving", 0.0, lambda: 0.0, is_saved)
        return saved[0]

    async def _until(
        self,
        step: str,
        duration_s: float,
        remaining_s: Callable[[], float],
        done: Callable[[], bool],
        *,
        fail_on_stop: bool = True,
    ) -> None:
        """Wait until ``done`` returns True. Show the remaining time.

        :raises ServiceDriverError: when it takes too long, or the apparatus stops and ``fail_on_stop`` is set.
        """
        total = max(duration_s, remaining_s(), 0.1)
        limit = asyncio.get_running_loop().time() + duration_s + _SPARE_S
        while not done():
            if fail_on_stop:
                self.raise_if_stopped()
            if asyncio.get_running_loop().time() > limit:
                raise ServiceDriverError(f"{step}: not finished after {duration_s + _SPARE_S:.0f} s")
            self._show(step, total, max(remaining_s(), 0.01))
            await asyncio.sleep(0.1)
        self._show(step, total, 0.0)

    def _as_journal(self, teaching_id: UUID, times_s: Floats, angles_deg: Floats) -> Journal:
        return synthetic_journal(
            JournalHeader(
                kind="teaching",
                id=str(teaching_id),
                recording_id=None,
                station=self.station.info.name,
                rate_hz=round((len(times_s) - 1) / (times_s[-1] - times_s[0])),
                started_at=datetime.now(UTC),
                started_ns=0,
            ),
            times_s,
            angles_deg,
            angles_deg,
            np.zeros_like(angles_deg),
            JournalEnd(reason="finished"),
        )


async def _show_states(page: ListeningPage) -> None:
    """Confirm states as a page does, so that the driver's browser is present."""
    for sequence in count(1):
        page.note_sent(sequence)
        page.note_shown(sequence)
        await asyncio.sleep(PRESENT_AFTER_SHOWN_S / 4)


@asynccontextmanager
async def driving_service(settings: Settings, show: Show) -> AsyncIterator[ServiceDriver]:
    """Start a service, wait until it is connected to its apparatus, and yield a driver for it."""
    app = create_app(settings)
    async with app.router.lifespan_context(app):
        driver = ServiceDriver(app, show)
        try:
            with driver.station.lease_manager.listening(driver.browser) as page:
                showing = asyncio.create_task(_show_states(page), name="states shown")
                try:
                    await driver.until_mode({"idle"}, "Connecting", _SPARE_S)
                    yield driver
                finally:
                    showing.cancel()
        except ProblemError:
            # If a stop caused the refusal, report the causes of the stop instead.
            driver.raise_if_stopped()
            raise
        finally:
            driver.close()
