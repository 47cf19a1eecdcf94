"""Routes for the user's own account: language, screen lock, password, second factor, login sessions."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Body, Request, Response
from pydantic import Field

from kata.auth import accounts, login_session, second_factor
from kata.auth import texts as access_texts
from kata.auth.login import Me, Password, Secret, TheAccess, TheActor, check_it_is_them, go_on, me
from kata.auth.tables import AccountRow, LoginSessionRow
from kata.auth.throttle import OF_A_NAME
from kata.dependencies import PROBLEMS, TheDatabase
from kata.errors import ProblemError, not_found
from kata.i18n import Language
from kata.pagination import Page
from kata.types import Moment, Schema

router = APIRouter(prefix="/api/me", tags=["own account"])


class Speaks(Schema):
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
    """The password; not needed within ten minutes after the last authentication."""

    password: Password | None = None


class SecondFactorRemoval(Schema):
    """The password, and a code of the second factor that is removed."""

    password: Password | None = Field(None, description="Null only for an account without a password.")
    code: Secret = Field(description="Six digits, or a recovery code.", examples=["123456"])


class Confirm(Schema):
    """The six digits that the app shows."""

    code: Secret = Field(examples=["123456"])


class SecondFactorBegun(Schema):
    """The secret for an app that makes codes."""

    address: str = Field(description="`otpauth://`: for an app on this device, or to type its secret.")
    picture: str = Field(description="The address as a QR code: a `data:` address of an SVG.")


class RecoveryCodes(Schema):
    """Recovery codes. Each replaces the second factor once. They are shown only once."""

    codes: list[str]


class OwnSignIn(Schema):
    """A login session of the user."""

    id: UUID
    here: bool = Field(description="True for this browser.")
    began_at: Moment
    seen_at: Moment = Field(description="Time of the last user activity. UTC.")
    address: str
    agent: str = Field(description="User agent of the browser.")


@router.put("/language", responses=PROBLEMS.of(401, 422), summary="Choose the page's language")
def choose_language(database: TheDatabase, access: TheAccess, actor: TheActor, given: Speaks) -> Me:
    """Choose the page's language for this account, on every browser."""
    with database.write() as session:
        accounts.get(session, actor.account_id).language = given.language
        session.flush()
        return me(session, actor, access)


@router.post("/lock", status_code=204, responses=PROBLEMS.of(401, 409), summary="Lock the screen")
def lock_screen(database: TheDatabase, access: TheAccess, actor: TheActor) -> None:
    """Lock the screen. A running session stays visible and can be stopped."""
    with database.write() as session:
        login_session.lock(session, actor.login_session_id, access.now())


@router.post("/unlock", responses=PROBLEMS.of(401, 403, 422, 429), summary="Unlock the screen")
def unlock_screen(
    request: Request, response: Response, database: TheDatabase, access: TheAccess, actor: TheActor, given: Unlock
) -> Me:
    """Unlock the screen with the password."""
    check_it_is_them(database, access, actor, given.password)
    with database.write() as session:
        return me(session, go_on(request, response, session, access, actor), access)


@router.post("/password", status_code=204, responses=PROBLEMS.of(401, 403, 422, 429), summary="Change the own password")
def change_password(
    request: Request,
    response: Response,
    database: TheDatabase,
    access: TheAccess,
    actor: TheActor,
    given: ChangePassword,
) -> None:
    """Change the own password. All other browsers are signed out."""
    check_it_is_them(database, access, actor, given.old_password)
    with database.read() as session:
        account = session.get_one(AccountRow, actor.account_id)
    access.passwords.check_choice(given.password, account.username, account.name)
    made = access.passwords.hash(given.password)
    with database.write() as session:
        row = accounts.get(session, actor.account_id)
        accounts.set_password(session, row, made, access.now(), besides=actor.login_session_id)
        go_on(request, response, session, access, actor)
    access.revocations.notice()


