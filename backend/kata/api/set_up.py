"""Set up the services in order. The exit stack shuts them down in reverse order, also after a failed start."""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack, suppress
from dataclasses import dataclass
from datetime import datetime, timedelta, tzinfo
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final
from uuid import UUID

import msgspec
from sqlalchemy.exc import IntegrityError

from kata import __version__
from kata.actor import by_program
from kata.api import lease_dependencies
from kata.api.commissioning_run import PRACTICE_FILE, CommissioningRun
from kata.api.commissioning_watch import CommissioningWatch
from kata.api.contraindication_watch import pausing_playbacks
from kata.api.database_probe import DatabaseProbe
from kata.api.fleet import Fleet
from kata.api.live_serializer import LiveStateSerializer
from kata.api.message_limits import Offences
from kata.api.metrics import Metrics
from kata.api.services import Services
from kata.api.simulation import Simulation
from kata.audit.audit_log import AuditLog
from kata.audit.entries import entry
from kata.auth import demonstration, login, second_factor, set_up
from kata.auth.accounts import count_administrators
from kata.auth.auth_cache import AuthCache
from kata.auth.demonstration import DemonstrationLinks
from kata.auth.login_session import Limits
from kata.auth.passwords import Passwords, hasher
from kata.backups.folder import claimed_by_service
from kata.backups.key import make_key
from kata.backups.router import Backups
from kata.clinic.event_spool import EventSpool
from kata.clinic.events import service as event_service
from kata.clinic.events.event_recorder import recording_events
from kata.clinic.events.observer import AlarmsEnded, NewDeviceEvent
from kata.clinic.importer import Importer, Saved
from kata.clinic.profile import service as profile
from kata.clinic.questionnaires.definitions import clinic_folder, use_folder
from kata.clinic.sessions import runs
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.clinic.sessions.offline_sessions import OfflineSessions
from kata.clinic.stations import service as station_service
from kata.clinic.statistics.derived_tables import DerivedTablesHook
from kata.database.availability import AvailabilityMonitor
from kata.database.base import utc_now
from kata.database.engine import SERVICE_ANSWER_S, Database
from kata.database.upgrade import upgrade
from kata.device import config
from kata.device.ipc_messages import Refusal
from kata.device.journal import Journal
from kata.plotting.figures import FigureWorker
from kata.reporting import letterhead
from kata.settings import Settings
from kata.simulator.process import Adapter, SimulatorError, SimulatorProcess
from kata.station import live_rhythm
from kata.station.device_process import DeviceLaunch
from kata.station.schemas import DatabaseStatus
from kata.station.station import Station

if TYPE_CHECKING:
    from kata.auth.openid_provider import Provider

log = logging.getLogger(__name__)

_NEW_KEY: Final = (
    "created the key of this clinic's backups: %s. KEEP A COPY OF IT OUTSIDE THIS COMPUTER, printed or on a USB stick in a safe: "
    "if this computer is lost, the backups cannot be opened without the key"
)
_WARM_UP_AFTER_S: Final = 20.0
"""Time from the start of the device process until the figure worker starts. A figure that is requested earlier starts it at once."""
_SPOOL_DELIVERY_LIMIT_S: Final = 30.0
"""Longest time in seconds that the start waits until the database has the records that the previous service left in the spool."""


@dataclass(frozen=True)
class Storage:
    """The services that store the clinic's data."""

    database: Database
    event_spool: EventSpool
    audit_log: AuditLog


@dataclass(frozen=True)
class Apparatus:
    """The apparatus that this service drives, real or simulated."""

    config: config.StationConfig
    config_file: Path
    simulation: Simulation | None


@dataclass(frozen=True)
class StationServices:
    """The services that drive the apparatus and store its measurements."""

    station: Station
    offline_cache: OfflineCache
    offline_sessions: OfflineSessions
    live_serializer: LiveStateSerializer
    importer: Importer
    commissioning: CommissioningWatch
    finish_imports: Callable[[], Awaitable[None]]
    """Waits until all running imports have ended."""


