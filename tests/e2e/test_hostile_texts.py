"""What people write is shown as it was written, wherever it is shown, and never becomes a script or a style of the page.

:mod:`tests.support.poisoned_database` fills the database, a row for each text, so that a list shows all five hundred; what a page shows
one of, it shows of ten records, whose notes hold fifty each. The API's own document tells which fields of text there are.
"""

import json
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final

import httpx2
import pytest
from playwright.sync_api import Page, Route, expect

from kata.audit.audit_log import AuditHook
from kata.auth.login_session import COOKIE
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from kata.reporting import phrases, rendering
from tests.support.browser_clinic import START_LIMIT_S, Clinic
from tests.support.hostile_texts import CALL, hostile
from tests.support.login import signed_in_at
from tests.support.paths import ROOT
from tests.support.poisoned_database import NOT_WRITTEN, Poison, poison, text_columns
from tests.support.reports import contents, how
from tests.support.text_fields import text_fields, texts_in

_LIMIT_MS: Final = START_LIMIT_S * 1000
_WATCH: Final = """
    window.kataHostile = () => window.kataTell("a script has run");
    addEventListener("securitypolicyviolation", (told) => window.kataTell(`${told.violatedDirective} ${told.blockedURI} ${told.sample}`));
"""


class Poisoned(Clinic):
    """Such a clinic; the page's user is called so, too."""

    def __init__(self, folder: Path, texts: list[str]) -> None:
        poisoned_user = signed_in_at(folder)
        database = Database(f"sqlite:///{folder / 'kata.db'}")
        upgrade(database)
        AuditHook(database)
        with database.write() as session:
            self.poison: Poison = poison(session, texts)
        database.close()
        super().__init__(folder)
        self.cookie = poisoned_user

    def ask(self, path: str, **query: Any) -> Any:
        """What the API says."""
        answer = httpx2.get(f"{self.url}{path}", params=query, cookies={COOKIE: self.cookie}, timeout=60)
        assert answer.status_code == 200, (path, answer.text)
        return answer.json()


@pytest.fixture(scope="module")
def texts() -> list[str]:
    return hostile()


@pytest.fixture(scope="module")
def poisoned(tmp_path_factory: pytest.TempPathFactory, texts: list[str]) -> Iterator[Poisoned]:
    clinic = Poisoned(tmp_path_factory.mktemp("kata"), texts)
    yield clinic
    clinic.close()


@pytest.fixture
def told(context: Any, poisoned: Poisoned) -> list[str]:
    """What scripts that ran, dialogs, and the browser's own reports of broken policy say; nothing, it is to be hoped."""
    said: list[str] = []

    def note(one: Any) -> None:
        if "Content Security Policy" in one.text:
            said.append(one.text)

    def dismissed(dialog: Any) -> None:
        said.append(f"dialog {dialog.message}")
        dialog.dismiss()

    context.add_cookies([{"name": COOKIE, "value": poisoned.cookie, "url": poisoned.url}])
    context.expose_function("kataTell", lambda what: said.append(what))  # Playwright wants to mark what it calls.
    context.add_init_script(_WATCH)
    context.on("dialog", dismissed)
    context.on("console", note)
    return said


@pytest.fixture
def page(context: Any, told: list[str]) -> Page:
    """In place of the one that begins at the station."""
    made: Page = context.new_page()
    made.set_default_timeout(_LIMIT_MS)
    return made


def alike(text: str) -> str:
    """White space made alike, as a browser does."""
    return " ".join(text.split())


def shown(page: Page) -> list[str]:
    """Every text of a page, and what stands in its fields."""
    found: list[str] = page.evaluate(_TEXTS)
    return [alike(one) for one in found]


_TEXTS: Final = """() => {
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), texts = [document.title];
    while (walker.nextNode()) texts.push(walker.currentNode.data);
    return [...texts, ...[...document.querySelectorAll("input, textarea")].map((one) => one.value)];
}"""


class Seen:
    """Which of the texts have been on a page, by column of the database."""

    def __init__(self, planted: dict[str, list[str]]) -> None:
        self.left = {column: {alike(text) for text in texts} for column, texts in planted.items()}
        self._all = set().union(*self.left.values())

    def look_at(self, page: Page) -> None:
        nodes = set(shown(page))
        # What stands in a sentence of the page's own is looked for in those alone.
        sentences = "\n".join(nodes - self._all)
        for column, left in self.left.items():
            self.left[column] = {text for text in left if text not in nodes and text not in sentences}


