"""Checking a password takes as long without an account as with one."""

from typing import Literal

import pytest
from argon2 import PasswordHasher
from argon2.exceptions import VerifyMismatchError

from kata.auth.passwords import Passwords


class RecordingHasher(PasswordHasher):
    """Stores every hash that it checks."""

    def __init__(self) -> None:
        super().__init__(time_cost=1, memory_cost=64, parallelism=1)
        self.checked: list[str] = []

    def verify(self, hash: str | bytes, password: str | bytes) -> Literal[True]:  # noqa: A002 - argon2's name
        self.checked.append(str(hash))
        return super().verify(hash, password)


def test_unknown_name_costs_a_whole_check() -> None:
    hasher = RecordingHasher()
    assert not Passwords(hasher).verify(None, "unknown")
    (hashed,) = hasher.checked
    assert not hasher.check_needs_rehash(hashed)
    # The hash is read and computed. An invalid hash would be refused at once.
    with pytest.raises(VerifyMismatchError):
        hasher.verify(hashed, "unknown")


def test_every_service_has_another_unknown_hash() -> None:
    hasher = RecordingHasher()
    for passwords in (Passwords(hasher), Passwords(hasher)):
        passwords.verify(None, "unknown")
    assert len(set(hasher.checked)) == 2
