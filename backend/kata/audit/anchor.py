"""The anchor: an append-only file outside the database. Each line contains the head of the chain at one time.

A person who can change the database can compute a new chain or remove its end. The anchor reveals both. Each row also contains the number
of anchor lines at that time, which reveals lines that are missing from the anchor's end.
"""

import json
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

from kata.audit.chain import Head


class AnchorError(Exception):
    """The anchor cannot be written. The message says why."""


@dataclass(frozen=True, slots=True)
class AnchorLine:
    """One line of an anchor."""

    line: int
    """Number of the line, from 1 without gaps."""
    anchor: str
    """Id of the anchor. All its lines have the same id."""
    head: Head


def read(path: Path) -> list[AnchorLine]:
    """Return every readable line. A line that a power cut has damaged is left out, so its number is missing.

    :raises OSError: when the file does not exist.
    """
    lines = []
    for encoded in path.read_bytes().splitlines():
        with suppress(ValueError, KeyError, TypeError):
            fields = json.loads(encoded)
            head = Head(int(fields["number"]), bytes.fromhex(fields["hash"]))
            lines.append(AnchorLine(int(fields["line"]), str(fields["anchor"]), head))
    return lines


def encode(line: AnchorLine) -> bytes:
    """Return a line in the form that the file contains."""
    fields = {"line": line.line, "anchor": line.anchor, "number": line.head.number, "hash": line.head.hash.hex()}
    return json.dumps(fields).encode() + b"\n"


class Anchor:
    """The anchor file, opened for appending. Only one process may open it at a time, and only one thread may use it."""

    def __init__(self, path: Path) -> None:
        """:raises AnchorError: when the file cannot be opened."""
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
        """Return the number of synced lines."""
        return self.last.line if self.last else 0

    def add(self, head: Head) -> None:
        """Append and sync a line with the head of the chain.

        :raises OSError: when the disk refuses the write.
        """
        line = AnchorLine(self.lines + 1, self.id, head)
        os.write(self._file, encode(line))
        os.fsync(self._file)
        self.last = line

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)
