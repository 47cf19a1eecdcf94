"""Defines the evaluated cases: the paper's fourteen, or every motion of a folder on both sides."""

from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from typing import Final, get_args

import numpy as np

from kata.motion.axes import AXES, BASIC_MOTIONS, POSE_RANGE_DEG, Side
from kata.motion.builtin import built_in_motions
from kata.motion.taught import Taught, TaughtError, read_csv
from kata.simulator.independent.patients import PATIENTS, PatientName

REPOSITIONING_ERROR_DEG: Final = 3.0
"""Largest error of a person who moves an arm back into a posture without a goniometer. The paper excludes the start if its
errors are 4 deg or more.
"""
MARGIN_DEG: Final = 5.0
"""Distance to the patient's peaks (assumed). The external rotation of a frozen shoulder ends at 4.5 deg, so that almost no
movement remains.
"""
_HOLD_S: Final = 0.5


@dataclass(frozen=True)
class Case:
    """One motion on one shoulder."""

    name: str
    side: Side
    motion: Taught
    motors: tuple[int, ...]
    """The motors that the paper's figure shows."""
    number: int | None = None
    """Number of the paper's motion: 1 to 6, and 7 for the arbitrary motion."""

    def for_patient(self, name: PatientName) -> "Case":
        """Return the case with the shoulder's angles scaled so that they end :data:`MARGIN_DEG` before the patient's peaks.

        This is necessary because a therapist does not guide a frozen shoulder through a healthy range.
        """
        poses = self.motion.poses_deg.copy()
        for n, (low, high) in enumerate(PATIENTS[name].peaks_deg, start=2):
            column = poses[:, n]
            poses[:, n] = np.where(
                column > 0,
                column * min(1.0, (high - MARGIN_DEG) / max(column.max(), 1.0)),
                column * min(1.0, (low + MARGIN_DEG) / min(column.min(), -1.0)),
            )
        return replace(self, motion=Taught(self.motion.name, self.motion.times_s, poses))

    def repositioning(self, seed: int | None, repetition: int) -> Taught:
        """Return the motion that moves the arm back near the start before a playback. Its error differs for each repetition."""
        random_source = Random(f"{self.name}, {self.side}, {seed}, {repetition}")
        pose = [
            min(max(angle + random_source.uniform(-REPOSITIONING_ERROR_DEG, REPOSITIONING_ERROR_DEG), low), high)
            for angle, (low, high) in zip(self.motion.poses_deg[0], POSE_RANGE_DEG, strict=True)
        ]
        return Taught("put back", np.array([0.0, _HOLD_S]), np.array([pose, pose]))


def paper_cases() -> list[Case]:
    """Return the six basic motions and the arbitrary one (Sections 4.2 to 4.8), left and right."""
    motors_of_cases = [motion.motors for motion in BASIC_MOTIONS] + [AXES]
    pairs = list(zip(built_in_motions(), motors_of_cases, strict=True))
    return [
        Case(motion.name, side, motion, motors, number)
        for number, (motion, motors) in enumerate(pairs, start=1)
        for side in get_args(Side)
    ]


def recorded_cases(folder: Path) -> list[Case]:
    """Return a case for every CSV file of a folder, left and right. All five motors are evaluated.

    :raises TaughtError: when a file cannot be used or the folder has none.
    """
    motions = [read_csv(path) for path in sorted(folder.glob("*.csv"))]
    if not motions:
        raise TaughtError(f"{folder} holds no CSV files")
    return [Case(motion.name, side, motion, AXES) for motion in motions for side in get_args(Side)]
