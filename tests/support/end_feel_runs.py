"""End-feel runs whose journals are calculated: a shoulder whose capsule is known, and the apparatus' friction and weight."""

from uuid import UUID

import numpy as np

from kata.clinic.episodes.limits import allowed
from kata.clinic.sessions import end_feel, runs
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.end_feel import EndFeelRequest, Kind
from kata.clinic.sessions.tables import EndFeelRow
from kata.database.base import utc_now
from kata.device.config import StationConfig
from kata.device.journal import PHASE_PLAYING, Journal, JournalEnd
from kata.motion.linkage import Floats
from tests.support.imported_runs import STARTED, Clinic

CHOSEN_NM = 2.0
SPEED_DEG_S = 5.0
FRICTION_NM = 0.4
STATION = "Station 1"
ONSET_DEG = 60.0
NM_DEG = 0.2
_COMPLETED = JournalEnd(reason="completed")


def capsule_nm(angle_deg: Floats) -> Floats:
    """Return the torque of a capsule that begins at 60 deg and gains 0.2 Nm in 1 deg."""
    torque: Floats = np.maximum(angle_deg - ONSET_DEG, 0.0) * NM_DEG
    return torque


def begin(clinic: Clinic, recording_id: UUID, kind: Kind, largest_deg: float | None = None) -> UUID:
    """Store an end-feel run as the route does, and return its id."""
    config = StationConfig()
    with clinic.database.write() as session:
        visit = sessions.open_of(session, clinic.patient_id) or sessions.begin(
            session, clinic.patient_id, station=STATION
        )
        request = EndFeelRequest(
            visit.id, recording_id, kind, 25, CHOSEN_NM, SPEED_DEG_S, hold_s=30.0, largest_deg=largest_deg
        )
        taught = runs.taught(session, recording_id)
        today = utc_now().replace(hour=0, minute=0, second=0, microsecond=0)
        limits, farthest_deg = (
            allowed(session, clinic.patient_id, "right"),
            end_feel.farthest_deg(session, request, STATION, today),
        )
        way = end_feel.longest_outward_path(taught, limits, config, request.speed_deg_s, farthest_deg)
        if kind == "stretch":
            way = end_feel.up_to(way, largest_deg)
        prepared = end_feel.prepare(session, request, way, config, today)
        row = runs.begin(session, runs.RunRequest(visit.id, recording_id), STATION)
        end_feel.add(session, row, request, prepared, STATION)
        return row.id


def row_of(clinic: Clinic, run_id: UUID) -> EndFeelRow:
    with clinic.database.read() as session:
        row = session.get_one(EndFeelRow, run_id)
        session.expunge(row)
        return row


def ended(
    clinic: Clinic, run_id: UUID, turns_deg: tuple[float, ...], *, shoulder: bool, bursts_nm: tuple[float, ...] = ()
) -> EndFeelRow:
    """Complete a run from a journal: out from the path's start to each place and back. ``bursts_nm``: what the patient pushes on each way out."""
    row = row_of(clinic, run_id)
    start_deg = 10.0
    pieces, torques = [], []
    for number, turn_deg in enumerate(turns_deg):
        out = np.arange(start_deg, turn_deg, SPEED_DEG_S / 100)
        for way, sign in ((out, 1.0), (out[::-1], -1.0)):
            torque = 1.5 * np.sin(np.radians(way)) + sign * FRICTION_NM
            if shoulder:
                torque = torque + capsule_nm(way)
                if sign > 0 and bursts_nm:
                    torque = torque + bursts_nm[number] * ((way > 40.0) & (way < 50.0))
            pieces.append(way)
            torques.append(torque)
    _complete(clinic, row, np.concatenate(pieces), np.concatenate(torques), start_deg)
    return row_of(clinic, run_id)


def stretched(clinic: Clinic, run_id: UUID, end: JournalEnd) -> EndFeelRow:
    """Complete a stretch from a journal with this end."""
    row = row_of(clinic, run_id)
    _complete(clinic, row, np.linspace(10.0, 60.0, 100), np.zeros(100), 10.0, end)
    return row_of(clinic, run_id)


def _complete(
    clinic: Clinic,
    row: EndFeelRow,
    angle_deg: Floats,
    torque_nm: Floats,
    start_deg: float,
    end: JournalEnd = _COMPLETED,
) -> None:
    count, axis = len(angle_deg), row.motor - 1
    measured = np.zeros((count, 5), dtype=np.float32)
    torque = np.zeros((count, 5), dtype=np.float32)
    measured[:, axis], torque[:, axis] = angle_deg, torque_nm
    journal = Journal(
        kind="run", id=str(row.run_id), recording_id=None, station=STATION, rate_hz=100, started_at=STARTED, started_ns=0,
        t_ns=np.arange(count) * 10_000_000, take=np.zeros(count, dtype=np.uint16), phase=np.full(count, PHASE_PLAYING, dtype=np.uint8),
        path_s=(angle_deg - start_deg) / SPEED_DEG_S, setpoint_deg=measured, measured_deg=measured, torque_nm=torque,
        end=end, truncated=False,
    )  # fmt: skip
    with clinic.database.write() as session:
        assert runs.complete(session, journal, StationConfig())
