"""Every page shows texts of users as they were written, and never runs them as a script or a style.

:mod:`tests.support.poisoned_database` fills the database with one row for each text, so that a list shows all five hundred. The pages of
single records show ten records, whose notes hold fifty texts each. The API's document lists the text fields.
"""

import json
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final

import httpx2
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Route, expect

from kata.auth.login_session import COOKIE
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from kata.reporting import phrases, rendering
from tests.support.browser_clinic import START_LIMIT_S
from tests.support.hostile_texts import CALL, hostile
from tests.support.paths import ROOT
from tests.support.poisoned_clinic import PoisonedClinic
from tests.support.poisoned_database import NOT_WRITTEN, text_columns
from tests.support.reports import contents, print_options
from tests.support.text_fields import text_fields, texts_in

_LIMIT_MS: Final = START_LIMIT_S * 1000
_WATCH: Final = """
    window.kataHostile = () => window.kataTell("a script has run");
    addEventListener("securitypolicyviolation", (event) => window.kataTell(`${event.violatedDirective} ${event.blockedURI} ${event.sample}`));
"""


class Poisoned(PoisonedClinic):
    """A poisoned clinic with its API."""

    def ask(self, path: str, **query: Any) -> Any:
        """Return the API's answer."""
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
def context(browser_without_3d: Browser, browser_context_args: dict[str, Any]) -> Iterator[BrowserContext]:
    """Return a browser of one test: functions and scripts that a test adds to it cannot be removed."""
    made = browser_without_3d.new_context(**browser_context_args)
    yield made
    made.close()


@pytest.fixture
def violations(context: BrowserContext, poisoned: Poisoned) -> list[str]:
    """Return the list that collects messages of scripts, dialogs and policy violations. A test passes with an empty list."""
    said: list[str] = []

    def note(one: Any) -> None:
        if "Content Security Policy" in one.text:
            said.append(one.text)

    def dismissed(dialog: Any) -> None:
        said.append(f"dialog {dialog.message}")
        dialog.dismiss()

    context.add_cookies([{"name": COOKIE, "value": poisoned.cookie, "url": poisoned.url}])
    context.expose_function("kataTell", lambda what: said.append(what))  # Playwright marks the functions that it calls.
    context.add_init_script(_WATCH)
    context.on("dialog", dismissed)
    context.on("console", note)
    return said


@pytest.fixture
def page(context: BrowserContext, violations: list[str]) -> Page:
    """Return an empty page instead of the station's page."""
    made: Page = context.new_page()
    made.set_default_timeout(_LIMIT_MS)
    return made


def alike(text: str) -> str:
    """Return the text with its white space collapsed, as a browser shows it."""
    return " ".join(text.split())


def shown(page: Page) -> list[str]:
    """Return every text of a page and the values of its fields."""
    found: list[str] = page.evaluate(_TEXTS)
    return [alike(text) for text in found]


_TEXTS: Final = """() => {
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), texts = [document.title];
    while (walker.nextNode()) texts.push(walker.currentNode.data);
    return [...texts, ...[...document.querySelectorAll("input, textarea")].map((one) => one.value)];
}"""


class Seen:
    """Tracks which texts have been shown, by column of the database."""

    def __init__(self, planted: dict[str, list[str]]) -> None:
        self.left = {column: {alike(text) for text in texts} for column, texts in planted.items()}
        self._all = set().union(*self.left.values())

    def look_at(self, page: Page) -> None:
        nodes = set(shown(page))
        # A text within a sentence of the page is searched in the page's own sentences only.
        sentences = "\n".join(nodes - self._all)
        for column, left in self.left.items():
            self.left[column] = {text for text in left if text not in nodes and text not in sentences}


def show_all(page: Page) -> None:
    """Press "Show more" until the list is complete."""
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
"""Columns that only the page of one record shows. The test looks at ten records."""
NEWEST: Final = {
    "backups.file", "backups.problem", "backups.test_problem", "backups.audit_problem", "broken_glass.reason", "broken_glass.reviewed_by",
}  # fmt: skip
"""Columns of which a page lists the newest one or two hundred rows."""
_UNLIKE: Final = 10
"""Accepted number of texts, of five hundred, that a page cuts in the middle of white space."""
ON_NO_PAGE: Final = {
    "stations.name", "erasures.decided_by", "erasures.explanation", "sessions.note", "teachings.name", "teachings.taught_by",
    "patients.notes", "recordings.note", "device_events.station", "device_events.code", "runs.stop_code",
}  # fmt: skip
"""Notes, whose texts are checked fifty together, and columns that no page shows."""


# -- the database and the API ------------------------------------------------------------------------------------------


