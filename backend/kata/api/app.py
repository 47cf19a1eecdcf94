"""The service: everything is put together here, started in order and ended in the opposite one."""

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Final
from uuid import UUID

import msgspec
from fastapi import Depends, FastAPI
from starlette.types import ASGIApp

from kata.actor import by_program
from kata.api import (
    authorization,
    health,
    live,
    metrics,
    operating,
    problems,
    security_middleware,
    static_files,
    stations,
)
from kata.api.overview import Overview
from kata.api.simulator import Simulation
from kata.api.simulator import router as simulator
from kata.api.station import router as station_router
from kata.audit.audit_log import AuditLog
from kata.audit.entries import entry
from kata.audit.router import Audited
from kata.audit.router import router as audit
from kata.auth import (
    accounts_router,
    demonstration,
    login,
    openid_router,
    own_account_router,
    second_factor,
    set_up,
    sign_in_router,
)
from kata.auth.accounts import count_administrators
from kata.auth.demonstration import DemonstrationLinks
from kata.auth.openid import Provider
from kata.auth.passwords import Passwords, hasher
from kata.auth.sign_in import Limits
from kata.backups.folder import served
from kata.backups.key import make_key
from kata.backups.router import Backups
from kata.backups.router import router as backups
from kata.clinic.assessments.router import router as assessments
from kata.clinic.episodes.router import router as episodes
from kata.clinic.event_spool import EventSpool
from kata.clinic.events import service as event_service
from kata.clinic.events.observer import Ended, Happening
from kata.clinic.events.recording import recording as events_recorded
from kata.clinic.events.router import router as events
from kata.clinic.importer import Importer, Saved
from kata.clinic.patients.router import router as patients
from kata.clinic.programmes.router import router as programmes
from kata.clinic.progress.router import router as progress
from kata.clinic.recordings.router import router as recordings
from kata.clinic.restricted.router import router as restricted
from kata.clinic.sessions import runs
from kata.clinic.sessions.lists_router import router as session_lists
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.clinic.sessions.router import router as sessions
from kata.clinic.stations import service as station_service
from kata.database.availability import AvailabilityMonitor
from kata.database.base import utc_now
from kata.database.engine import SERVICE_ANSWER_S, Database
from kata.database.upgrade import upgrade
from kata.dependencies import Problem
from kata.device import config
from kata.device.journal import Journal
from kata.interop.erasure_router import router as erasures
from kata.interop.router import router as exchange
from kata.plotting.figures import FigureWorker
from kata.reporting import letterhead
from kata.reporting.router import drafts
from kata.reporting.router import router as reports
from kata.settings import Settings
from kata.simulator.process import SimulatorProcess
from kata.station.schemas import Kept
from kata.station.station import Station

log = logging.getLogger(__name__)

_DESCRIPTION: Final = """
Teach a motion by hand, play it back, compare. Angles are degrees, speeds degrees a second, torques newton metres, times
seconds; moments are UTC. Errors are problem documents (RFC 9457) with a stable `code`, a sentence and a next step.
"""

_NEW_KEY: Final = (
    "the key of this clinic's backups was made: %s. KEEP A COPY OF IT AWAY FROM THIS COMPUTER, printed or on a stick in a safe: "
    "when this computer is lost, the backups are worth nothing without it"
)
_FOREIGN: Final = "The request came from another site's page."

_LEFT_S: Final = 30.0
"""So long the start waits for what the last service left in the spool to be in the database."""


