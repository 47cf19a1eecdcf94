"""Motions as CSV files."""

import os
from pathlib import Path

from kata.motion.axes import POSE_COLUMNS
from kata.motion.taught import Taught


def recorded_motions() -> list[Path]:
    """Return the CSV files in the folder KATA_TAUGHT; none if it is not set."""
    folder = os.environ.get("KATA_TAUGHT")
    return sorted(Path(folder).glob("*.csv")) if folder else []


def write_csv(motion: Taught, path: Path) -> Path:
    rows = [",".join(("time_s", *POSE_COLUMNS))]
    for time_s, pose in zip(motion.times_s, motion.poses_deg, strict=True):
        rows.append(",".join(f"{value:.4f}" for value in (time_s, *pose)))
    path.write_text("\n".join(rows) + "\n")
    return path
