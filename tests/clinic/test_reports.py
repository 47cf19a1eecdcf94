"""Reports show the rows in both languages. Typed texts have no effect on their layout or code."""

import base64
import io
import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any, get_args
from uuid import uuid4

import pytest
from pypdf import PdfReader

from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions.schemas import RunOutcome
from kata.clinic.sessions.tables import SessionRow
from kata.database.arrays import UnreadableError
from kata.database.engine import Database
from kata.database.series import Series
from kata.device.faults import FAULTS
from kata.errors import ProblemError
from kata.motion.edit import AS_TAUGHT
from kata.plotting.figures import RunFigureSamples
from kata.reporting import charts, episode, letterhead, rehabilitation_plan, rendering, session
from kata.reporting.content import DatedValue, EpisodeContent, Limit, RehabilitationPlanContent, SessionContent
from kata.reporting.joining import join_units
from kata.reporting.letterhead import Letterhead, LetterheadError
from kata.reporting.phrases import LANGUAGES, PHRASES, STOP_REASONS_JA, Language, Phrases
from kata.reporting.rendering import PrintOptions, ReportPage
from tests.support.databases import SQLITE_FIRST
from tests.support.paths import ROOT
from tests.support.reports import AT, CLINIC, contents, print_options
from tests.support.treatment import Texts, treat

HOSTILE = (
    """</style></title><script>alert(1)</script><img src=x onerror=alert(1)>"'&{{999*9999}}{%x%}\\</td>} @page{}"""
)
TEMPLATES = ROOT / "backend/kata/reporting/templates"


@pytest.fixture(scope="module")
def signed(sqlite: Database) -> tuple[SessionContent, EpisodeContent]:
    return contents(sqlite, sessions=3)


@pytest.fixture(scope="module")
def draft(sqlite: Database) -> SessionContent:
    return contents(sqlite, signed=False)[0]


def texts_of(pdf: bytes) -> list[str]:
    """The text of every page, without its line breaks."""
    return [" ".join(page.extract_text().split()) for page in PdfReader(io.BytesIO(pdf)).pages]


class Parsed(HTMLParser):
    """The parts of a page. An element that is closed out of order is an error."""

    EMPTY = frozenset({"meta", "img", "br", "line", "polyline", "circle"})

    def __init__(self, page: ReportPage) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.style = ""
        self._open: list[str] = []
        self.feed(page.html.replace("</t", " </t"))
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self.text += " " * (tag == "br")
        if tag not in self.EMPTY:
            self._open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1] == "style":
            self.style += data
        else:
            self.text += data

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]


# -- content ---------------------------------------------------------------------------------------------------


def test_session_report_matches_the_database_rows(signed: tuple[SessionContent, EpisodeContent]) -> None:
    visit, _ = signed
    text = " ".join(Parsed(rendering.session_page(visit, print_options())).text.split())
    for said in (
        "Yamada Hanako (ヤマダ ハナコ)", "12 Apr 1968 (58 years)", "09:30 to 10:11, 41 min", "Sato Ken", "Kata 1", "Left",
        "Went well. More range next time.", "Signed by Sato Ken, 2 Nov 2026 10:30", "Motor 3 does not answer.",
        "pin is in: Left 09:32 Sato Ken", "are closed: arm fixer 2, elbow fixer 2 09:32", "released today 09:32 detected by the apparatus", "Frozen shoulder, version 2, prescribed by Sato Ken, timer 30 min",
        "1 of 3 repetitions playback 1: Played to its end", "0 of 3 repetitions playback 2: Stopped", "Playbacks outside the programme: 3", "Completed as planned",
        "moved back by resistance: 2", "smallest range 80 %", "4.5 to 85.5", "5.0 to 84.9", "Before During After 7 6 5",
    ):  # fmt: skip
        assert said in text, said
    phrases = Phrases("en", "")
    for run in visit.runs:
        assert run.motors
        for motor in run.motors:
            errors = [phrases.number(motor.peak_deg, 2), phrases.number(motor.rmse_deg, 2)]
            assert f"{motor.motor} {' '.join(errors)}" in text.replace("\n", " ")