def create_app(settings: Settings) -> FastAPI:
    """The service, not started yet."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with AsyncExitStack() as stack:
            await _start(app, settings, stack)
            yield

    app = FastAPI(
        title="Kata",
        version=version("kata"),
        description=_DESCRIPTION,
        license_info={"name": "Apache-2.0", "identifier": "Apache-2.0"},
        lifespan=lifespan,
        dependencies=[Depends(authorization.allowed)],
        generate_unique_id_function=lambda route: route.name,
        docs_url=None,
        redoc_url=None,
        openapi_url="/api/openapi.json",
    )
    for router in (
        health.router,
        metrics.router,
        accounts_router.router,
        assessments,
        backups,
        audit,
        episodes,
        events,
        erasures,
        exchange,
        patients,
        programmes,
        progress,
        recordings,
        reports,
        drafts,
        restricted,
        session_lists,
        sessions,
        own_account_router.router,
        openid_router.router,
        station_router,
        stations.router,
        simulator,
        live.router,
    ):
        app.include_router(router)
    app.include_router(sign_in_router.router, dependencies=[Depends(metrics.refusals_counted)])
    problems.install(app)
    live.document(app)
    stations.document(app)
    _document_problems(app)
    static_files.install(app)
    authorization.install(app)
    _harden(app, security_middleware.allowed_hosts(settings))
    return app


@dataclass(frozen=True)
class _Storage:
    """What keeps the clinic's data."""

    database: Database
    event_spool: EventSpool
    audit_log: AuditLog


@dataclass(frozen=True)
class _AtTheStation:
    """What drives the apparatus and stores what it measured."""

    station: Station
    offline_cache: OfflineCache
    importer: Importer
    import_last: Callable[[], Awaitable[None]]
    """Wait for the imports that have begun."""


@dataclass(frozen=True)
class _Apparatus:
    """The apparatus that this service drives: a real one or a simulated one."""

    config: config.StationConfig
    config_file: Path
    simulation: Simulation | None


async def _start(app: FastAPI, settings: Settings, stack: AsyncExitStack) -> None:
    """Set everything up, in order. The stack ends what was started, also if a later step fails."""
    app.state.letterhead = letterhead.read(
        settings.clinic_name, settings.clinic_address, settings.clinic_phone, settings.clinic_logo
    )
    app.state.clinic_zone, app.state.metrics_token = settings.clinic_zone, settings.metrics_token
    await asyncio.to_thread(stack.enter_context, served(settings))
    storage = await _set_up_storage(settings, stack)
    app.state.database, app.state.audit_log = storage.database, storage.audit_log
    app.state.event_spool = storage.event_spool
    await _set_up_access(app, settings, storage.database, stack)
    app.state.figures = FigureWorker()
    stack.callback(app.state.figures.close)
    apparatus = await _set_up_apparatus(settings, stack, storage.database)
    app.state.simulation = apparatus.simulation
    here = await _set_up_station(app, settings, storage, apparatus, stack)
    await _set_up_metrics(app, storage, here, stack)
    await _set_up_events(storage.event_spool, here, stack)
    stack.push_async_callback(here.import_last)
    stack.push_async_callback(here.station.close)
    backups_made = app.state.backups = Backups(settings, storage.database, lambda: here.station.occupied)
    await stack.enter_async_context(backups_made.each_night())
    here.station.start()


async def _set_up_storage(settings: Settings, stack: AsyncExitStack) -> _Storage:
    """Open the database, the spool and the audit log, and deliver what the last service left in the spool."""
    settings.journal.mkdir(parents=True, exist_ok=True)
    if await asyncio.to_thread(make_key, settings):
        log.warning(_NEW_KEY, settings.backup_key_file)
    await asyncio.to_thread(_upgrade, settings.effective_database_url)
    database = Database(settings.effective_database_url, answer_s=SERVICE_ANSWER_S)
    stack.callback(database.close)
    database.watch = AvailabilityMonitor(database.writer)
    event_spool = await asyncio.to_thread(EventSpool, database, _station_name(settings), settings.spool)
    stack.push_async_callback(asyncio.to_thread, event_spool.close)
    audit_log = await asyncio.to_thread(AuditLog, database, settings.effective_audit_anchor, event_spool)
    stack.push_async_callback(asyncio.to_thread, audit_log.close)
    database.watch.on_back = partial(_was_away, audit_log)
    # Events of the last service are stored before new ones.
    await asyncio.to_thread(event_spool.until_taken, _LEFT_S)
    return _Storage(database, event_spool, audit_log)


async def _set_up_access(app: FastAPI, settings: Settings, database: Database, stack: AsyncExitStack) -> None:
    """Let users sign in, and end login sessions that are revoked elsewhere."""
    access = app.state.access = await _opened(settings, database)
    await stack.enter_async_context(access.revocations.watched(app.state.remembered))


