"""Sends a page's requests to a service over HTTP, one after another, and measures the answer times."""

import http.client
import itertools
import json
import socket
import threading
import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote, urlencode

import numpy as np
import uvicorn
from fastapi import FastAPI

from benchmarks.synthetic import ACCOUNTS, ACTIONS, STATIONS, STOPS, THERAPISTS, History
from kata.api.app import create_app
from kata.audit.audit_log import AuditLog
from kata.audit.chain import Entry
from kata.audit.deduplication import RecordedViews
from kata.auth.auth_cache import AuthCache
from kata.auth.demonstration import DemonstrationLinks
from kata.auth.login import Authentication, SessionRevocations
from kata.auth.login_session import Limits
from kata.auth.passwords import Passwords, hasher
from kata.bench.account import sign_in_cookie
from kata.bench.running_service import BenchError
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.clinic.sessions.offline_sessions import OfflineSessions
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.plotting.figures import FigureWorker
from kata.settings import Settings
from kata.system.gc_freeze import permanent_objects

_START_LIMIT_S: Final = 30.0
_LONGEST: Final = timedelta(hours=12)
"""Longest time of a measurement. The sign-in sends no request while the next database is created, so the screen locks only after this time."""
_PAGES: Final = 20
"""Number of pages of a list that are read one after another."""


@dataclass(frozen=True)
class RequestKind:
    """One kind of request. Names in braces are replaced by values of the history, with other values each time.

    The request is not sent to a service without this path or parameter.
    """

    path: str
    query: dict[str, str] = field(default_factory=dict)
    paged: bool = False
    """True if the list is read page by page."""
    administrator: bool = False
    """True if an administrator sends the request."""

    @property
    def name(self) -> str:
        """Name of the request in the table."""
        query = "&".join(f"{name}={value}" for name, value in self.query.items())
        return self.path + (f"?{query}" if query else "") + (", further pages" if self.paged else "")


LISTS: Final = (
    RequestKind("/api/patients"),
    RequestKind("/api/patients", paged=True),
    RequestKind("/api/patients", {"search": "{name}"}),
    RequestKind("/api/patients", {"search": "{kana}"}),
    RequestKind("/api/patients", {"search": "{number}"}),
    RequestKind("/api/patients", {"search": "{born}"}),
    RequestKind("/api/patients/{patient_id}"),
    RequestKind("/api/patients/{patient_id}/sessions"),
    RequestKind("/api/patients/{patient_id}/sessions", {"limit": "200"}),
    RequestKind("/api/patients/{patient_id}/banner"),
    RequestKind("/api/patients/{patient_id}/contraindications"),
    RequestKind("/api/patients/{patient_id}/recordings"),
    RequestKind("/api/patients/{patient_id}/episodes"),
    RequestKind("/api/patients/{patient_id}/assessments"),
    RequestKind("/api/patients/{patient_id}/programmes"),
    RequestKind("/api/episodes/{episode_id}"),
    RequestKind("/api/episodes/{episode_id}/assessments"),
    RequestKind("/api/episodes/{episode_id}/adherence"),
    RequestKind("/api/episodes/{episode_id}/progress/{chart}"),
    RequestKind("/api/sessions"),
    RequestKind("/api/sessions", paged=True),
    RequestKind("/api/sessions", {"since": "2019-05-01T00:00:00Z", "until": "2019-05-08T00:00:00Z"}),
    RequestKind("/api/sessions", {"therapist": "{therapist}"}),
    RequestKind("/api/sessions", {"station": "{station}"}),
    RequestKind("/api/sessions", {"stop": "{stop}"}),
    RequestKind("/api/sessions", {"therapist": "{therapist}", "stop": "{stop}"}),
    RequestKind("/api/sessions", {"therapist": "Nobody", "stop": "{stop}"}),
    *(
        RequestKind("/api/sessions", {"unsigned": "true"} | more)
        for more in (
            {},
            {"therapist": "{therapist}"},
            {"station": "{station}"},
            {"stop": "{stop}"},
            {"since": "2019-05-01T00:00:00Z", "until": "2019-05-08T00:00:00Z"},
        )
    ),
    RequestKind("/api/sessions", {"unsigned": "true"}, paged=True),
    RequestKind("/api/patients", {"search": "Nobody"}),
    RequestKind("/api/sessions/{session_id}"),
    RequestKind("/api/sessions/filter-options"),
    RequestKind("/api/events", {"session_id": "{session_id}", "kind": "alarm"}),
    RequestKind("/api/break-glass-accesses", administrator=True),
    RequestKind("/api/events"),
    RequestKind("/api/events", {"station": "{station}"}),
    RequestKind("/api/notifications", administrator=True),
    RequestKind("/api/worklist"),
    RequestKind("/api/statistics/adherence"),
    RequestKind("/api/statistics/clinic-adherence"),
    RequestKind("/api/statistics/usage", {"by": "week"}, administrator=True),
    RequestKind(
        "/api/statistics/usage", {"by": "day", "since": "{years_ago}", "station": "{station}"}, administrator=True
    ),
    RequestKind("/api/statistics/tracking", administrator=True),
    RequestKind("/api/statistics/tracking", {"since": "{years_ago}"}, administrator=True),
    RequestKind("/api/statistics/stops", administrator=True),
    RequestKind("/api/statistics/stops", {"since": "{years_ago}"}, administrator=True),
    RequestKind("/api/statistics/outcomes", administrator=True),
    RequestKind("/api/statistics/outcomes", {"since": "{years_ago}"}, administrator=True),
    *(
        RequestKind("/api/audit", query, administrator=True)
        for query in (
            {},
            {"account_id": "{account_id}"},
            {"patient_id": "{patient_id}"},
            {"action": "{action}"},
            {"action": "unheard_of"},
            {"outcome": "refused"},
            {"outcome": "failed"},
            {"station": "{station}"},
            {"since": "2019-05-01T00:00:00Z", "until": "2019-05-08T00:00:00Z"},
            {"account_id": "{account_id}", "until": "2017-05-08T00:00:00Z"},
        )
    ),
    RequestKind("/api/audit", paged=True, administrator=True),
)
ERROR_PLOT: Final = RequestKind("/api/runs/{run_id}/figures")


