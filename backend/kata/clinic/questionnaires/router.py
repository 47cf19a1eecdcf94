"""REST route of questionnaires."""

from fastapi import APIRouter

from kata.clinic.questionnaires import service
from kata.clinic.questionnaires.schemas import Questionnaire
from kata.dependencies import TheDatabase
from kata.pagination import Page

router = APIRouter(tags=["questionnaires"])


@router.get("/api/questionnaires", summary="List the questionnaires")
def list_questionnaires(database: TheDatabase) -> Page[Questionnaire]:
    """Return every questionnaire that Kata scores, with the languages of its imported texts. The list has no pages."""
    with database.read() as session:
        return Page[Questionnaire].complete(service.questionnaires(session))