async def _set_up_apparatus(settings: Settings, stack: AsyncExitStack, database: Database) -> _Apparatus:
    """Read the station's configuration, start the simulator if there is one, and register the station."""
    station_config = config.read(settings.station) if settings.station else None
    simulation: Simulation | None = None
    if settings.simulate:
        process = await asyncio.to_thread(SimulatorProcess, settings.data, settings.seed)
        stack.callback(process.close)
        simulation = Simulation(process, settings.taught)
        station_config = (
            msgspec.structs.replace(station_config, port=process.port)
            if station_config
            else config.simulated(process.port)
        )
    station_config = station_config or config.StationConfig()
    if settings.rate_hz is not None:
        station_config = config.at_rate(station_config, settings.rate_hz)
    station_file = settings.data / "station-in-use.toml"
    station_config = _as_it_stood(station_config, station_file)
    if simulation:
        await asyncio.to_thread(simulation.turn, station_config.side)
    config.write(station_config, station_file)
    await asyncio.to_thread(_register, database, station_config, simulated=settings.simulate)
    return _Apparatus(station_config, station_file, simulation)


async def _set_up_station(
    app: FastAPI, settings: Settings, storage: _Storage, apparatus: _Apparatus, stack: AsyncExitStack
) -> _AtTheStation:
    """Make the station, its live state and its offline cache, and import the journals of the last service. Starts no device process."""
    database, event_spool = storage.database, storage.event_spool
    loop = asyncio.get_running_loop()
    importing: set[asyncio.Task[None]] = set()

    def saved(record: Saved) -> None:
        loop.call_soon_threadsafe(station.tell, record)

    def has_undelivered() -> bool:
        return event_spool.delivery.waiting > 0

    offline_cache = app.state.offline_cache = OfflineCache(database, apparatus.config.name, has_undelivered)

    def waits(measured: Journal) -> None:
        if measured.kind == "run":
            offline_cache.finish_run(UUID(measured.id), runs.outcome_of(measured))

    importer = Importer(database, settings.journal, apparatus.config, saved, has_undelivered, waits)

    def import_journal(finished: Path | None) -> None:
        work = partial(importer.run, finished) if finished else partial(importer.run_ended, utc_now())
        task = asyncio.create_task(asyncio.to_thread(work), name="import")
        importing.add(task)
        task.add_done_callback(importing.discard)

    async def import_last() -> None:
        await asyncio.gather(*importing)

    station = app.state.station = Station(
        apparatus.config,
        apparatus.config_file,
        settings.journal,
        simulated=settings.simulate,
        real_time=settings.real_time,
        on_journal=import_journal,
        on_due=operating.noting(storage.audit_log, apparatus.config.name),
    )
    app.state.access.revocations.at_the_arm = lambda: station.at_the_arm
    app.state.live_view = operating.LiveStateView(
        station, lambda: _kept(database, event_spool, importer), lambda: offline_cache.may_load
    )
    await asyncio.to_thread(importer.run_at_start)
    overview = app.state.overview = Overview(station, database, lambda: _stations(database))
    await stack.enter_async_context(overview.going_on())

    def in_between() -> None:
        importer.run_due()
        offline_cache.refresh()

    event_spool.delivery.each_round = in_between
    return _AtTheStation(station, offline_cache, importer, import_last)


async def _set_up_metrics(app: FastAPI, storage: _Storage, here: _AtTheStation, stack: AsyncExitStack) -> None:
    """Measure the service for ``/metrics`` and the health probe."""
    app.state.probe = health.Probe(storage.database)
    app.state.metrics = measured = metrics.Metrics(here.station)
    storage.database.on_waited = measured.write_waited_s.observe
    measured.ask_for(
        "kata_spool_waiting",
        "What happened at the station and is kept on its computer, not in the database yet.",
        lambda: storage.event_spool.delivery.waiting + here.importer.due,
    )
    measured.ask_for(
        "kata_ready_patients",
        "Patients of this day whom a session could begin or go on for without the database.",
        lambda: here.offline_cache.ready_patients,
    )
    await stack.enter_async_context(measured.counting_stops(here.station))


