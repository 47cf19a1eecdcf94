"""Everything that the routes of one running service use.

``app.state.services`` holds the one instance of :class:`Services`; the application's state holds nothing else. Only modules of
this package may import this module. Packages below the API read the same object through a Protocol of their own that names only the parts they
use; :func:`attach` makes the type checker prove that ``Services`` satisfies each of these Protocols.
"""

from dataclasses import dataclass

from fastapi import FastAPI
from starlette.requests import HTTPConnection

from kata.api.commissioning_run import CommissioningRun
from kata.api.commissioning_watch import CommissioningWatch
from kata.api.database_probe import DatabaseProbe
from kata.api.fleet import Fleet
from kata.api.live_serializer import LiveStateSerializer
from kata.api.message_limits import Offences
from kata.api.metrics import Metrics
from kata.api.simulation import Simulation
from kata.audit.audit_log import AuditLog
from kata.audit.router import AuditServices
from kata.auth.auth_cache import AuthCache
from kata.auth.login import Authentication, AuthServices
from kata.backups.router import Backups, BackupServices
from kata.clinic.event_spool import EventSpool
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.clinic.sessions.offline_sessions import OfflineSessions
from kata.clinic.sessions.router import SessionServices
from kata.database.engine import Database
from kata.dependencies import CoreServices
from kata.plotting.figures import FigureWorker
from kata.reporting.letterhead import Letterhead
from kata.reporting.router import ReportServices
from kata.settings import Settings
from kata.station.station import Station


@dataclass(frozen=True)
class Services:
    """The services that ``api/set_up.py`` sets up."""

    settings: Settings
    database: Database
    event_spool: EventSpool
    audit_log: AuditLog
    auth: Authentication
    auth_cache: AuthCache
    figures: FigureWorker
    station: Station
    live_serializer: LiveStateSerializer
    offline_cache: OfflineCache
    offline_sessions: OfflineSessions
    fleet: Fleet
    simulation: Simulation | None
    """None if the apparatus is real."""
    probe: DatabaseProbe
    metrics: Metrics
    backups: Backups
    commissioning: CommissioningWatch
    commissioning_run: CommissioningRun
    letterhead: Letterhead
    offences: Offences

    @property
    def station_name(self) -> str:
        """Return the name of this service's station."""
        return self.station.info.name


def attach(app: FastAPI, services: Services) -> None:
    """Hand the services to the routes of ``app``."""
    _lower_views: tuple[CoreServices, AuditServices, AuthServices, BackupServices, SessionServices, ReportServices]
    _lower_views = (services, services, services, services, services, services)
    app.state.services = services


def services_of(connection: HTTPConnection) -> Services:
    """Return the services of the application that received this request or WebSocket."""
    services: Services = connection.app.state.services
    return services
