"""A service without an apparatus, with cheap password hashing and a clock that the test moves."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any
from uuid import UUID

from argon2 import PasswordHasher
from fastapi.testclient import TestClient

from kata.actor import Role
from kata.auth import accounts, login_session
from kata.auth.login_session import COOKIE
from kata.auth.passwords import Passwords
from kata.auth.tables import AccountRow
from kata.auth.throttle import Throttle
from kata.database.base import utc_now
from kata.database.engine import Database
from tests.support.login import signed_in
from tests.support.service import running

PASSWORD = "seven slow swans at dawn"
OTHER = "a kettle under the bridge"


class Clock:
    """A clock that only the test moves."""

    def __init__(self) -> None:
        self.at = utc_now()

    def now(self) -> datetime:
        return self.at

    def seconds(self) -> float:
        return self.at.timestamp()

    def forward(self, seconds: float) -> None:
        self.at += timedelta(seconds=seconds)


class Clinic:
    """The service and its browsers."""

    def __init__(self, first: TestClient) -> None:
        self._first = first
        app: Any = first.app
        self.app = app
        self.database: Database = app.state.services.database
        self.clock = Clock()
        auth = replace(
            app.state.services.auth,
            passwords=Passwords(PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)),
            throttle=Throttle(self.clock.seconds),
            now=self.clock.now,
        )
        app.state.services = replace(app.state.services, auth=auth)

    @property
    def administrator(self) -> TestClient:
        """Return a new browser in which the first administrator has just signed in."""
        browser = self.browser()
        with self.database.write() as session:
            actor = login_session.find_actor(session, self._first.cookies[COOKIE], utc_now())
            assert actor
            account = session.get_one(AccountRow, actor.account_id)
            browser.cookies.set(COOKIE, login_session.begin(session, account, "totp", self.clock.now(), "", ""))
        return browser

    def browser(self, address: str = "127.0.0.1") -> TestClient:
        """Return a new browser."""
        browser = TestClient(self.app, client=(address, 50_001))
        # In the service's event loop.
        browser.portal = self._first.portal
        return browser

    def account(self, role: Role = "therapist") -> str:
        """Create an account with PASSWORD and without a second factor; return its user name."""
        cookie = signed_in(self.database, role)
        with self.database.write() as session:
            actor = login_session.find_actor(session, cookie, utc_now())
            assert actor
            row = session.get_one(AccountRow, actor.account_id)
            row.password_hash = self.app.state.services.auth.passwords.hash(PASSWORD)
            row.totp_confirmed_at = None
            return row.username

    def id_of(self, username: str) -> UUID:
        with self.database.read() as session:
            row = accounts.find_by_username(session, username)
            assert row
            return row.id

    def sign_in(self, username: str, password: str = PASSWORD, **more: Any) -> TestClient:
        """Sign in at a new browser; the sign-in must succeed."""
        browser = self.browser()
        answer = browser.post("/api/sign-in", json={"username": username, "password": password, **more})
        assert answer.status_code == 200, answer.text
        return browser


@contextmanager
def clinic(folder: Path) -> Iterator[Clinic]:
    """Run the service during the context."""
    with running(folder, simulate=False) as client:
        yield Clinic(client)


def code(answer: Any, status: int) -> str:
    """Return the code of a problem."""
    assert answer.status_code == status, answer.text
    code: str = answer.json()["code"]
    return code
