"""Tracks the device's newest snapshot and adds data of the service: patient, recording, times on the wall clock."""

import logging
import time
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any, Final
from uuid import UUID

import msgspec

from kata.device.ipc_messages import COMMAND_NAMES, Event, Refusal, Snapshot
from kata.motion.axes import Side
from kata.station.live_end_range import LiveEndRange
from kata.station.live_rhythm import LiveRhythm
from kata.station.schemas import PatientRef, TextKey

log = logging.getLogger(__name__)

_STILL_STOPPING: Final = "still_stopping"
"""Code of the device's refusal to acknowledge while the arm slows down."""
_TORQUE_OFF_NS: Final = 500_000_000
"""Drives report torque off within some cycles. For this time after a stop its ``arm_held`` stays False."""

_ON_PATH: Final = frozenset({"playing", "paused"})
"""Modes in which the remaining time is that of the path. In the others it is that of approach or return, which do not depend on the patient."""


@dataclass(frozen=True)
class Occupation:
    """The patient and recording of a run or teaching. The service knows them, the device does not."""

    id: str
    """Id of the teaching or the run."""
    patient: PatientRef
    recording_name: str | None = None
    session_id: UUID | None = None
    changes: tuple[str, ...] = ()
    """Changes of the recording for this run."""
    end_range: LiveEndRange | None = None
    """None if no end-range time is prescribed for this run."""
    side: Side | None = None
    """The shoulder that a run moves; None for a teaching."""
    limits: object = None
    """The doctor's limits with which a run was checked; None for a teaching. The station only stores them."""
    duration_known: bool = True
    """False for a run whose length depends on the patient: an end-feel test, a stretch, and a self-paced run."""


