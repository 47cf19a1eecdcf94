"""REST for signing in by the clinic's own OpenID provider, and for unlocking the screen by it.

The provider sends the browser back to a screen of the page, and that asks here: so what changes something is a request of our own page, and
the cookies are those that no other site's page can have sent. A sign-in of the same account that is open at this browser goes on, unlocked.
"""

from collections.abc import Callable
from functools import partial
from typing import Annotated, Final, TypeVar

import anyio
from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool
from pydantic import Field, StringConstraints

from kata.actor import REQUEST_CONTEXT
from kata.audit import entries
from kata.auth import accounts, login_session, second_factor, texts
from kata.auth.login import Access, Me, Secret, TheAccess, address_of, cookie_of, go_on, let_in, me, name_key, whose
from kata.auth.openid import LASTS, IdTokenClaims, OidcLoginState, PendingMfa, Provider, login_state_of
from kata.auth.tables import AccountRow
from kata.auth.throttle import OF_A_NAME, OF_AN_ADDRESS
from kata.database.engine import Database
from kata.dependencies import PROBLEMS, TheDatabase
from kata.errors import ProblemError
from kata.types import NO_NUL, Schema

router = APIRouter(prefix="/api/sign-in", tags=["sign-in"])

_COOKIE: Final = "kata_openid"
_BACK: Final = "/sign-in/openid"
"""The screen that the provider sends the browser back to."""
_LONGEST_S: Final = 10.0
"""So long somebody waits for the provider, whatever it does."""

Screen = Annotated[str, StringConstraints(max_length=500, pattern=r"^(/([^/\\\x00-\x20][^\\\x00-\x20]*)?)?$")]
"""A path of our own page: nothing that a browser could take for another site."""
_Given = Annotated[str, StringConstraints(max_length=4000, pattern=NO_NUL)]
_Told = TypeVar("_Told")


class WaysIn(Schema):
    """How people sign in here, besides name and password."""

    openid: str | None = Field(description="What the clinic's OpenID provider is called; null: there is none.")


class BeginOpenId(Schema):
    """Where somebody wants to go."""

    to: Screen = Field("/", description="The screen to come back to; empty: to none, in a tab of its own.")


class Away(Schema):
    """To the provider."""

    address: str


class OidcCallback(Schema):
    """What the provider has sent the browser back with."""

    state: _Given
    code: _Given = Field("", description="Empty where the provider refused.")
    iss: _Given | None = Field(None, description="Who it is that answers, where it says so (RFC 9207).")


class LoginResult(Schema):
    """The result of a login: the account, and the screen to show."""

    me: Me | None = Field(description="Null: the code of the account's second factor is needed, too.")
    to: str = Field(description="The screen that was wanted; empty: none, this tab can be closed.")


class OpenIdCode(Schema):
    """Of the account's own second factor."""

    code: Secret = Field(description="Six digits, or a recovery code.", examples=["123456"])


@router.get("", summary="List the ways to sign in")
async def get_ways_in(access: TheAccess) -> WaysIn:
    """Return the ways to sign in to this service."""
    return WaysIn(openid=access.openid.name if access.openid else None)


@router.post("/openid/begin", responses=PROBLEMS.of(404, 422, 503), summary="Begin a login at the OpenID provider")
async def begin_openid(request: Request, response: Response, access: TheAccess, given: BeginOpenId) -> Away:
    """Begin to sign in, or to unlock the screen, at the clinic's OpenID provider. Return the address to send the browser to."""
    provider, now = _provider(access), access.now()
    redirect = f"{request.url.scheme}://{request.url.netloc}{_BACK}"
    address, begun = await _asked(provider, partial(provider.begin, redirect, given.to, now))
    _keep(request, response, access, begun)
    return Away(address=address)


@router.post(
    "/openid", responses=PROBLEMS.of(401, 403, 404, 422, 429, 503), summary="Complete a login at the OpenID provider"
)
async def sign_in_by_openid(
    request: Request, response: Response, database: TheDatabase, access: TheAccess, given: OidcCallback
) -> LoginResult:
    """Sign in, or unlock the screen, with what the provider has sent the browser back with."""
    provider = _provider(access)
    of_address = f"address {address_of(request)}"
    access.throttle.begin((of_address, OF_AN_ADDRESS))
    begun = login_state_of(access.sealed.open(_kept(request), access.now()), given.state)
    if begun is None:
        raise ProblemError(401, "openid_not_begun", texts.OPENID_NOT_BEGUN(), texts.BEGIN_AGAIN())
    if not given.code or not provider.is_itself(given.iss):
        raise provider.refused()
    word = await _asked(provider, partial(provider.confirm, begun, given.code, access.now()))
    told = await run_in_threadpool(_come_in, request, response, database, access, begun, word)
    access.throttle.was_no_failure(of_address)
    access.revocations.notice()
    return told


