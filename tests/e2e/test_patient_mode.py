"""A patient answers a questionnaire on a tablet: one question a page and nothing else. A password leads back to the record."""

import re
from collections import Counter
from collections.abc import Iterator
from typing import Final

import pytest
from playwright.sync_api import Page, expect

from kata.clinic.questionnaires.definitions import DEFINITIONS, ItemScale, clinic_folder, score, use_folder
from kata.database.engine import Database
from tests.support.accessibility import wrong
from tests.support.browser_clinic import LONG_MS, Clinic, clinic_in
from tests.support.databases import upgraded_file
from tests.support.page_accounts import PASSWORD, sign_in_new_account
from tests.support.page_actions import sign_up
from tests.support.questionnaires import PROMIS, promis_file, store_words
from tests.support.shown_pages import SIZES

FINGER_PX: Final = 44
"""Least width and height of a target for a finger."""

WORDS: Final = {
    "en": {
        "open": "Questionnaire for the patient", "begin": "Hand over to the patient", "place": "Question 1 of 13", "question": "Invented question ",
        "next": "Next", "skip": "Next, without an answer", "back": "Back", "complete": "You have answered 12 of 13 questions.", "finish": "Finish",
        "thanks": "Thank you.", "staff": "For the staff", "stop": "Stop", "unlock": "Unlock", "password": "Password of Ito Mai",
    },
    "ja": {
        "open": "患者用の質問票", "begin": "患者に渡す", "place": "13問中1問目", "question": "架空の質問", "next": "次へ",
        "skip": "回答せずに次へ", "back": "戻る", "complete": "13問中12問に回答しました。", "finish": "終了する", "thanks": "ありがとうございました。",
        "staff": "スタッフ用", "stop": "停止", "unlock": "ロックを解除", "password": "",
    },
}  # fmt: skip


@pytest.fixture(scope="module")
def clinic(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Clinic]:
    """Return one clinic that has imported texts in both languages. Each test has an account of its own."""
    folder = tmp_path_factory.mktemp("kata")
    clinic_folder(folder).mkdir()
    promis_file(clinic_folder(folder) / f"{PROMIS}.toml")
    use_folder(clinic_folder(folder))
    database = Database(upgraded_file(folder / "kata.db"))
    for language in WORDS:
        for code in DEFINITIONS:
            store_words(database, code, language)
    database.close()
    try:
        with clinic_in(folder) as made_clinic:
            yield made_clinic
    finally:
        use_folder(folder / "nothing")


def sign_in_therapist(page: Page, clinic: Clinic, name: str, username: str) -> None:
    """Create a therapist's account and sign in with it."""
    sign_in_new_account(page.context, page, name, username, "therapist")
    page.goto(clinic.url)
    expect(page.get_by_role("button", name=f"Signed in as {name}")).to_be_visible(timeout=LONG_MS)


def rows_of_answers(page: Page, size: str) -> list[int]:
    """Return the number of answers in each row on a screen of this size. Each answer is large enough for a finger."""
    width, height = SIZES[size]
    page.set_viewport_size({"width": width, "height": height})
    boxes = [button.bounding_box() for button in page.get_by_role("radio").all()]
    assert all(box and min(box["width"], box["height"]) >= FINGER_PX for box in boxes)
    return list(Counter(box["y"] for box in boxes if box).values())


@pytest.mark.parametrize("language", [pytest.param("en", marks=pytest.mark.campaign), "ja"])
def test_patient_answers_alone_and_the_password_leads_back(page: Page, clinic: Clinic, language: str) -> None:
    sign_in_therapist(page, clinic, "Ito Mai", f"ito-{language}")
    sign_up(page, "Yamada Hanako")
    words = WORDS[language]
    if language == "ja":
        page.evaluate("localStorage.setItem('kata.language', 'ja')")
        page.request.put(f"{clinic.url}/api/me/language", data={"language": "ja"}, headers={"Origin": clinic.url})
        page.reload()
    record = f"{page.url.partition('?')[0]}?tab=assessments"
    page.goto(record)
    page.set_viewport_size({"width": 820, "height": 1180})
    page.get_by_role("button", name=words["open"]).click()
    page.get_by_role("radio", name="SPADI").check()
    page.get_by_role("button", name=words["begin"]).click()

    mode = page.get_by_test_id("patient-mode")
    expect(mode.get_by_text(words["place"])).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_text("Yamada Hanako")).to_have_count(0)
    assert wrong(page) == []
    assert rows_of_answers(page, "telephone") == [6, 5]
    assert rows_of_answers(page, "tablet") == [11]
    # Neither an address nor a reload leaves the patient mode.
    page.goto(record)
    expect(mode.get_by_text(words["place"])).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_role("navigation")).to_have_count(0)
    assert page.request.get(f"{clinic.url}/api/patients").status == 423

    for number in range(1, 14):
        expect(mode.get_by_role("heading", level=1)).to_have_text(f"{words['question']}{number}")
        if number == 13:
            mode.get_by_role("button", name=words["skip"]).click()
            continue
        mode.get_by_role("radio", name=re.compile("^7")).click()
        mode.get_by_role("button", name=words["next"], exact=True).click()
    expect(mode.get_by_role("heading", level=1)).to_have_text(words["complete"])
    mode.get_by_role("button", name=words["finish"]).click()
    expect(mode.get_by_role("heading", level=1)).to_have_text(words["thanks"])
    assert wrong(page) == []

    page.get_by_role("button", name=words["staff"]).click()
    page.locator("input[type=password]").fill(PASSWORD)
    page.locator("form button[type=submit]").click()
    expect(page.get_by_role("heading", name="Yamada Hanako")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("newest-assessment")).to_contain_text("SPADI 70", timeout=LONG_MS)


