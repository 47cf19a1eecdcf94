"""The check of a patient's identity by two identifiers, before the first motion of a session. Pure functions.

Source: The Joint Commission, National Patient Safety Goal NPSG.01.01.01: use at least two patient identifiers when providing treatment;
a room number is not an identifier. The patient states the identifiers, and the user compares them with the record. An answer is valid for
one day, so that a session that was left open is not continued with another patient in the chair.
"""

from collections.abc import Collection
from datetime import date
from typing import Annotated, Final, Literal

from pydantic import Field

from kata.clinic import texts
from kata.errors import ProblemError
from kata.types import Schema

Identifier = Literal["name", "birth_date", "clinic_number"]
NEEDED: Final = 2
Identifiers = Annotated[
    set[Identifier],
    Field(
        max_length=3,
        description="Identifiers that the patient stated and that agree with the record; two are needed.",
        examples=[["name", "birth_date"]],
    ),
]


class PatientIdentity(Schema):
    """The identifiers in the record. The user compares them with those that the patient states."""

    name: str = Field(examples=["Yamada Hanako"])
    kana: str | None = Field(examples=["ヤマダ ハナコ"])
    birth_date: date | None = Field(description="Null if it is not recorded; it then cannot be compared.")
    clinic_number: str = Field(examples=["K-0042"])


def subject(compared: Collection[Identifier], birth_date: date | None) -> str:
    """Return the identifiers in the form stored with the answer, such as ``birth_date+name``.

    :param birth_date: birth date in the record.
    :raises ProblemError: 422 for fewer than two identifiers, and for a birth date that the record lacks.
    """
    if "birth_date" in compared and birth_date is None:
        raise ProblemError(
            422, "identifier_unknown", texts.BIRTH_DATE_NOT_RECORDED(), texts.COMPARE_OTHER_IDENTIFIERS()
        )
    if len(set(compared)) < NEEDED:
        raise ProblemError(
            422, "two_identifiers_needed", texts.TWO_IDENTIFIERS_NEEDED(), texts.COMPARE_TWO_IDENTIFIERS()
        )
    return "+".join(sorted(compared))
