"""Passwords: argon2id, one at a time, never in the event loop; and none that everybody tries first.

``common_passwords.txt.gz`` are the 39,774 of four characters or more out of two lists: Django's (BSD-3-Clause, compiled by Royce
Williams) and zxcvbn's (MIT, Dan Wheeler).
"""

import gzip
import re
from importlib.resources import files
from threading import BoundedSemaphore, Lock
from typing import Final

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

from kata.auth import secrets, texts
from kata.errors import ProblemError

SHORTEST: Final = 10
_OURS: Final = ("kata", "shoulder", "clinic", "therapist", "administrator")
"""What a guesser tries first here."""
_TRIMMINGS: Final = "0123456789!?.,-_*#$@+ "
"""What people put around a word to make a password of it."""
_REPEATED: Final = re.compile(r"(.{1,4})\1+")
_ROWS: Final = ("abcdefghijklmnopqrstuvwxyz", "01234567890", "qwertyuiop", "asdfghjkl", "zxcvbnm")
_WAITING: Final = 8
"""So many may wait for their turn, half a second at most; a ninth is told to come back."""


def hasher() -> PasswordHasher:
    """One of the settings that OWASP's Password Storage Cheat Sheet calls equally strong: 46 MiB, one pass, one lane.

    One lane, because there is one core to spare where the other one moves an arm.
    """
    return PasswordHasher(time_cost=1, memory_cost=47_104, parallelism=1)


class Passwords:
    """Makes and checks hashes of passwords. Blocks for some 50 ms: call it from a worker thread."""

    def __init__(self, made_by: PasswordHasher) -> None:
        self._hasher = made_by
        self._one = Lock()
        self._waiting = BoundedSemaphore(_WAITING)
        self._nobodys = made_by.hash(secrets.fresh())
        packed = files("kata.auth").joinpath("common_passwords.txt.gz").read_bytes()
        self._common = frozenset(gzip.decompress(packed).decode().split())

    def check_choice(self, password: str, *about: str) -> None:
        """Whether somebody may choose it: long enough, not common, not made of what is known of them (``about``).

        :raises ProblemError: 422 ``weak_password``.
        """
        told = ""
        if len(password) < SHORTEST:
            told = texts.PASSWORD_TOO_SHORT(characters=SHORTEST)
        elif self._is_common(password, about):
            told = texts.PASSWORD_COMMON()
        if told:
            raise ProblemError(
                422,
                "weak_password",
                texts.WEAK_PASSWORD(reason=told),
                texts.CHOOSE_ANOTHER_PASSWORD(),
                [("#/password", told)],
            )

    def _is_common(self, password: str, about: tuple[str, ...]) -> bool:
        lower = password.lower()
        core = lower.strip(_TRIMMINGS)
        known = {word for told in (*about, *_OURS) for word in told.lower().split() if len(word) > 2}
        left = lower
        for word in sorted(known, key=len, reverse=True):
            left = left.replace(word, "")
        return (
            lower in self._common
            or core in self._common
            or len(left.strip(_TRIMMINGS)) < 4
            or _REPEATED.fullmatch(lower) is not None
            or any(lower in row or lower in row[::-1] for row in _ROWS)
        )

    def hash(self, password: str) -> str:
        """What is kept of a password.

        :raises ProblemError: 429 when too many wait already.
        """
        with self._turn():
            return self._hasher.hash(password)

    def fits(self, kept: str | None, given: str) -> bool:
        """Whether this is the password; without a kept one it takes as long, and it is not.

        :raises ProblemError: 429 when too many wait already.
        """
        with self._turn():
            try:
                self._hasher.verify(kept or self._nobodys, given)
                return kept is not None
            except (VerificationError, InvalidHashError):
                return False

    def is_outdated(self, kept: str) -> bool:
        """Whether it was made with other settings than today's."""
        return self._hasher.check_needs_rehash(kept)

    def _turn(self) -> "_Turn":
        return _Turn(self._one, self._waiting)


class _Turn:
    """Waits, with few others, until nobody else is at it."""

    def __init__(self, one: Lock, waiting: BoundedSemaphore) -> None:
        self._one = one
        self._waiting = waiting

    def __enter__(self) -> None:
        if not self._waiting.acquire(blocking=False):
            raise ProblemError(429, "too_many_tries", texts.SIGN_IN_CROWDED(), texts.TRY_AGAIN_IN_A_MOMENT())
        self._one.acquire()

    def __exit__(self, *_: object) -> None:
        self._one.release()
        self._waiting.release()
