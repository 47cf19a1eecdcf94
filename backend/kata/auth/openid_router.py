"""Routes for signing in and for unlocking the screen by the clinic's OpenID provider.

The provider sends the browser back to a screen of the page, which calls these routes. Each change is therefore a request of Kata's own
page, with cookies that another site's page cannot send. If the same account is signed in at this browser, its login session continues and
the screen is unlocked.
"""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Annotated, Final, TypeVar

import anyio
from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool
from pydantic import Field, StringConstraints

from kata.actor import REQUEST_CONTEXT
from kata.audit import entries
from kata.auth import accounts, login_session, second_factor, texts
from kata.auth.login import (
    Authentication,
    Me,
    Secret,
    TheAuthentication,
    address_of,
    cookie_of,
    describe_user,
    renew_login_session,
    set_audited_account,
    start_login_session,
    throttle_key,
)
from kata.auth.openid import LOGIN_STATE_VALIDITY, IdTokenClaims, OidcLoginState, PendingMfa, login_state_of
from kata.auth.tables import AccountRow
from kata.auth.throttle import ADDRESS_POLICY, USERNAME_POLICY
from kata.database.engine import Database
from kata.dependencies import PROBLEMS, TheDatabase
from kata.errors import ProblemError
from kata.types import NO_NUL, Schema

if TYPE_CHECKING:
    from kata.auth.openid_provider import Provider

router = APIRouter(prefix="/api/sign-in", tags=["sign-in"])

_COOKIE: Final = "kata_openid"
_CALLBACK_SCREEN: Final = "/sign-in/openid"
"""Screen to which the provider sends the browser back."""
_PROVIDER_LIMIT_S: Final = 10.0
"""Longest wait for the provider."""

Screen = Annotated[str, StringConstraints(max_length=500, pattern=r"^(/([^/\\\x00-\x20][^\\\x00-\x20]*)?)?$")]
"""A path of Kata's own page. No browser interprets it as an address of another site."""
_Parameter = Annotated[str, StringConstraints(max_length=4000, pattern=NO_NUL)]
_Result = TypeVar("_Result")


class SignInOptions(Schema):
    """Ways to sign in other than name and password."""

    openid: str | None = Field(description="Name of the clinic's OpenID provider; null: there is none.")


class BeginOpenId(Schema):
    """The screen to show after the login."""

    to: Screen = Field(
        "/", description="Screen to show after the login; empty if the login takes place in a separate tab."
    )


class ProviderAddress(Schema):
    """The address of the provider's login page."""

    address: str


class OidcCallback(Schema):
    """Parameters that the provider adds to the address to which it sends the browser back."""

    state: _Parameter
    code: _Parameter = Field("", description="Empty if the provider refused.")
    iss: _Parameter | None = Field(None, description="The issuer, if the provider names it (RFC 9207).")


class LoginResult(Schema):
    """The result of a login: the account, and the screen to show."""

    me: Me | None = Field(description="Null: the code of the account's second factor is also needed.")
    to: str = Field(description="The screen to show; empty: close this tab.")


class OpenIdCode(Schema):
    """A code of the account's second factor."""

    code: Secret = Field(description="Six digits, or a recovery code.", examples=["123456"])


@router.get("", summary="List the ways to sign in")
async def get_sign_in_options(auth: TheAuthentication) -> SignInOptions:
    """Return the ways to sign in to this service."""
    return SignInOptions(openid=auth.openid.name if auth.openid else None)


@router.post("/openid/begin", responses=PROBLEMS.of(404, 422, 503), summary="Begin a login at the OpenID provider")
async def begin_openid(
    request: Request, response: Response, auth: TheAuthentication, body: BeginOpenId
) -> ProviderAddress:
    """Begin to sign in, or to unlock the screen, at the clinic's OpenID provider. Return the address of the provider's login page."""
    provider, now = _provider(auth), auth.now()
    redirect = f"{request.url.scheme}://{request.url.netloc}{_CALLBACK_SCREEN}"
    address, login_state = await _run_with_limit(provider, partial(provider.begin, redirect, body.to, now))
    _set_cookie(request, response, auth, login_state)
    return ProviderAddress(address=address)


@router.post(
    "/openid", responses=PROBLEMS.of(401, 403, 404, 422, 429, 503), summary="Complete a login at the OpenID provider"
)
async def sign_in_by_openid(
    request: Request, response: Response, database: TheDatabase, auth: TheAuthentication, body: OidcCallback
) -> LoginResult:
    """Sign in, or unlock the screen, with the provider's answer."""
    provider = _provider(auth)
    of_address = f"address {address_of(request)}"
    auth.throttle.begin((of_address, ADDRESS_POLICY))
    login_state = login_state_of(auth.state_cookies.decrypt(_cookie(request), auth.now()), body.state)
    if login_state is None:
        raise ProblemError(401, "openid_not_begun", texts.OPENID_NOT_BEGUN(), texts.BEGIN_AGAIN())
    if not body.code or not provider.is_issuer(body.iss):
        raise provider.refusal()
    claims = await _run_with_limit(provider, partial(provider.confirm, login_state, body.code, auth.now()))
    result = await run_in_threadpool(_sign_in, request, response, database, auth, login_state, claims)
    auth.throttle.undo_attempt(of_address)
    auth.revocations.check_now()
    return result


