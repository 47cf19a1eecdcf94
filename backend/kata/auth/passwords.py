"""Hash and check passwords (argon2id), and refuse common passwords. One password is hashed at a time, never in the event loop.

``common_passwords.txt.gz`` contains the 39,774 passwords of at least four characters of two lists: Django's (BSD-3-Clause, compiled by Royce
Williams) and zxcvbn's (MIT, Dan Wheeler).
"""

import gzip
import re
from base64 import b64encode
from functools import cached_property
from importlib.resources import files
from secrets import token_bytes
from threading import BoundedSemaphore, Lock
from typing import Final

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError
from argon2.low_level import ARGON2_VERSION

from kata.auth import texts
from kata.errors import ProblemError

SHORTEST: Final = 10
_SERVICE_WORDS: Final = ("kata", "shoulder", "clinic", "therapist", "administrator")
"""Words that an attacker of this service tries first."""
_PADDING: Final = "0123456789!?.,-_*#$@+ "
"""Characters that people add to a word to make it a password."""
_REPEATED: Final = re.compile(r"(.{1,4})\1+")
_KEYBOARD_ROWS: Final = ("abcdefghijklmnopqrstuvwxyz", "01234567890", "qwertyuiop", "asdfghjkl", "zxcvbnm")
_MAX_WAITING: Final = 8
"""Maximum number of waiting requests. Each waits at most 0.5 s. Further requests are refused."""


def hasher() -> PasswordHasher:
    """Return a hasher with one of the settings that OWASP's Password Storage Cheat Sheet recommends: 46 MiB, one pass, one lane.

    One lane uses one core. The other core may be running the control loop.
    """
    return PasswordHasher(time_cost=1, memory_cost=47_104, parallelism=1)


class Passwords:
    """Creates and checks hashes of passwords. Each takes about 50 ms: call the methods from a worker thread."""

    def __init__(self, hasher: PasswordHasher) -> None:
        self._hasher = hasher
        self._lock = Lock()
        self._waiting = BoundedSemaphore(_MAX_WAITING)
        self._dummy_hash = _hash_of_no_password(hasher)

    @cached_property
    def _common(self) -> frozenset[str]:
        """The common passwords. They are read when a user chooses a password, because they take 5 MB."""
        packed = files("kata.auth").joinpath("common_passwords.txt.gz").read_bytes()
        return frozenset(gzip.decompress(packed).decode().split())

    def check_choice(self, password: str, *names: str) -> None:
        """Check that a new password is long enough, not common, and not derived from the user's ``names``.

        :raises ProblemError: 422 ``weak_password``.
        """
        reason = ""
        if len(password) < SHORTEST:
            reason = texts.PASSWORD_TOO_SHORT(characters=SHORTEST)
        elif self._is_common(password, names):
            reason = texts.PASSWORD_COMMON()
        if reason:
            raise ProblemError(
                422,
                "weak_password",
                texts.WEAK_PASSWORD(reason=reason),
                texts.CHOOSE_ANOTHER_PASSWORD(),
                [("#/password", reason)],
            )

    def _is_common(self, password: str, names: tuple[str, ...]) -> bool:
        lower = password.lower()
        core = lower.strip(_PADDING)
        guessable_words = {word for text in (*names, *_SERVICE_WORDS) for word in text.lower().split() if len(word) > 2}
        remainder = lower
        for word in sorted(guessable_words, key=len, reverse=True):
            remainder = remainder.replace(word, "")
        return (
            lower in self._common
            or core in self._common
            or len(remainder.strip(_PADDING)) < 4
            or _REPEATED.fullmatch(lower) is not None
            or any(lower in row or lower in row[::-1] for row in _KEYBOARD_ROWS)
        )

    def hash(self, password: str) -> str:
        """Return the hash of a password.

        :raises ProblemError: 429 when too many requests wait.
        """
        with self._turn():
            return self._hasher.hash(password)

    def verify(self, stored_hash: str | None, password: str) -> bool:
        """Return whether the password has this hash. Without a hash, return False after the same time as with one.

        :raises ProblemError: 429 when too many requests wait.
        """
        with self._turn():
            try:
                self._hasher.verify(stored_hash or self._dummy_hash, password)
                return stored_hash is not None
            except (VerificationError, InvalidHashError):
                return False

    def is_outdated(self, stored_hash: str) -> bool:
        """Return whether a hash was made with other settings than the present ones."""
        return self._hasher.check_needs_rehash(stored_hash)

    def _turn(self) -> "_HashingTurn":
        return _HashingTurn(self._lock, self._waiting)


def _hash_of_no_password(hasher: PasswordHasher) -> str:
    """Return a hash that takes as long to check as others and that no password has: its digest is random."""
    salt, digest = (b64encode(token_bytes(size)).decode().rstrip("=") for size in (hasher.salt_len, hasher.hash_len))
    costs = f"m={hasher.memory_cost},t={hasher.time_cost},p={hasher.parallelism}"
    return f"$argon2id$v={ARGON2_VERSION}${costs}${salt}${digest}"


class _HashingTurn:
    """Context that lets one thread hash at a time. It waits for the previous thread, and limits the number of waiting threads."""

    def __init__(self, lock: Lock, waiting: BoundedSemaphore) -> None:
        self._lock = lock
        self._waiting = waiting

    def __enter__(self) -> None:
        if not self._waiting.acquire(blocking=False):
            raise ProblemError(429, "too_many_tries", texts.SIGN_IN_CROWDED(), texts.TRY_AGAIN_IN_A_MOMENT())
        self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        self._lock.release()
        self._waiting.release()