class HistoryService:
    """The service with a database and without an apparatus, on its own port."""

    def __init__(self, app: FastAPI, port: int, cookie: str, administrator_cookie: str) -> None:
        """Store the address. ``cookie``, ``administrator_cookie``: headers of the login sessions of a therapist and of an administrator."""
        self._app = app
        self._port = port
        self._cookies = {False: cookie, True: administrator_cookie}

    def answers_ms(self, kind: RequestKind, history: History) -> Generator[float]:
        """Send requests without end. Yield the time of each answer in ms.

        :raises BenchError: when a request fails.
        """
        connection = http.client.HTTPConnection("127.0.0.1", self._port, timeout=60.0)
        try:
            after = None
            for n in itertools.count():
                page = n % _PAGES
                after = None if page == 0 else after
                query = {name: _fill(history, text, n) for name, text in kind.query.items()}
                query |= {"after": after} if kind.paged and after else {}
                began = time.perf_counter()
                path = f"{_fill(history, kind.path, n, quoted=True)}?{urlencode(query)}"
                connection.request("GET", path, headers={"Cookie": self._cookies[kind.administrator]})
                answer = connection.getresponse()
                body = answer.read()
                took_ms = (time.perf_counter() - began) * 1000
                if answer.status != 200:
                    raise BenchError(f"{kind.name} was answered with {answer.status}: {body[:300]!r}")
                after = json.loads(body).get("next") if kind.paged else None
                yield took_ms
        finally:
            connection.close()

    def has(self, kind: RequestKind) -> bool:
        """Return True if the service has the path and every parameter."""
        described: dict[str, Any] = self._app.openapi()["paths"]
        found = [path for path in described if _shape(path) == _shape(kind.path) and "get" in described[path]]
        if not found:
            return False
        known = {
            parameter["name"]
            for parameter in described[found[0]]["get"].get("parameters", [])
            if parameter["in"] == "query"
        }
        return set(kind.query) | ({"after"} if kind.paged else set()) <= known


def percentiles_ms(
    kind: RequestKind, of: Sequence[tuple[HistoryService, History]], times: int
) -> list[tuple[float, float]]:
    """Return median and 95th percentile of each service's answer times. Requests alternate, so that other work affects all
    services equally.

    :raises BenchError: when a request fails.
    """
    with ExitStack() as asking:
        answers = [asking.enter_context(closing(service.answers_ms(kind, history))) for service, history in of]
        took = [[next(durations) for durations in answers] for _ in range(times + 1)]
    # Omit the first answer, which opens the connection and files.
    medians, p95s = np.percentile(took[1:], (50, 95), axis=0)
    return [(float(median), float(p95)) for median, p95 in zip(medians, p95s, strict=True)]


