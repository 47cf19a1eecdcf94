"""Assemble the application: routers, error answers, OpenAPI document and middleware around :class:`~kata.api.services.Services`."""

from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from functools import cache
from typing import Final

from fastapi import APIRouter, Depends, FastAPI
from starlette.routing import BaseRoute
from starlette.types import ASGIApp

from kata import __version__
from kata.api import (
    authorization,
    commissioning_run_router,
    end_feel_router,
    errors,
    fleet_router,
    health,
    live,
    notifications,
    operation,
    security_middleware,
    simulator_router,
    static_files,
    station_router,
    station_settings_router,
    support_router,
)
from kata.api.services import attach
from kata.api.set_up import set_up_services
from kata.audit.middleware import AuditMiddleware
from kata.audit.router import router as audit_router
from kata.auth import access_tokens_router, accounts_router, login_router, openid_router, own_account_router
from kata.backups.router import router as backups_router
from kata.clinic.assessments.router import router as assessments_router
from kata.clinic.commissionings.router import router as commissionings_router
from kata.clinic.contraindications.router import router as contraindications_router
from kata.clinic.episodes.router import router as episodes_router
from kata.clinic.events.router import router as events_router
from kata.clinic.patient_mode.router import router as patient_mode_router
from kata.clinic.patients.router import router as patients_router
from kata.clinic.profile.router import router as profile_router
from kata.clinic.programmes.router import router as programmes_router
from kata.clinic.progress.router import router as progress_router
from kata.clinic.questionnaires.router import router as questionnaires_router
from kata.clinic.recordings.router import router as recordings_router
from kata.clinic.restricted.router import router as restricted_router
from kata.clinic.rhythm.router import router as rhythm_router
from kata.clinic.sessions.end_feel_router import router as end_feel_results_router
from kata.clinic.sessions.goniometer_router import router as goniometer_router
from kata.clinic.sessions.lists_router import router as session_lists_router
from kata.clinic.sessions.router import router as sessions_router
from kata.clinic.sessions.runs_router import router as runs_router
from kata.clinic.statistics.router import router as statistics_router
from kata.dependencies import Problem
from kata.interop.erasure_router import router as erasures_router
from kata.interop.router import router as interop_router
from kata.reporting.router import drafts as drafts_router
from kata.reporting.router import router as reports_router
from kata.settings import Settings

_DESCRIPTION: Final = """
Teach a motion by hand, play it back, compare. Angles are in degrees, speeds in degrees per second, torques in newton metres, times in
seconds; timestamps are UTC. Errors are problem documents (RFC 9457) with a stable `code`, a sentence and a next step.
"""

_ROUTERS: Final[tuple[APIRouter, ...]] = (
    health.router,
    access_tokens_router.router,
    accounts_router.router,
    assessments_router,
    backups_router,
    audit_router,
    commissionings_router,
    contraindications_router,
    episodes_router,
    events_router,
    erasures_router,
    interop_router,
    patient_mode_router,
    patients_router,
    profile_router,
    programmes_router,
    progress_router,
    questionnaires_router,
    recordings_router,
    reports_router,
    drafts_router,
    restricted_router,
    session_lists_router,
    sessions_router,
    goniometer_router,
    runs_router,
    rhythm_router,
    end_feel_results_router,
    statistics_router,
    own_account_router.router,
    openid_router.router,
    station_router.router,
    end_feel_router.router,
    station_settings_router.router,
    commissioning_run_router.router,
    fleet_router.router,
    simulator_router.router,
    support_router.router,
    live.router,
    notifications.router,
    operation.router,
)


_AUTHORIZED: Final = [Depends(authorization.authorize)]
"""Dependencies of every route."""


def create_app(settings: Settings) -> FastAPI:
    """Return the application. The services start when its lifespan begins."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with AsyncExitStack() as stack:
            attach(app, await set_up_services(settings, stack))
            yield

    app = FastAPI(
        title="Kata",
        version=__version__,
        description=_DESCRIPTION,
        license_info={"name": "Apache-2.0", "identifier": "Apache-2.0"},
        lifespan=lifespan,
        dependencies=_AUTHORIZED,
        docs_url=None,
        redoc_url=None,
        openapi_url="/api/openapi.json",
    )
    app.router.routes.extend(_all_routes())
    errors.install(app)
    _complete_openapi(app)
    static_files.install(app)
    authorization.check_rules(app)
    _add_middleware(app, security_middleware.allowed_hosts(settings))
    return app


@cache
def _all_routes() -> list[BaseRoute]:
    """Return the routes of all features, each of which authorizes its request. Every application of a process shares them, because
    building them takes a quarter of a second.
    """
    router_of_all = APIRouter(dependencies=_AUTHORIZED, generate_unique_id_function=lambda route: route.name)
    for router in _ROUTERS:
        router_of_all.include_router(router)
    router_of_all.include_router(login_router.router, dependencies=[Depends(health.count_refused_logins)])
    return router_of_all.routes


def _add_middleware(app: FastAPI, hosts: frozenset[str]) -> None:
    """Wrap the whole application in audit and security middleware. ``add_middleware`` would not wrap the answer to an unexpected error."""
    build_inner_stack = app.build_middleware_stack

    def build_middleware_stack() -> ASGIApp:
        # The audit middleware is outermost: it also records what the security middleware refuses.
        return AuditMiddleware(security_middleware.SecurityMiddleware(build_inner_stack(), hosts))

    app.build_middleware_stack = build_middleware_stack  # type: ignore[method-assign]


def _complete_openapi(app: FastAPI) -> None:
    """Add WebSocket messages and authorization to the OpenAPI document, and the problem document in place of FastAPI's error body."""
    live.document(app)
    fleet_router.document(app)
    generate = app.openapi

    def openapi() -> dict[str, object]:
        if app.openapi_schema is None:
            document = generate()
            schemas = document["components"]["schemas"]
            schemas.pop("HTTPValidationError", None)
            schemas.pop("ValidationError", None)
            for webhook in document["webhooks"].values():
                webhook["post"]["responses"].pop("422")
            problem = Problem.model_json_schema(ref_template="#/components/schemas/{model}")
            schemas.update(problem.pop("$defs"))
            schemas["Problem"] = problem
            authorization.document(document)
            app.openapi_schema = document
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]