def test_partial_run_is_marked_beside_its_errors(signed: tuple[SessionContent, EpisodeContent]) -> None:
    visit, _ = signed
    motors = tuple(replace(motor, change_deg=-12.25, wall_peak_deg=3.75) for motor in visit.runs[0].motors)
    run = replace(
        visit.runs[0],
        compared_percent=8.0,
        partial=True,
        clock_offset_s=0.094,
        motors=motors,
        work_j=3.21,
        mean_effort_nm=1.44,
        mean_pace_percent=61.4,
        playback_settings=replace(visit.runs[0].playback_settings, self_paced=True),
    )
    text = " ".join(Parsed(rendering.session_page(replace(visit, runs=(run,)), print_options())).text.split())
    for said in (
        "(partial)", "compared: 8\u00a0% of the playing time, partial, real time ahead by up to 0.094\u00a0s",
        "pace set by the patient,", "mean pace 61\u00a0%, patient's mean effort 1.4\u00a0Nm, work 3.2\u00a0J (estimates)", "3.75 −12.25", "Change by settings is the requested minus the taught motion",
    ):  # fmt: skip
        assert " ".join(said.split()) in text, said
    assert "peak and RMSE include the start" not in text


def test_report_has_the_patients_angle_with_its_uncertainty(signed: tuple[SessionContent, EpisodeContent]) -> None:
    visit, _ = signed
    known = visit.runs[0].motions[0].patient_deg
    assert known
    low, high = known
    text = " ".join(Parsed(rendering.session_page(visit, print_options())).text.split())
    for said in (
        "Abduction / adduction (motion 4) 09:33 20.0 26.0 Sato Ken", "it lies within ± in 95 % of cases", "Patient's angle, °",
        f"{low.angle_deg:.0f}° ± {low.uncertainty_deg:.0f}° to {high.angle_deg:.0f}° ± {high.uncertainty_deg:.0f}°",
    ):  # fmt: skip
        assert said in text, said
    japanese = " ".join(texts_of(rendering.session_pdf(visit, print_options("ja"))))
    assert "患者の角度" in japanese and "角度計の測定値" in japanese


def test_report_has_end_range_time_only_where_it_was_counted(signed: tuple[SessionContent, EpisodeContent]) -> None:
    visit, _ = signed
    first, *others = visit.runs
    held = replace(first.motions[0], end_range_s=92.4, end_range_limits=(5.0, 1.5))
    counted = replace(first, motions=(held, *first.motions[1:]))
    pages = [
        Parsed(rendering.session_page(replace(visit, runs=(run, *others)), print_options())).text
        for run in (counted, first)
    ]
    assert [page.count("End-range time,\u00a0s") for page in pages] == [1, 0]
    assert "92.4 (last 5°, at least 1.5 Nm)" in " ".join(pages[0].split())


def test_report_without_readings_names_only_the_apparatus_angle(signed: tuple[SessionContent, EpisodeContent]) -> None:
    visit, _ = signed
    runs = tuple(
        replace(run, motions=tuple(replace(motion, patient_deg=None) for motion in run.motions)) for run in visit.runs
    )
    text = Parsed(rendering.session_page(replace(visit, runs=runs, readings=()), print_options())).text
    assert "Apparatus angle reached" in text
    assert "Patient's angle" not in text and "Goniometer" not in text


def test_a_session_report_speaks_japanese(draft: SessionContent) -> None:
    text = " ".join(texts_of(rendering.session_pdf(draft, print_options("ja"))))
    for said in ("治療セッション報告書", "患者番号", "ヤマダ ハナコ", "2026年11月2日", "09:30〜10:11", "モータ3が応答しない", "最後まで再生",
                 "みどり整形外科", "宮城県仙台市青葉区", "未署名"):  # fmt: skip
        assert said in text, said


def test_one_repetition_and_one_session_are_singular(signed: tuple[SessionContent, EpisodeContent]) -> None:
    visit, care = signed
    assert visit.plan
    item = visit.plan.items[0]
    once = replace(item.playback_settings, asked=replace(item.playback_settings.asked, repetitions=1))
    plan = replace(visit.plan, items=(replace(item, playback_settings=once, repetitions_done=1),))
    text = Parsed(rendering.session_page(replace(visit, plan=plan), print_options())).text
    assert re.search("1\u00a0of\u00a01 repetition\\b", text)
    text = Parsed(rendering.episode_page(replace(care, sessions=care.sessions[:1]), print_options())).text
    assert "1 session, 2\u00a0Nov\u00a02026." in text


