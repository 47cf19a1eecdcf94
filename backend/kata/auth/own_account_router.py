"""Routes for the user's own account: language, screen lock, password, second factor, login sessions."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Body, Request, Response
from pydantic import Field

from kata.auth import accounts, login_session, second_factor, texts
from kata.auth.login import (
    Me,
    Password,
    Secret,
    TheActor,
    TheAuthentication,
    describe_user,
    renew_login_session,
    require_reauthentication,
)
from kata.auth.tables import AccountRow, LoginSessionRow
from kata.auth.throttle import USERNAME_POLICY
from kata.dependencies import PROBLEMS, TheDatabase
from kata.errors import ProblemError, not_found
from kata.i18n import Language
from kata.pagination import Page
from kata.types import Moment, Schema

router = APIRouter(prefix="/api/me", tags=["own account"])


class LanguageChoice(Schema):
    """A language of the page."""

    language: Language = Field(description="en: English. ja: Japanese.")


class Unlock(Schema):
    """The password."""

    password: Password


class ChangePassword(Schema):
    """The old and the new password."""

    old_password: Password
    password: Password = Field(description="The new password.")


class Reauthentication(Schema):
    """The password. It is not needed within ten minutes after the last authentication."""

    password: Password | None = None


class SecondFactorRemoval(Schema):
    """The password, and a code of the second factor that is to be removed."""

    password: Password | None = Field(None, description="Null only for an account without a password.")
    code: Secret = Field(description="Six digits, or a recovery code.", examples=["123456"])


class SecondFactorConfirmation(Schema):
    """The six digits that the app shows."""

    code: Secret = Field(examples=["123456"])


class SecondFactorSetup(Schema):
    """The secret for an app that makes codes."""

    address: str = Field(
        description="An `otpauth://` address: opens an app on this device, and contains the secret for typing."
    )
    picture: str = Field(description="The address as a QR code: a `data:` address of an SVG.")


class RecoveryCodes(Schema):
    """Recovery codes. Each replaces the second factor once. They are shown only now."""

    codes: list[str]


class OwnLoginSession(Schema):
    """A login session of the user."""

    id: UUID
    here: bool = Field(description="True for this browser.")
    began_at: Moment
    seen_at: Moment = Field(description="Time of the last user activity. UTC.")
    address: str
    agent: str = Field(description="User agent of the browser.")


@router.put("/language", responses=PROBLEMS.of(401, 422), summary="Choose the page's language")
def choose_language(database: TheDatabase, auth: TheAuthentication, actor: TheActor, body: LanguageChoice) -> Me:
    """Set the page's language for this account on every browser."""
    with database.write() as session:
        accounts.get(session, actor.account_id).language = body.language
        session.flush()
        return describe_user(session, actor, auth)


@router.post("/lock", status_code=204, responses=PROBLEMS.of(401, 409), summary="Lock the screen")
def lock_screen(database: TheDatabase, auth: TheAuthentication, actor: TheActor) -> None:
    """Lock the screen. A running session stays visible and can be stopped."""
    with database.write() as session:
        login_session.lock(session, actor.login_session_id, auth.now())


@router.post("/unlock", responses=PROBLEMS.of(401, 403, 422, 429), summary="Unlock the screen")
def unlock_screen(
    request: Request, response: Response, database: TheDatabase, auth: TheAuthentication, actor: TheActor, body: Unlock
) -> Me:
    """Unlock the screen with the password."""
    require_reauthentication(database, auth, actor, body.password)
    with database.write() as session:
        return describe_user(session, renew_login_session(request, response, session, auth, actor), auth)


@router.post("/password", status_code=204, responses=PROBLEMS.of(401, 403, 422, 429), summary="Change the own password")
def change_password(
    request: Request,
    response: Response,
    database: TheDatabase,
    auth: TheAuthentication,
    actor: TheActor,
    body: ChangePassword,
) -> None:
    """Change the own password and sign out all other browsers."""
    require_reauthentication(database, auth, actor, body.old_password)
    with database.read() as session:
        account = session.get_one(AccountRow, actor.account_id)
    auth.passwords.check_choice(body.password, account.username, account.name)
    password_hash = auth.passwords.hash(body.password)
    with database.write() as session:
        row = accounts.get(session, actor.account_id)
        accounts.set_password(session, row, password_hash, auth.now(), except_session=actor.login_session_id)
        renew_login_session(request, response, session, auth, actor)
    auth.revocations.check_now()


