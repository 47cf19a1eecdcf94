"""The declared matrix of identity, operation and record: every identity requests every route, WebSocket and static address."""

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from datetime import date, timedelta
from typing import Any, Final
from uuid import UUID, uuid4

import pytest
from fastapi import Depends, FastAPI, WebSocket
from fastapi.routing import APIWebSocketRoute, iter_route_contexts
from fastapi.staticfiles import StaticFiles
from fastapi.testclient import TestClient
from sqlalchemy import func, select, update
from starlette.websockets import WebSocketDisconnect

from kata.actor import Actor, Role
from kata.api import authorization
from kata.audit import deduplication
from kata.audit.tables import AuditRow
from kata.auth import access_tokens
from kata.auth.login_session import COOKIE
from kata.auth.permissions import ROUTE_RULES, UNAUDITED_READ_PERMISSIONS, audit_action
from kata.auth.tables import AccountRow, LoginSessionRow
from kata.clinic import tables
from kata.clinic.patients.tables import ErasureRow
from kata.clinic.restricted.objects import PATIENT_QUERY_BY_ID_NAME, WITHOUT_PATIENT
from kata.clinic.restricted.tables import BreakGlassAccessRow, CareTeamRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.errors import ProblemError
from tests.support.login import signed_in, with_token
from tests.support.service import api_document, other_browser, replaced, running
from tests.support.treatment import Texts, treat

_EVERYBODY: Final[frozenset[Role]] = frozenset({"viewer", "technician", "therapist", "administrator"})
_READ: Final[frozenset[Role]] = frozenset({"viewer", "therapist", "administrator"})
_WRITE: Final[frozenset[Role]] = frozenset({"therapist", "administrator"})
_DEVICE: Final[frozenset[Role]] = frozenset({"technician", "therapist", "administrator"})
_ADMINISTER: Final[frozenset[Role]] = frozenset({"administrator"})

