"""Routes for signing in (with a password, a demonstration link or the set-up link) and for signing out."""

from fastapi import APIRouter, Request, Response
from pydantic import Field

from kata.audit import entries
from kata.auth import accounts, demonstration, login_session, second_factor, set_up, texts
from kata.auth.login import (
    Authentication,
    Me,
    Password,
    Secret,
    TheActor,
    TheAuthentication,
    Username,
    address_of,
    auth_services,
    cookie_of,
    describe_user,
    end_browser_session,
    set_audited_account,
    start_login_session,
    throttle_key,
)
from kata.auth.login_session import Method
from kata.auth.throttle import ADDRESS_POLICY, USERNAME_POLICY
from kata.database.availability import DatabaseUnavailableError
from kata.dependencies import PROBLEMS, TheDatabase
from kata.errors import ProblemError
from kata.types import Name, Schema

router = APIRouter(tags=["sign-in"])


class SignIn(Schema):
    """User name and password."""

    username: Username = Field(examples=["yamada"])
    password: Password = Field(examples=["correct horse battery staple"])
    code: Secret | None = Field(
        None, description="Code of the second factor: six digits, or a recovery code.", examples=["123456"]
    )


class LinkSignIn(Schema):
    """The secret of a demonstration link."""

    secret: Secret = Field(description="The part of the link after `link=`; valid for one login.")


class SetUp(Schema):
    """The first administrator, or a new administrator for a clinic that is locked out."""

    secret: Secret = Field(description="The part of the set-up link after `secret=`; valid once.")
    username: Username = Field(
        description="A new user name, or an existing one, whose account becomes an administrator with this password."
    )
    name: Name = Field(examples=["Yamada Hanako"])
    password: Password


class SetPassword(Schema):
    """A one-time code that an administrator has issued, and the new password."""

    username: Username
    code: Secret = Field(examples=["7KQ2M-XW4HT-PR9CD-3NBVF"])
    password: Password


@router.post("/api/sign-in", responses=PROBLEMS.of(401, 403, 422, 429), summary="Sign in with a password")
def sign_in_by_password(
    request: Request, response: Response, database: TheDatabase, auth: TheAuthentication, body: SignIn
) -> Me:
    """Sign in with user name and password, and with the second factor if the account has one."""
    with database.read() as session:
        account = accounts.find_by_username(session, body.username)
    if account:
        set_audited_account(account.id)
    of_name, of_address = throttle_key(body.username), _count_attempt(request, auth, body.username)
    fits = auth.passwords.verify(account.password_hash if account else None, body.password)
    if account is None or account.disabled_at is not None or not fits:
        # Every failure has the same message, so that the answer does not reveal existing user names.
        raise ProblemError(401, "wrong_password", texts.WRONG_NAME_OR_PASSWORD(), texts.TRY_AGAIN_OR_ASK_FOR_CODE())
    outdated = account.password_hash and auth.passwords.is_outdated(account.password_hash)
    rehashed = auth.passwords.hash(body.password) if outdated else None
    with database.write() as session:
        account = accounts.get(session, account.id)
        if account.disabled_at is not None:
            raise ProblemError(401, "wrong_password", texts.WRONG_NAME_OR_PASSWORD(), texts.ASK_ADMINISTRATOR())
        method: Method = "password"
        if account.totp_confirmed_at is not None:
            if body.code is None:
                # The attempt still counts for the user name, so that codes cannot be guessed faster than passwords.
                auth.throttle.undo_attempt(of_address)
                raise ProblemError(
                    403,
                    "second_factor_needed",
                    texts.SECOND_FACTOR_NEEDED(),
                    texts.TYPE_APP_CODE(),
                )
            accepted = second_factor.use_code(session, auth.factor_key, account, body.code, auth.now())
            if accepted is None:
                raise ProblemError(401, "wrong_code", texts.CODE_WRONG_OR_USED(), texts.WAIT_FOR_NEXT_CODE())
            method = accepted
        account.password_hash = rehashed or account.password_hash
        user = start_login_session(request, response, session, auth, account, method)
    auth.throttle.succeeded(of_name)
    auth.throttle.undo_attempt(of_address)
    auth.revocations.check_now()
    return user


@router.post("/api/sign-in/link", responses=PROBLEMS.of(401, 422), summary="Sign in with a demonstration link")
def sign_in_by_link(
    request: Request, response: Response, database: TheDatabase, auth: TheAuthentication, body: LinkSignIn
) -> Me:
    """Sign in to the demonstration clinic by a link that `kata serve --simulate` has printed."""
    role = auth.links.take(body.secret) if auth.links.allowed else None
    if role is None:
        raise ProblemError(401, "link_used", texts.LINK_USED(), texts.RESTART_FOR_NEW_LINKS())
    with database.write() as session:
        user = start_login_session(request, response, session, auth, demonstration.account_of(session, role), "link")
    auth.revocations.check_now()
    return user