@router.post(
    "/second-factor", responses=PROBLEMS.of(401, 403, 409, 422, 429), summary="Begin to set up a second factor"
)
def begin_second_factor(
    database: TheDatabase, access: TheAccess, actor: TheActor, given: Reauthentication
) -> SecondFactorBegun:
    """Begin to set up a second factor. It becomes valid when a code is confirmed."""
    check_it_is_them(database, access, actor, given.password)
    with database.write() as session:
        address = second_factor.begin(access.factor_key, accounts.get(session, actor.account_id))
    return SecondFactorBegun(address=address, picture=second_factor.drawn(address))


@router.put("/second-factor", responses=PROBLEMS.of(401, 409, 422, 429), summary="Confirm the new second factor")
def confirm_second_factor(
    request: Request, response: Response, database: TheDatabase, access: TheAccess, actor: TheActor, given: Confirm
) -> RecoveryCodes:
    """Confirm the second factor by a code of it. All other browsers are signed out."""
    now = access.now()
    with database.write() as session:
        account = accounts.get(session, actor.account_id)
        codes = second_factor.confirm(session, access.factor_key, account, given.code, now)
        go_on(request, response, session, access, actor, "totp")
        login_session.end_all(session, actor.account_id, "password", now, besides=actor.login_session_id)
    access.revocations.notice()
    return RecoveryCodes(codes=codes)


@router.delete(
    "/second-factor", status_code=204, responses=PROBLEMS.of(401, 403, 422, 429), summary="Remove the second factor"
)
def remove_second_factor(
    database: TheDatabase, access: TheAccess, actor: TheActor, given: Annotated[SecondFactorRemoval, Body()]
) -> None:
    """Remove the second factor, always with the password and a code. An account that needs one must set up another at once."""
    check_it_is_them(database, access, actor, given.password, password_always=True)
    key = f"second factor {actor.account_id}"
    access.throttle.begin((key, OF_A_NAME))
    with database.write() as session:
        account = accounts.get(session, actor.account_id)
        if account.totp_confirmed_at and not second_factor.accepted(
            session, access.factor_key, account, given.code, access.now()
        ):
            raise ProblemError(403, "wrong_code", access_texts.CODE_WRONG_OR_USED(), access_texts.WAIT_FOR_NEXT_CODE())
        second_factor.remove(session, account)
    access.throttle.succeeded(key)


@router.get("/sign-ins", responses=PROBLEMS.of(401), summary="List the own login sessions")
def list_own_sign_ins(database: TheDatabase, access: TheAccess, actor: TheActor) -> Page[OwnSignIn]:
    """Return the browsers at which this account is signed in, the newest first. There are few, so the list has no pages."""
    with database.read() as session:
        rows = login_session.present(session, actor.account_id, access.now(), access.limits)
        return Page[OwnSignIn].complete([_shown(row, actor.login_session_id) for row in rows])


@router.delete(
    "/sign-ins/{sign_in_id}",
    status_code=204,
    responses=PROBLEMS.of(401, 403, 404, 422, 429),
    summary="End one of the own login sessions",
)
def end_own_sign_in(
    database: TheDatabase,
    access: TheAccess,
    actor: TheActor,
    sign_in_id: UUID,
    given: Annotated[Reauthentication, Body()],
) -> None:
    """End another login session of the user."""
    check_it_is_them(database, access, actor, given.password)
    with database.write() as session:
        row = session.get(LoginSessionRow, sign_in_id)
        if row is None or row.account_id != actor.account_id:
            raise not_found(access_texts.LOGIN_SESSION_NOT_FOUND)
        login_session.end(session, sign_in_id, "signed_out", access.now())
    access.revocations.notice()


def _shown(row: LoginSessionRow, here: UUID) -> OwnSignIn:
    return OwnSignIn(
        id=row.id,
        here=row.id == here,
        began_at=row.began_at,
        seen_at=row.seen_at,
        address=row.address,
        agent=row.agent,
    )