# The requirement, by kind of route and independent of ROUTE_RULES. Every route belongs to exactly one group of GROUPS.
PUBLIC: Final = {
    "get_health_live", "get_health_ready", "get_health_idle", "sign_in_by_password", "sign_in_by_link", "set_up_clinic", "set_password_by_code", "sign_out",
    "get_sign_in_options", "begin_openid", "sign_in_by_openid", "confirm_openid",
}  # fmt: skip
STATIC: Final = {"page", "openapi"}
"""Outside the OpenAPI document."""
SOCKETS: Final = {"live": "/api/live", "live_stations": "/api/stations/live"}
ENROLLING: Final = {"get_me", "lock_screen", "unlock_screen", "begin_second_factor", "confirm_second_factor"}
OWN: Final = ENROLLING | {
    "remove_second_factor", "change_password", "choose_language", "get_patient_questionnaire", "answer_patient_questionnaire", "list_own_sign_ins", "end_own_sign_in",
    "list_own_access_tokens", "create_access_token", "revoke_own_access_token", "mark_notifications_read",
}  # fmt: skip
REDUCES_PERMISSIONS: Final = {"lock_screen", "start_patient_mode"}
"""These routes reduce the user's permissions. tests/api/test_accounts.py tests them."""
STATION: Final = {
    "get_station", "get_drive_trend", "list_stations", "list_events", "stop", "get_commissioning_status",
    "list_notifications",
}  # fmt: skip
ALLOWED_WHEN_LOCKED: Final = set(SOCKETS) | {
    "get_station",
    "list_stations",
    "stop",
    "get_me",
    "lock_screen",
    "unlock_screen",
    "get_patient_questionnaire",
    "answer_patient_questionnaire",
}
DEVICE: Final = {"get_simulator", "set_pedal", "set_estop", "set_effort", "guide_arm", "release_arm", "upload_motion"}
OPERATE: Final = {
    "set_side", "teach", "finish_teaching", "load", "load_end_feel", "unload", "approach", "play", "pause", "reduce_range", "return_to_rest",
    "release_torque", "acknowledge", "take_lease", "release_lease",
}  # fmt: skip
ADMINISTER: Final = {
    "refuse_erasure", "approve_erasure", "change_record_access", "list_break_glass_accesses", "review_break_glass_access", "list_audit",
    "list_accounts", "create_account", "update_account", "reset_account", "list_backups", "make_backup",
    "get_clinic_profile", "update_clinic_profile", "list_access_tokens", "revoke_access_token",
}  # fmt: skip
OPERATION: Final = {
    "get_metrics", "get_support_bundle", "list_station_versions", "get_operation", "get_usage", "get_tracking_quality", "get_stop_counts",
    "list_commissionings", "get_commissioning", "get_commissioning_report_pdf", "get_station_settings", "get_commissioning_run",
}  # fmt: skip
"""The state of the service, without personal data."""
COMMISSION: Final = {
    "preview_station_settings", "import_station_settings", "start_commissioning", "confirm_commissioning",
}  # fmt: skip
OWN_STATION_ONLY: Final = (
    COMMISSION | DEVICE - {"get_simulator"} | OPERATE | {"create_session", "confirm_check", "list_ready_patients"}
)
ALLOWED_ON_RESTRICTED: Final = {"get_record_access", "change_record_access", "break_glass", "list_audit"}
READ: Final = {
    "get_assessment_form", "list_assessments", "list_patient_assessments", "get_assessment", "list_episodes", "get_episode",
    "list_erasures", "list_patient_erasures", "get_recording_samples", "get_recording_parquet", "get_run_samples", "get_run_parquet",
    "get_recording_mcap", "get_run_mcap", "get_run_lerobot",
    "get_patient_fhir", "export_patient", "list_patients", "get_patient", "list_programmes", "get_programme", "get_session_plan",
    "get_adherence", "get_progress", "list_recordings", "get_recording", "get_recording_figure", "get_recording_motion", "get_recording_rhythm",
    "get_sound_rhythm",
    "get_session_report_html", "get_session_report_pdf", "get_episode_report_html", "get_episode_report_pdf",
    "get_rehabilitation_plan_pdf", "get_note_draft",
    "get_record_access", "break_glass", "list_sessions", "get_session_filter_options", "list_patient_sessions", "list_ready_patients",
    "get_worklist", "get_outcomes", "get_clinic_adherence", "get_patient_adherence", "list_questionnaires", "get_patient_banner",
    "list_contraindication_kinds", "list_contraindications",
    "get_session", "get_checklist", "get_teaching_checklist", "get_run", "get_run_motion", "get_played_motion",
    "get_run_figures", "get_run_rhythm", "get_end_feel_guide", "get_end_feel", "get_end_feel_csv",
}  # fmt: skip
WRITE: Final = {
    "create_assessment", "update_assessment", "withdraw_assessment", "open_episode", "update_episode", "close_episode",
    "reopen_episode", "add_stage", "remove_stage", "request_erasure", "preview_imported_motion", "import_motion",
    "import_fhir_patients", "create_patient", "update_patient", "create_programme", "preview_programme", "update_programme",
    "create_programme_version", "update_recording", "derive_recording", "preview_derived_recording", "create_session",
    "start_patient_mode", "add_contraindication", "sign_off_contraindication", "resolve_contraindication",
    "update_session", "confirm_check", "end_session", "sign_session", "add_addendum",
    "add_goniometer_reading", "remove_goniometer_reading",
}  # fmt: skip
FOR_PROGRAMS: Final = READ - {"break_glass"} | STATION - {"stop"} | OPERATION
"""Routes that accept an access token."""
GROUPS: Final[tuple[tuple[Collection[str], frozenset[Role]], ...]] = (
    (PUBLIC, _EVERYBODY),
    (STATIC, _EVERYBODY),
    (SOCKETS, _EVERYBODY),
    (OWN, _EVERYBODY),
    (STATION, _EVERYBODY),
    (DEVICE, _DEVICE),
    (OPERATE, _WRITE),
    (ADMINISTER, _ADMINISTER),
    (OPERATION, frozenset({"technician", "administrator"})),
    (COMMISSION, frozenset({"technician", "administrator"})),
    (READ, _READ),
    (WRITE, _WRITE),
)
"""Every route by name, and the roles that may use it."""
AUTHORIZATION: Final = frozenset(
    {
        "not_signed_in", "locked", "second_factor_needed", "not_allowed", "other_station", "restricted",
        "token_only_reads", "token_ended",
    }
)  # fmt: skip
"""Codes of refusals before the route."""


@dataclass(frozen=True)
class Requester:
    """An identity at a browser."""

    name: str
    role: Role | None = None
    here: bool = True
    invalid_because: str = ""
    """Why the login session is invalid."""
    locked: bool = False
    enrolling: bool = False
    by_token: bool = False
    """A program with an access token."""


