"""Reports of unusual records, each of which once misled a reader."""

import json
import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from uuid import UUID, uuid4

import pytest

from kata.clinic.contraindications.tables import ContraindicationRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.database.engine import Database
from kata.reporting import episode, rendering
from kata.reporting.content import EpisodeContent, PrintedSession, RehabilitationPlanContent, RunContent, SessionContent
from kata.reporting.phrases import LANGUAGES, PHRASES, Language
from kata.reporting.rendering import ReportPage
from tests.support.paths import ROOT
from tests.support.reports import contents, print_options
from tests.support.treatment import DAY, treat


@pytest.fixture(scope="module")
def treated(sqlite: Database) -> tuple[SessionContent, EpisodeContent]:
    return contents(sqlite, sessions=2)


def text_of(page: ReportPage) -> str:
    return " ".join(re.sub("<[^>]+>", " ", page.html).split())


def _without_comparison(run: RunContent) -> RunContent:
    return replace(run, motors=(), motions=(), worst_rmse_deg=None, worst_peak_deg=None, parts=None)


def test_a_playback_with_reduced_range_only_was_played(treated: tuple[SessionContent, EpisodeContent]) -> None:
    visit, _ = treated
    run = replace(_without_comparison(visit.runs[0]), compared_percent=0.0, least_range_percent=60.0, partial=True)
    visit = replace(visit, runs=(run,))
    text = text_of(rendering.session_page(visit, print_options()))
    assert "The whole playback had a reduced range." in text
    assert "Nothing was played" not in text
    assert "再生されていない" not in text_of(rendering.session_page(visit, print_options("ja")))


def test_a_playback_that_has_not_ended_is_not_called_unplayed(treated: tuple[SessionContent, EpisodeContent]) -> None:
    visit, _ = treated
    run = replace(_without_comparison(visit.runs[0]), ended_at=None, outcome="loaded", compared_percent=None)
    text = text_of(rendering.session_page(replace(visit, runs=(run,)), print_options()))
    assert "This playback has not ended, so nothing has been compared yet." in text
    assert "Nothing was played" not in text


def test_a_time_of_another_day_names_the_day(treated: tuple[SessionContent, EpisodeContent]) -> None:
    """A session over midnight, or one that was forgotten and ended the next morning."""
    visit, _ = treated
    began = datetime(2026, 11, 2, 14, 50, tzinfo=UTC)  # 23:50 in Tokyo
    after_midnight = began + timedelta(minutes=20)
    run = replace(visit.runs[0], started_at=after_midnight, ended_at=after_midnight)
    visit = replace(visit, started_at=began, ended_at=began + timedelta(hours=9), runs=(run,), checks=(), readings=())
    text = text_of(rendering.session_page(visit, print_options()))
    assert "23:50 to 3 Nov 2026 08:50, 540 min" in text
    assert "1 3 Nov 2026 00:10 Abduction to 90" in text


@pytest.mark.parametrize("language", LANGUAGES)
def test_reports_write_every_date_in_one_notation(
    treated: tuple[SessionContent, EpisodeContent], language: Language
) -> None:
    """Narrow columns and times of another day once had dates such as 2026-11-03."""
    visit, care = treated
    overnight = replace(visit, ended_at=visit.started_at + timedelta(days=1))
    pages = [
        rendering.session_page(overnight, print_options(language)),
        rendering.episode_page(care, print_options(language)),
    ]
    if language == "ja":
        pages.append(rendering.rehabilitation_plan_page(RehabilitationPlanContent(care, ()), print_options(language)))
    for page in pages:
        text = text_of(page)
        assert ("2026年11月" if language == "ja" else " Nov 2026") in text
        assert not re.search(r"\d{4}-\d", text)


@pytest.mark.parametrize(
    ("language", "motion"), [("en", "Abduction / adduction (motion 4)"), ("ja", "肩関節 外転・内転（動作4）")]
)
def test_a_motions_number_is_not_taken_for_a_motor(
    treated: tuple[SessionContent, EpisodeContent], language: Language, motion: str
) -> None:
    """Motors and motions have numbers beside each other: motion 4 is moved by motor 3."""
    visit, care = treated
    for page in (
        rendering.session_page(visit, print_options(language)),
        rendering.episode_page(care, print_options(language)),
    ):
        assert motion in text_of(page)
        assert not re.search(r">\s*[1-6] (Abduction|Flexion|External|Horizontal|Scapular|肩)", page.html)


