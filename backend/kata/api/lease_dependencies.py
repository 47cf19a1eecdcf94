"""Dependencies that return the browser of a request, and that check whether it may operate the apparatus."""

from collections.abc import Callable
from typing import Annotated

from fastapi import Depends

from kata.actor import CURRENT_ACTOR, REQUEST_CONTEXT, by_program
from kata.api.errors import refused
from kata.audit.audit_log import AuditLog
from kata.audit.entries import entry
from kata.dependencies import TheStation
from kata.station.lease import AbsenceAction, Browser


def browser() -> Browser:
    """Return the browser of the current request, identified by its login session. Use it only in routes that need a login."""
    actor = CURRENT_ACTOR.get()
    # Authorization rejects requests without a login (``api/authorization.py``).
    assert actor is not None
    return Browser(actor.login_session_id, actor.name)


async def _watcher(station: TheStation) -> Browser:
    watcher = browser()
    station.lease_manager.note_request(watcher)
    return watcher


async def _operator(station: TheStation) -> Browser:
    requesting = browser()
    refusal = station.lease_manager.take(requesting)
    if refusal:
        raise refused(refusal)
    return requesting


Watcher = Annotated[Browser, Depends(_watcher)]
"""The browser of the request. The request proves that this browser is still connected."""
Operator = Annotated[Browser, Depends(_operator)]
"""The browser that operates the apparatus. The request takes a free lease; it is refused with 409 while another browser holds it."""


def record_absence_actions(audit_log: AuditLog, station: str) -> Callable[[Browser, AbsenceAction], None]:
    """Return a callback that records in the audit trail what the station does when the operating browser is lost."""

    def record(browser: Browser, absence_action: AbsenceAction) -> None:
        action = "pause_without_browser" if absence_action == "pause" else "stop_without_browser"
        with by_program(action, station):
            audit_log.record_at_once(
                entry(action, "done", subject=f"sign_in {browser.id}", detail={"operator": browser.name})
            )

    return record


def record_takeover(audit_log: AuditLog, before: Browser) -> None:
    """Record a takeover with the previous operator, in place of the request's own audit entry."""
    audit_log.record_at_once(entry("take_over", "done", subject=f"sign_in {before.id}", detail={"from": before.name}))
    if context := REQUEST_CONTEXT.get():
        context.audited.add("done")