REQUESTERS: Final = (
    Requester("without a cookie"),
    Requester("with a made-up cookie", invalid_because="made up"),
    *(Requester(f"disabled {role}", role, invalid_because="disabled") for role in sorted(_EVERYBODY)),
    Requester("signed-out administrator", "administrator", invalid_because="ended"),
    Requester("administrator of yesterday", "administrator", invalid_because="old"),
    *(Requester(role, role) for role in sorted(_EVERYBODY)),
    *(Requester(f"{role} of another station", role, here=False) for role in sorted(_EVERYBODY)),
    *(Requester(f"{role} behind a locked screen", role, locked=True) for role in sorted(_EVERYBODY)),
    Requester("administrator without a second factor", "administrator", enrolling=True),
    *(Requester(f"program of a {role}", role, by_token=True) for role in sorted(_EVERYBODY)),
    Requester("program with a revoked token", "administrator", invalid_because="revoked", by_token=True),
)
_REPEATED: Final = {
    # A disabled account and a locked screen are refused before the role is read.
    "disabled viewer", "disabled technician", "disabled therapist",
    "viewer behind a locked screen", "technician behind a locked screen", "therapist behind a locked screen",
    # The administrator may use every route that a station limits.
    "viewer of another station", "technician of another station", "therapist of another station",
}  # fmt: skip
"""Identities that are refused for the same reason at the same place as another one. The campaign asks as these too."""


def _as_each(in_campaign: Collection[str]) -> pytest.MarkDecorator:
    """Return the parameters of a test that every identity takes, those with these names in the campaign only."""
    return pytest.mark.parametrize(
        "requester",
        [
            pytest.param(
                requester, marks=[pytest.mark.campaign] if requester.name in in_campaign else [], id=requester.name
            )
            for requester in REQUESTERS
        ],
    )


AS_EVERYBODY: Final = _as_each(_REPEATED)
_AT_EVERY_ROUTE: Final = {"without a cookie"}
"""The identity that requests every route. An ended login session is refused at the same place as a missing one."""
_EVERY_ROUTE: Final = pytest.mark.parametrize(
    ("requester", "every_route"),
    [
        pytest.param(
            requester,
            every_route,
            marks=[pytest.mark.campaign] if requester.name in _REPEATED or (every_route and not always) else [],
            id=f"{requester.name}, every route" if every_route and not always else requester.name,
        )
        for requester in REQUESTERS
        for always in [requester.name in _AT_EVERY_ROUTE]
        for every_route in ([True] if always else [False, True])
    ],
)
"""Over HTTP, the other identities request one route of each rule, and every route in the campaign."""


@dataclass(frozen=True)
class Operation:
    """A route, and the ids in its parameters."""

    name: str
    method: str
    path: str
    ids: tuple[str, ...]
    """In path, query and body."""
    query: tuple[str, ...]
    body: tuple[str, ...]


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """Return a service without an apparatus: it answers allowed commands with 503."""
    with running(tmp_path_factory.mktemp("route-permissions"), simulate=False) as client:
        yield client


def _services(client: TestClient) -> Any:
    app: Any = client.app
    return app.state.services


def _database(client: TestClient) -> Database:
    database: Database = _services(client).database
    return database


def _ids_in(schema: Any, schemas: Any, name: str = "") -> Iterator[str]:
    """Return the names of a schema's fields that are ids, at any depth."""
    if "$ref" in schema:
        yield from _ids_in(schemas[schema["$ref"].rpartition("/")[2]], schemas, name)
    if schema.get("format") == "uuid":
        yield name
    for name, field in schema.get("properties", {}).items():
        yield from _ids_in(field, schemas, name)
    for variant in (
        *schema.get("anyOf", ()),
        *schema.get("oneOf", ()),
        *([schema["items"]] if "items" in schema else ()),
    ):
        yield from _ids_in(variant, schemas, name)


def operations(document: Any) -> Iterator[Operation]:
    """Return all operations of the OpenAPI document."""
    for path, methods in document["paths"].items():
        for method, answer in methods.items():
            given = [
                (parameter["in"], parameter["name"], parameter["schema"]) for parameter in answer.get("parameters", ())
            ]
            ids = [(place, name) for place, name, schema in given if [*_ids_in(schema, {}, name)]]
            body = [
                body_id
                for content in answer.get("requestBody", {}).get("content", {}).values()
                for body_id in _ids_in(content["schema"], document["components"]["schemas"])
            ]
            query = tuple(name for place, name in ids if place == "query")
            names = (*(name for _, name in ids), *body)
            yield Operation(answer["operationId"], method.upper(), path, names, query, tuple(body))