def test_episode_report_matches_the_database_rows(signed: tuple[SessionContent, EpisodeContent]) -> None:
    _, care = signed
    text = " ".join(Parsed(rendering.episode_page(care, print_options())).text.split())
    for said in (
        "Onset 1 Jun 2026", "Freezing 1 Jun 2026", "Frozen 20 Oct 2026", "Abduction / adduction (motion 4) – 95",
        "Highest resistance level: 12 of 25", "Highest speed: 35 °/s", "Set by Sato Ken", "Flexion Active 95 31 Oct 2026 116 11 Nov 2026 +21 141 (11 Nov 2026) 180",
        "External rotation, arm at the side Passive 23 31 Oct 2026 44 11 Nov 2026 +21 69 (11 Nov 2026) 60", "At rest 3 31 Oct 2026 2 11 Nov 2026 −1",
        "(SPADI), 0 to 100 points, lower is better 60.0 31 Oct 2026 40.0 11 Nov 2026 −20.0 improvement beyond measurement error",
        "3 sessions, 2 Nov 2026 to 8 Nov 2026.", "Planned repetitions that were completed: 3 of 18.",
        "Playbacks that were stopped: 3.", "Motor 3 does not answer. 3", "2 Nov 2026 Sato Ken Yes 6 1 1 7 5", "a change of 8 to 13 points important (MCID; Roy, MacDermid",
        "A change of 17 points or less may be measurement error (SDC; Tveita et al. 2008",
    ):  # fmt: skip
        assert said in text, said
    japanese = " ".join(texts_of(rendering.episode_pdf(care, print_options("ja"))))
    for said in ("治療経過報告書", "屈曲", "外旋", "外旋(1st)", "安静時", "禁忌", "発症日", "2026年6月1日", "推移"):
        assert said in japanese, said


def _plan(database: Database, texts: Texts | None = None) -> Parsed:
    with database.write() as writing:
        episode_id = treat(writing, texts or Texts()).episode_id
    with database.read() as reading:
        content = rehabilitation_plan.read_content(reading, episode_id, UTC)
    return Parsed(rendering.rehabilitation_plan_page(content, print_options()))


def test_rehabilitation_plan_says_what_the_record_says(sqlite: Database) -> None:
    text = " ".join(_plan(sqlite).text.split())
    for said in (
        "リハビリテーション実施計画書（案）", "下書きである", "Yamada Hanako（ヤマダ ハナコ）", "1968年4月12日（58歳）", "診断名（記録） Frozen shoulder",
        "拘縮期（frozen）（2026年10月20日から）", "2026年6月1日（発症、記録）", "95°まで", "抵抗許容レベル上限：25段階中12", "Sato Ken",
        "屈曲（自動）116°、2026年11月5日（反対側 141°、2026年11月5日）", "安静時 2（2026年11月5日）", "40.0（2026年11月5日）", "Abduction to 90：速度",
    ):  # fmt: skip
        assert said in text, said


def test_reports_print_limits_and_angles_without_rounding(
    sqlite: Database, signed: tuple[SessionContent, EpisodeContent]
) -> None:
    _, care = signed
    first, *others = care.rom
    angles = (DatedValue(AT, -22.5), DatedValue(AT + timedelta(days=7), 60.3))
    care = replace(
        care,
        limits=(Limit(4, -0.4, 89.6),),
        max_speed_deg_s=7.5,
        rom=(replace(first, readings=angles, other=DatedValue(AT, 141.5)), *others),
    )
    report = " ".join(Parsed(rendering.episode_page(care, print_options())).text.split())
    plan = " ".join(
        Parsed(rendering.rehabilitation_plan_page(RehabilitationPlanContent(care, ()), print_options())).text.split()
    )
    for said in ("−0.4 89.6", "7.5 °/s", "−22.5", "60.3", "+82.8", "141.5 (30 Nov 2026)"):
        assert said in report, said
    for said in ("−0.4°から89.6°まで", "7.5°/s", "60.3°", "141.5°"):
        assert said in plan, said