def answer_highest(page: Page, words: dict[str, str], item: int, scale: ItemScale) -> None:
    """Choose the highest answer of the open item. Check the item's answers, and with axe the page of the first item."""
    mode = page.get_by_test_id("patient-mode")
    expect(mode.get_by_role("heading", level=1)).to_have_text(f"{words['question']}{item + 1}", timeout=LONG_MS)
    expect(mode.get_by_role("radio")).to_have_count(scale.highest - scale.lowest + 1)
    ends = [button.bounding_box() for button in (mode.get_by_role("radio").first, mode.get_by_role("radio").last)]
    assert ends[0] and ends[1] and ends[0]["y"] == ends[1]["y"], "a scale in two rows is no scale"
    if item == 0:
        assert wrong(page) == []
    mode.get_by_role("radio").last.click()
    with page.expect_response("**/api/me/questionnaire"):
        mode.get_by_role("button", name=words["next"], exact=True).click()


@pytest.mark.campaign
@pytest.mark.parametrize("language", WORDS)
def test_every_questionnaire_is_answered_on_the_tablet(page: Page, clinic: Clinic, language: str) -> None:
    """Each item has the answers of its scale, and the total is that of its definition; axe finds nothing."""
    sign_in_therapist(page, clinic, "Ito Ken", f"ken-{language}")
    origin = {"Origin": clinic.url}
    page.evaluate(f"localStorage.setItem('kata.language', '{language}')")
    page.request.put(f"{clinic.url}/api/me/language", data={"language": language}, headers=origin)
    body = {"clinic_number": f"Q-{language}", "name": "Mori Ken", "affected_side": "right"}
    episode = page.request.post(f"{clinic.url}/api/patients", data=body, headers=origin).json()["episode_id"]
    page.set_viewport_size({"width": 800, "height": 1280})
    words, mode = WORDS[language], page.get_by_test_id("patient-mode")
    for name, definition in DEFINITIONS.items():
        handed = page.request.post(
            f"{clinic.url}/api/episodes/{episode}/patient-mode",
            data={"questionnaire": name, "language": language},
            headers=origin,
        )
        assert handed.status == 204, handed.text()
        scales = definition.item_scales
        questions = page.request.get(f"{clinic.url}/api/me/questionnaire").json()["questions"]
        assert [[option["answer"] for option in question["options"]] for question in questions] == [
            [*range(scale.lowest, scale.highest + 1)] for scale in scales
        ]
        page.goto(clinic.url)
        for item, scale in enumerate(scales):
            answer_highest(page, words, item, scale)
        mode.get_by_role("button", name=words["finish"]).click()
        expect(mode.get_by_role("heading", level=1)).to_have_text(words["thanks"])
        unlocked = page.request.post(f"{clinic.url}/api/me/unlock", data={"password": PASSWORD}, headers=origin)
        assert unlocked.status == 200, unlocked.text()
    found = page.request.get(f"{clinic.url}/api/episodes/{episode}/assessments").json()["items"]
    totals = {
        questionnaire["code"]: questionnaire["total_points"]
        for assessment in found
        for questionnaire in assessment["questionnaires"]
    }
    expected = {
        name: score(definition, [scale.highest for scale in definition.item_scales]).total
        for name, definition in DEFINITIONS.items()
        if name != "spadi"
    }
    assert totals == expected