def show_all(page: Page) -> None:
    """A list that goes on is shown to its end."""
    more = page.locator("main").last.get_by_role("button", name="Show more")
    page.wait_for_load_state("networkidle")
    while more.count():
        with page.expect_response(lambda answer: "/api/" in answer.url and "after=" in answer.url):
            more.first.dispatch_event("click")
        expect(page.locator("button[data-loading]")).to_have_count(0, timeout=_LIMIT_MS)


ONE_AT_A_TIME: Final = {
    "assessments.note", "programme_versions.note", "recordings.station", "recordings.taught_by", "sessions.signed_by", "runs.stop_message",
    "session_stops.code",
}  # fmt: skip
"""What stands on the page of one record alone, and of which ten have been looked at."""
NEWEST: Final = {
    "backups.file", "backups.problem", "backups.test_problem", "backups.audit_problem", "broken_glass.reason", "broken_glass.reviewed_by",
}  # fmt: skip
"""Of which a page lists the newest hundred or two."""
_UNLIKE: Final = 10
"""So few of five hundred may be drawn otherwise than they are looked for: cut in the middle of white space."""
ON_NO_PAGE: Final = {
    "stations.name", "erasures.decided_by", "erasures.explanation", "sessions.note", "teachings.name", "teachings.taught_by",
    "patients.notes", "recordings.note", "device_events.station", "device_events.code", "runs.stop_code",
}  # fmt: skip
"""Notes, which are looked at fifty texts together, and what no page shows at all."""


# -- what is in the database, and what the API says of it --------------------------------------------------------------


def test_five_hundred_texts_would_each_run_on_an_unsafe_page(texts: list[str]) -> None:
    assert len(set(texts)) == 500
    assert all(len(text) > len(CALL) for text in texts)


def test_every_column_of_text_holds_them(poisoned: Poisoned) -> None:
    planted, columns = poisoned.poison.planted, set(text_columns())
    assert columns - set(planted) == NOT_WRITTEN, (
        "a column of text is neither filled nor said to be nobody's to write in"
    )
    assert set(planted) - ON_NO_PAGE - ONE_AT_A_TIME <= {
        column for column, found in planted.items() if len(found) >= 500
    }


def test_every_text_that_the_api_knows_has_held_them(poisoned: Poisoned, texts: list[str]) -> None:
    document = json.loads((ROOT / "frontend/openapi.json").read_text())
    schemas = document["components"]["schemas"]
    planted = {text for column in poisoned.poison.planted.values() for text in column} | set(poisoned.poison.together)
    # Who has ticked, what was done: within a column of something else, so without the column's mark.
    planted |= set(texts)
    told: set[str] = set()
    held: set[str] = set()
    taken: set[str] = set()
    for path, methods in document["paths"].items():
        for operation in methods.values():
            for content in operation.get("requestBody", {}).get("content", {}).values():
                taken.update(text_fields(content["schema"], schemas))
            for code, answer in operation["responses"].items():
                schema = answer.get("content", {}).get("application/json", {}).get("schema")
                if code.startswith("2") and schema:
                    told.update(text_fields(schema, schemas))
        schema = methods.get("get", {}).get("responses", {}).get("200", {}).get("content", {}).get("application/json")
        if schema and path.startswith("/api/") and methods["get"]["operationId"] not in _NOT_ASKED:
            answer = poisoned.ask(
                _filled(path, poisoned.poison.ids), **_query(methods["get"], poisoned.poison.ids | _CHOICES)
            )
            held.update(name for name, text in texts_in(answer, schema["schema"], schemas) if text in planted)
    told.discard("")
    cursors = {name for name in told if name.endswith(".next")}
    assert told - held - cursors == MADE_BY_KATA, (
        "an answer has a text field that no hostile text was tried in, and that is not listed as free of user text"
    )
    kept = {name.partition(".")[2] for name in held}
    assert {name for name in taken if name.partition(".")[2] not in kept} == NOT_KEPT