async def set_up_services(settings: Settings, stack: AsyncExitStack) -> Services:
    """Set up all services. The station starts last, after the services that record its events."""
    letterhead_data = _letterhead(settings)
    await asyncio.to_thread(stack.enter_context, claimed_by_service(settings))
    simulator = _begin_simulator(settings, stack)
    storage = await set_up_storage(settings, stack)
    auth_cache = AuthCache()
    auth = await set_up_authentication(settings, storage.database, auth_cache, stack)
    figures = FigureWorker()
    stack.callback(figures.close)
    apparatus = await set_up_apparatus(settings, storage.database, simulator)
    at_station = await set_up_station(settings, storage, apparatus)
    station = at_station.station
    auth.revocations.operator_under_torque = lambda: station.operator_under_torque
    at_station.importer.worker = figures
    await asyncio.to_thread(at_station.importer.run_at_start)
    fleet = await set_up_fleet(station, storage.database, stack)
    set_up_delivery_round(storage.event_spool, at_station)
    metrics = await set_up_metrics(storage, at_station, stack)
    await set_up_events(storage, at_station, stack)
    stack.push_async_callback(at_station.finish_imports)
    stack.push_async_callback(station.close)
    record_absence_action = lease_dependencies.record_absence_actions(storage.audit_log, apparatus.config.name)
    commissioning_run = CommissioningRun(
        station,
        settings.station,
        settings.data,
        _adoption(settings, storage.database, at_station),
        lambda browser: record_absence_action(browser, "stop"),
    )
    stack.push_async_callback(commissioning_run.close)
    backups = Backups(
        settings, storage.database, lambda: station.occupied, partial(clinic_time_zone, settings, storage.database)
    )
    await stack.enter_async_context(backups.running_schedule())
    station.start()
    warming_up = asyncio.create_task(_warm_up(figures, station), name="warm up")
    stack.callback(warming_up.cancel)
    return Services(
        settings=settings,
        database=storage.database,
        event_spool=storage.event_spool,
        audit_log=storage.audit_log,
        auth=auth,
        auth_cache=auth_cache,
        figures=figures,
        station=station,
        live_serializer=at_station.live_serializer,
        offline_cache=at_station.offline_cache,
        offline_sessions=at_station.offline_sessions,
        fleet=fleet,
        simulation=apparatus.simulation,
        probe=DatabaseProbe(storage.database),
        metrics=metrics,
        backups=backups,
        commissioning=at_station.commissioning,
        commissioning_run=commissioning_run,
        letterhead=letterhead_data,
        offences=Offences(),
    )


async def _warm_up(figures: FigureWorker, station: Station) -> None:
    """Prepare the live rhythm, and start the figure worker some time after the device process, so that it slows down neither the start nor
    the first pages.
    """
    with station.subscribed() as subscription:
        while station.live().device != "running":
            await subscription.changed.wait()
            subscription.changed.clear()
    await asyncio.to_thread(live_rhythm.prepare)
    await asyncio.sleep(_WARM_UP_AFTER_S)
    await asyncio.to_thread(figures.warm_up)


def _letterhead(settings: Settings) -> letterhead.Letterhead:
    """Return the clinic's letterhead. If the logo cannot be used, return a letterhead without it, so that the service can start."""
    read_letterhead = partial(letterhead.read, settings.clinic_name, settings.clinic_address, settings.clinic_phone)
    try:
        return read_letterhead(settings.clinic_logo)
    except letterhead.LetterheadError as error:
        log.error("%s Reports are printed without a logo.", error)
        return read_letterhead(None)


def clinic_time_zone(settings: Settings, database: Database) -> tzinfo:
    """Return the clinic's time zone: UTC if none is set."""
    with database.read() as session:
        return profile.time_zone(session, settings)


async def set_up_storage(settings: Settings, stack: AsyncExitStack) -> Storage:
    """Open database, spool and audit log, and deliver the records that the previous service left in the spool.

    ``DerivedTablesHook`` and ``AuditLog`` register themselves as the database's hooks. From here on every write updates the clinic's
    figures and gets its audit entries.
    """
    settings.journal.mkdir(parents=True, exist_ok=True)
    use_folder(clinic_folder(settings.data))
    if await asyncio.to_thread(make_key, settings):
        log.warning(_NEW_KEY, settings.backup_key_file)
    await asyncio.to_thread(_upgrade, settings.effective_database_url)
    database = Database(
        settings.effective_database_url, answer_s=SERVICE_ANSWER_S, pooler_url=settings.effective_database_pooler_url
    )
    stack.callback(database.close)
    database.monitor = AvailabilityMonitor(database.writer)
    DerivedTablesHook(database)
    event_spool = await asyncio.to_thread(EventSpool, database, _station_name(settings), settings.spool)
    stack.push_async_callback(asyncio.to_thread, event_spool.close)
    anchor, copy = settings.effective_audit_anchor, settings.audit_anchor_copy
    audit_log = await asyncio.to_thread(AuditLog, database, anchor, event_spool, copy=copy, data=settings.data)
    stack.push_async_callback(asyncio.to_thread, audit_log.close)
    database.monitor.on_back = partial(_record_outage, audit_log)
    await asyncio.to_thread(_adopt_computer_zone, settings, database)
    # Events of the previous service are stored before new ones.
    await asyncio.to_thread(event_spool.until_taken, _SPOOL_DELIVERY_LIMIT_S)
    return Storage(database, event_spool, audit_log)


def _adopt_computer_zone(settings: Settings, database: Database) -> None:
    # Another service that starts on the same database stores a zone at the same time.
    with suppress(IntegrityError), by_program("adopt_time_zone"), database.write() as session:
        profile.adopt_computer_zone(session, settings)


