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

    A cached user may stop the apparatus without waiting for the database, and may continue a running session while the database is
    unavailable. While the database answers, an ended login session leaves the cache within half a second, even if another service on the
    database ended it (:class:`kata.auth.login.SessionRevocations`).
    """

    _MAX_ENTRIES: Final = 1000
    _STOP_VALID_S: Final = 3600.0
    _ACTIVITY_PERIOD_S: Final = 30.0

    def __init__(self) -> None:
        self._actors: OrderedDict[str, tuple[Actor, float]] = OrderedDict()
        self._activity_stored_s: dict[str, float] = {}
        self._me: dict[str, Me] = {}
        self._keys: dict[UUID, str] = {}
        """Key of each login session. A reauthentication replaces the cookie and so the key."""
        self.activity_writes: set[asyncio.Task[None]] = set()
        """Running writes of user activity. No command waits for them."""

    def put(self, cookie: str, actor: Actor) -> None:
        """Cache a user who has just been authenticated."""
        key = secrets.hash_secret(cookie)
        if (before := self._keys.get(actor.login_session_id, key)) != key:
            self._drop(before)
        self._actors[key], self._keys[actor.login_session_id] = (actor, time.monotonic()), key
        self._actors.move_to_end(key)
        while len(self._actors) > self._MAX_ENTRIES:
            self._drop(next(iter(self._actors)))

    def forget(self, cookie: str) -> None:
        """Remove a cookie."""
        self._drop(secrets.hash_secret(cookie))

    def forget_account(self, account_id: UUID) -> None:
        """Remove all entries of an account whose rights have changed or that is disabled."""
        for key in [key for key, (actor, _) in list(self._actors.items()) if actor.account_id == account_id]:
            self._drop(key)

    def login_sessions(self) -> set[UUID]:
        """Return the cached login sessions."""
        return {actor.login_session_id for actor, _ in list(self._actors.values())}

    def forget_login_sessions(self, ended_ids: Collection[UUID]) -> None:
        """Remove login sessions that have ended."""
        for key in [key for key, (actor, _) in list(self._actors.items()) if actor.login_session_id in ended_ids]:
            self._drop(key)

    def _drop(self, key: str) -> None:
        actor, _ = self._actors.pop(key, (None, 0.0))
        if actor and self._keys.get(actor.login_session_id) == key:
            self._keys.pop(actor.login_session_id, None)
        self._activity_stored_s.pop(key, None)
        self._me.pop(key, None)

    def put_me(self, cookie: str, me: "Me") -> None:
        """Cache the answer about the signed-in user."""
        self._me[secrets.hash_secret(cookie)] = me

    def me(self, cookie: str) -> "Me | None":
        """Return the cached answer about the signed-in user."""
        return self._me.get(secrets.hash_secret(cookie))

    def cached_actor(self, cookie: str, max_age_s: float) -> Actor | None:
        """Return the cookie's user if the database confirmed it less than ``max_age_s`` seconds ago, else None."""
        actor, at_s = self._actors.get(secrets.hash_secret(cookie), (None, 0.0))
        return actor if time.monotonic() - at_s < max_age_s else None

    def cached_actor_for_stop(self, cookie: str) -> Actor | None:
        """Return the cookie's user if it was confirmed within the last hour. None: query the database."""
        actor, at_s = self._actors.get(secrets.hash_secret(cookie), (None, 0.0))
        return actor if time.monotonic() - at_s < self._STOP_VALID_S else None

    def should_store_activity(self, cookie: str) -> bool:
        """Return True if the activity should be persisted (at most every 30 s)."""
        key, now = secrets.hash_secret(cookie), time.monotonic()
        if now - self._activity_stored_s.get(key, -self._ACTIVITY_PERIOD_S) < self._ACTIVITY_PERIOD_S:
            return False
        self._activity_stored_s[key] = now
        return True
