"""Routes for access tokens. Users manage their own tokens, administrators those of all accounts."""

from datetime import timedelta
from typing import Annotated, Final
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
MAX_TOKEN_DAYS: Final = 366
"""Longest time that an access token is valid: a year, also one with a leap day."""


class AccessTokenCreate(Schema):
    """A new access token."""

    name: Name = Field(description="Purpose of the token.", examples=["Nightly export"])
    valid_days: Annotated[int, Field(ge=1, le=MAX_TOKEN_DAYS, description="Days until the token expires.")]
    password: Password | None = Field(
        None, description="The user's password. It is not needed within ten minutes after the last authentication."
    )


class AccessToken(Schema):
    """An access token that is valid now, without its secret."""

    id: UUID
    name: str
    created_at: Moment
    expires_at: Moment
    last_used_at: Moment | None = Field(
        description="Time of the last use, to the minute, UTC; null: the token was never used."
    )


class CreatedAccessToken(AccessToken):
    """A new access token. Only this answer contains the token itself, because the service does not store it."""

    token: str = Field(description="The token, to be sent in the header `Authorization: Bearer`.")


class AccountAccessToken(AccessToken):
    """An access token and its owner."""

    account_id: UUID
    owner: str = Field(description="Name of the account.")


@router.get("/api/me/access-tokens", responses=PROBLEMS.of(401), summary="List the own access tokens")
def list_own_access_tokens(database: TheDatabase, auth: TheAuthentication, actor: TheActor) -> Page[AccessToken]:
    """Return the user's valid access tokens, newest first. They are few, so the list has no pages."""
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
    """Create a token with which the user's programs can read what the user may read. A token can neither change anything nor stop the
    apparatus.

    It can read neither accounts nor the audit trail.
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
    """Revoke an access token of the user. Later requests with it are refused."""
    with database.write() as session:
        access_tokens.revoke(session, access_token_id, auth.now(), actor.account_id)


@router.get("/api/access-tokens", responses=PROBLEMS.of(401, 403), summary="List the access tokens of all accounts")
def list_access_tokens(database: TheDatabase, auth: TheAuthentication) -> Page[AccountAccessToken]:
    """Return all valid access tokens, newest first. A clinic has few, so the list has no pages."""
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
    """Revoke an access token of any account. Later requests with it are refused."""
    with database.write() as session:
        access_tokens.revoke(session, access_token_id, auth.now())