@router.post(
    "/openid/code", responses=PROBLEMS.of(401, 404, 422, 429), summary="Give the second factor after an OpenID login"
)
def confirm_openid(
    request: Request, response: Response, database: TheDatabase, access: TheAccess, given: OpenIdCode
) -> LoginResult:
    """Give the code of the account's second factor, where the provider has asked for none."""
    _provider(access)
    proven = access.sealed.open(_kept(request), access.now())
    if not isinstance(proven, PendingMfa):
        raise ProblemError(401, "openid_not_begun", texts.OPENID_TOOK_TOO_LONG(), texts.BEGIN_AGAIN())
    with database.read() as session:
        username = session.get_one(AccountRow, proven.account_id).username
    of_name, of_address = name_key(username), f"address {address_of(request)}"
    access.throttle.begin((of_name, OF_A_NAME), (of_address, OF_AN_ADDRESS))
    whose(proven.account_id)
    with database.write() as session:
        account = accounts.get(session, proven.account_id)
        _check_open(account)
        if second_factor.accepted(session, access.factor_key, account, given.code, access.now()) is None:
            raise ProblemError(401, "wrong_code", texts.CODE_WRONG_OR_USED(), texts.WAIT_FOR_NEXT_CODE())
        told = let_in(request, response, session, access, account, "oidc_two")
    access.throttle.was_no_failure(of_address)
    access.revocations.notice()
    _keep(request, response, access, None)
    return LoginResult(me=told, to=proven.to)


def _come_in(
    request: Request, response: Response, database: Database, access: Access, begun: OidcLoginState, word: IdTokenClaims
) -> LoginResult:
    provider, now = _provider(access), access.now()
    context = REQUEST_CONTEXT.get()
    if context:
        # An administrator finds here whom to link.
        context.subject = f"openid {word.subject}"
    with database.write() as session:
        account = accounts.linked(session, provider.linked(word.subject))
        if account is None:
            raise ProblemError(
                403,
                "not_linked",
                texts.OPENID_NOT_LINKED(provider=provider.name),
                texts.HAVE_IDENTITY_LINKED(identity=word.subject),
            )
        whose(account.id)
        account = accounts.get(session, account.id)
        _check_open(account)
        here = login_session.actor_of(session, cookie_of(request), now, access.limits)
        if here and here.account_id == account.id:
            entries.add_entry(session, entries.entry("sign_in_by_openid", actor=here, detail={"method": "again"}))
            told = me(session, go_on(request, response, session, access, here), access)
        elif account.totp_confirmed_at is not None and not word.two_factors:
            _keep(request, response, access, PendingMfa(account_id=account.id, to=begun.to))
            entries.add_entry(session, entries.entry("sign_in_by_openid", detail={"needed": "second_factor"}))
            return LoginResult(me=None, to=begun.to)
        else:
            told = let_in(request, response, session, access, account, "oidc_two" if word.two_factors else "oidc")
    _keep(request, response, access, None)
    return LoginResult(me=told, to=begun.to)


def _check_open(account: AccountRow) -> None:
    if account.disabled_at is not None:
        raise ProblemError(403, "account_disabled", texts.ACCOUNT_DISABLED(), texts.ASK_ADMINISTRATOR())


def _provider(access: Access) -> Provider:
    if access.openid is None:
        raise ProblemError(404, "no_openid", texts.NO_OPENID(), texts.SIGN_IN_WITH_NAME())
    return access.openid


async def _asked(provider: Provider, ask: Callable[[], _Told]) -> _Told:
    """Off the event loop, for a limited time, and by few at once."""
    try:
        with anyio.fail_after(_LONGEST_S):
            return await anyio.to_thread.run_sync(ask, abandon_on_cancel=True, limiter=provider.room)
    except TimeoutError as error:
        raise provider.down() from error


def _kept(request: Request) -> str | None:
    return request.cookies.get(_name(request))


def _keep(request: Request, response: Response, access: Access, content: OidcLoginState | PendingMfa | None) -> None:
    """At this browser, until it comes back; None: nothing any more."""
    response.set_cookie(
        _name(request),
        access.sealed.close(content, access.now()) if content else "",
        max_age=int(LASTS.total_seconds()) if content else 0,
        secure=request.url.scheme == "https",
        httponly=True,
        samesite="strict",
    )


def _name(request: Request) -> str:
    return f"__Host-{_COOKIE}" if request.url.scheme == "https" else _COOKIE