def test_five_hundred_texts_would_each_run_on_an_unsafe_page(texts: list[str]) -> None:
    assert len(set(texts)) == 500
    assert all(len(text) > len(CALL) for text in texts)


def test_every_column_of_text_holds_them(poisoned: Poisoned) -> None:
    planted, columns = poisoned.poison.planted, set(text_columns())
    assert columns - set(planted) == NOT_WRITTEN, "a text column is neither filled nor listed as not written by users"
    assert set(planted) - ON_NO_PAGE - ONE_AT_A_TIME <= {
        column for column, found in planted.items() if len(found) >= 500
    }


@pytest.mark.campaign
def test_every_text_that_the_api_knows_has_held_them(poisoned: Poisoned, texts: list[str]) -> None:
    document = json.loads((ROOT / "frontend/openapi.json").read_text())
    schemas = document["components"]["schemas"]
    planted = {text for column in poisoned.poison.planted.values() for text in column} | set(poisoned.poison.together)
    # Some texts, such as who confirmed a check, are within another column and have no mark of their own.
    planted |= set(texts)
    fields: set[str] = set()
    held: set[str] = set()
    taken: set[str] = set()
    for path, methods in document["paths"].items():
        for operation in methods.values():
            for content in operation.get("requestBody", {}).get("content", {}).values():
                taken.update(text_fields(content["schema"], schemas))
            for code, answer in operation["responses"].items():
                schema = answer.get("content", {}).get("application/json", {}).get("schema")
                if code.startswith("2") and schema:
                    fields.update(text_fields(schema, schemas))
        schema = methods.get("get", {}).get("responses", {}).get("200", {}).get("content", {}).get("application/json")
        if schema and path.startswith("/api/") and methods["get"]["operationId"] not in _NOT_ASKED:
            answer = poisoned.ask(
                _filled(path, poisoned.poison.ids), **_query(methods["get"], poisoned.poison.ids | _CHOICES)
            )
            held.update(name for name, text in texts_in(answer, schema["schema"], schemas) if text in planted)
    fields.discard("")
    cursors = {name for name in fields if name.endswith(".next")}
    assert fields - held - cursors == MADE_BY_KATA, (
        "an answer has a text field that no hostile text was tried in, and that is not listed as free of user text"
    )
    fields_held = {name.partition(".")[2] for name in held}
    assert {name for name in taken if name.partition(".")[2] not in fields_held} == NOT_KEPT