@pytest.fixture(scope="module")
def records(service: TestClient) -> dict[str, dict[str, UUID]]:
    """Return the ids of a patient with an open record, and of one whose restricted record no identity may open."""
    found = {}
    kinds: dict[str, Any] = {
        "episode_id": tables.EpisodeRow,
        "stage_id": tables.StageRow,
        "contraindication_id": tables.ContraindicationRow,
        "reading_id": tables.GoniometerReadingRow,
        "recording_id": tables.RecordingRow,
        "session_id": tables.SessionRow,
        "run_id": tables.RunRow,
        "programme_id": tables.ProgrammeRow,
        "programme_version_id": tables.ProgrammeVersionRow,
        "assessment_id": tables.AssessmentRow,
    }
    database = _database(service)
    seen: dict[str, set[UUID]] = {name: set() for name in kinds}
    for whose in ("open", "restricted"):
        with database.write() as session:
            made = treat(session, Texts(name=f"Patient {whose}"), sessions=1, runs=1)
            patient = session.get_one(tables.EpisodeRow, made.episode_id).patient_id
            session.get_one(tables.PatientRow, patient).restricted = whose == "restricted"
            erasure = ErasureRow(id=uuid4(), patient_id=patient, asked_at=utc_now(), reason="", noted_by="N")
            session.add(erasure)
            session.add(
                tables.StageRow(
                    id=uuid4(), episode_id=made.episode_id, stage="frozen", since=date(2026, 1, 1), noted_at=utc_now()
                )
            )
            session.add(
                tables.ContraindicationRow(
                    id=uuid4(), patient_id=patient, code="osteoporosis", noted_at=utc_now(), noted_by="N"
                )
            )
            session.flush()
            ids = {"patient_id": patient, "erasure_id": erasure.id}
            for name, row in kinds.items():
                ids[name] = next(row_id for row_id in session.scalars(select(row.id)) if row_id not in seen[name])
                seen[name].update(session.scalars(select(row.id)))
        found[whose] = ids
    return found


def sign_in_as(client: TestClient, requester: Requester) -> str:
    """Return the cookie of a login session, or the access token, of this kind."""
    if requester.role is None:
        return "made-up" if requester.invalid_because else ""
    database = _database(client)
    if requester.by_token:
        return with_token(database, requester.role, revoked=requester.invalid_because == "revoked")
    cookie = signed_in(database, requester.role, stations=() if requester.here else ("Elsewhere",))
    with database.write() as session:
        row = session.scalars(select(LoginSessionRow).order_by(LoginSessionRow.began_at.desc())).first()
        assert row
        if requester.invalid_because == "disabled":
            session.execute(update(AccountRow).where(AccountRow.id == row.account_id).values(disabled_at=utc_now()))
        elif requester.invalid_because == "ended":
            row.ended_at = utc_now()
        elif requester.invalid_because == "old":
            row.began_at -= timedelta(days=1)
        if requester.locked:
            row.locked_at = utc_now()
        if requester.enrolling:
            session.execute(update(AccountRow).where(AccountRow.id == row.account_id).values(totp_confirmed_at=None))
    return cookie


def present(client: TestClient, credential: str) -> None:
    """Let a client send a cookie, an access token, or nothing."""
    client.cookies.clear()
    client.headers.pop("authorization", None)
    if credential.startswith(access_tokens.PREFIX):
        client.headers["authorization"] = f"Bearer {credential}"
    elif credential:
        client.cookies.set(COOKIE, credential)


def roles_of(name: str) -> frozenset[Role]:
    """Return the roles that may use a route. Fails for a route that is not declared."""
    (roles,) = (roles for names, roles in GROUPS if name in names)
    return roles


def expected(name: str, requester: Requester, whose: str = "") -> tuple[int, str] | None:
    """Return the refusal of a cell of the matrix; None: allowed."""
    if name in PUBLIC or name in STATIC:
        return None
    if requester.invalid_because and requester.by_token:
        return 401, "token_ended"
    if requester.role is None or requester.invalid_because:
        return 401, "not_signed_in"
    if requester.by_token and name not in FOR_PROGRAMS:
        return 403, "token_only_reads"
    if requester.locked and name not in ALLOWED_WHEN_LOCKED:
        return 423, "locked"
    if requester.enrolling and name not in ENROLLING | {"stop"}:
        return 403, "second_factor_needed"
    if requester.role not in roles_of(name) or (whose and requester.role == "technician"):
        return 403, "not_allowed"
    if not requester.here and name in OWN_STATION_ONLY:
        return 403, "other_station"
    if whose in ("restricted", "mixed") and name not in ALLOWED_ON_RESTRICTED:
        return 403, "restricted"
    return None


