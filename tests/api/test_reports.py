"""Reports over REST: content, type and headers."""

import io
import sys
from typing import Any
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient
from pypdf import PdfReader

from tests.support.responses import problem
from tests.support.treatment import Treated, treat

pytestmark = pytest.mark.no_apparatus


@pytest.fixture(scope="module")
def treated(client: TestClient) -> Treated:
    app: Any = client.app
    with app.state.services.database.write() as writing:
        return treat(writing, sessions=2)


@pytest.fixture(params=["sessions", "episodes"])
def address(request: pytest.FixtureRequest, treated: Treated) -> str:
    key = treated.session_ids[0] if request.param == "sessions" else treated.episode_id
    return f"/api/{request.param}/{key}/report"


@pytest.mark.parametrize("language", ["en", "ja"])
def test_a_report_is_a_page_that_may_do_nothing(client: TestClient, address: str, language: str) -> None:
    answer = client.get(f"{address}.html", params={"language": language})
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert answer.headers["content-security-policy"].startswith("default-src 'none'; style-src 'sha256-")
    assert answer.headers["cache-control"] == "no-store"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert f'<html lang="{language}">' in answer.text


def test_a_report_is_a_pdf(client: TestClient, address: str) -> None:
    answer = client.get(f"{address}.pdf", params={"language": "ja"})
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "application/pdf"
    assert answer.headers["content-disposition"].startswith('inline; filename="')
    assert "Yamada" not in answer.headers["content-disposition"]
    pages = PdfReader(io.BytesIO(answer.content)).pages
    assert "報告書" in pages[0].extract_text()


def test_rehabilitation_plan_is_a_japanese_pdf(client: TestClient, treated: Treated) -> None:
    answer = client.get(f"/api/episodes/{treated.episode_id}/rehabilitation-plan.pdf")
    assert answer.headers["content-type"] == "application/pdf"
    assert answer.headers["cache-control"] == "no-store"
    assert "Yamada" not in answer.headers["content-disposition"]
    assert "リハビリテーション実施計画書" in PdfReader(io.BytesIO(answer.content)).pages[0].extract_text()


def test_without_the_printing_library_only_pages_are_shown(
    client: TestClient, address: str, treated: Treated, monkeypatch: pytest.MonkeyPatch
) -> None:
    """plutoprint has no wheel for 64-bit ARM."""
    monkeypatch.setitem(sys.modules, "plutoprint", None)
    refused = client.get(f"{address}.pdf")
    problem(refused, 503, "no_printing")
    assert "browser" in refused.json()["next_step"]
    problem(client.get(f"/api/episodes/{treated.episode_id}/rehabilitation-plan.pdf"), 503, "no_printing")
    assert client.get(f"{address}.html").status_code == 200


@pytest.mark.parametrize("kind", ["html", "pdf"])
def test_report_is_english_unless_another_language_is_requested(client: TestClient, address: str, kind: str) -> None:
    answer = client.get(f"{address}.{kind}")
    text = answer.text if kind == "html" else PdfReader(io.BytesIO(answer.content)).pages[0].extract_text()
    assert "report" in text
    assert "報告書" not in text


@pytest.mark.parametrize("kind", ["html", "pdf"])
@pytest.mark.parametrize("of", ["sessions", "episodes"])
def test_report_needs_a_session_and_a_supported_language(client: TestClient, of: str, kind: str) -> None:
    problem(client.get(f"/api/{of}/{uuid4()}/report.{kind}"), 404, "not_found")
    problem(client.get(f"/api/{of}/{uuid4()}/report.{kind}", params={"language": "xx"}), 422, "invalid")


def test_report_of_a_new_session_is_a_draft(client: TestClient, patient: dict[str, Any]) -> None:
    begun = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    text = client.get(f"/api/sessions/{begun['id']}/report.html").text
    assert "still open" in text
    assert "Not signed." in text
    assert "Nothing was played in this session." in text
