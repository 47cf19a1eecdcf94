"""A patient fills in a questionnaire on a browser that is limited to it, and that only the user's password opens again."""

import json
from collections.abc import Iterator
from typing import Any
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient

from kata.clinic.questionnaires import service
from kata.clinic.questionnaires.definitions import DEFINITIONS
from kata.clinic.questionnaires.licensed_texts import read_texts
from kata.database.base import utc_now
from tests.support.login_service import PASSWORD, Clinic, clinic, code
from tests.support.questionnaires import words_of

pytestmark = pytest.mark.no_apparatus
ANSWERS = [6] * 5 + [3] * 7 + [None]


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Clinic]:
    with clinic(tmp_path_factory.mktemp("kata")) as made:
        for name in ("spadi", "quickdash"):
            given = read_texts(json.dumps(words_of(name, "en")).encode(), DEFINITIONS[name])
            with made.database.write() as session:
                service.store_texts(session, name, given, utc_now(), may_be_exported=False)
        yield made


@pytest.fixture
def therapist(shared: Clinic) -> TestClient:
    return shared.sign_in(shared.account("therapist"))


@pytest.fixture
def patient(therapist: TestClient) -> dict[str, Any]:
    body = {"clinic_number": f"K-{uuid4().hex[:8]}", "name": "Yamada Hanako", "affected_side": "left"}
    made: dict[str, Any] = therapist.post("/api/patients", json=body).json()
    return made


def handed_over(
    browser: TestClient, patient: dict[str, Any], questionnaire: str = "spadi", language: str = "en"
) -> Any:
    body = {"questionnaire": questionnaire, "language": language}
    return browser.post(f"/api/episodes/{patient['episode_id']}/patient-mode", json=body)


def test_browser_shows_only_the_questionnaire_until_the_password(
    therapist: TestClient, patient: dict[str, Any]
) -> None:
    assert therapist.get("/api/me/questionnaire").json() is None
    assert handed_over(therapist, patient).status_code == 204
    shown = therapist.get("/api/me/questionnaire").json()
    assert (shown["title"], len(shown["questions"]), shown["finished"]) == ("Invented questions", 13, False)
    assert shown["questions"][0]["options"][0] == {"answer": 0, "label": "Not at all"}
    # A patient with two treated shoulders must know which one is meant.
    assert shown["side"] == "left"

    for path in (
        f"/api/patients/{patient['id']}",
        "/api/patients",
        "/api/sessions",
        "/api/events",
        f"/api/patients/{patient['id']}/fhir",
    ):
        assert code(therapist.get(path), 423) == "locked", path
    assert code(therapist.post("/api/patients", json={}), 423) == "locked"
    assert code(handed_over(therapist, patient), 423) == "locked"
    # The live state that a locked screen may see names no patient.
    with therapist.websocket_connect("/api/live") as socket:
        assert patient["name"] not in json.dumps(socket.receive_json())
    assert code(therapist.post("/api/me/unlock", json={"password": "wrong"}), 403)
    assert therapist.post("/api/me/unlock", json={"password": PASSWORD}).status_code == 200
    assert therapist.get("/api/me/questionnaire").json() is None
    assert therapist.get(f"/api/patients/{patient['id']}").status_code == 200


def test_finished_answers_become_an_assessment_once(therapist: TestClient, patient: dict[str, Any]) -> None:
    handed_over(therapist, patient)
    stored = therapist.put("/api/me/questionnaire", json={"answers": ANSWERS}).json()
    assert (stored["answers"], stored["finished"]) == (ANSWERS, False)
    assert therapist.get("/api/me/questionnaire").json()["answers"] == ANSWERS
    assert therapist.put("/api/me/questionnaire", json={"answers": ANSWERS, "finished": True}).json()["finished"]
    again = therapist.put("/api/me/questionnaire", json={"answers": ANSWERS, "finished": True})
    assert code(again, 409) == "finished"
    assert code(therapist.get(f"/api/episodes/{patient['episode_id']}/assessments"), 423) == "locked"
    therapist.post("/api/me/unlock", json={"password": PASSWORD})
    (found,) = therapist.get(f"/api/episodes/{patient['episode_id']}/assessments").json()["items"]
    assert (found["spadi"], found["assessed_by"], found["spadi_score"]["total"]) == (ANSWERS, "Test therapist", 45)


def test_other_questionnaire_is_stored_with_its_total(therapist: TestClient, patient: dict[str, Any]) -> None:
    handed_over(therapist, patient, "quickdash")
    therapist.put("/api/me/questionnaire", json={"answers": [2] * 11, "finished": True})
    therapist.post("/api/me/unlock", json={"password": PASSWORD})
    (found,) = therapist.get(f"/api/episodes/{patient['episode_id']}/assessments").json()["items"]
    assert found["spadi"] is None
    assert [(questionnaire["code"], questionnaire["total_points"]) for questionnaire in found["questionnaires"]] == [
        ("quickdash", 25)
    ]


def test_nothing_answered_is_no_assessment(therapist: TestClient, patient: dict[str, Any]) -> None:
    handed_over(therapist, patient)
    assert therapist.put("/api/me/questionnaire", json={"answers": [None] * 13, "finished": True}).status_code == 200
    therapist.post("/api/me/unlock", json={"password": PASSWORD})
    assert therapist.get(f"/api/episodes/{patient['episode_id']}/assessments").json()["items"] == []


@pytest.mark.parametrize("answers", [[1] * 12, [11] * 13, []])
def test_answers_that_the_items_do_not_have_are_refused(
    therapist: TestClient, patient: dict[str, Any], answers: list[int]
) -> None:
    handed_over(therapist, patient)
    assert code(therapist.put("/api/me/questionnaire", json={"answers": answers}), 422) == "answers_unfit"


def test_later_lock_does_not_show_the_old_questionnaire(
    shared: Clinic, therapist: TestClient, patient: dict[str, Any]
) -> None:
    handed_over(therapist, patient)
    shared.clock.forward(1)
    therapist.post("/api/me/unlock", json={"password": PASSWORD})
    therapist.post("/api/me/lock")
    assert therapist.get("/api/me/questionnaire").json() is None
    assert code(therapist.put("/api/me/questionnaire", json={"answers": ANSWERS}), 404) == "not_found"


def test_without_licensed_texts_nothing_is_handed_over(therapist: TestClient, patient: dict[str, Any]) -> None:
    assert code(handed_over(therapist, patient, "oxford"), 409) == "no_texts"
    assert code(handed_over(therapist, patient, "spadi", "ja"), 409) == "no_texts"
    assert therapist.get(f"/api/patients/{patient['id']}").status_code == 200, "not locked"
    languages = {item["code"]: item["languages"] for item in therapist.get("/api/questionnaires").json()["items"]}
    assert languages == {key: [] for key in languages} | {"spadi": ["en"], "quickdash": ["en"]}
    assert {"oxford", "ases"} <= set(languages)


def test_viewer_cannot_hand_over(shared: Clinic, patient: dict[str, Any]) -> None:
    viewer = shared.sign_in(shared.account("viewer"))
    assert code(handed_over(viewer, patient), 403) == "not_allowed"