def test_session_of_both_shoulders_claims_neither(sqlite: Database) -> None:
    with sqlite.write() as writing:
        treated = treat(writing, runs=2)
        row = writing.get_one(SessionRow, treated.session_ids[0])
        row.episode_id = None
        other = RecordingRow(
            id=uuid4(), patient_id=row.patient_id, name="Lift", side="right", station="Kata 1", taught_at=AT, taught_by="", duration_s=1.0,
            rate_hz=100, samples=1, note="",
        )  # fmt: skip
        writing.add(other)
        writing.flush()
        row.runs[1].recording_id = other.id
    with sqlite.read() as reading:
        content = session.read_content(reading, treated.session_ids[0], UTC)
    assert content.side is None
    text = " ".join(Parsed(rendering.session_page(content, print_options())).text.split())
    assert "Treated shoulder Not recorded" in text
    assert "Abduction to 90 (Left)" in text and "Lift (Right)" in text


def test_recording_of_the_other_shoulder_is_marked(signed: tuple[SessionContent, EpisodeContent]) -> None:
    visit, _ = signed
    runs = (replace(visit.runs[0], side="right"), visit.runs[1])
    text = " ".join(Parsed(rendering.session_page(replace(visit, runs=runs), print_options())).text.split())
    assert text.count("Abduction to 90 (Right)") == 2 and "(Left)" not in text


def test_printed_share_is_below_the_bound_of_a_partial_run(signed: tuple[SessionContent, EpisodeContent]) -> None:
    visit, _ = signed
    run = replace(visit.runs[0], compared_percent=89.97, partial=True)
    text = Parsed(rendering.session_page(replace(visit, runs=(run,)), print_options())).text
    assert "compared: 89\u00a0% of the playing time" in text


def test_rehabilitation_plan_leaves_open_what_nobody_recorded(sqlite: Database) -> None:
    text = " ".join(_plan(sqlite).text.split())
    for title, following in (
        ("算定病名", "診断名（記録）"), ("計画評価実施日", "最新の評価日"), ("リハ開始日", "治療内容"), ("併存疾患・合併症", "安静度・リスク"),
        ("目標（1か月）", "目標（終了時）"), ("目標（終了時）", "治療方針"), ("リハ担当医", "主治医"), ("説明者", "説明日"), ("署名", ""),
    ):  # fmt: skip
        assert f"{title} {following}".rstrip() in text, title
    assert "☑" not in text and "■" not in text, "no choice is made for the clinician"


def test_hostile_texts_stay_texts_in_a_rehabilitation_plan(sqlite: Database) -> None:
    parsed = _plan(sqlite, Texts(HOSTILE[:100], HOSTILE[:100], HOSTILE[:100], HOSTILE, HOSTILE[:100], HOSTILE))
    assert HOSTILE in parsed.text
    assert parsed.all("script") == parsed.all("img") == []


def test_report_rates_every_questionnaire_by_its_own_limits(
    sqlite: Database, signed: tuple[SessionContent, EpisodeContent]
) -> None:
    """A change within the published error is called perhaps chance, in both languages, with its source."""
    _, care = signed
    rows = [
        AssessmentRow(assessed_at=AT + timedelta(days=7 * week), spadi=None, questionnaires=answered)
        for week, answered in enumerate(
            (
                {"quickdash": [3] * 11, "oxford": [3] * 12},
                {"quickdash": [3] * 5 + [2] * 6, "oxford": [2] * 12, "ases": [5, *[2] * 10]},
                {"quickdash": [None] * 2 + [1] * 9, "of_tomorrow": [1]},
            )
        )
    ]
    answered = replace(care, questionnaires=tuple(episode._questionnaires(rows)))
    text = " ".join(Parsed(rendering.episode_page(answered, print_options())).text.split())
    first, second = "30 Nov 2026", "7 Dec 2026"
    for said in (
        f"QuickDASH, 0 to 100 points, lower is better 50.0 {first} 36.4 {second} −13.6 improvement of at least the MCID, possibly measurement error",
        f"Oxford Shoulder Score, 0 to 48 points, higher is better 36.0 {first} 24.0 {second} −12.0 worsening beyond measurement error",
        f"higher is better 58.3 {second} – – – –",
        "QuickDASH: patients call a change of 13.4 points important (MCID; van Kampen et al. 2013, J Orthop Surg Res 8, 40). A change of 17.1 "
        "points or less may be measurement error (SDC; van Kampen",
    ):  # fmt: skip
        assert said in text, said
    # Only a value of two days or more has a trend.
    assert len(Parsed(rendering.episode_page(answered, print_options())).all("svg")) == len(care.rom) // 2 + 1 + 2
    japanese = Parsed(rendering.episode_page(answered, print_options("ja"))).text
    for said in (
        "QuickDASH（0〜100点、低いほど良好）",
        "MCID以上の改善（測定誤差の可能性あり）",
        "測定誤差を超える悪化",
    ):
        assert said in japanese, said