class _NoAuditLog:
    """Replaces the audit log, because accesses to invented patients need no record. The query for other anchors is the service's own."""

    copy = None
    elsewhere: Sequence[Path] = ()
    recorded_views: Final = RecordedViews()
    _anchor_id = ""
    has_other_anchors = AuditLog.has_other_anchors

    async def record(self, _: Entry) -> None:
        """Do nothing: the benchmark keeps no audit trail."""

    def record_at_once(self, _: Entry) -> None:
        """Do nothing: the benchmark keeps no audit trail."""

    def until_written(self, _: float) -> bool:
        """Return True, because no entry waits to be written."""
        return True


@dataclass(frozen=True)
class _ListServices:
    """The part of :class:`kata.api.services.Services` that lists and figures use. There is no station."""

    database: Database
    figures: FigureWorker
    offline_cache: OfflineCache
    offline_sessions: OfflineSessions
    auth: Authentication
    settings: Settings
    auth_cache: AuthCache = field(default_factory=AuthCache)
    audit_log: _NoAuditLog = field(default_factory=_NoAuditLog)
    station_name: str = ""


def _app(database: Database, folder: Path, figures: FigureWorker) -> FastAPI:
    settings = Settings(data=folder, database_url=database.url.render_as_string(hide_password=False))
    app = create_app(settings)
    offline_cache = OfflineCache(database, STATIONS[0])
    links, limits = DemonstrationLinks(allowed=False), Limits(idle=_LONGEST)
    app.state.services = _ListServices(
        database=database,
        figures=figures,
        offline_cache=offline_cache,
        offline_sessions=OfflineSessions(offline_cache, STATIONS[0]),
        auth=Authentication(
            Passwords(hasher()), links, SessionRevocations(database, limits, utc_now), folder, limits=limits
        ),
        settings=settings,
    )
    # It is made once and kept.
    app.openapi()
    return app


@contextmanager
def serving(database: Database, folder: Path) -> Iterator[HistoryService]:
    """Serve the database over HTTP during the block. Like ``kata serve``, exclude permanent objects from garbage collection."""
    figures = FigureWorker()
    with permanent_objects():
        app = _app(database, folder, figures)
    # With IPPROTO_TCP asyncio switches off Nagle's algorithm, which would delay every answer by 40 ms.
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listening.bind(("127.0.0.1", 0))
    listening.listen()
    # A connection waits while the other service answers, for the first figure longer than uvicorn's 5 s.
    config = uvicorn.Config(app, lifespan="off", log_level="error", access_log=False, timeout_keep_alive=60)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, args=([listening],), name="service", daemon=True)
    thread.start()
    try:
        limit = time.monotonic() + _START_LIMIT_S
        while not server.started:
            if time.monotonic() > limit:
                raise BenchError("the service did not start")
            time.sleep(0.01)
        yield HistoryService(
            app,
            listening.getsockname()[1],
            sign_in_cookie(database, name=THERAPISTS[0]),
            sign_in_cookie(database, "administrator"),
        )
    finally:
        server.should_exit = True
        thread.join(_START_LIMIT_S)
        listening.close()
        figures.close()


def _shape(path: str) -> Sequence[str]:
    """Return the parts of a path, without the names in braces."""
    return ["{}" if part.startswith("{") else part for part in path.split("/")]


_CHARTS: Final = ("rom", "pain", "spadi", "tracking", "correction", "adherence", "end_feel")
_KANA: Final = ("ヤマダ", "コバヤシ ケン", "モリ マイ")
_BORN: Final = ("1968", "1955-03", "1949-12")


def _fill(history: History, text: str, n: int, *, quoted: bool = False) -> str:
    choices: dict[str, Sequence[object]] = {
        "patient_id": history.patients,
        "episode_id": history.episodes,
        "session_id": history.sessions,
        "recording_id": history.recordings,
        "run_id": (history.hour,),
        "name": history.names,
        "kana": _KANA,
        "number": [f"K-{k:06}" for k in range(100)],
        "born": _BORN,
        "chart": _CHARTS,
        "therapist": THERAPISTS,
        "station": STATIONS,
        "stop": STOPS,
        # The longest period that the page offers.
        "years_ago": ((utc_now() - timedelta(days=2 * 365)).isoformat(timespec="seconds"),),
        "account_id": ACCOUNTS,
        "action": ACTIONS,
    }
    chosen = {name: str(of[n % len(of)]) for name, of in choices.items()}
    return text.format_map({name: quote(value) for name, value in chosen.items()} if quoted else chosen)
