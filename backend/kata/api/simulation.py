"""The simulated apparatus and the motions that its simulated hand can follow."""

from contextlib import closing
from pathlib import Path
from typing import Literal
from uuid import uuid4

from pydantic import Field

from kata.api import texts
from kata.errors import ProblemError
from kata.messages import text_of
from kata.motion.axes import CANONICAL_SIDE, Side
from kata.motion.builtin import built_in_motions
from kata.motion.taught import Taught, TaughtError, read_csv
from kata.simulator.hand import HandRefusedError
from kata.simulator.process import SimulatorProcess
from kata.station.schemas import OptionalKey, TextKey
from kata.types import Schema

Source = Literal["built-in", "recorded", "uploaded"]


class HandMotion(Schema):
    """A motion that the simulated hand can follow."""

    id: str
    name: str
    name_key: OptionalKey = None
    source: Source
    duration_s: float = Field(gt=0, description="Seconds.")


class Simulation:
    """The simulator process and the motions of the simulated hand."""

    def __init__(self, process: SimulatorProcess, taught: Path | None) -> None:
        """``taught``: folder of recorded motions (CSV). Files that cannot be read as a motion are skipped."""
        self.process = process
        self._motions: dict[str, tuple[Source, Taught]] = {
            f"built-in-{n}": ("built-in", motion) for n, motion in enumerate(built_in_motions(), start=1)
        }
        for file in sorted(taught.glob("*.csv")) if taught else ():
            try:
                self._motions[f"recorded-{file.stem}"] = ("recorded", read_csv(file))
            except TaughtError:
                continue

    def set_side(self, side: Side) -> None:
        """Turn the simulated apparatus to a side.

        :raises ProblemError: 409 while its motors hold the arm or the simulated hand guides the arm.
        """
        with closing(self.process.client()) as client:
            try:
                client.turn(turned=side != CANONICAL_SIDE)
            except HandRefusedError as error:
                raise hand_refused(error) from error

    def motions(self) -> list[HandMotion]:
        """Return all motions."""
        return [self._motion(key) for key in self._motions]

    def add(self, motion: Taught) -> HandMotion:
        """Add an uploaded motion. It is lost when the service ends."""
        key = f"uploaded-{uuid4()}"
        self._motions[key] = ("uploaded", motion)
        return self._motion(key)

    def get(self, key: str) -> Taught:
        """Return one motion.

        :raises ProblemError: 404.
        """
        if key not in self._motions:
            raise ProblemError(404, "not_found", texts.MOTION_NOT_FOUND(), texts.CHOOSE_FROM_LIST())
        return self._motions[key][1]

    def _motion(self, key: str) -> HandMotion:
        source, taught = self._motions[key]
        return HandMotion(
            id=key,
            name=taught.name,
            name_key=TextKey.of(taught.name),
            source=source,
            duration_s=taught.duration_s,
        )


def hand_refused(error: HandRefusedError) -> ProblemError:
    """Return the error answer for a request that the simulated hand refuses."""
    return ProblemError(409, "hand_refused", texts.SENTENCE(clause=text_of(error)), texts.HAND_WAIT())