def test_an_episode_without_anything_yet_has_a_report_too(signed: tuple[SessionContent, EpisodeContent]) -> None:
    _, care = signed
    bare = replace(
        care, onset_on=None, diagnosis="", contraindications="", limits=(), max_resistance_level=None, max_speed_deg_s=None,
        limits_by="", stages=(),
        assessed_at=(), rom=(), pain=(), questionnaires=(), sessions=(), stops=(), closing_note="",
    )  # fmt: skip
    text = Parsed(rendering.episode_page(bare, print_options())).text
    assert "There are no assessments yet." in text
    assert "There have been no sessions yet." in text
    assert "Trends" not in text


def test_run_with_damaged_samples_is_reported_without_curves(
    signed: tuple[SessionContent, EpisodeContent],
) -> None:
    visit, _ = signed
    first = visit.runs[0]
    assert first.parts
    damaged = replace(first, parts=replace(first.parts, played=Series(b"nonsense"), downsampled=None))
    page = Parsed(rendering.session_page(replace(visit, runs=(damaged, *visit.runs[1:])), print_options()))
    assert "The samples of this playback cannot be read" in page.text
    assert len(page.all("svg")) == 5 * (len(visit.runs) - 1)


@SQLITE_FIRST
def test_every_database_gives_the_same_report(database: Database) -> None:
    visit, care = contents(database, sessions=2)
    assert [run.outcome for run in visit.runs] == ["completed", "stopped", "completed"]
    assert [(line.motion, line.kind) for line in care.rom][:3] == [
        ("flexion", "active"),
        ("flexion", "passive"),
        ("abduction", "active"),
    ]
    assert [(visit.planned, visit.done, visit.stops) for visit in care.sessions] == [(6, 1, 1), (6, 1, 1)]
    assert [(stop.code, count) for stop, count in care.stops] == [("drive_silent", 2)]


def test_missing_session_has_no_report(sqlite: Database) -> None:
    with sqlite.read() as reading:
        for read_content in (session.read_content, episode.read_content):
            with pytest.raises(ProblemError) as raised:
                read_content(reading, uuid4(), UTC)
            assert raised.value.status == 404


# -- paper ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("language", LANGUAGES)
def test_unsigned_reports_say_draft_on_every_page(
    draft: SessionContent, signed: tuple[SessionContent, EpisodeContent], language: Language
) -> None:
    mark = PHRASES["draft"][LANGUAGES.index(language)]
    pages = texts_of(rendering.session_pdf(draft, print_options(language)))
    assert len(pages) > 1
    assert all(mark in page for page in pages)
    assert not any(mark in page for page in texts_of(rendering.session_pdf(signed[0], print_options(language))))


def test_every_page_names_patient_page_and_print_time(draft: SessionContent) -> None:
    pages = texts_of(rendering.session_pdf(draft, print_options()))
    for number, page in enumerate(pages, start=1):
        assert f"{number} / {len(pages)}" in page
        assert f"Yamada Hanako, {draft.patient.clinic_number}" in page
        assert "Printed 30 Nov 2026 12:04 JST" in page