async def set_up_authentication(
    settings: Settings, database: Database, auth_cache: AuthCache, stack: AsyncExitStack
) -> login.Authentication:
    """Set up logins, and watch for login sessions that end."""
    links = DemonstrationLinks(allowed=settings.simulate and settings.is_on_loopback)
    limits = Limits(
        idle=timedelta(minutes=settings.idle_minutes),
        longest=timedelta(hours=settings.login_session_hours),
        second_factor_roles=second_factor.roles_required(settings.second_factor),
    )

    def prepare() -> str:
        with by_program("prepare_demonstration"), database.write() as session:
            demonstration.prepare(session, utc_now(), allowed=links.allowed)
            needs_administrator = not links.allowed and not count_administrators(session)
        # Each start makes a new secret, because other people may read the terminal today than yesterday.
        return set_up.offer(settings.data, utc_now()) if needs_administrator else ""

    auth = login.Authentication(
        passwords=await asyncio.to_thread(Passwords, hasher()),
        links=links,
        set_up_secret=await asyncio.to_thread(prepare),
        revocations=login.SessionRevocations(database, limits, utc_now),
        folder=settings.data,
        factor_key=await asyncio.to_thread(login.load_factor_key, settings.effective_second_factor_key, database),
        limits=limits,
        openid=_openid_provider(settings) if settings.openid_issuer else None,
        read_time_zone=lambda session: profile.read(session, settings).time_zone,
    )
    await stack.enter_async_context(auth.revocations.watched(auth_cache))
    return auth


def _openid_provider(settings: Settings) -> "Provider":
    # Imported here, because the HTTP and JWT libraries would delay every start and few clinics have a provider.
    from kata.auth.openid_provider import Provider

    return Provider(settings)


def _begin_simulator(settings: Settings, stack: AsyncExitStack) -> "asyncio.Task[SimulatorProcess] | None":
    """Start the simulator if the settings ask for one. It starts while the other services are set up, which takes as long."""
    if not settings.simulate:
        return None

    async def end() -> None:
        with suppress(SimulatorError):
            (await starting).close()

    start = partial(SimulatorProcess, settings.data, settings.seed, adapter=Adapter(port="socket"))
    starting = asyncio.create_task(asyncio.to_thread(start), name="simulator")
    stack.push_async_callback(end)
    return starting


async def set_up_apparatus(
    settings: Settings, database: Database, simulator: "asyncio.Task[SimulatorProcess] | None"
) -> Apparatus:
    """Read the station's configuration, wait for the simulator if there is one, and register the station."""
    station_config = config.read(settings.station) if settings.station else None
    simulation: Simulation | None = None
    if simulator:
        process = await simulator
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
    station_config = _with_last_side(station_config, station_file)
    if simulation:
        await asyncio.to_thread(simulation.set_side, station_config.side)
    config.write(station_config, station_file)
    await asyncio.to_thread(_register, database, station_config, simulated=settings.simulate)
    return Apparatus(station_config, station_file, simulation)


async def set_up_station(settings: Settings, storage: Storage, apparatus: Apparatus) -> StationServices:
    """Create the station with its importer, live state and offline cache. This does not start the device process."""
    database, event_spool = storage.database, storage.event_spool
    loop = asyncio.get_running_loop()
    running_imports: set[asyncio.Task[None]] = set()

    def notify_saved(record: Saved) -> None:
        loop.call_soon_threadsafe(station.publish, record)

    def has_undelivered() -> bool:
        return event_spool.delivery.waiting > 0

    read_zone = partial(profile.time_zone, settings=settings)
    offline_cache = OfflineCache(database, apparatus.config.name, has_undelivered, read_zone)
    offline_sessions = OfflineSessions(offline_cache, apparatus.config.name)

    def on_postponed(measured: Journal) -> None:
        if measured.kind == "run":
            offline_sessions.finish_run(UUID(measured.id), runs.outcome_of(measured))

    importer = Importer(database, settings.journal, apparatus.config, notify_saved, has_undelivered, on_postponed)

    file_config = config.read(settings.station) if settings.station else apparatus.config
    records_beside = settings.data / PRACTICE_FILE if settings.simulate and not settings.station else settings.station
    watch = CommissioningWatch(database, file_config, records_beside, simulated=settings.simulate)

    def import_journal(finished: Path | None) -> None:
        work = partial(importer.run, finished) if finished else partial(importer.run_ended, utc_now())
        task = asyncio.create_task(asyncio.to_thread(work), name="import")
        running_imports.add(task)
        task.add_done_callback(running_imports.discard)

    async def finish_imports() -> None:
        await asyncio.gather(*running_imports)

    station = Station(
        apparatus.config,
        DeviceLaunch(apparatus.config_file, settings.journal, settings.real_time),
        simulated=settings.simulate,
        on_journal=import_journal,
        on_absence_action=lease_dependencies.record_absence_actions(storage.audit_log, apparatus.config.name),
        not_commissioned=watch.refusal,
    )

    def refuse_from_now(refusal: Refusal | None) -> None:
        loop.call_soon_threadsafe(station.set_not_commissioned, refusal)

    watch.on_change = refuse_from_now
    live_serializer = LiveStateSerializer(
        station, lambda: _database_status(database, event_spool, importer), lambda: offline_cache.may_load
    )
    return StationServices(station, offline_cache, offline_sessions, live_serializer, importer, watch, finish_imports)