class SnapshotTracker:
    """Tracks the snapshots of one device process after another."""

    def __init__(self) -> None:
        self.snapshot: Snapshot | None = None
        """The newest snapshot of the running device process, None before its first."""
        self.occupation: Occupation | None = None
        """The last run or teaching that began. It may have ended since; the live state shows that."""
        self.verified_since: datetime | None = None
        self.has_run = False
        """True if a device process has sent a snapshot since the service started, or since another program gave the drives back."""
        self._rhythm = LiveRhythm()
        self._received_at_s = 0.0
        self._torque_since_ns: int | None = None
        """Device time since which torque has remained on although a stop has ended."""
        self._reversal: Event | None = None
        """The last reversal of the present run."""

    @property
    def age_ms(self) -> float | None:
        """Return the age of the newest snapshot, None without one."""
        return None if self.snapshot is None else (time.monotonic() - self._received_at_s) * 1000

    def take(self, snapshot: Snapshot, side: Side) -> None:
        """Store a snapshot that has just arrived. ``side``: the shoulder to which the apparatus is set."""
        self._note_verification(snapshot)
        self._note_torque(snapshot)
        self.snapshot = snapshot
        self.has_run = True
        self._received_at_s = time.monotonic()
        try:
            if (live := self._end_range(snapshot)) is not None:
                live.take(snapshot)
            self._rhythm.take(snapshot, side)
        except Exception:
            # These figures are for the page only. An error must not end the device process, which moves the arm.
            log.exception("figures of the live state could not be calculated")

    def note_reversal(self, event: Event) -> None:
        """Remember the text of a reversal."""
        self._reversal = event

    def begin(self, occupation: Occupation) -> None:
        """Store the run or teaching that has begun."""
        self.occupation = occupation
        self._reversal = None

    def clear(self) -> None:
        """Discard snapshot and occupation, because the device process has ended."""
        self.snapshot = None
        self.occupation = None

    def known_fields(self, snapshot: Snapshot) -> dict[str, Any]:
        """Return the fields of the live state that come from a snapshot."""
        state: dict[str, Any] = msgspec.to_builtins(snapshot)
        state["run"] = self._with_occupation(state["run"], "run_id")
        state["teaching"] = self._with_occupation(state["teaching"], "teaching_id")
        if snapshot.run:
            reversal = self._reversal if snapshot.run.reversals else None
            state["run"]["resistance"] = reversal and reversal.message
            state["run"]["resistance_key"] = reversal and msgspec.to_builtins(reversal.message_key)
            end_range = self._end_range(snapshot)
            state["run"]["end_range"] = end_range and end_range.live()
            if snapshot.mode in _ON_PATH and not self._duration_known(snapshot.run.run_id):
                state["run"]["left_s"] = None
        state["rhythm"] = self._rhythm.live()
        state["verified_since"] = self.verified_since
        if snapshot.stop:
            state["stop"]["arm_held"] = self._may_hold(snapshot)
        return state

    def unknown_fields(self, offline: Refusal) -> dict[str, Any]:
        """Return the same fields for a station without a device process. ``offline``: the refusal of all commands except Stop."""
        refusal = msgspec.to_builtins(offline)
        axes = self.snapshot.axes if self.snapshot else ()
        return {
            "mode": "offline",
            "torque": "unknown",
            "stops": 0,
            "verified_since": None,
            "estop": "unknown",
            "pedal": "unknown",
            "axes": [msgspec.to_builtins(axis) | {"torque": "unknown"} for axis in axes],
            "stop": None,
            "run": None,
            "teaching": None,
            "refusals": {name: refusal for name in COMMAND_NAMES if name != "stop"},
            "loop": None,
            "warnings": (),
        }

    def _end_range(self, snapshot: Snapshot) -> LiveEndRange | None:
        """Return the counter of the snapshot's run, or None."""
        occupation = self.occupation
        return occupation.end_range if occupation and snapshot.run and snapshot.run.run_id == occupation.id else None

    def _note_verification(self, snapshot: Snapshot) -> None:
        """Convert the device's monotonic time to the wall clock once for each change, because stored events use the wall clock."""
        since_ns = snapshot.verified_since_ns
        if since_ns is None:
            self.verified_since = None
        elif self.snapshot is None or self.snapshot.verified_since_ns != since_ns:
            ago = timedelta(microseconds=(time.monotonic_ns() - since_ns) / 1000)
            self.verified_since = datetime.now(UTC) - ago

    def _note_torque(self, snapshot: Snapshot) -> None:
        acknowledging = snapshot.refusals.get("acknowledge")
        slowing_down = acknowledging is not None and acknowledging.code == _STILL_STOPPING
        if snapshot.stop is None or snapshot.torque == "off" or slowing_down:
            self._torque_since_ns = None
        elif self._torque_since_ns is None:
            self._torque_since_ns = snapshot.t_ns

    def _duration_known(self, run_id: str) -> bool:
        """Return False if the run is known to last as long as the patient makes it last."""
        return not self.occupation or self.occupation.id != run_id or self.occupation.duration_known

    def _with_occupation(self, state: dict[str, Any] | None, key: str) -> dict[str, Any] | None:
        if state is None:
            return None
        occupation = self.occupation if self.occupation and self.occupation.id == state[key] else None
        return state | {
            "patient": occupation.patient if occupation else None,
            "recording_name": occupation.recording_name if occupation else None,
            "changes": occupation.changes if occupation else (),
            "changes_keys": [TextKey.of(change) for change in occupation.changes] if occupation else [],
            "session_id": occupation.session_id if occupation else None,
        }

    def _may_hold(self, snapshot: Snapshot) -> bool:
        """Return True if the motors hold the arm after a stop, or may hold it.

        A stop of category 2 holds the arm from its beginning. The other stops end with torque off. After such a stop the arm counts as held
        if torque is unknown, or still on, after the arm has slowed down.
        """
        if snapshot.stop is None or snapshot.torque == "off":
            return False
        if all(cause.category == 2 for cause in snapshot.stop.causes):
            return True
        since_ns = self._torque_since_ns
        return since_ns is not None and (snapshot.torque == "unknown" or snapshot.t_ns - since_ns >= _TORQUE_OFF_NS)