@pytest.mark.campaign
def test_sixty_runs_fill_many_pages_with_repeated_table_heads(draft: SessionContent) -> None:
    run = draft.runs[0]
    many = replace(draft, runs=tuple(replace(run, number=number) for number in range(1, 61)))
    pages = texts_of(rendering.session_pdf(many, print_options()))
    assert 14 <= len(pages) <= 24
    listed = [page for page in pages if "Settings Outcome" in page]
    assert len(listed) >= 2
    for number in range(1, 61):
        assert any(f"{number}. {run.recording}" in page for page in pages)


def test_a_pdf_carries_its_title_and_its_own_font(draft: SessionContent) -> None:
    reader = PdfReader(io.BytesIO(rendering.session_pdf(draft, print_options("ja"))))
    assert reader.metadata
    assert reader.metadata.title == "治療セッション報告書、2026年11月2日"
    assert reader.metadata.author == CLINIC.name
    width, height = (float(side) for side in reader.pages[0].mediabox[2:])
    assert (round(width), round(height)) == (595, 842)
    fonts = {str(font.get_object()["/BaseFont"]) for font in _fonts(reader)}
    assert fonts
    assert all("NotoSansJP" in font for font in fonts), fonts


def _fonts(reader: PdfReader) -> list[Any]:
    resources: list[Any] = [page["/Resources"] for page in reader.pages]
    return [font for of_page in resources for font in of_page.get("/Font", {}).values()]


# -- HTML -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_pages_are_sound(signed: tuple[SessionContent, EpisodeContent], language: Language) -> None:
    visit, care = signed
    for page in (
        rendering.session_page(visit, print_options(language)),
        rendering.episode_page(care, print_options(language)),
    ):
        parsed = Parsed(page)
        assert parsed.all("html") == [{"lang": language}]
        assert len(parsed.all("h1")) == 1
        levels = [int(tag[1]) for tag, _ in parsed.elements if re.fullmatch(r"h[1-6]", tag)]
        assert all(after <= before + 1 for before, after in pairwise(levels))
        assert all(head.get("scope") in ("row", "col") for head in parsed.all("th"))
        assert len(parsed.all("thead")) >= 3
        assert all(chart.get("aria-label") for chart in parsed.all("svg"))


def test_nothing_runs_and_nothing_is_fetched(signed: tuple[SessionContent, EpisodeContent]) -> None:
    page = rendering.session_page(signed[0], print_options())
    parsed = Parsed(page)
    for tag, attributes in parsed.elements:
        assert tag not in ("script", "link", "iframe", "object", "embed", "form", "base", "a")
        assert not {name for name in attributes if name.startswith("on") or name in ("style", "href")}
        assert str(attributes.get("src", "data:")).startswith("data:")
    assert "url(" not in parsed.style
    digest = re.search(r"style-src 'sha256-([^']+)'", page.policy)
    assert digest
    assert "script" not in page.policy
    assert page.policy.startswith("default-src 'none'; ")


@pytest.mark.parametrize("language", ["en", pytest.param("ja", marks=pytest.mark.campaign)])
def test_whatever_people_write_is_only_text(sqlite: Database, language: Language) -> None:
    """Check the page, the margins of the style sheet, the head, and the print."""
    hostile = Texts(HOSTILE[:100], HOSTILE[:100], HOSTILE[:100], HOSTILE, HOSTILE[:100], HOSTILE)
    visit, care = contents(sqlite, hostile, signed=True)
    letters = PrintOptions(Letterhead(HOSTILE, (HOSTILE,), HOSTILE), language, "Asia/Tokyo", AT)
    harmless, its_care = contents(sqlite)
    for page, plain in (
        (rendering.session_page(visit, letters), rendering.session_page(harmless, print_options(language))),
        (rendering.episode_page(care, letters), rendering.episode_page(its_care, print_options(language))),
    ):
        parsed = Parsed(page)
        assert HOSTILE in parsed.text
        assert [tag for tag, _ in parsed.elements] == [tag for tag, _ in Parsed(plain).elements]
        assert "9989001" not in parsed.style
        assert "<" not in parsed.style
        assert parsed.style.count("@page") == 1
    pages = texts_of(rendering.session_pdf(visit, letters))
    assert all("</style></title><script>" in page for page in pages)