_CHOICES: Final = {"fixtures": "arm_fixer_1", "station": "Station 1"}
_NOT_ASKED: Final = {
    "get_patient_fhir",
    "list_ready_patients",
    "get_commissioning",
    "get_recording_rhythm",
    "get_run_rhythm",
    "get_end_feel",
}
"""Operations without an answer here: the FHIR export, which tests/clinic/test_fhir.py checks; the patients of a station, which this user
does not have; commissioning records, of which there are none; the rhythm, because the recordings here are of no pose of the scapula; and end-feel tests, of which there are none.
"""
NOT_KEPT: Final = {
    "", "AccessTokenCreate.password", "AccountUpdate.openid", "Reauthentication.password", "BeginOpenId.to", "OidcCallback.iss", "OidcCallback.state", "ChangePassword.old_password", "ChangePassword.password", "GuideRequest.motion_id",
    "PatientModeStart.questionnaire", "StationFile.config", "LinkSignIn.secret", "SetPassword.password", "SetUp.password", "SetUp.secret",
    "ClinicProfileUpdate.phone", "ClinicProfileUpdate.time_zone", "SecondFactorRemoval.password", "SignIn.password", "SignOff.doctor", "Unlock.password",
}  # fmt: skip
"""Texts of requests that no answer contains by this name: secrets, files, which are numbers, the doctor who is ``signed_off_by``, and parts of
a letterhead that this clinic has not (MADE_BY_KATA)."""
MADE_BY_KATA: Final = {
    # Names and folders of files.
    "AuditHeads.copy_file", "AuditHeads.elsewhere", "BackupList.folder", "BackupList.key_file",
    # Kata's own words and sentences, without a text of a user.
    "AuditEntry.role", "CheckAnswer.subject", "Contraindication.name", "Contraindication.source", "ContraindicationKind.name", "ContraindicationKind.source", "Readiness.version", "ItemPreview.problem", "Me.language", "MotionTracking.name", "EndRangeDone.name", "EndRangeLive.name", "EndRangeLive.problem",
    "ProgressColumn.name", "ProgressTable.rows", "ReachMargin.quantity", "StageProposal.source", "TextKey.code", "PlacedText.code", "PlacedText.places", "RomMeasure.name", "RomMeasure.name_ja", "SessionCheck.sentence", "SessionCheck.subject",
    "SpadiItem.text", "SpadiItem.text_ja", "StopCauseLive.code", "StopCauseLive.message", "StopCauseLive.next_step", "MotorTuning.advice", "GainTuningReview.fault",
    "RunLive.changes", "RunLive.resistance", "Draft.text", "LearningNote.message",
    # The id of a take or run.
    "RhythmLive.motion_id",
    # Kata's own words. An edit that uses another recording names it, and Recording.name tries that name.
    "Recording.done", "RecordingDetail.done",
    # Definitions of questionnaires, and texts that a technician imports on the service's computer.
    "AnswerOption.label", "ChangeThreshold.source", "PatientQuestion.text", "PatientQuestionnaire.copyright", "PatientQuestionnaire.title", "Questionnaire.better",
    "ProgressNote.title", "ProgressNote.sentence", "ProgressNote.source",
    "Questionnaire.code", "Questionnaire.copyright", "Questionnaire.scoring_source", "Questionnaire.title", "QuestionnaireScore.code", "QuestionnaireScore.title",
    # The therapist of a session, which SessionSummary.therapist tries; no programme of the poisoned clinic is due or followed.
    "DuePatient.therapist", "PatientAdherence.therapist", "Operation.version",
    # Steps, values and faults of a commissioning, and what a station's file is accepted with.
    "CommissioningSignature.changed", "CommissioningSignature.public_key", "CommissioningState.reason", "CommissioningStepRun.fault", "CommissioningStepRun.step", "CommissioningValue.after", "CommissioningValue.before",
    "CommissioningValue.name", "CommissioningInstruction.kind", "CommissioningInstruction.text", "CommissioningStepState.description", "CommissioningStepState.title", "SettingChange.name", "SettingChange.unit",
    "SettingField.name", "SettingField.unit", "DriveWarningLive.code", "DriveWarningLive.message", "DriveWarningLive.next_step",
    # Read from records and files on the service's computer, of which there are none: names of stations and of who did it, values.
    *(f"Commissioning{kind}.{name}" for kind in ("", "Detail") for name in ("configuration_digest", "digest", "done_by", "fault", "software", "station")),
    "CommissioningRunState.by", "SettingChange.after", "SettingChange.before", "SettingField.value", "StationVersion.changed_by",
    # Secrets, shown once.
    "CreatedAccessToken.token", "OneTimeCode.code", "RecoveryCodes.codes", "SecondFactorSetup.address", "SecondFactorSetup.picture",
    # Texts of the apparatus, its configuration and its files.
    "AuditEntry.address", "AuditEntry.station", "StationInfo.name", "Hand.motion", "HandMotion.id", "HandMotion.name",
    "UnderstoodMotion.left_alone", "ImportedPatients.left_out",
    "Account.openid", "ProviderAddress.address", "LoginResult.to", "Me.openid", "StationVersion.config", "StationVersion.software",
    "SignInOptions.openid",
    # Names of accounts and patients, which other fields try: this clinic has no care team.
    "TeamMember.name",
    # Only while the apparatus is in use.
    "PatientRef.name",
    "StationReport.operator", "StationReport.recording_name", "StationReport.station",
    "LeaseLive.holder", "LeaseLive.taken_from", "RunLive.recording_name",
    # Only during a database outage.
    "ReadyPatient.contraindications",
    # An administrator's own words, of which this clinic has none; tests/api/test_clinic_profile.py tries them.
    "ClinicProfile.name", "ClinicProfile.address", "ClinicProfile.phone", "ClinicProfile.time_zone", "Me.time_zone", "ClinicProfile.updated_by",
    # The name of an account, which other fields try. No restricted record was opened in an emergency.
    "Notification.name",
    # The name of an access token, which AccessToken.name tries.
    "CreatedAccessToken.name",
    # The name of a recording, which RecordingDetail.name tries.
    "SoundRecording.name",
    # The name of a recording, as before, and names of motions.
    "EndFeelRecord.recording_name", "EndFeelRecord.name", "EndFeelMotion.name",
}  # fmt: skip
"""Text fields of the API that contain no text of a user."""


def _filled(path: str, ids: dict[str, str]) -> str:
    return path.format_map(ids | {"chart": "rom"})


def _query(operation: Any, ids: dict[str, str]) -> dict[str, str]:
    asked = [
        parameter
        for parameter in operation.get("parameters", ())
        if parameter["in"] == "query" and parameter.get("required")
    ]
    return {parameter["name"]: ids[parameter["name"]] for parameter in asked}


# -- shown in a browser ------------------------------------------------------------------------------------------------


