"""Who was let in lately: whoever is remembered may stop the apparatus without a look into the database."""

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
    """Who was let in lately, and when they were last seen to do something. By the hash of their cookie.

    A Stop is taken from whoever is remembered, so that it waits for no database; and while there is none, what has begun goes on
    with them. Where there is one, sign-ins that have ended are forgotten within half a second, whichever service on it has ended them (:class:`kata.auth.login.SessionRevocations`).
    """

    _MOST: Final = 1000
    _STOPS_FOR_S: Final = 3600.0
    _SEEN_EVERY_S: Final = 30.0

    def __init__(self) -> None:
        self._actors: OrderedDict[str, tuple[Actor, float]] = OrderedDict()
        self._seen_s: dict[str, float] = {}
        self._told: dict[str, Me] = {}
        self._keys: dict[UUID, str] = {}
        """Of a sign-in: whoever shows again who they are goes on under another cookie."""
        self.writing: set[asyncio.Task[None]] = set()
        """That somebody did something is being written down: nobody's command waits for that."""

    def put(self, cookie: str, actor: Actor) -> None:
        """Has been let in just now."""
        key = secrets.hashed(cookie)
        if (before := self._keys.get(actor.sign_in_id, key)) != key:
            self._drop(before)
        self._actors[key], self._keys[actor.sign_in_id] = (actor, time.monotonic()), key
        self._actors.move_to_end(key)
        while len(self._actors) > self._MOST:
            self._drop(next(iter(self._actors)))

    def forget(self, cookie: str) -> None:
        """Is not let in any more."""
        self._drop(secrets.hashed(cookie))

    def forget_account(self, account_id: UUID) -> None:
        """Its rights have changed, or it is shut: at each browser of it the database is asked again."""
        for key in [key for key, (actor, _) in list(self._actors.items()) if actor.account_id == account_id]:
            self._drop(key)

    def sign_ins(self) -> set[UUID]:
        """Those that are remembered."""
        return {actor.sign_in_id for actor, _ in list(self._actors.values())}

    def forget_sign_ins(self, ended: Collection[UUID]) -> None:
        """These have ended."""
        for key in [key for key, (actor, _) in list(self._actors.items()) if actor.sign_in_id in ended]:
            self._drop(key)

    def _drop(self, key: str) -> None:
        actor, _ = self._actors.pop(key, (None, 0.0))
        if actor and self._keys.get(actor.sign_in_id) == key:
            self._keys.pop(actor.sign_in_id, None)
        self._seen_s.pop(key, None)
        self._told.pop(key, None)

    def tell(self, cookie: str, told: "Me") -> None:
        """What the page was told of who they are."""
        self._told[secrets.hashed(cookie)] = told

    def told(self, cookie: str) -> "Me | None":
        """What it was told last."""
        return self._told.get(secrets.hashed(cookie))

    def who_was_here(self, cookie: str, longest_s: float) -> Actor | None:
        """Who this was when the database last answered, no longer ago than a sign-in lasts."""
        actor, at_s = self._actors.get(secrets.hashed(cookie), (None, 0.0))
        return actor if time.monotonic() - at_s < longest_s else None

    def who_may_stop(self, cookie: str) -> Actor | None:
        """Who this was within the last hour; None: the database has to be asked."""
        actor, at_s = self._actors.get(secrets.hashed(cookie), (None, 0.0))
        return actor if time.monotonic() - at_s < self._STOPS_FOR_S else None

    def is_news(self, cookie: str) -> bool:
        """Whether that its user did something has to be written down: twice a minute is enough."""
        key, now = secrets.hashed(cookie), time.monotonic()
        if now - self._seen_s.get(key, -self._SEEN_EVERY_S) < self._SEEN_EVERY_S:
            return False
        self._seen_s[key] = now
        return True