def test_a_name_of_a_hundred_letters_stays_on_the_page(sqlite: Database) -> None:
    long = Texts(name="W" * 100, recording="M" * 100, therapist="W" * 100, other="W" * 100)
    visit, _ = contents(sqlite, long)
    text = "".join(texts_of(rendering.session_pdf(visit, print_options()))).replace(" ", "")
    assert "W" * 100 in text
    assert "M" * 100 in text


# -- words ----------------------------------------------------------------------------------------------------------


def test_every_text_exists_in_both_languages_and_is_used() -> None:
    python = [file for file in TEMPLATES.parent.glob("*.py") if file.name != "phrases.py"]
    source = (
        "".join(file.read_text() for file in [*TEMPLATES.iterdir(), *python])
        + '"to" "rom" "motion_with_number" named("rom"'
    )
    for key, (english, japanese) in PHRASES.items():
        assert english.strip(" ")
        assert japanese
        assert set(re.findall(r"{(\w+)}", english)) == set(re.findall(r"{(\w+)}", japanese)), key
        kind, dot, _ = key.partition(".")
        assert f'"{key}"' in source or (dot and f'named("{kind}"' in source), key


def test_every_stop_and_outcome_has_a_text() -> None:
    assert set(STOP_REASONS_JA) == {fault.code for fault in FAULTS}
    for fault in FAULTS:
        assert ("{motor}" in STOP_REASONS_JA[fault.code]) == ("motor" in fault.message.params), fault.code
    assert {f"outcome.{outcome}" for outcome in get_args(RunOutcome)} <= set(PHRASES)
    assert Phrases("ja", "").stop("unheard_of", "As it was told.", None) == "As it was told."
    assert Phrases("ja", "").stop("drive_silent", "Motor 3 does not answer.", None) == "Motor 3 does not answer."


@pytest.mark.parametrize(
    ("value", "digits", "sign", "text"),
    [(-0.004, 2, False, "0.00"), (-1.25, 1, False, "−1.3"), (3.0, 0, True, "+3"), (None, 1, False, "–"), (0.0, 0, True, "0")],
)  # fmt: skip
def test_numbers_use_a_real_minus_and_zero_has_none(value: float | None, digits: int, sign: bool, text: str) -> None:
    assert Phrases("en", "").number(value, digits, sign=sign) == text


def test_a_day_is_the_clinics() -> None:
    late = datetime(2026, 11, 2, 20, 0, tzinfo=UTC)
    assert Phrases("en", "Asia/Tokyo").moment(late) == "3\u00a0Nov\u00a02026 05:00"
    assert Phrases("ja", "Asia/Tokyo").day(late) == "2026年11月3日"


@pytest.mark.parametrize(
    ("text", "joined"),
    [
        ("−39.0 to −26.6", "−39.0_to_−26.6"),
        ("1 of 7 repetitions", "1_of_7 repetitions"),
        ("30° to 60°", "30°_to_60°"),
        ("3 Nov 2026 to 30 Nov 2026 02:10", "3_Nov_2026 to 30_Nov_2026 02:10"),
        ("83° ± 5° to 170° ± 6°", "83°_±_5° to 170°_±_6°"),
        ("Apparatus angle, °", "Apparatus angle,_°"),
        ("range 90 %, motor 5, Station 2", "range 90_%, motor_5, Station_2"),
        ("3 sessions, up to 5", "3 sessions, up to 5"),
    ],
)
def test_no_line_breaks_within_a_range_or_date(text: str, joined: str) -> None:
    assert join_units(text).replace("\u00a0", "_") == joined


def test_no_line_of_a_report_breaks_within_a_range(signed: tuple[SessionContent, EpisodeContent]) -> None:
    visit, care = signed
    for page in (rendering.session_page(visit, print_options()), rendering.episode_page(care, print_options())):
        assert re.findall("\\d (?:to|of) −?\\d+(?!\\d|\u00a0[A-Z])|angle, °", Parsed(page).text) == []


# -- curves ---------------------------------------------------------------------------------------------------------