def ask(client: TestClient, operation: Operation, cookie: str, ids: dict[str, UUID]) -> Any:
    """Send a request with only ids in the body, so most allowed requests end at 422."""
    known = {name: str(value) for name, value in ids.items()} | {
        "check": "side",
        "chart": "rom",
        "glass_id": str(uuid4()),
    }
    path = operation.path.format_map(_OrAnything(known))
    query = {name: known[name] for name in operation.query if name in known}
    body: Any = {name: known[name] for name in operation.body if name in known}
    present(client, cookie)
    if operation.method == "GET":
        return client.get(path, params=query)
    return client.request(operation.method, path, params=query, json=body)


class _OrAnything(dict[str, str]):
    def __missing__(self, key: str) -> str:
        return str(uuid4())


def _asked(document: Any, every_route: bool) -> list[Operation]:
    """Return every operation, or one of each rule. Signing out comes last, because it ends the login session."""
    found = list(operations(document))
    if not every_route:
        found = [*{ROUTE_RULES[operation.name]: operation for operation in found}.values()]
    return sorted(found, key=lambda operation: operation.name == "sign_out")


@pytest.mark.parametrize(
    "requester",
    [
        pytest.param(requester, id=requester.name)
        for requester in REQUESTERS
        if requester.role is not None and not requester.invalid_because
    ],
)
def test_the_rules_grant_every_identity_the_declared_routes(service: TestClient, requester: Requester) -> None:
    wrong = {}
    for operation in operations(api_document()):
        named = [(name, uuid4()) for name in operation.ids if name in PATIENT_QUERY_BY_ID_NAME]
        refusal = expected(operation.name, requester, "open" if named else "")
        if (got := _refused(operation, requester, named)) != refusal:
            wrong[operation.name] = refusal, got
    assert wrong == {}


def _refused(operation: Operation, requester: Requester, named: list[tuple[str, UUID]]) -> tuple[int, str] | None:
    """Return how the rule of a route refuses an identity, without a request."""
    rule = ROUTE_RULES[operation.name]
    if rule.needs == "public":
        return None
    assert requester.role is not None
    stations = frozenset[str]() if requester.here else frozenset({"Elsewhere"})
    actor = Actor(
        uuid4(), uuid4(), "N", requester.role, stations, requester.locked, requester.enrolling, requester.by_token
    )
    try:
        if requester.by_token:
            authorization.check_only_reads(operation.method, rule)
        authorization.check_user(actor, rule, "Station 1", named)
    except ProblemError as error:
        return error.status, error.code
    return None


@pytest.mark.timeout(600)
@_EVERY_ROUTE
def test_every_role_is_limited_to_its_rights(
    service: TestClient, records: dict[str, dict[str, UUID]], requester: Requester, every_route: bool
) -> None:
    # Other tests check the results of allowed requests.
    client = other_browser(service)
    wrong, cells = [], 0
    cookie = sign_in_as(service, requester)
    for operation in _asked(api_document(), every_route):
        named = [name for name in dict.fromkeys(operation.ids) if name in PATIENT_QUERY_BY_ID_NAME]
        for whose in RECORDS if len(named) > 1 else RECORDS[:2] if named else ("",):
            refusal = expected(operation.name, requester, whose)
            if refusal is None and operation.name in {"export_patient"} | REDUCES_PERMISSIONS | _SLOW:
                continue
            ids = records["restricted" if whose == "restricted" else "open"]
            if whose == "mixed":
                ids = ids | {named[-1]: records["restricted"][named[-1]]}
            answer = ask(client, operation, cookie, ids)
            code = answer.json().get("code") if answer.status_code >= 400 else None
            cells += 1
            if (got := (answer.status_code, code) if code in AUTHORIZATION else None) != refusal:
                wrong.append((operation.name, whose, refusal, answer.status_code, code, got))
    assert wrong == []
    assert cells > (120 if every_route else 20)


