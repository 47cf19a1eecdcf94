"""Routes for access tokens: those of the user, and for administrators those of all accounts."""

from datetime import timedelta
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter
from pydantic import Field

from kata.auth import access_tokens
from kata.auth.login import Password, TheActor, TheAuthentication, require_reauthentication
from kata.auth.tables import AccountRow
from kata.dependencies import PROBLEMS, TheDatabase
from kata.pagination import Page
from kata.types import Moment, Name, Schema

router = APIRouter(tags=["access tokens"])


class AccessTokenCreate(Schema):
    """A new access token."""

    name: Name = Field(description="What the token is for.", examples=["Nightly export"])
    valid_days: Annotated[int, Field(ge=1, le=366, description="Days until the token expires.")]
    password: Password | None = Field(None, description="Not needed within ten minutes after the last authentication.")


class AccessToken(Schema):
    """An access token that is accepted now, without its secret."""

    id: UUID
    name: str
    created_at: Moment
    expires_at: Moment
    last_used_at: Moment | None = Field(description="To the minute; null: never. UTC.")


class CreatedAccessToken(AccessToken):
    """A new access token. The service does not store the token itself, so this is the only answer that contains it."""

    token: str = Field(description="For the header `Authorization: Bearer`.")


class AccountAccessToken(AccessToken):
    """An access token, with its owner."""

    account_id: UUID
    owner: str = Field(description="Name of the account.")


@router.get("/api/me/access-tokens", responses=PROBLEMS.of(401), summary="List the own access tokens")
def list_own_access_tokens(database: TheDatabase, auth: TheAuthentication, actor: TheActor) -> Page[AccessToken]:
    """Return the user's valid access tokens, the newest first. There are few, so the list has no pages."""
    with database.read() as session:
        rows = access_tokens.list_valid(session, auth.now(), actor.account_id)
        return Page[AccessToken].complete([AccessToken.model_validate(row) for row in rows])


@router.post(
    "/api/me/access-tokens",
    status_code=201,
    responses=PROBLEMS.of(401, 403, 409, 422, 429),
    summary="Create an access token",
)
def create_access_token(
    database: TheDatabase, auth: TheAuthentication, actor: TheActor, given: AccessTokenCreate
) -> CreatedAccessToken:
    """Create a token with which the user's programs read what the user may read. It never changes anything, and never stops the apparatus.

    It sees neither accounts nor the audit trail.
    """
    require_reauthentication(database, auth, actor, given.password)
    with database.write() as session:
        row, token = access_tokens.create(
            session, actor.account_id, given.name, timedelta(days=given.valid_days), auth.now()
        )
        return CreatedAccessToken(token=token, **AccessToken.model_validate(row).model_dump())


@router.delete(
    "/api/me/access-tokens/{access_token_id}",
    status_code=204,
    responses=PROBLEMS.of(401, 404, 422),
    summary="Revoke one of the own access tokens",
)
def revoke_own_access_token(
    database: TheDatabase, auth: TheAuthentication, actor: TheActor, access_token_id: UUID
) -> None:
    """Revoke an access token of the user. The next request with it is refused."""
    with database.write() as session:
        access_tokens.revoke(session, access_token_id, auth.now(), actor.account_id)


@router.get("/api/access-tokens", responses=PROBLEMS.of(401, 403), summary="List the access tokens of all accounts")
def list_access_tokens(database: TheDatabase, auth: TheAuthentication) -> Page[AccountAccessToken]:
    """Return all valid access tokens, the newest first. A clinic has few, so the list has no pages."""
    with database.read() as session:
        return Page[AccountAccessToken].complete(
            [
                AccountAccessToken(
                    account_id=row.account_id,
                    owner=session.get_one(AccountRow, row.account_id).name,
                    **AccessToken.model_validate(row).model_dump(),
                )
                for row in access_tokens.list_valid(session, auth.now())
            ]
        )


@router.delete(
    "/api/access-tokens/{access_token_id}",
    status_code=204,
    responses=PROBLEMS.of(401, 403, 404, 422),
    summary="Revoke an access token of any account",
)
def revoke_access_token(database: TheDatabase, auth: TheAuthentication, access_token_id: UUID) -> None:
    """Revoke an access token of any account. The next request with it is refused."""
    with database.write() as session:
        access_tokens.revoke(session, access_token_id, auth.now())
