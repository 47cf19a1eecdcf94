"""Cache recently authenticated users, so that they can stop the apparatus without a database query."""

import asyncio
import time
from collections import OrderedDict
from collections.abc import Collection
from typing import TYPE_CHECKING, Final
from uuid import UUID

from kata.actor import Actor
from kata.auth import secrets

if TYPE_CHECKING:
    from kata.auth.login import Me


class AuthCache:
    """Recently authenticated users and their last activity, by the hash of their cookie.

    A cached user may stop the apparatus without waiting for the database, and continue a running session while it is unavailable. While
    it answers, ended login sessions leave the cache within half a second, whichever service on the database ended them
    (:class:`kata.auth.login.SessionRevocations`).
    """

    _MOST: Final = 1000
    _STOPS_FOR_S: Final = 3600.0
    _SEEN_EVERY_S: Final = 30.0

    def __init__(self) -> None:
        self._actors: OrderedDict[str, tuple[Actor, float]] = OrderedDict()
        self._seen_s: dict[str, float] = {}
        self._told: dict[str, Me] = {}
        self._keys: dict[UUID, str] = {}
        """Key of each login session: a reauthentication replaces its cookie."""
        self.writing: set[asyncio.Task[None]] = set()
        """Running writes of user activity. No command waits for them."""

    def put(self, cookie: str, actor: Actor) -> None:
        """Cache a user who has just been authenticated."""
        key = secrets.hashed(cookie)
        if (before := self._keys.get(actor.login_session_id, key)) != key:
            self._drop(before)
        self._actors[key], self._keys[actor.login_session_id] = (actor, time.monotonic()), key
        self._actors.move_to_end(key)
        while len(self._actors) > self._MOST:
            self._drop(next(iter(self._actors)))

    def forget(self, cookie: str) -> None:
        """Remove a cookie."""
        self._drop(secrets.hashed(cookie))

    def forget_account(self, account_id: UUID) -> None:
        """Remove an account whose rights have changed or that is disabled, on all its browsers."""
        for key in [key for key, (actor, _) in list(self._actors.items()) if actor.account_id == account_id]:
            self._drop(key)

    def login_sessions(self) -> set[UUID]:
        """Return the cached login sessions."""
        return {actor.login_session_id for actor, _ in list(self._actors.values())}

    def forget_login_sessions(self, ended: Collection[UUID]) -> None:
        """Remove login sessions that have ended."""
        for key in [key for key, (actor, _) in list(self._actors.items()) if actor.login_session_id in ended]:
            self._drop(key)

    def _drop(self, key: str) -> None:
        actor, _ = self._actors.pop(key, (None, 0.0))
        if actor and self._keys.get(actor.login_session_id) == key:
            self._keys.pop(actor.login_session_id, None)
        self._seen_s.pop(key, None)
        self._told.pop(key, None)

    def tell(self, cookie: str, told: "Me") -> None:
        """Cache the answer about the signed-in user."""
        self._told[secrets.hashed(cookie)] = told

    def told(self, cookie: str) -> "Me | None":
        """Return the cached answer about the signed-in user."""
        return self._told.get(secrets.hashed(cookie))

    def who_was_here(self, cookie: str, longest_s: float) -> Actor | None:
        """Return the cookie's user as last confirmed by the database, at most ``longest_s`` seconds ago."""
        actor, at_s = self._actors.get(secrets.hashed(cookie), (None, 0.0))
        return actor if time.monotonic() - at_s < longest_s else None

    def who_may_stop(self, cookie: str) -> Actor | None:
        """Return the cookie's user as confirmed within the last hour; None: query the database."""
        actor, at_s = self._actors.get(secrets.hashed(cookie), (None, 0.0))
        return actor if time.monotonic() - at_s < self._STOPS_FOR_S else None

    def is_news(self, cookie: str) -> bool:
        """Return True if the activity should be persisted (at most every 30 s)."""
        key, now = secrets.hashed(cookie), time.monotonic()
        if now - self._seen_s.get(key, -self._SEEN_EVERY_S) < self._SEEN_EVERY_S:
            return False
        self._seen_s[key] = now
        return True
