"""The anchor: a file outside the database that is only added to, a line for where the chain ended at a moment.

Who can change the database can work out a whole chain anew, or cut its end off; what the anchor says of it shows that. Each
row, in turn, says how many lines the anchor was known to hold, so that lines which are missing from its end show as well.
"""

import json
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

from kata.audit.chain import Head


class AnchorError(Exception):
    """The anchor cannot be written; the message says why."""


@dataclass(frozen=True, slots=True)
class Line:
    """What the anchor says."""

    line: int
    """From 1, without gaps."""
    anchor: str
    """Which anchor this is: the same in all of its lines."""
    head: Head


def read(path: Path) -> list[Line]:
    """Every line that can be read; one that a power cut has torn is left out, and its number is missing then.

    :raises OSError: when there is no such file.
    """
    lines = []
    for written in path.read_bytes().splitlines():
        with suppress(ValueError, KeyError, TypeError):
            told = json.loads(written)
            lines.append(
                Line(
                    int(told["line"]),
                    str(told["anchor"]),
                    Head(int(told["number"]), bytes.fromhex(told["hash"])),
                )
            )
    return lines


class Anchor:
    """The file, open to be added to. One process has it at a time, and one thread uses it."""

    def __init__(self, path: Path) -> None:
        """:raises AnchorError: when it cannot be opened."""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
            self.last = max(read(path), key=lambda line: line.line, default=None)
            if path.stat().st_size and not path.read_bytes().endswith(b"\n"):
                os.write(self._file, b"\n")
        except OSError as error:
            raise AnchorError(f"the audit trail's anchor {path} cannot be opened: {error.strerror}") from error
        self.id = self.last.anchor if self.last else uuid4().hex

    @property
    def lines(self) -> int:
        """How many it holds for certain, through a power cut too."""
        return self.last.line if self.last else 0

    def add(self, head: Head) -> None:
        """A line for where the chain ends; waits for the disk.

        :raises OSError: when the disk does not take it.
        """
        line = Line(self.lines + 1, self.id, head)
        told = {"line": line.line, "anchor": line.anchor, "number": head.number, "hash": head.hash.hex()}
        os.write(self._file, json.dumps(told).encode() + b"\n")
        os.fsync(self._file)
        self.last = line

    def close(self) -> None:
        """Let go of the file."""
        os.close(self._file)
