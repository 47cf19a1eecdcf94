"""How much of a run was played, counted once, when its journal is imported: later nobody loads samples for that."""

from typing import Final

import numpy as np
from sqlalchemy.orm import Session

from kata.clinic.recordings import service as recordings
from kata.clinic.sessions.tables import RunRow
from kata.device.journal import PHASE_LESSENED, PHASE_PLAYING, PHASE_REVERSING, Journal
from kata.motion.edit import Asked, Motion
from kata.motion.repetitions import pace

_FORWARD: Final = (PHASE_PLAYING, PHASE_LESSENED)
"""With less range it is a repetition all the same."""
_ON_THE_PATH: Final = (*_FORWARD, PHASE_REVERSING)


def keep(session: Session, row: RunRow, journal: Journal) -> None:
    """Repetitions played to their end, and seconds on the path, of a run that has ended."""
    row.played_s = float(np.isin(journal.phase, _ON_THE_PATH).sum()) / journal.rate_hz
    reached_s = journal.path_s[np.isin(journal.phase, _FORWARD)]
    if row.outcome == "completed":
        row.repetitions_done = row.repetitions
    elif len(reached_s) == 0:
        row.repetitions_done = 0
    else:
        taught = recordings.samples(session, row.recording_id)
        asked = Asked(row.speed_percent, row.repetitions, row.pause_s, row.range_percent)
        found = pace(Motion(taught.times_s, taught.angles_deg), asked)
        # The last sample of a repetition lies up to one sample before its end, and is not exactly punctual.
        row.repetitions_done = found.done(float(reached_s.max()) + 1.5 / journal.rate_hz)