@router.post(
    "/second-factor", responses=PROBLEMS.of(401, 403, 409, 422, 429), summary="Begin to set up a second factor"
)
def begin_second_factor(
    database: TheDatabase, auth: TheAuthentication, actor: TheActor, body: Reauthentication
) -> SecondFactorSetup:
    """Begin to set up a second factor. It becomes valid when a code is confirmed."""
    require_reauthentication(database, auth, actor, body.password)
    with database.write() as session:
        address = second_factor.begin(auth.factor_key, accounts.get(session, actor.account_id))
    return SecondFactorSetup(address=address, picture=second_factor.qr_code(address))


@router.put("/second-factor", responses=PROBLEMS.of(401, 409, 422, 429), summary="Confirm the new second factor")
def confirm_second_factor(
    request: Request,
    response: Response,
    database: TheDatabase,
    auth: TheAuthentication,
    actor: TheActor,
    body: SecondFactorConfirmation,
) -> RecoveryCodes:
    """Confirm the second factor by one of its codes. All other browsers are signed out."""
    now = auth.now()
    with database.write() as session:
        account = accounts.get(session, actor.account_id)
        codes = second_factor.confirm(session, auth.factor_key, account, body.code, now)
        renew_login_session(request, response, session, auth, actor, "totp")
        login_session.end_all(session, actor.account_id, "password", now, except_session=actor.login_session_id)
    auth.revocations.check_now()
    return RecoveryCodes(codes=codes)


@router.delete(
    "/second-factor", status_code=204, responses=PROBLEMS.of(401, 403, 422, 429), summary="Remove the second factor"
)
def remove_second_factor(
    database: TheDatabase, auth: TheAuthentication, actor: TheActor, body: Annotated[SecondFactorRemoval, Body()]
) -> None:
    """Remove the second factor. This always needs the password and a code. A user who must have a second factor has to set up another at
    once.
    """
    require_reauthentication(database, auth, actor, body.password, password_always=True)
    key = f"second factor {actor.account_id}"
    auth.throttle.begin((key, USERNAME_POLICY))
    with database.write() as session:
        account = accounts.get(session, actor.account_id)
        if account.totp_confirmed_at and not second_factor.use_code(
            session, auth.factor_key, account, body.code, auth.now()
        ):
            raise ProblemError(403, "wrong_code", texts.CODE_WRONG_OR_USED(), texts.WAIT_FOR_NEXT_CODE())
        second_factor.remove(session, account)
    auth.throttle.succeeded(key)


@router.get("/sign-ins", responses=PROBLEMS.of(401), summary="List the own login sessions")
def list_own_sign_ins(database: TheDatabase, auth: TheAuthentication, actor: TheActor) -> Page[OwnLoginSession]:
    """Return the browsers at which this account is signed in, newest login first. They are few, so the list has no pages."""
    with database.read() as session:
        rows = login_session.list_active(session, actor.account_id, auth.now(), auth.limits)
        return Page[OwnLoginSession].complete([_as_own_session(row, actor.login_session_id) for row in rows])


@router.delete(
    "/sign-ins/{sign_in_id}",
    status_code=204,
    responses=PROBLEMS.of(401, 403, 404, 422, 429),
    summary="End one of the own login sessions",
)
def end_own_sign_in(
    database: TheDatabase,
    auth: TheAuthentication,
    actor: TheActor,
    sign_in_id: UUID,
    body: Annotated[Reauthentication, Body()],
) -> None:
    """End another login session of the user."""
    require_reauthentication(database, auth, actor, body.password)
    with database.write() as session:
        row = session.get(LoginSessionRow, sign_in_id)
        if row is None or row.account_id != actor.account_id:
            raise not_found(texts.LOGIN_SESSION_NOT_FOUND)
        login_session.end(session, sign_in_id, "signed_out", auth.now())
    auth.revocations.check_now()


def _as_own_session(row: LoginSessionRow, this_login_session_id: UUID) -> OwnLoginSession:
    return OwnLoginSession(
        id=row.id,
        here=row.id == this_login_session_id,
        began_at=row.began_at,
        seen_at=row.seen_at,
        address=row.address,
        agent=row.agent,
    )