@pytest.mark.campaign
def test_watcher_detects_every_unsafe_text(page: Page, poisoned: Poisoned, violations: list[str]) -> None:
    page.goto(poisoned.url)
    with page.expect_console_message(
        lambda said: "script-src" in said.text
    ):  # At any time after the picture has failed.
        page.evaluate("document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=kataHostile(1)>')")
    page.evaluate("document.body.setAttribute('style', 'color: red')")
    expect(page.locator("img[src=x]")).to_have_count(1)
    page.evaluate("kataHostile()")
    assert any("script-src" in violation for violation in violations)
    assert any("style-src" in violation for violation in violations)
    assert "a script has run" in violations


@pytest.mark.campaign
@pytest.mark.timeout(900)
def test_five_hundred_hostile_texts_run_nowhere(page: Page, poisoned: Poisoned, violations: list[str]) -> None:
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
            seen.look_at(page)
            for tab in page.get_by_role("tab", selected=False).all_inner_texts():
                chosen = page.get_by_role("tab", name=tab, exact=True)
                chosen.dispatch_event("click")
                expect(chosen).to_have_attribute("aria-selected", "true")
                # The network of a page that was idle before counts as idle at once. A tab is part of the address.
                page.reload()
                expect(chosen).to_have_attribute("aria-selected", "true", timeout=_LIMIT_MS)
                page.wait_for_load_state("networkidle")
                if tab == "Assessments":
                    page.get_by_role("button", name=re.compile("All assessments")).dispatch_event("click")
                show_all(page)
                seen.look_at(page)
    assert violations == []
    left = {column: len(texts) for column, texts in seen.left.items() if len(texts) > _UNLIKE}
    assert set(left) <= ONE_AT_A_TIME | NEWEST | ON_NO_PAGE, left


# -- names of files, and translations ----------------------------------------------------------------------------------


@pytest.mark.campaign
@pytest.mark.timeout(600)
def test_a_hostile_file_name_is_a_name(page: Page, poisoned: Poisoned, texts: list[str], violations: list[str]) -> None:
    """Choose a file with each text as its name."""
    page.goto(f"{poisoned.url}/patients/{poisoned.poison.places[0].patients}?tab=data")
    page.get_by_role("button", name="Import motion from CSV file").dispatch_event("click")
    chooser = page.locator("input[type=file]").first
    chooser.wait_for(state="attached")
    names = [text.replace("/", "\N{DIVISION SLASH}") for text in texts]
    missing: list[str] = page.evaluate(_CHOOSE, names)
    assert missing == []
    assert violations == []


_CHOOSE: Final = """async (names) => {
    // Choose one file after the other, and wait after each until the page has drawn.
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
    page: Page, poisoned: Poisoned, texts: list[str], violations: list[str]
) -> None:
    """The page shows the service's sentence unchanged, also one that a translator has changed."""
    all_of_them = " | ".join(texts)
    problem = {"title": "T", "status": 409, "detail": all_of_them, "code": "x", "next_step": all_of_them}
    page.route(
        "**/api/patients?*",
        lambda route: route.fulfill(status=409, content_type="application/problem+json", body=json.dumps(problem)),
    )
    page.goto(f"{poisoned.url}/patients")
    expect(page.get_by_role("alert").last).to_contain_text(alike(all_of_them), timeout=_LIMIT_MS)
    assert violations == []


@pytest.mark.campaign
@pytest.mark.timeout(600)
def test_a_hostile_translation_of_a_report_is_a_text(
    page: Page,
    poisoned: Poisoned,
    texts: list[str],
    violations: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Append three texts to each of the reports' words, in both languages."""
    behind = {}
    for number, (key, both) in enumerate(phrases.PHRASES.items()):
        more = [texts[(3 * number + n) % len(texts)] for n in range(3)]
        behind[key] = more
        # Braces mark placeholders; double the braces of the texts.
        written = " | ".join(more).replace("{", "{{").replace("}", "}}")
        monkeypatch.setitem(phrases.PHRASES, key, (f"{both[0]} {written}", f"{both[1]} {written}"))
    database = Database(f"sqlite:///{tmp_path / 'kata.db'}")
    upgrade(database)
    visit, care = contents(database)
    database.close()
    shown_of: set[str] = set()
    for language in phrases.LANGUAGES:
        for made in (
            rendering.session_page(visit, print_options(language)),
            rendering.episode_page(care, print_options(language)),
        ):
            where = f"{poisoned.url}/translated"
            page.route(where, partial(_answer_with, made))
            page.goto(where)
            text = " ".join(shown(page))
            shown_of.update(key for key, more in behind.items() if alike(" | ".join(more)) in text)
            page.unroute(where)
    assert violations == []
    assert len(shown_of) > len(behind) / 2, "these four pages show most words of a report"


def _answer_with(made: rendering.ReportPage, route: Route) -> None:
    headers = {"Content-Security-Policy": made.policy}
    route.fulfill(content_type="text/html; charset=utf-8", headers=headers, body=made.html)