@router.post(
    "/api/set-up", responses=PROBLEMS.of(401, 422, 429), summary="Create an administrator with the set-up link"
)
def set_up_clinic(
    request: Request, response: Response, database: TheDatabase, auth: TheAuthentication, body: SetUp
) -> Me:
    """Create the first administrator, or a further one for a clinic that is locked out, and sign in as this user."""
    address = f"address {address_of(request)}"
    auth.throttle.begin((address, ADDRESS_POLICY))
    invalid = ProblemError(
        401,
        "link_used",
        texts.LINK_USED_OR_OLD(),
        texts.PRINT_NEW_LINK(),
    )
    if not set_up.is_valid(auth.folder, body.secret, auth.now()):
        raise invalid
    auth.throttle.undo_attempt(address)
    auth.passwords.check_choice(body.password, body.username, body.name)
    password_hash = auth.passwords.hash(body.password)
    now = auth.now()
    with database.write() as session:
        account = accounts.find_by_username(session, body.username, to_change=True)
        if account is None or account.username in demonstration.USERNAMES:
            account = accounts.create(session, body.username, body.name, "administrator", (), now)
        account.name, account.role = body.name, "administrator"
        accounts.set_stations(session, account, ())
        accounts.disable(session, account, now, disabled=False)
        second_factor.remove(session, account)
        accounts.set_password(session, account, password_hash, now)
        user = start_login_session(request, response, session, auth, account, "password")
        # Last, so that the link stays valid after an earlier failure. If two requests use the link, only the first succeeds.
        if not set_up.use_up(auth.folder):
            raise invalid
    auth.revocations.check_now()
    return user


@router.post(
    "/api/set-password",
    status_code=204,
    responses=PROBLEMS.of(401, 422, 429),
    summary="Set a password with a one-time code",
)
def set_password_by_code(request: Request, database: TheDatabase, auth: TheAuthentication, body: SetPassword) -> None:
    """Set a password with a one-time code that an administrator has issued. The user can then sign in with the password."""
    # The attempt does not count for the user name, so that a user whose name an attacker has throttled can still use a one-time code.
    address = f"address {address_of(request)}"
    auth.throttle.begin((address, ADDRESS_POLICY))
    invalid = ProblemError(
        401,
        "wrong_code",
        texts.ONE_TIME_CODE_UNFIT(),
        texts.ASK_FOR_NEW_CODE(),
    )
    with database.read() as session:
        account = accounts.find_by_username(session, body.username)
        if account:
            set_audited_account(account.id)
        if account is None or not accounts.code_is_valid(account, body.code, auth.now()):
            raise invalid
    auth.throttle.undo_attempt(address)
    auth.passwords.check_choice(body.password, account.username, account.name)
    password_hash = auth.passwords.hash(body.password)
    with database.write() as session:
        account = accounts.get(session, account.id)
        if not accounts.code_is_valid(account, body.code, auth.now()):
            raise invalid
        accounts.set_password(session, account, password_hash, auth.now())
        entries.add_entry(session, entries.entry("set_password_by_code", subject=f"account {account.id}"))
    auth.throttle.succeeded(throttle_key(body.username))
    auth.revocations.check_now()


@router.post("/api/sign-out", status_code=204, responses=PROBLEMS.of(403), summary="Sign out")
def sign_out(request: Request, response: Response, database: TheDatabase, auth: TheAuthentication) -> None:
    """End the login session of this browser."""
    with database.write() as session:
        actor = end_browser_session(request, session, auth)
        entries.add_entry(session, entries.entry("sign_out", actor=actor))
    auth.revocations.check_now()
    for name in (login_session.COOKIE, login_session.SECURE_COOKIE):
        response.delete_cookie(name, secure=name == login_session.SECURE_COOKIE, httponly=True, samesite="strict")


@router.get("/api/me", responses=PROBLEMS.of(401), summary="Read the signed-in user")
def get_me(request: Request, database: TheDatabase, auth: TheAuthentication, actor: TheActor) -> Me:
    """Return the user of this browser. While the database does not answer, return the last cached answer."""
    cookie, auth_cache = cookie_of(request) or "", auth_services(request).auth_cache
    try:
        with database.read() as session:
            user = describe_user(session, actor, auth)
    except DatabaseUnavailableError:
        cached: Me | None = auth_cache.me(cookie)
        if cached is None:
            raise
        return cached
    auth_cache.put_me(cookie, user)
    return user


def _count_attempt(request: Request, auth: Authentication, username: str) -> str:
    """Count an attempt for the user name and the address. Return the address's throttle key."""
    address = f"address {address_of(request)}"
    auth.throttle.begin((throttle_key(username), USERNAME_POLICY), (address, ADDRESS_POLICY))
    return address
