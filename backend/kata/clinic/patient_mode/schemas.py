"""Request and response models of the patient's mode."""

from typing import Annotated

from pydantic import Field, StrictBool

from kata.i18n import Language
from kata.types import Schema, Side

Answers = Annotated[
    list[Annotated[int, Field(ge=0, le=100)] | None],
    Field(
        max_length=200, description="One answer for each item in order; null if unanswered.", examples=[[7, 8, None]]
    ),
]


class PatientModeStart(Schema):
    """A questionnaire for a patient, on this browser."""

    questionnaire: str = Field(max_length=32, examples=["spadi"])
    language: Language


class AnswerOption(Schema):
    """One possible answer."""

    answer: int
    label: str = Field(description="Text of the answer; empty if the questionnaire has none.")


class PatientQuestion(Schema):
    """One question."""

    text: str
    options: list[AnswerOption]


class PatientQuestionnaire(Schema):
    """The questionnaire that the patient fills in on this browser."""

    title: str
    side: Side = Field(description="Shoulder about which the questions ask.")
    language: Language
    copyright: str
    questions: list[PatientQuestion]
    answers: Answers
    finished: bool = Field(
        description="True once the answers are stored. Only the user's password then unlocks the screen."
    )


class PatientAnswers(Schema):
    """The patient's answers so far."""

    answers: Answers
    finished: StrictBool = Field(
        False, description="True stores the answers as an assessment; the patient cannot change them afterwards."
    )
