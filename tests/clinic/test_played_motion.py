"""The played motion that the session's page shows in 3-D."""

import numpy as np
import pytest
from sqlalchemy import select, update

from kata.clinic.sessions import played_motion
from kata.clinic.sessions.tables import RUN_COLUMNS, RUN_SAMPLES, RunRow, RunSampleBlockRow, RunSamplesRow
from kata.database.engine import Database
from kata.database.series import pack
from kata.device.journal import PHASE_APPROACHING, PHASE_PAUSED, PHASE_PLAYING, PHASE_REVERSING
from kata.errors import ProblemError
from tests.support.treatment import treat

TIMES_S = np.arange(0.0, 12.0, 0.01)
PHASES = np.repeat(
    [PHASE_APPROACHING, PHASE_PLAYING, PHASE_REVERSING, PHASE_PAUSED, PHASE_REVERSING, PHASE_PLAYING], 200
).astype(np.uint8)
MEASURED = np.stack([np.sin(TIMES_S) * (axis + 1) for axis in range(5)], axis=-1)


def test_played_motion_is_what_was_measured_with_each_reversal_once(database: Database) -> None:
    with database.write() as session:
        treat(session)
        row = session.scalars(select(RunRow)).first()
        assert row is not None
        session.query(RunSampleBlockRow).filter_by(run_id=row.id).delete()
        session.query(RunSamplesRow).filter_by(run_id=row.id).delete()
        session.flush()
        session.expunge_all()
        columns = {
            "time_s": TIMES_S,
            "phase": PHASES,
            "path_s": TIMES_S,
            "setpoint_deg": MEASURED + 1.0,
            "measured_deg": MEASURED,
            "torque_nm": np.zeros_like(MEASURED),
        }
        RUN_SAMPLES.store(session, row.id, pack(columns, RUN_COLUMNS), None)
        run_id = row.id
    with database.read() as session:
        played = played_motion.of_run(session, session.get_one(RunRow, run_id))
    assert played.times_s[0] == 0.0
    assert played.times_s[-1] == pytest.approx(TIMES_S[-1], abs=1e-3)
    assert np.diff(played.times_s).max() <= 0.051
    expected = np.stack([np.sin(played.times_s) * (axis + 1) for axis in range(5)], axis=-1)
    np.testing.assert_allclose(played.measured_deg, expected, atol=0.02)
    np.testing.assert_allclose(np.array(played.setpoint_deg) - played.measured_deg, 1.0, atol=0.02)
    assert played.reversals_s == [4.0]


def test_run_without_samples_and_damaged_samples_are_problems(database: Database) -> None:
    with database.write() as session:
        treat(session)
        first, second, *_ = session.scalars(select(RunRow)).all()
        session.query(RunSampleBlockRow).filter_by(run_id=first.id).delete()
        session.query(RunSamplesRow).filter_by(run_id=first.id).delete()
        session.execute(update(RunSamplesRow).where(RunSamplesRow.run_id == second.id).values(data=b"damaged"))
        ids = first.id, second.id
    with database.read() as session:
        found = []
        for run_id in ids:
            with pytest.raises(ProblemError) as caught:
                played_motion.of_run(session, session.get_one(RunRow, run_id))
            found.append((caught.value.status, caught.value.code))
    assert found == [(409, "nothing_played"), (410, "unreadable_samples")]