@pytest.mark.parametrize(("language", "motor"), [("en", "Motor\u00a0"), ("ja", "モータ")])
def test_a_motors_number_is_not_taken_for_a_motion(
    treated: tuple[SessionContent, EpisodeContent], language: Language, motor: str
) -> None:
    """The rows of the motors' errors were once called 1 to 5, beside those of the motions 1 to 6."""
    page = rendering.session_page(treated[0], print_options(language)).html
    rows = re.findall(r'<th scope="row">([^<]*)</th>', page)
    assert {f"{motor}{number}" for number in range(1, 6)} <= set(rows)
    assert not {"1", "2", "3", "4", "5", "6"} & set(rows)


def _second_episode(database: Database, **contraindication: object) -> UUID:
    """Write a closed episode with a contraindication, and a new one of the same shoulder a year later. Return the new one."""
    with database.write() as writing:
        first = writing.get_one(EpisodeRow, treat(writing).episode_id)
        first.closed_at = DAY + timedelta(days=30)
        second = EpisodeRow(
            id=uuid4(), patient_id=first.patient_id, side="left", diagnosis="", contraindications="", limits=[], limits_by="",
            opened_at=DAY + timedelta(days=365), closing_note="", updated_at=DAY,
        )  # fmt: skip
        writing.add(second)
        row = {"note": "Humeral head.", "noted_by": "Dr. Mori", "noted_at": DAY} | contraindication
        writing.add(ContraindicationRow(id=uuid4(), patient_id=first.patient_id, episode_id=first.id, **row))
        return second.id


def _read(database: Database, episode_id: UUID) -> EpisodeContent:
    with database.read() as reading:
        return episode.read_content(reading, episode_id, UTC)


def test_a_contraindication_of_an_earlier_episode_is_printed(sqlite: Database) -> None:
    care = _read(sqlite, _second_episode(sqlite, code="tumour"))
    assert "Tumour of shoulder or arm Humeral head." in text_of(rendering.episode_page(care, print_options()))
    plan = rendering.rehabilitation_plan_page(RehabilitationPlanContent(care, ()), print_options())
    assert "肩または腕の腫瘍：Humeral head." in text_of(plan)


def test_a_contraindication_that_ended_before_the_episode_is_not_printed(sqlite: Database) -> None:
    ended = {"resolved_at": DAY + timedelta(days=20), "resolved_by": "Dr. Mori", "resolution": "United."}
    assert _read(sqlite, _second_episode(sqlite, code="fracture", **ended)).listed == ()


def test_a_missing_permission_is_printed(sqlite: Database) -> None:
    missing = _read(sqlite, _second_episode(sqlite, code="recent_repair"))
    assert "No doctor has allowed the treatment" in text_of(rendering.episode_page(missing, print_options()))
    plan = rendering.rehabilitation_plan_page(RehabilitationPlanContent(missing, ()), print_options())
    assert "2026年11月2日、Dr. Mori、医師の許可なし" in text_of(plan)
    given = {"signed_off_at": DAY + timedelta(days=366), "signed_off_by": "Dr. Abe"}
    allowed = _read(sqlite, _second_episode(sqlite, code="recent_repair", **given))
    assert "No doctor" not in text_of(rendering.episode_page(allowed, print_options()))
    plan = rendering.rehabilitation_plan_page(RehabilitationPlanContent(allowed, ()), print_options())
    assert "治療の許可：Dr. Abe、2027年11月3日" in text_of(plan)


def test_the_first_treatment_of_a_plan_moved_a_patient(treated: tuple[SessionContent, EpisodeContent]) -> None:
    """Neither a session of the simulated apparatus nor one in which nothing was played is the first treatment."""
    _, care = treated
    first, second = care.sessions

    def day_of(*sessions: PrintedSession) -> str:
        content = RehabilitationPlanContent(replace(care, sessions=sessions), ())
        text = text_of(rendering.rehabilitation_plan_page(content, print_options()))
        return text.partition("装置による初回の治療日（記録）")[2].partition("併存疾患")[0].strip()

    assert day_of(first, second) == "2026年11月2日"
    assert day_of(replace(first, simulated=True), second) == "2026年11月5日"
    assert day_of(replace(first, was_played=False), second) == "2026年11月5日"
    assert day_of(replace(first, was_played=False)) == ""


@pytest.mark.parametrize(("language", "slip"), [("en", "the arm can slip in its cuff"), ("ja", "固定具の中で滑る")])
def test_angles_of_end_feel_tests_have_the_slip_caveat(language: Language, slip: str) -> None:
    assert slip in PHRASES["end_feel_explained"][LANGUAGES.index(language)]
    page = json.loads((ROOT / f"frontend/src/locales/{language}/endFeel.json").read_text())
    assert slip in page["definitions"]
