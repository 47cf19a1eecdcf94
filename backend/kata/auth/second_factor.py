"""The second factor: time-based codes (RFC 6238) from an app, and recovery codes, each of which replaces an app code once.

The secret of the codes is stored encrypted (:mod:`kata.auth.factor_key`). Callers pass the key.
"""

from datetime import datetime
from typing import Final, Literal, get_args

import pyotp
from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from kata.actor import Role
from kata.auth import secrets, texts
from kata.auth.factor_key import FactorKey
from kata.auth.tables import AccountRow, RecoveryCodeRow
from kata.errors import ProblemError

MfaRequirement = Literal["administrators", "everyone", "nobody"]
_STEP_S: Final = 30
_RECOVERY_CODES: Final = 10


def roles_required(requirement: MfaRequirement) -> frozenset[Role]:
    """Return the roles that need a second factor."""
    everyone: frozenset[Role] = frozenset(get_args(Role))
    roles: dict[MfaRequirement, frozenset[Role]] = {
        "everyone": everyone,
        "administrators": frozenset({"administrator"}),
        "nobody": frozenset(),
    }
    return roles[requirement]


def begin(key: FactorKey, account: AccountRow) -> str:
    """Create a secret and return its address for an app (``otpauth://``). The secret becomes valid by :func:`confirm`.

    :raises ProblemError: 409 when the account has a second factor.
    """
    if account.totp_confirmed_at:
        raise ProblemError(409, "second_factor_there", texts.SECOND_FACTOR_EXISTS(), texts.REMOVE_SECOND_FACTOR_FIRST())
    secret = pyotp.random_base32()
    account.totp_sealed = key.encrypt(secret, account.id)
    return pyotp.TOTP(secret, interval=_STEP_S).provisioning_uri(name=account.username, issuer_name="Kata")


def qr_code(address: str) -> str:
    """Return the address as a QR code: SVG for an ``<img>``, black on white in every theme."""
    # Imported here, because only the set-up of a second factor draws a QR code.
    import segno

    return segno.make(address, error="m").svg_data_uri(scale=4, border=4, light="#fff")


def confirm(session: Session, key: FactorKey, account: AccountRow, code: str, now: datetime) -> list[str]:
    """Confirm the new second factor by one of its codes. Return the recovery codes, which are shown only once.

    :raises ProblemError: 422 when the code is wrong; 409 without :func:`begin`.
    """
    if account.totp_sealed is None or account.totp_confirmed_at:
        raise ProblemError(409, "nothing_begun", texts.SECOND_FACTOR_NOT_BEGUN(), texts.BEGIN_ANEW())
    if not _use_app_code(key, account, code, now):
        raise ProblemError(
            422,
            "wrong_code",
            texts.CODE_INCORRECT(),
            texts.TYPE_SIX_DIGITS(),
            [("#/code", texts.CODE_INCORRECT_FIELD())],
        )
    account.totp_confirmed_at = now
    session.execute(delete(RecoveryCodeRow).where(RecoveryCodeRow.account_id == account.id))
    codes = [secrets.new_code() for _ in range(_RECOVERY_CODES)]
    session.add_all(RecoveryCodeRow(account_id=account.id, code_hash=secrets.hash_secret(code)) for code in codes)
    return codes


def use_code(
    session: Session, key: FactorKey, account: AccountRow, code: str, now: datetime
) -> Literal["totp", "recovery"] | None:
    """Use up a code. Return whether it was an app code or a recovery code, or None if it is wrong.

    :raises ProblemError: 403 when codes of the app cannot be checked because the key does not match.
    """
    if _use_app_code(key, account, code, now):
        return "totp"
    used_code_id = session.execute(
        update(RecoveryCodeRow)
        .where(
            RecoveryCodeRow.account_id == account.id,
            RecoveryCodeRow.code_hash == secrets.hash_secret(secrets.normalize_code(code)),
            RecoveryCodeRow.used_at.is_(None),
        )
        .values(used_at=now)
        .returning(RecoveryCodeRow.code_hash)
    ).scalar_one_or_none()
    if used_code_id:
        return "recovery"
    if account.totp_sealed is not None and key.decrypt(account.totp_sealed, account.id) is None:
        raise ProblemError(
            403,
            "second_factor_unreadable",
            texts.SECOND_FACTOR_KEY_MISSING(),
            texts.USE_RECOVERY_CODE(),
        )
    return None


def count_undecryptable(session: Session, key: FactorKey) -> int:
    """Return the number of accounts whose second factor this key cannot decrypt."""
    query = select(AccountRow.id, AccountRow.totp_sealed).where(AccountRow.totp_sealed.is_not(None))
    return sum(key.decrypt(encrypted or "", account_id) is None for account_id, encrypted in session.execute(query))


def remove(session: Session, account: AccountRow) -> None:
    """Remove the second factor and its recovery codes."""
    account.totp_sealed = account.totp_confirmed_at = account.totp_last_step = None
    session.execute(delete(RecoveryCodeRow).where(RecoveryCodeRow.account_id == account.id))


def _use_app_code(key: FactorKey, account: AccountRow, code: str, now: datetime) -> bool:
    """Accept a code of the present, previous or next time step. No code is accepted twice."""
    digits = code.replace(" ", "")
    secret = key.decrypt(account.totp_sealed, account.id) if account.totp_sealed else None
    if secret is None or not digits.isascii():
        return False
    totp = pyotp.TOTP(secret, interval=_STEP_S)
    present = int(now.timestamp()) // _STEP_S
    for step in (present - 1, present, present + 1):
        is_new = account.totp_last_step is None or step > account.totp_last_step
        if is_new and pyotp.utils.strings_equal(digits, totp.generate_otp(step)):
            account.totp_last_step = step
            return True
    return False
