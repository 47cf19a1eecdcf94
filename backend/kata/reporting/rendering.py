"""Render a report as HTML and as PDF. Use it in the worker process that builds figures.

Texts that people entered are always escaped: in the template by Jinja, and in the style sheet's margins by :func:`css_string`. The page
runs no script and fetches nothing, and its policy forbids both.
"""

import base64
import hashlib
from dataclasses import dataclass, replace
from datetime import datetime
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING

from markupsafe import Markup
from msgspec import structs

from kata import __version__
from kata.commissioning.record import CommissioningRecord, SignatureState
from kata.database.arrays import UnreadableError
from kata.reporting import charts, trends
from kata.reporting.charts import Chart
from kata.reporting.content import EpisodeContent, RehabilitationPlanContent, RunContent, SessionContent
from kata.reporting.letterhead import Letterhead
from kata.reporting.phrases import Language, Phrases
from kata.reporting.totals import limits_of, scale_of

if TYPE_CHECKING:
    from jinja2 import Environment

Content = SessionContent | EpisodeContent | RehabilitationPlanContent | CommissioningRecord


@dataclass(frozen=True)
class PrintOptions:
    """Print options of a report: letterhead, language, time zone and time."""

    letterhead: Letterhead
    language: Language
    zone: str
    at: datetime


@dataclass(frozen=True)
class ReportPage:
    """A page and its content security policy."""

    html: str
    policy: str


def session_page(content: SessionContent, options: PrintOptions) -> ReportPage:
    """Return the report of one session as a page."""
    phrases = Phrases(options.language, options.zone)
    title = phrases.text("comma").join([phrases.text("session_report"), phrases.day(content.started_at)])
    curves = {run.number: _curves(run) for run in content.runs}
    torques = {run.number: chart for run in content.runs if (chart := _torque_angle(run, phrases))}
    draft = content.signed_at is None
    return _page("session.html", title, content, options, draft=draft, curves=curves, torques=torques)


def episode_page(content: EpisodeContent, options: PrintOptions) -> ReportPage:
    """Return the report of one episode as a page."""
    phrases = Phrases(options.language, options.zone)
    charts = trends.draw(content, phrases)
    return _page(
        "episode.html",
        phrases.text("episode_report"),
        content,
        options,
        draft=False,
        trends=charts,
        scale_of=scale_of,
        limits_of=limits_of,
    )


def commissioning_page(
    record: CommissioningRecord, options: PrintOptions, signature: SignatureState = "unsigned"
) -> ReportPage:
    """Return the record of a commissioning (the acceptance report) or of one periodic check as a page."""
    phrases = Phrases(options.language, options.zone)
    if record.checks and not record.steps:
        record = structs.replace(record, steps=record.checks, by=record.checks[0].by)
    times = {step.ended_at: datetime.fromisoformat(step.ended_at) for step in record.steps}
    responses = [charts.step_responses(step.curves) for step in record.steps]
    return _page(
        "commissioning.html",
        phrases.text("commissioning_report"),
        record,
        options,
        draft=not record.passed,
        signature=signature,
        times=times,
        responses=responses,
    )


def commissioning_pdf(
    record: CommissioningRecord, options: PrintOptions, signature: SignatureState = "unsigned"
) -> bytes:
    """Return the record of a commissioning as PDF on A4."""
    return _pdf(commissioning_page(record, options, signature), options)


def session_pdf(content: SessionContent, options: PrintOptions) -> bytes:
    """Return the report of one session as PDF on A4."""
    return _pdf(session_page(content, options), options)


def episode_pdf(content: EpisodeContent, options: PrintOptions) -> bytes:
    """Return the report of one episode as PDF on A4."""
    return _pdf(episode_page(content, options), options)


def rehabilitation_plan_page(content: RehabilitationPlanContent, options: PrintOptions) -> ReportPage:
    """Return the draft of a rehabilitation plan as a page. It is a form of Japan, in Japanese."""
    title = "リハビリテーション実施計画書（案）"
    return _page("rehabilitation_plan.html", title, content, replace(options, language="ja"), draft=True)


def rehabilitation_plan_pdf(content: RehabilitationPlanContent, options: PrintOptions) -> bytes:
    """Return the draft of a rehabilitation plan as PDF on A4."""
    return _pdf(rehabilitation_plan_page(content, options), options)


def css_string(text: str) -> Markup:
    """Return a CSS string that contains the text. No text can end the string or the style sheet."""
    return Markup(f'"{"".join(letter if letter.isalnum() else f"{chr(92)}{ord(letter):x} " for letter in text)}"')  # noqa: S704 - escaped right here


def _page(
    template: str,
    title: str,
    content: Content,
    options: PrintOptions,
    *,
    draft: bool,
    **template_values: object,
) -> ReportPage:
    phrases = Phrases(options.language, options.zone)
    environment = _environment()
    values = {
        "title": title,
        "report": content,
        "about": _about(content, phrases),
        "letterhead": options.letterhead,
        "language": options.language,
        "draft": draft,
        "at": options.at,
        "printed": f"{phrases.moment(options.at)} {phrases.zone(options.at)}".strip(),
        "version": __version__,
        "phrases": phrases,
        "phrase": phrases.text,
    }
    style = environment.get_template("style.css").render(values)
    html = environment.get_template(template).render(values, style=Markup(style), **template_values)  # noqa: S704 - css_string has escaped
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; style-src 'sha256-{digest}'; img-src data:; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return ReportPage(html, policy)


def _about(content: Content, phrases: Phrases) -> str:
    """Return the person or station that the report is about, for the margin."""
    match content:
        case CommissioningRecord(station=station):
            return station
        case RehabilitationPlanContent(episode=care):
            patient = care.patient
        case SessionContent() | EpisodeContent():
            patient = content.patient
    return patient.name + phrases.text("comma") + patient.clinic_number


def _curves(run: RunContent) -> tuple[Chart, ...] | None:
    """Return the run's charts, or None if the samples are damaged. The report still contains the rest of the run."""
    if run.parts is None:
        return ()
    try:
        return charts.tracking(run.parts)
    except UnreadableError:
        return None


def _torque_angle(run: RunContent, phrases: Phrases) -> Chart | None:
    """Return the chart of an end-feel test, or None if there is no curve."""
    test = run.end_feel
    if test is None or test.curve is None:
        return None
    range_deg = test.range_deg[0] if test.range_deg else None
    marks = [angle for angle in (test.onset_deg, range_deg) if angle is not None]
    name = phrases.text("end_feel_curve", number=run.number, motion=phrases.motion(test.motion))
    return charts.torque_angle(name, test.curve, test.outward, marks)


@cache
def _environment() -> "Environment":
    # Imported here for the same reason as the printing library.
    from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

    environment = Environment(
        loader=PackageLoader("kata.reporting"),
        autoescape=select_autoescape(["html"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["css_string"] = css_string
    return environment


def can_print() -> bool:
    """Return whether the printing library is installed. Reports as pages need no library."""
    return find_spec("plutoprint") is not None


def _pdf(page: ReportPage, options: PrintOptions) -> bytes:
    # Imported here, because only the worker prints. The library and its font would cost every start time and the service memory.
    from kata.reporting.pdf import as_pdf

    return as_pdf(page.html, options.letterhead.name, options.at)