@router.post(
    "/openid/code", responses=PROBLEMS.of(401, 404, 422, 429), summary="Give the second factor after an OpenID login"
)
def confirm_openid(
    request: Request, response: Response, database: TheDatabase, auth: TheAuthentication, body: OpenIdCode
) -> LoginResult:
    """Check the code of the account's second factor if the provider has not checked a second factor."""
    _provider(auth)
    pending = auth.state_cookies.decrypt(_cookie(request), auth.now())
    if not isinstance(pending, PendingMfa):
        raise ProblemError(401, "openid_not_begun", texts.OPENID_TOOK_TOO_LONG(), texts.BEGIN_AGAIN())
    with database.read() as session:
        username = session.get_one(AccountRow, pending.account_id).username
    of_name, of_address = throttle_key(username), f"address {address_of(request)}"
    auth.throttle.begin((of_name, USERNAME_POLICY), (of_address, ADDRESS_POLICY))
    set_audited_account(pending.account_id)
    with database.write() as session:
        account = accounts.get(session, pending.account_id)
        _check_enabled(account)
        if second_factor.use_code(session, auth.factor_key, account, body.code, auth.now()) is None:
            raise ProblemError(401, "wrong_code", texts.CODE_WRONG_OR_USED(), texts.WAIT_FOR_NEXT_CODE())
        user = start_login_session(request, response, session, auth, account, "oidc_two")
    auth.throttle.undo_attempt(of_address)
    auth.revocations.check_now()
    _set_cookie(request, response, auth, None)
    return LoginResult(me=user, to=pending.to)


def _sign_in(
    request: Request,
    response: Response,
    database: Database,
    auth: Authentication,
    login_state: OidcLoginState,
    claims: IdTokenClaims,
) -> LoginResult:
    provider, now = _provider(auth), auth.now()
    context = REQUEST_CONTEXT.get()
    if context:
        # An administrator needs this identity to link it with an account.
        context.subject = f"openid {claims.subject}"
    with database.write() as session:
        account = accounts.find_by_subject(session, provider.stored_subject(claims.subject))
        if account is None:
            raise ProblemError(
                403,
                "not_linked",
                texts.OPENID_NOT_LINKED(provider=provider.name),
                texts.HAVE_IDENTITY_LINKED(identity=claims.subject),
            )
        set_audited_account(account.id)
        account = accounts.get(session, account.id)
        _check_enabled(account)
        present_actor = login_session.find_actor(session, cookie_of(request), now, auth.limits)
        if present_actor and present_actor.account_id == account.id:
            entries.add_entry(
                session, entries.entry("sign_in_by_openid", actor=present_actor, detail={"method": "again"})
            )
            user = describe_user(session, renew_login_session(request, response, session, auth, present_actor), auth)
        elif account.totp_confirmed_at is not None and not claims.two_factors:
            _set_cookie(request, response, auth, PendingMfa(account_id=account.id, to=login_state.to))
            entries.add_entry(session, entries.entry("sign_in_by_openid", detail={"needed": "second_factor"}))
            return LoginResult(me=None, to=login_state.to)
        else:
            user = start_login_session(
                request, response, session, auth, account, "oidc_two" if claims.two_factors else "oidc"
            )
    _set_cookie(request, response, auth, None)
    return LoginResult(me=user, to=login_state.to)


def _check_enabled(account: AccountRow) -> None:
    if account.disabled_at is not None:
        raise ProblemError(403, "account_disabled", texts.ACCOUNT_DISABLED(), texts.ASK_ADMINISTRATOR())


def _provider(auth: Authentication) -> "Provider":
    if auth.openid is None:
        raise ProblemError(404, "no_openid", texts.NO_OPENID(), texts.SIGN_IN_WITH_NAME())
    return auth.openid


async def _run_with_limit(provider: "Provider", request: Callable[[], _Result]) -> _Result:
    """Run a request to the provider in one of few threads, with a time limit.

    :raises ProblemError: 503 after the limit.
    """
    try:
        with anyio.fail_after(_PROVIDER_LIMIT_S):
            return await anyio.to_thread.run_sync(request, abandon_on_cancel=True, limiter=provider.limiter)
    except TimeoutError as error:
        raise provider.unavailable() from error


def _cookie(request: Request) -> str | None:
    return request.cookies.get(_name(request))


def _set_cookie(
    request: Request, response: Response, auth: Authentication, content: OidcLoginState | PendingMfa | None
) -> None:
    """Store the state of the login in the browser's cookie. None removes the cookie."""
    response.set_cookie(
        _name(request),
        auth.state_cookies.encrypt(content, auth.now()) if content else "",
        max_age=int(LOGIN_STATE_VALIDITY.total_seconds()) if content else 0,
        secure=request.url.scheme == "https",
        httponly=True,
        samesite="strict",
    )


def _name(request: Request) -> str:
    return f"__Host-{_COOKIE}" if request.url.scheme == "https" else _COOKIE
