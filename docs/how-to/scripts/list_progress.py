"""List the SPADI scores and sessions of every patient: list_progress.py URL TOKEN_FILE."""

import sys
from pathlib import Path

from kata.client import Kata, Patient


def spadi(kata: Kata, patient: Patient) -> str:
    """Return the first and the last SPADI score of the open episode: 0 is best, 100 worst."""
    scores = [
        one.spadi_score.total
        for one in kata.assessments(patient.id)
        if one.episode_id == patient.episode_id and one.withdrawn_at is None and one.spadi_score
    ]
    # The newest assessment comes first.
    known = [score for score in scores if score is not None]
    return f"SPADI {known[-1]:.0f} to {known[0]:.0f}" if known else "no SPADI"


def main(url: str, token_file: str) -> None:
    """Print one line for each patient with an open episode."""
    with Kata(url, Path(token_file).read_text().strip()) as kata:
        for patient in kata.patients():
            if patient.episode_id is None:
                continue
            sessions = list(kata.patient_sessions(patient.id))
            marked = " (simulated)" if any(session.simulated for session in sessions) else ""
            print(f"{patient.clinic_number}: {spadi(kata, patient)}, sessions: {len(sessions)}{marked}")


if __name__ == "__main__":
    main(*sys.argv[1:])
