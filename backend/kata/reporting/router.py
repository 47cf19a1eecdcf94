"""Routes of reports, as HTML and PDF, and of note drafts."""

from datetime import datetime
from typing import Annotated, Any, Final, Protocol
from uuid import UUID

from fastapi import APIRouter, Depends, Query, Request
from fastapi.responses import HTMLResponse, Response

from kata.clinic.commissionings import service as commissionings
from kata.clinic.local_time import zone_of
from kata.clinic.profile import service as profile
from kata.clinic.sessions import ending, service
from kata.clinic.sessions.schemas import Draft
from kata.commissioning.record import signature_state
from kata.database.base import utc_now
from kata.dependencies import PROBLEMS, TheDatabase, TheFigures
from kata.errors import ProblemError
from kata.messages import Template
from kata.reporting import episode, rehabilitation_plan, rendering, session, texts
from kata.reporting.letterhead import Letterhead
from kata.reporting.note_draft import draft
from kata.reporting.phrases import Language
from kata.reporting.rendering import PrintOptions, ReportPage
from kata.settings import Settings

router = APIRouter(tags=["reports"])
drafts = APIRouter(tags=["sessions"])

_PRIVATE: Final = {
    # No cache may store a patient's report, and no other site may learn that it was read.
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}
_HTML: Final = PROBLEMS.of(404, 422) | {200: {"content": {"text/html": {"schema": {"type": "string"}}}}}
_PDF: Final[dict[int | str, dict[str, Any]]] = PROBLEMS.of(404, 422) | {
    200: {"content": {"application/pdf": {"schema": {"type": "string", "contentMediaType": "application/pdf"}}}}
}


class ReportServices(Protocol):
    """The services that this module uses. ``kata.api.services.Services`` provides them."""

    @property
    def letterhead(self) -> Letterhead:
        """Return the letterhead of the settings, with the logo."""

    @property
    def settings(self) -> Settings:
        """Return the settings."""


def _print_options(
    request: Request,
    database: TheDatabase,
    language: Annotated[Language, Query(description="en: English. ja: Japanese.")] = "en",
) -> PrintOptions:
    services: ReportServices = request.app.state.services
    with database.read() as reading:
        clinic = profile.read(reading, services.settings)
    head = Letterhead(clinic.name, tuple(clinic.address.splitlines()), clinic.phone, services.letterhead.logo)
    return PrintOptions(head, language, clinic.time_zone, utc_now())


ThePrintOptions = Annotated[PrintOptions, Depends(_print_options)]


def _prints(otherwise: Template) -> list[Any]:
    """Return the dependency of a route that needs the printing library, which has no wheel for some computers. Without the library the
    route answers 503 ``no_printing`` with this next step.
    """

    def check() -> None:
        if not rendering.can_print():
            raise ProblemError(503, "no_printing", texts.NO_PRINTING(), otherwise())

    return [Depends(check)]


@router.get(
    "/api/sessions/{session_id}/report.html",
    summary="Get a session's report as HTML",
    response_class=HTMLResponse,
    responses=_HTML,
)
def get_session_report_html(
    database: TheDatabase, worker: TheFigures, options: ThePrintOptions, session_id: UUID
) -> HTMLResponse:
    """Return a session's report as HTML for reading and printing. Every page says if the note is not signed."""
    with database.read() as reading:
        content = session.read_content(reading, session_id, zone_of(options.zone))
    return _html_response(worker.build(rendering.session_page, content, options))


@router.get(
    "/api/sessions/{session_id}/report.pdf",
    summary="Get a session's report as PDF",
    response_class=Response,
    responses=_PDF,
    dependencies=_prints(texts.PRINT_IN_BROWSER),
)
def get_session_report_pdf(
    database: TheDatabase, worker: TheFigures, options: ThePrintOptions, session_id: UUID
) -> Response:
    """Return a session's report as PDF on A4."""
    with database.read() as reading:
        content = session.read_content(reading, session_id, zone_of(options.zone))
    return _printed(worker.build(rendering.session_pdf, content, options), "session", content.started_at, options)