@pytest.mark.parametrize("every_route", [False, pytest.param(True, marks=pytest.mark.campaign)])
def test_refresh_of_any_view_leaves_no_audit_row(
    service: TestClient, records: dict[str, dict[str, UUID]], monkeypatch: pytest.MonkeyPatch, every_route: bool
) -> None:
    monkeypatch.setattr(deduplication, "WINDOW_S", 0.0)
    audit_log = _services(service).audit_log
    monkeypatch.setattr(audit_log, "_deduplicator", deduplication.Deduplicator())
    cookie = signed_in(_database(service), "administrator")
    wrong, viewed = {}, 0

    def rows_after(headers: dict[str, str]) -> int:
        client = other_browser(service)
        client.headers.update(headers)
        status = ask(client, operation, cookie, records["open"]).status_code
        assert audit_log.until_written()
        query = select(func.count()).where(AuditRow.action == audit_action(operation.name), AuditRow.outcome == "done")
        with _database(service).read() as session:
            return session.scalar(query) or 0 if status < 400 else -1

    slow = {"export_patient"} | _SLOW
    views = [found for found in operations(api_document()) if found.method == "GET" and found.name not in slow]
    for operation in views if every_route else {ROUTE_RULES[found.name]: found for found in views}.values():
        counts = [rows_after({}), rows_after({}), rows_after({"x-kata-refresh": "1"})]
        if counts[0] > 0:
            viewed += 1
            # The second view, which is no refresh, is recorded.
            if counts != [counts[0], counts[0] + 1, counts[0] + 1]:
                wrong[operation.name] = counts
    assert wrong == {}
    assert viewed > (30 if every_route else 3)


RECORDS: Final = ("open", "restricted", "mixed")
"""Records that a request names: a patient's whose record is open, a patient's whose record is restricted, and both."""
_SLOW: Final = {"get_session_report_pdf", "get_episode_report_pdf", "get_rehabilitation_plan_pdf", "make_backup"}
"""Let through, they take seconds; tests/api/test_reports.py and test_backups.py ask for them."""


@AS_EVERYBODY
def test_every_role_sees_only_permitted_station_data(service: TestClient, requester: Requester) -> None:
    client = TestClient(service.app)
    present(client, sign_in_as(service, requester))
    for name, path in SOCKETS.items():
        refusal = expected(name, requester)
        if refusal:
            with pytest.raises(WebSocketDisconnect) as closed, client.websocket_connect(path):
                pass
            assert (closed.value.code, closed.value.reason) == (1008, refusal[1])
            continue
        with client.websocket_connect(path) as socket:
            first = socket.receive_json()
        assert (
            [station["here"] for station in first["stations"]] == [True]
            if "stations" in first
            else first["kind"] == "snapshot"
        )


# Every identity gets the same files. A test run asks without a login and with all rights.
@_as_each({requester.name for requester in REQUESTERS} - {"without a cookie", "administrator"})
def test_static_addresses_are_public_and_contain_only_files(
    service: TestClient, records: dict[str, dict[str, UUID]], requester: Requester
) -> None:
    client = TestClient(service.app)
    present(client, sign_in_as(service, requester))
    patient_id = records["open"]["patient_id"]
    answers = {path: client.get(path) for path in (*STATIC_ADDRESSES, f"/patients/{patient_id}")}
    # Without a built page or documentation the service says so.
    assert {path for path, answer in answers.items() if answer.status_code not in (200, 404, 503)} == set()
    assert {path for path, answer in answers.items() if _reveals(answer.content, service, patient_id)} == set()
    for path in FOREIGN_FILES:
        answer = client.get(path)
        # The shell of the page, or nothing.
        assert answer.status_code in (400, 404, 503) or answer.text.startswith("<!doctype html>"), path
        assert not _reveals(answer.content, service, patient_id), path
    for method in ("POST", "PUT", "PATCH", "DELETE"):
        assert client.request(method, "/docs/").status_code == 405


STATIC_ADDRESSES: Final = (
    "/",
    "/index.html",
    "/docs",
    "/docs/",
    "/docs/manual/",
    "/assets/none.js",
    "/api/openapi.json",
)
FOREIGN_FILES: Final = (
    "/kata.db", "/..%2fkata.db", "/%2e%2e/%2e%2e/etc/passwd", "/docs/..%2f..%2fkata.db", "/docs/%2fetc%2fpasswd", "//etc/passwd",
    "/assets/..%2f..%2fpyproject.toml", "/audit.anchor", "/docs/%00", "/%00",
)  # fmt: skip
"""Files outside the folders of the page and of the documentation."""


def _reveals(content: bytes, service: TestClient, patient_id: UUID) -> bool:
    """Return whether an answer contains a file of this computer or of a record."""
    data = str(_services(service).settings.data).encode()
    return any(
        found in content
        for found in (b"SQLite format", b"root:", b"[project]", data, str(patient_id).encode(), b"Patient open")
    )


def test_a_request_that_cannot_be_read_is_refused_first(service: TestClient) -> None:
    client = TestClient(service.app)
    for body in (b"{", b"\xff\xfe", b'{"a": ' * 2000):
        answer = client.post("/api/patients", content=body, headers={"content-type": "application/json"})
        assert (answer.status_code, answer.json()["code"]) == (401, "not_signed_in")