async def set_up_fleet(station: Station, database: Database, stack: AsyncExitStack) -> Fleet:
    """Start to exchange states with the clinic's other stations."""
    fleet = Fleet(station, database, lambda: _station_names(database))
    await stack.enter_async_context(fleet.exchange_states())
    return fleet


def _adoption(
    settings: Settings, database: Database, at_station: StationServices
) -> Callable[[config.StationConfig, str], None]:
    """Return a function that makes the service use the configuration that a commissioning has written."""

    def adopt(new: config.StationConfig, by: str) -> None:
        at_station.commissioning.use(new)
        at_station.importer.use(new)
        task = asyncio.create_task(asyncio.to_thread(_register, database, new, simulated=settings.simulate, by=by))
        adopting.add(task)
        task.add_done_callback(adopting.discard)

    adopting: set[asyncio.Task[None]] = set()
    return adopt


def set_up_delivery_round(event_spool: EventSpool, at_station: StationServices) -> None:
    """Make the spool's delivery thread also import postponed journals and commissioning records, and refresh the offline cache."""

    def each_round() -> None:
        at_station.importer.run_due()
        at_station.offline_cache.refresh()
        at_station.commissioning.check()

    event_spool.delivery.each_round = each_round


async def set_up_metrics(storage: Storage, at_station: StationServices, stack: AsyncExitStack) -> Metrics:
    """Register the metrics of ``/metrics``."""
    metrics = Metrics(at_station.station)
    storage.database.on_waited = metrics.write_waited_s.observe
    metrics.add_gauge(
        "kata_spool_waiting",
        "Records of the station that wait on its computer for the database.",
        lambda: storage.event_spool.delivery.waiting + at_station.importer.waiting,
    )
    metrics.add_gauge(
        "kata_ready_patients",
        "Patients of this day whose session could begin or continue without the database.",
        lambda: at_station.offline_cache.ready_patients,
    )
    await stack.enter_async_context(metrics.counting_stops(at_station.station))
    return metrics


async def set_up_events(storage: Storage, at_station: StationServices, stack: AsyncExitStack) -> None:
    """Write every event of the device to the spool, and pause playbacks that a new contraindication forbids."""
    station, cache = at_station.station, at_station.offline_cache

    def on_event(item: NewDeviceEvent | AlarmsEnded) -> None:
        storage.event_spool.put_event(item)
        cache.on_event(item)

    await stack.enter_async_context(recording_events(station, on_event))
    await stack.enter_async_context(pausing_playbacks(station, cache, storage.database, storage.audit_log))


def _station_name(settings: Settings) -> str:
    return config.read(settings.station).name if settings.station else config.StationConfig().name


def _record_outage(audit_log: AuditLog, since: datetime) -> None:
    with by_program("database_away"):
        audit_log.record_at_once(entry("database_away", "done", detail={"since": since.isoformat(timespec="seconds")}))


def _database_status(database: Database, event_spool: EventSpool, importer: Importer) -> DatabaseStatus:
    return DatabaseStatus(
        unavailable_since=database.unavailable_since,
        waiting=event_spool.delivery.waiting + importer.waiting,
        spool_full_since=event_spool.spool.full_since,
    )


def _upgrade(url: str) -> None:
    """Migrate the database, without a time limit."""
    database = Database(url)
    try:
        upgrade(database)
    finally:
        database.close()


def _register(database: Database, station_config: config.StationConfig, *, simulated: bool, by: str = "") -> None:
    now = utc_now()
    with by_program("register_station", station_config.name), database.write() as session:
        station_service.register(session, station_config, __version__, now, simulated=simulated, changed_by=by)
        if not by:
            event_service.end_left_open(session, station_config.name, now)


def _station_names(database: Database) -> list[str]:
    with database.read() as session:
        return [row.name for row, _ in station_service.registered(session)]


def _with_last_side(station_config: config.StationConfig, station_file: Path) -> config.StationConfig:
    """Return the configuration with the side that was last in use, because a restart does not turn the apparatus."""
    try:
        before = config.read(station_file)
    except config.ConfigError:
        return station_config
    return msgspec.structs.replace(station_config, side=before.side)