async def _set_up_events(event_spool: EventSpool, here: _AtTheStation, stack: AsyncExitStack) -> None:
    """Spool every event of the device."""

    def happened(item: Happening | Ended) -> None:
        event_spool.put_event(item)
        here.offline_cache.on_event(item)

    await stack.enter_async_context(events_recorded(here.station, happened))


async def _opened(settings: Settings, database: Database) -> login.Access:
    """Let people sign in: the first administrator by a link, and the demonstration's."""
    links = DemonstrationLinks(allowed=settings.simulate and settings.is_on_loopback)
    limits = Limits(
        idle=timedelta(minutes=settings.idle_minutes),
        longest=timedelta(hours=settings.sign_in_hours),
        second_factor_of=second_factor.roles_required(settings.second_factor),
    )

    def prepare() -> str:
        with by_program("prepare_demonstration"), database.write() as session:
            demonstration.prepare(session, utc_now(), allowed=links.allowed)
            needs_somebody = not links.allowed and not count_administrators(session)
        # Anew at each start: whoever reads the terminal today need not be who read it yesterday.
        return set_up.offer(settings.data, utc_now()) if needs_somebody else ""

    return login.Access(
        passwords=await asyncio.to_thread(Passwords, hasher()),
        links=links,
        set_up_secret=await asyncio.to_thread(prepare),
        revocations=login.SessionRevocations(database, limits, utc_now),
        folder=settings.data,
        factor_key=await asyncio.to_thread(login.opened_key, settings.effective_second_factor_key, database),
        limits=limits,
        openid=Provider(settings) if settings.openid_issuer else None,
    )


def _station_name(settings: Settings) -> str:
    return config.read(settings.station).name if settings.station else config.StationConfig().name


def _was_away(audit_log: AuditLog, since: datetime) -> None:
    with by_program("database_away"):
        audit_log.tell_at_once(entry("database_away", "done", detail={"since": since.isoformat(timespec="seconds")}))


def _kept(database: Database, kept: EventSpool, importer: Importer) -> Kept:
    return Kept(
        away_since=database.away_since,
        waiting=kept.delivery.waiting + importer.due,
        not_kept_since=kept.spool.full_since,
    )


def _upgrade(url: str) -> None:
    """As long as it takes."""
    database = Database(url)
    try:
        upgrade(database)
    finally:
        database.close()


def _register(database: Database, station_config: config.StationConfig, *, simulated: bool) -> None:
    now = utc_now()
    with by_program("register_station", station_config.name), database.write() as session:
        station_service.register(session, station_config, version("kata"), now, simulated=simulated)
        event_service.end_left_open(session, station_config.name, now)


def _stations(database: Database) -> list[str]:
    with database.read() as session:
        return [row.name for row, _ in station_service.registered(session)]


def _as_it_stood(station_config: config.StationConfig, station_file: Path) -> config.StationConfig:
    """Nobody turns an apparatus by starting a service."""
    try:
        before = config.read(station_file)
    except config.ConfigError:
        return station_config
    return msgspec.structs.replace(station_config, side=before.side)


def _harden(app: FastAPI, hosts: frozenset[str]) -> None:
    """Around everything: ``add_middleware`` would leave the answer to an unexpected error outside."""
    made = app.build_middleware_stack

    def build_middleware_stack() -> ASGIApp:
        # What is refused at the door is told the trail too.
        return Audited(security_middleware.Hardening(made(), hosts))

    app.build_middleware_stack = build_middleware_stack  # type: ignore[method-assign]


def _document_problems(app: FastAPI) -> None:
    """The problem document's schema, and in place of FastAPI's own error body wherever that stands."""
    made = app.openapi

    def openapi() -> dict[str, object]:
        if app.openapi_schema is None:
            document = made()
            schemas = document["components"]["schemas"]
            schemas.pop("HTTPValidationError", None)
            schemas.pop("ValidationError", None)
            for told in document["webhooks"].values():
                told["post"]["responses"].pop("422")
            described = Problem.model_json_schema(ref_template="#/components/schemas/{model}")
            schemas.update(described.pop("$defs"))
            schemas["Problem"] = described
            authorization.document(document)
            app.openapi_schema = document
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]