@router.get(
    "/api/episodes/{episode_id}/report.html",
    summary="Get an episode's report as HTML",
    response_class=HTMLResponse,
    responses=_HTML,
)
def get_episode_report_html(
    database: TheDatabase, worker: TheFigures, options: ThePrintOptions, episode_id: UUID
) -> HTMLResponse:
    """Return an episode's report as HTML with assessments, trends and sessions."""
    with database.read() as reading:
        content = episode.read_content(reading, episode_id, zone_of(options.zone))
    return _html_response(worker.build(rendering.episode_page, content, options))


@router.get(
    "/api/episodes/{episode_id}/report.pdf",
    summary="Get an episode's report as PDF",
    response_class=Response,
    responses=_PDF,
    dependencies=_prints(texts.PRINT_IN_BROWSER),
)
def get_episode_report_pdf(
    database: TheDatabase, worker: TheFigures, options: ThePrintOptions, episode_id: UUID
) -> Response:
    """Return an episode's report as PDF on A4."""
    with database.read() as reading:
        content = episode.read_content(reading, episode_id, zone_of(options.zone))
    return _printed(worker.build(rendering.episode_pdf, content, options), "episode", options.at, options)


@router.get(
    "/api/episodes/{episode_id}/rehabilitation-plan.pdf",
    summary="Get a draft of the Japanese rehabilitation plan as PDF",
    response_class=Response,
    responses=_PDF,
    dependencies=_prints(texts.INSTALL_PLUTOPRINT),
)
def get_rehabilitation_plan_pdf(
    database: TheDatabase, worker: TheFigures, options: ThePrintOptions, episode_id: UUID
) -> Response:
    """Return a draft of リハビリテーション実施計画書 as PDF on A4: what the record has is filled in, the rest is left open. Always Japanese."""
    with database.read() as reading:
        content = rehabilitation_plan.read_content(reading, episode_id, zone_of(options.zone))
    pdf = worker.build(rendering.rehabilitation_plan_pdf, content, options)
    return _printed(pdf, "rehabilitation-plan", options.at, options)


@drafts.get("/api/sessions/{session_id}/draft", summary="Draft a session's note", responses=PROBLEMS.of(404, 422))
def get_note_draft(
    database: TheDatabase,
    session_id: UUID,
    language: Annotated[Language, Query(description="en: English. ja: Japanese.")] = "en",
) -> Draft:
    """Return a note that is drafted from the measurements, for reading and editing. Nothing is stored."""
    with database.read() as reading:
        ended_session = service.as_session(service.get(reading, session_id))
    planned = ended_session.programme.items if ended_session.programme else []
    return Draft(text=draft(ended_session, language), end_reason=ending.suggested_reason(planned, ended_session.runs))


@router.get(
    "/api/commissionings/{commissioning_id}/report.pdf",
    summary="Get a commissioning record as PDF",
    response_class=Response,
    responses=_PDF,
    dependencies=_prints(texts.INSTALL_PLUTOPRINT),
)
def get_commissioning_report_pdf(
    database: TheDatabase, worker: TheFigures, options: ThePrintOptions, commissioning_id: UUID
) -> Response:
    """Return the record of a commissioning or periodic check as PDF on A4."""
    with database.read() as reading:
        row = commissionings.get(reading, commissioning_id)
        record, signature = commissionings.record_of(row), signature_state(row.record.encode())
    pdf = worker.build(rendering.commissioning_pdf, record, options, signature)
    return _printed(pdf, "commissioning", row.ended_at, options)


def _html_response(page: ReportPage) -> HTMLResponse:
    return HTMLResponse(page.html, headers=_PRIVATE | {"Content-Security-Policy": page.policy})


def _printed(pdf: bytes, kind: str, when: datetime, options: PrintOptions) -> Response:
    """Return the PDF. Its file's name has the clinic's day of ``when``."""
    day = when.astimezone(zone_of(options.zone)).date()
    headers = _PRIVATE | {"Content-Disposition": f'inline; filename="{kind}-{day}.pdf"'}
    return Response(pdf, media_type="application/pdf", headers=headers)
