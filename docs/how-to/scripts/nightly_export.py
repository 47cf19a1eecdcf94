"""Export the records of all patients who had a session on the last day: nightly_export.py URL TOKEN_FILE FOLDER."""

import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

from kata.client import Kata, KataError


def main(url: str, token_file: str, folder: str) -> int:
    """Save one ZIP file for each patient, and return how many could not be saved."""
    failed = 0
    # An hour more than a day: a night's run may begin late.
    since = datetime.now(UTC) - timedelta(hours=25)
    with Kata(url, Path(token_file).read_text().strip()) as kata:
        for patient in {session.patient.id: session.patient for session in kata.sessions(since)}.values():
            try:
                kata.save_export(patient.id, Path(folder) / f"{patient.clinic_number}.zip")
            except KataError as error:
                failed += 1
                print(f"{patient.clinic_number}: {error}", file=sys.stderr)
    return failed


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]) > 0)