_CHOICES: Final = {"fixtures": "arm_fixer_1", "station": "Station 1"}
_NOT_ASKED: Final = {"get_patient_fhir", "list_ready_patients"}
"""Everything of a patient, which tests/clinic/test_fhir.py has judged; and who may be treated at a station, of which this user has none."""
NOT_KEPT: Final = {
    "", "AccountUpdate.openid", "Reauthentication.password", "BeginOpenId.to", "OidcCallback.iss", "OidcCallback.state", "ChangePassword.old_password", "ChangePassword.password", "GuideRequest.motion_id",
    "LinkSignIn.secret", "SetPassword.password", "SetUp.password", "SetUp.secret",
    "SecondFactorRemoval.password", "SignIn.password", "Unlock.password",
}  # fmt: skip
"""Texts of requests that no answer contains: secrets, and files, which are numbers."""
MADE_BY_KATA: Final = {
    # What a file is called, where it lies.
    "AuditHeads.copy_file", "AuditHeads.elsewhere", "BackupList.folder", "BackupList.key_file",
    # Words and sentences of the program's own, in which nobody's text stands.
    "AuditEntry.role", "CheckAnswer.subject", "Recording.done", "RecordingDetail.done", "Ready.version", "ItemPreview.problem", "Me.language", "MotionTracking.name",
    "ProgressColumn.name", "ProgressTable.rows", "TextKey.code", "PlacedText.code", "PlacedText.places", "RomMeasure.name", "RomMeasure.name_ja", "SessionCheck.sentence", "SessionCheck.subject",
    "SpadiItem.text", "SpadiItem.text_ja", "StopCauseLive.code", "StopCauseLive.message", "StopCauseLive.next_step",
    "RunLive.changes", "RunLive.resistance", "Draft.text",
    # Secrets, told once.
    "OneTimeCode.code", "RecoveryCodes.codes", "SecondFactorBegun.address", "SecondFactorBegun.picture",
    # Of the apparatus, its configuration, and the files that are beside it.
    "AuditEntry.address", "AuditEntry.station", "StationInfo.name", "Hand.motion", "HandMotion.id", "HandMotion.name",
    "UnderstoodMotion.left_alone", "ImportedPatients.left_out",
    "Account.openid", "Away.address", "LoginResult.to", "Me.openid", "StationVersion.config", "StationVersion.software",
    "WaysIn.openid",
    # Names of accounts and patients, which are tried wherever else they stand: there is no care team here.
    "TeamMember.name",
    # Only while somebody is at it.
    "PatientRef.name",
    "StationReport.operator", "StationReport.recording_name", "StationReport.station",
    "LeaseLive.holder", "LeaseLive.taken_from", "RunLive.recording_name",
    # Only while the database is away.
    "ReadyPatient.contraindications",
}  # fmt: skip
"""Texts of the API that do not come out of what people write."""


def _filled(path: str, ids: dict[str, str]) -> str:
    return path.format_map(ids | {"chart": "rom"})


def _query(operation: Any, ids: dict[str, str]) -> dict[str, str]:
    asked = [one for one in operation.get("parameters", ()) if one["in"] == "query" and one.get("required")]
    return {one["name"]: ids[one["name"]] for one in asked}


# -- shown in a browser ------------------------------------------------------------------------------------------------


def test_watcher_detects_every_unsafe_text(page: Page, poisoned: Poisoned, told: list[str]) -> None:
    page.goto(poisoned.url)
    with page.expect_console_message(lambda said: "script-src" in said.text):  # The picture fails when it fails.
        page.evaluate("document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=kataHostile(1)>')")
    page.evaluate("document.body.setAttribute('style', 'color: red')")
    expect(page.locator("img[src=x]")).to_have_count(1)
    page.evaluate("kataHostile()")
    assert any("script-src" in one for one in told)
    assert any("style-src" in one for one in told)
    assert "a script has run" in told


@pytest.mark.campaign
@pytest.mark.timeout(900)
def test_five_hundred_hostile_texts_run_nowhere(page: Page, poisoned: Poisoned, told: list[str]) -> None:
    seen = Seen(poisoned.poison.planted)
    for path in (
        "/patients", "/sessions", "/account", "/administration/accounts", "/administration/audit",
        "/administration/emergency-access", "/administration/backups",
    ):  # fmt: skip
        page.goto(poisoned.url + path)
        show_all(page)
        seen.look_at(page)
    for place, together in zip(poisoned.poison.places, poisoned.poison.together, strict=True):
        for path, last in (
            (f"/patients/{place.patients}", together),
            (f"/recordings/{place.recordings}", together),
            (f"/sessions/{place.sessions}", together),
            (f"/programmes/{place.programmes}", ""),
            (f"/episodes/{place.episodes}/progress", ""),
            (f"/?patient={place.patients}&recording={place.recordings}", ""),
            (f"/api/sessions/{place.sessions}/report.html", together),
            (f"/api/episodes/{place.episodes}/report.html?language=ja", ""),
        ):
            page.goto(poisoned.url + path)
            if last:
                expect(page.locator("body")).to_contain_text(alike(last), timeout=_LIMIT_MS)
            page.wait_for_load_state("networkidle")
            if path.startswith("/patients/"):
                page.get_by_role("button", name=re.compile("All assessments")).dispatch_event("click")
                show_all(page)
            seen.look_at(page)
    assert told == []
    left = {column: len(texts) for column, texts in seen.left.items() if len(texts) > _UNLIKE}
    assert set(left) <= ONE_AT_A_TIME | NEWEST | ON_NO_PAGE, left