def test_every_id_in_a_request_leads_to_its_patient(service: TestClient) -> None:
    named = {name for operation in operations(api_document()) for name in operation.ids}
    assert named <= set(PATIENT_QUERY_BY_ID_NAME) | WITHOUT_PATIENT
    assert set(PATIENT_QUERY_BY_ID_NAME) <= named


def _routes(app: FastAPI) -> set[str]:
    """Return the names of all routes, those outside the OpenAPI document too."""
    return {found.name or "" for found in iter_route_contexts(app.routes)}


def _undeclared(app: FastAPI) -> set[str]:
    """Return the routes that do not belong to exactly one group."""
    declared = Counter(name for names, _ in GROUPS for name in names)
    return {name for name in _routes(app) | set(declared) if declared[name] != 1 or name not in _routes(app)}


def test_every_route_has_a_declared_cell(service: TestClient) -> None:
    app: Any = service.app
    assert _undeclared(app) == set()
    in_document = {operation.name for operation in operations(api_document())}
    assert _routes(app) == in_document | STATIC | set(SOCKETS)
    assert {name for name, path in SOCKETS.items() if path in _paths_of_sockets(app)} == set(SOCKETS)
    assert len(SOCKETS) == len(_paths_of_sockets(app))


def _paths_of_sockets(app: FastAPI) -> set[str]:
    found = (context.original_route for context in iter_route_contexts(app.routes))
    return {route.path for route in found if isinstance(route, APIWebSocketRoute)}


def test_undeclared_route_fails_the_matrix_check(service: TestClient) -> None:
    app = FastAPI()
    app.router.routes.extend(service.app.router.routes)  # type: ignore[attr-defined]

    @app.get("/api/secret")
    def secret() -> None:
        """A route that no group contains."""

    @app.websocket("/api/secret/live")
    async def secret_live(socket: WebSocket) -> None:
        """A WebSocket that no group contains."""

    app.mount("/secret", StaticFiles(directory="."), name="secret_files")
    assert _undeclared(app) >= {"secret", "secret_live", "secret_files"}
    with pytest.raises(ValueError, match="not enough values"):
        roles_of("secret")


def test_routes_and_rules_match_one_to_one(service: TestClient) -> None:
    app: Any = service.app
    assert _routes(app) == set(ROUTE_RULES)


def test_every_view_of_a_patients_record_is_audited(service: TestClient) -> None:
    views = {operation.name: operation.path for operation in operations(api_document()) if operation.method == "GET"}
    of_patients = {
        name for name, path in views.items() if any(f"{{{id_}}}" in path for id_ in PATIENT_QUERY_BY_ID_NAME)
    }
    of_patients |= READ & views.keys()
    assert len(of_patients) > 40
    assert {
        name: ROUTE_RULES[name].needs for name in of_patients if ROUTE_RULES[name].needs in UNAUDITED_READ_PERMISSIONS
    } == {}


def test_service_with_a_route_without_a_rule_does_not_start() -> None:
    app = FastAPI(dependencies=[Depends(authorization.authorize)], openapi_url=None, docs_url=None, redoc_url=None)

    @app.get("/api/secret")
    def secret() -> None:
        """A route without a rule."""

    with pytest.raises(LookupError, match="secret"):
        authorization.check_rules(app)


def test_stop_works_without_a_database_for_recently_authenticated_users(service: TestClient) -> None:
    client = TestClient(service.app)
    client.cookies.set(COOKIE, signed_in(_database(service), "viewer"))
    assert client.get("/api/station").status_code == 200
    with replaced(service.app, database=None):
        assert client.post("/api/station/stop").status_code in (200, 503)


# -- restricted records ---------------------------------------------------------------------------------------------


def _as(service: TestClient, role: Role) -> tuple[TestClient, UUID]:
    """Return a browser and the id of its user's account."""
    client = TestClient(service.app)
    client.cookies.set(COOKIE, signed_in(_database(service), role))
    return client, UUID(client.get("/api/me").json()["account_id"])


REASON: Final = {"reason": "Acute pain, her therapist is away."}


def test_lists_omit_records_the_user_may_not_see(service: TestClient, records: dict[str, dict[str, UUID]]) -> None:
    hidden = str(records["restricted"]["patient_id"])
    therapist, _ = _as(service, "therapist")
    paths = ("/api/patients?limit=200", "/api/sessions?limit=200", "/api/erasures", "/api/events?limit=200")
    assert not [path for path in paths if hidden in therapist.get(path).text]
    assert all(str(records["open"]["patient_id"]) in therapist.get(path).text for path in paths[:3])


