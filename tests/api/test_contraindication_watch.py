"""Whatever a doctor changes and whatever is recorded between the load and the end of a motion: what may not start does not go on."""

import asyncio
import contextlib
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, Final
from unittest import mock
from uuid import UUID

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from kata.api import contraindication_watch
from kata.api.contraindication_watch import pausing_playbacks, require_allowed
from kata.clinic.contraindications import service as contraindications
from kata.clinic.contraindications.kinds import KINDS
from kata.clinic.episodes import service as episodes
from kata.clinic.episodes.limits import DoctorLimits
from kata.database.availability import DatabaseUnavailableError
from kata.database.base import utc_now
from kata.device.ipc_messages import Command, Pause, Refusal
from kata.errors import ProblemError
from kata.motion.axes import Side
from kata.station.schemas import PatientRef
from kata.station.snapshot_tracker import Occupation

_SESSION, _PATIENT = UUID(int=1), UUID(int=2)
_NOT_PLAYING: Final = Refusal(code="is_paused", message="", next_step="")
_ROUNDS: Final = 10
"""Rounds of the event loop in which the watch makes several checks."""
_SIDES: Final[tuple[Side, ...]] = ("right", "left")


def limits(side: Side, level: int | None) -> DoctorLimits:
    """Return a doctor's limits that differ in the resistance level."""
    return DoctorLimits(side, "Dr. Mori", level, None, ())


class Watched(RuleBasedStateMachine):
    """One loaded recording, the record of its patient, and the service's checks. Station, cache and database are replaced by this state."""

    occupation: Occupation | None = None
    mode = "idle"

    @initialize(cached=st.booleans(), level=st.sampled_from([None, 8, 12]))
    def begin(self, cached: bool, level: int | None) -> None:
        """``cached``: the record of a restricted patient is never cached."""
        self.cached = cached
        self.reachable = True
        self.limits: dict[Side, DoctorLimits] = {side: limits(side, level) for side in _SIDES}
        self.conditions: list[tuple[Side, Any]] = []
        self.events: list[str] = []
        self.info = SimpleNamespace(name="Station 1")

    # -- the station, as the checks see it ---------------------------------------------------------------------------

    def refusal(self, name: str) -> Refusal | None:
        assert name == "pause"
        return None if self.mode == "playing" else _NOT_PLAYING

    async def command(self, command: Command) -> Refusal | None:
        assert isinstance(command, Pause)
        self.mode = "paused"
        return None

    def publish(self, event: Any) -> None:
        self.events.append(event.code)

    # -- cache and database ------------------------------------------------------------------------------------------

    def find_session(self, session_id: UUID) -> Any:
        assert session_id == _SESSION
        if not self.cached:
            return None
        recordings = {side: SimpleNamespace(side=side, allowed=found) for side, found in self.limits.items()}
        return SimpleNamespace(banner=SimpleNamespace(contraindications_of=self.of_shoulder), recordings=recordings)

    def of_shoulder(self, side: Side) -> list[Any]:
        return [condition for shoulder, condition in self.conditions if shoulder == side]

    @contextlib.contextmanager
    def read(self) -> Any:
        if not self.reachable:
            raise DatabaseUnavailableError(utc_now())
        yield self

    def require_none(self, session: Any, patient_id: UUID, side: Side) -> None:
        assert patient_id == _PATIENT
        contraindications.check(self.of_shoulder(side))

    @contextlib.contextmanager
    def replaced(self) -> Any:
        watch = contraindication_watch

        async def run_here(function: Callable[..., None], *given: Any) -> None:
            function(*given)

        with (
            mock.patch.object(watch, "run_in_threadpool", run_here),
            mock.patch.object(watch, "_EVERY_S", 0.0),
            mock.patch.object(contraindications, "require_none", self.require_none),
            mock.patch.object(episodes, "open_episode", lambda session, patient_id, side: side),
            mock.patch.object(watch, "of_episode", lambda side: self.limits[side]),
        ):
            yield

    # -- what people do ----------------------------------------------------------------------------------------------

    @rule(side=st.sampled_from(_SIDES), level=st.sampled_from([None, 3, 8, 12]))
    def a_doctor_sets_limits(self, side: Side, level: int | None) -> None:
        self.limits[side] = limits(side, level)

    @rule(side=st.sampled_from(_SIDES), code=st.sampled_from(sorted(KINDS)), stops=st.sampled_from([True, True, False]))
    def a_condition_is_recorded(self, side: Side, code: str, stops: bool) -> None:
        effect = "block" if stops else "warn"
        self.conditions.append((side, SimpleNamespace(code=code, stops_motion=stops, effect=effect)))

    @precondition(lambda self: self.conditions)
    @rule()
    def a_condition_is_resolved(self) -> None:
        self.conditions.pop(0)

    @rule(reachable=st.booleans())
    def the_database(self, reachable: bool) -> None:
        self.reachable = reachable

    @precondition(lambda self: self.mode == "idle")
    @rule(side=st.sampled_from(_SIDES))
    def load(self, side: Side) -> None:
        """The checks of a load refuse a condition that stops motion."""
        if not any(condition.stops_motion for condition in self.of_shoulder(side)):
            patient = PatientRef(id=_PATIENT, name="Sato")
            self.occupation = Occupation("run", patient, session_id=_SESSION, side=side, limits=self.limits[side])
            self.mode = "ready"
            self.start()

    @precondition(lambda self: self.mode in ("ready", "paused"))
    @rule()
    def start(self) -> None:
        """Approach or play is pressed."""
        refused = ""
        with self.replaced():
            try:
                asyncio.run(require_allowed(self, self, self))  # type: ignore[arg-type]
            except ProblemError as problem:
                refused = problem.code
        if refused:
            assert refused in ("contraindicated", "sign_off_needed", "limits_changed")
            assert not self.may_move, refused
            return
        assert self.may_move or not self.is_known
        self.mode = "playing"

    @precondition(lambda self: self.mode == "playing")
    @rule()
    def half_a_second_passes(self) -> None:
        before = len(self.events)

        async def watch() -> None:
            audit_log: Any = mock.Mock()
            async with pausing_playbacks(self, self, self, audit_log):  # type: ignore[arg-type]
                for _ in range(_ROUNDS):
                    await asyncio.sleep(0)

        with self.replaced():
            asyncio.run(watch())
        assert (self.mode == "playing") == (self.may_move or not self.is_known)
        assert self.events[before:] == ([] if self.mode == "playing" else ["contraindication_pause"])

    @precondition(lambda self: self.mode == "paused")
    @rule()
    def return_and_unload(self) -> None:
        self.mode, self.occupation = "idle", None

    # -- what must hold ----------------------------------------------------------------------------------------------

    @property
    def is_known(self) -> bool:
        """True if the service can read the patient's record now."""
        return self.cached or self.reachable

    @property
    def may_move(self) -> bool:
        """True if the loaded motion may start, by the record."""
        assert self.occupation is not None and self.occupation.side is not None
        side = self.occupation.side
        stopping = any(condition.stops_motion for condition in self.of_shoulder(side))
        return not stopping and self.limits[side] == self.occupation.limits

    @invariant()
    def nothing_plays_without_a_recording(self) -> None:
        assert self.mode == "idle" or self.occupation is not None


TestWatched = Watched.TestCase
TestWatched.settings = settings(max_examples=100, stateful_step_count=20, deadline=None)