# -- names of files, and translations ----------------------------------------------------------------------------------


@pytest.mark.timeout(600)
def test_a_hostile_file_name_is_a_name(page: Page, poisoned: Poisoned, texts: list[str], told: list[str]) -> None:
    page.goto(f"{poisoned.url}/patients/{poisoned.poison.places[0].patients}")
    page.get_by_role("button", name="Import motion from CSV file").dispatch_event("click")
    chooser = page.locator("input[type=file]").first
    chooser.wait_for(state="attached")
    names = [text.replace("/", "\N{DIVISION SLASH}") for text in texts]
    missing: list[str] = page.evaluate(_CHOOSE, names)
    assert missing == []
    assert told == []


_CHOOSE: Final = """async (names) => {
    // As if somebody chose one file after the other; after each, the page has drawn itself anew.
    const missing = [], dialog = document.querySelector("[role=dialog]");
    for (const name of names) {
        const chooser = document.querySelector("input[type=file]"), files = new DataTransfer();
        files.items.add(new File(["time_s\\n0\\n"], name, { type: "text/csv" }));
        chooser.files = files.files;
        chooser.dispatchEvent(new Event("change", { bubbles: true }));
        await new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)));
        if (!dialog.textContent.includes(name)) missing.push(name);
    }
    return missing;
}"""


@pytest.mark.timeout(600)
def test_a_hostile_sentence_of_the_service_is_a_text(
    page: Page, poisoned: Poisoned, texts: list[str], told: list[str]
) -> None:
    """Whatever a translator has made of what it answers: it is told as it comes."""
    all_of_them = " | ".join(texts)
    problem = {"title": "T", "status": 409, "detail": all_of_them, "code": "x", "next_step": all_of_them}
    page.route(
        "**/api/patients?*",
        lambda route: route.fulfill(status=409, content_type="application/problem+json", body=json.dumps(problem)),
    )
    page.goto(f"{poisoned.url}/patients")
    expect(page.get_by_role("alert").last).to_contain_text(alike(all_of_them), timeout=_LIMIT_MS)
    assert told == []


@pytest.mark.timeout(600)
def test_a_hostile_translation_of_a_report_is_a_text(
    page: Page,
    poisoned: Poisoned,
    texts: list[str],
    told: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Three texts behind each of the reports' words, in both languages."""
    behind = {}
    for number, (key, both) in enumerate(phrases.WORDS.items()):
        more = [texts[(3 * number + n) % len(texts)] for n in range(3)]
        behind[key] = more
        # What stands in braces is put in; a text's own are none of those.
        written = " | ".join(more).replace("{", "{{").replace("}", "}}")
        monkeypatch.setitem(phrases.WORDS, key, (f"{both[0]} {written}", f"{both[1]} {written}"))
    database = Database(f"sqlite:///{tmp_path / 'kata.db'}")
    upgrade(database)
    visit, care = contents(database)
    database.close()
    shown_of: set[str] = set()
    for language in phrases.LANGUAGES:
        for made in (rendering.session_page(visit, how(language)), rendering.episode_page(care, how(language))):
            where = f"{poisoned.url}/translated"
            page.route(where, partial(_answer_with, made))
            page.goto(where)
            text = " ".join(shown(page))
            shown_of.update(key for key, more in behind.items() if alike(" | ".join(more)) in text)
            page.unroute(where)
    assert told == []
    assert len(shown_of) > len(behind) / 2, "most words of a report stand on one of these four"


def _answer_with(made: rendering.ReportPage, route: Route) -> None:
    headers = {"Content-Security-Policy": made.policy}
    route.fulfill(content_type="text/html; charset=utf-8", headers=headers, body=made.html)