def test_curve_keeps_its_peak_inside_its_frame(signed: tuple[SessionContent, EpisodeContent]) -> None:
    run = signed[0].runs[0]
    assert run.parts
    third = charts.tracking(run.parts)[2]
    assert [line.name for line in third.lines] == ["taught", "played"]
    places = [tuple(map(float, place.split(","))) for place in third.lines[0].points.split()]
    assert len(places) <= 180
    frame = third.frame
    assert all(frame.x(0) <= x <= frame.x(1) and frame.y(1) <= y <= frame.y(0) for x, y in places)
    # 90 % of 0 to 90 deg, reduced towards the start: the top is at 81, where 50 and 75 have their ticks.
    at = {tick.label: tick.at for tick in third.y_ticks}
    a_degree = (at["50"] - at["75"]) / 25
    assert min(y for _, y in places) == pytest.approx(at["75"] - 6 * a_degree, abs=0.1)


def test_damaged_samples_are_no_curves() -> None:
    with pytest.raises(UnreadableError):
        charts.tracking(RunFigureSamples(Series(b""), Series(b""), AS_TAUGHT, None, None))


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [(0, 10, (0, 2.5, 5, 7.5, 10)), (-20, 130, (-50, 0, 50, 100, 150)), (5, 5, (5,)), (0, 0.3, (0, 0.1, 0.2, 0.3))],
)
def test_ticks_are_round_and_hold_everything(low: float, high: float, ticks: tuple[float, ...]) -> None:
    assert charts.nice_ticks(low, high, 4) == ticks


# -- letterhead -----------------------------------------------------------------------------------------------------

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
SVG = b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><circle cx="4" cy="4" r="3"/></svg>'


@pytest.mark.parametrize(("image", "kind"), [(PNG, "png"), (SVG, "svg+xml")], ids=["png", "svg"])
def test_letterhead_appears_on_both_reports(
    tmp_path: Path, signed: tuple[SessionContent, EpisodeContent], image: bytes, kind: str
) -> None:
    logo = tmp_path / "logo"
    logo.write_bytes(image)
    ours = letterhead.read("Midori Clinic", "1-2-3 Aoba| Sendai |", "022", logo)
    assert ours.address == ("1-2-3 Aoba", "Sendai")
    visit, care = signed
    printed = PrintOptions(ours, "en", "", AT)
    for page in (rendering.session_page(visit, printed), rendering.episode_page(care, printed)):
        parsed = Parsed(page)
        assert [image["src"] for image in parsed.all("img")] == [
            f"data:image/{kind};base64,{base64.b64encode(image).decode()}"
        ]
        assert "Midori Clinic" in parsed.text
        assert "Tel. 022" in parsed.text
    assert "Midori Clinic" in texts_of(rendering.episode_pdf(care, printed))[0]


def test_report_without_a_letterhead_has_none(signed: tuple[SessionContent, EpisodeContent]) -> None:
    nobody = PrintOptions(letterhead.read("", "", "", None), "en", "", AT)
    assert not Parsed(rendering.session_page(signed[0], nobody)).all("header")


@pytest.mark.parametrize(
    ("image", "why"),
    [
        (b"x" * 300_000, "larger than 256 kB"),
        (b"GIF89a", "neither PNG nor SVG"),
        (b"<html/>", "neither PNG nor SVG"),
        (b"", "neither PNG nor SVG"),
        (PNG[:18], "damaged PNG"),
        (PNG[:16] + b"\0\0\xff\xff\0\0\0\x01", "pixels on a side"),
        (b"<!DOCTYPE svg><svg/>", "document type"),
        (b"<svg><script/></svg>", "script"),
        (b'<svg onload="x"/>', "script"),
        (b'<svg><image href="http://elsewhere.example/x.png"/></svg>', "external content"),
    ],
    ids=str,
)
def test_unusable_logo_is_refused_with_a_sentence(tmp_path: Path, image: bytes, why: str) -> None:
    logo = tmp_path / "logo"
    logo.write_bytes(image)
    with pytest.raises(LetterheadError, match=why):
        letterhead.read("", "", "", logo)


def test_missing_logo_is_refused_with_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(LetterheadError, match="cannot be read"):
        letterhead.read("", "", "", tmp_path / "none.png")