def test_restricted_record_is_found_by_whole_number_and_identified(
    service: TestClient, records: dict[str, dict[str, UUID]]
) -> None:
    patient_id = records["restricted"]["patient_id"]
    with _database(service).read() as session:
        number = session.get_one(tables.PatientRow, patient_id).clinic_number
    therapist, _ = _as(service, "therapist")
    items = therapist.get("/api/patients", params={"search": number}).json()["items"]
    assert [item["id"] for item in items] == [str(patient_id)]
    answer = {name: value for name, value in items[0].items() if value not in (None, "", "unknown")}
    assert set(answer) == {"id", "clinic_number", "name", "created_at", "updated_at", "restricted"}
    assert therapist.get("/api/patients", params={"search": number[:-1]}).json()["items"] == []


def test_break_glass_needs_a_reason_and_lasts_four_hours(
    service: TestClient, records: dict[str, dict[str, UUID]], caplog: pytest.LogCaptureFixture
) -> None:
    patient_id = records["restricted"]["patient_id"]
    path = f"/api/patients/{patient_id}"
    therapist, account_id = _as(service, "therapist")
    assert therapist.post(f"{path}/break-glass-accesses", json={"reason": "because"}).status_code == 422
    before = therapist.get(f"{path}/access").json()
    assert (before["restricted"], before["open_to_you"], before["glass_until"]) == (True, False, None)

    answer = therapist.post(f"{path}/break-glass-accesses", json=REASON).json()
    assert (answer["open_to_you"], answer["glass_until"] is not None) == (True, True)
    assert "in an emergency" in caplog.text
    assert "Test therapist" not in caplog.text, "the log is part of support bundles"
    assert therapist.get(path).status_code == 200
    assert therapist.post(f"{path}/break-glass-accesses", json=REASON).json()["code"] == "not_restricted"
    assert _as(service, "therapist")[0].get(path).json()["code"] == "restricted"

    administrator, _ = _as(service, "administrator")
    first = administrator.get("/api/break-glass-accesses").json()["items"][0]
    assert (first["account_id"], first["reason"], first["reviewed_at"]) == (str(account_id), REASON["reason"], None)
    reviewed = administrator.post(f"/api/break-glass-accesses/{first['id']}/review").json()
    assert reviewed["reviewed_by"] == "Test administrator"
    assert administrator.post(f"/api/break-glass-accesses/{first['id']}/review").json()["code"] == "reviewed"

    with _database(service).write() as session:
        session.execute(update(BreakGlassAccessRow).values(until=utc_now()))
    assert therapist.get(path).json()["code"] == "restricted"


def test_user_cannot_review_their_own_break_glass_access(
    service: TestClient, records: dict[str, dict[str, UUID]]
) -> None:
    administrator, account_id = _as(service, "administrator")
    path = f"/api/patients/{records['restricted']['patient_id']}/break-glass-accesses"
    assert administrator.post(path, json=REASON).status_code == 200
    own = next(
        item
        for item in administrator.get("/api/break-glass-accesses").json()["items"]
        if item["account_id"] == str(account_id)
    )
    assert administrator.post(f"/api/break-glass-accesses/{own['id']}/review").json()["code"] == "own_glass"


def test_an_administrator_restricts_a_record_to_a_team(service: TestClient) -> None:
    administrator, _ = _as(service, "administrator")
    member, member_id = _as(service, "therapist")
    body = {"clinic_number": "T-1", "name": "N", "affected_side": "left"}
    path = f"/api/patients/{member.post('/api/patients', json=body).json()['id']}"
    unknown = administrator.put(f"{path}/access", json={"restricted": True, "account_ids": [str(uuid4())]})
    assert (unknown.status_code, unknown.json()["code"]) == (422, "no_account")
    answer = administrator.put(f"{path}/access", json={"restricted": True, "account_ids": [str(member_id)]}).json()
    assert [member["account_id"] for member in answer["team"]] == [str(member_id)]
    assert answer["open_to_you"] is False
    assert member.get(path).json()["restricted"] is True
    assert _as(service, "therapist")[0].get(path).status_code == 403
    administrator.put(f"{path}/access", json={"restricted": False})
    assert _as(service, "viewer")[0].get(path).status_code == 200
    with _database(service).read() as session:
        assert session.scalars(select(CareTeamRow)).all() == []
