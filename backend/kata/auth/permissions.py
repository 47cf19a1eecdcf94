"""Permissions: a table with the permissions of each role, and a table with the rule of each route.

A route is named by its operation id; WebSockets also have one. The service does not start if a route has no rule
(``api/authorization.py``).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

from kata.actor import Role

Permission = Literal[
    "public",
    "own_account",
    "see_station",
    "stop",
    "operate",
    "diagnose",
    "see_operation",
    "commission",
    "read_records",
    "write_records",
    "administer",
]
"""What each permission allows:

- ``public``: what everyone may do who can reach the service. ``own_account``: what every signed-in user may do with the own account.
- ``see_station``: see the live state of the stations. ``stop``: stop the apparatus. ``operate``: move it, and hold the lease.
- ``diagnose``: see the device without patient data, and use the simulated hand, pedal and emergency stop.
- ``see_operation``: see the state of service and device, without patient data: use, stops, tracking error, versions, metrics,
  commissionings and the support bundle.
- ``commission``: commission the station and change its configuration.
- ``read_records``, ``write_records``: read and change the records of patients.
- ``administer``: manage accounts and their access tokens, the access to restricted records and its reviews, the clinic's profile and
  backups; decide requests for erasure; read the audit trail.
"""

_ALL_USERS: Final[frozenset[Permission]] = frozenset({"own_account", "see_station", "stop"})
"""Every user who sees the apparatus may stop it."""
_THERAPIST: Final[frozenset[Permission]] = _ALL_USERS | {"read_records", "write_records", "operate", "diagnose"}
ROLE_PERMISSIONS: Final[Mapping[Role, frozenset[Permission]]] = MappingProxyType(
    {
        "viewer": _ALL_USERS | {"read_records"},
        "technician": _ALL_USERS | {"diagnose", "see_operation", "commission"},
        "therapist": _THERAPIST,
        "administrator": _THERAPIST | {"administer", "see_operation", "commission"},
    }
)

UNAUDITED_READ_PERMISSIONS: Final[frozenset[Permission]] = frozenset(
    {"public", "own_account", "see_station", "diagnose", "see_operation"}
)
"""Permissions whose read requests the audit trail does not record, because their answers contain no patient's record. Read requests of
all other permissions are recorded.
"""
COMMAND_PERMISSIONS: Final[frozenset[Permission]] = frozenset({"stop", "operate"})
"""Permissions of commands to the apparatus. The answer to a command does not wait for the audit trail."""
TOKEN_PERMISSIONS: Final[frozenset[Permission]] = frozenset({"see_station", "see_operation", "read_records"})
"""Permissions that an access token has, if its owner has them. A program with a token can only read. It cannot read accounts or the audit
trail.
"""


@dataclass(frozen=True, slots=True)
class RouteRule:
    """Permission rule of a route."""

    needs: Permission
    own_station_only: bool = False
    """True if only accounts that work at this service's station may use the route."""
    allowed_for_restricted: bool = False
    """True if the route is allowed on a restricted record, because it requests or manages access to it."""
    allowed_while_locked: bool = False
    """True if the route is allowed while the screen is locked."""
    allowed_while_enrolling: bool = False
    """True if the route is allowed before the required second factor is set up."""
    allowed_without_database: bool = False
    """True if users whom the database has confirmed before may use the route while the database does not answer. The request may then
    name only records of patients in the offline cache (:mod:`kata.clinic.sessions.offline_cache`).
    """
    accepts_metrics_token: bool = False
    """True if programs that send the token of ``KATA_METRICS_TOKEN_FILE`` may use the route without a login. That token is no user's
    access token.
    """
    upload_media_type: str = ""
    """Media type of the body if it is a file. The file may be large, names no record, and is parsed outside the service's process."""


_PUBLIC: Final = RouteRule("public")
_OWN_ACCOUNT: Final = RouteRule(
    "own_account", allowed_while_locked=True, allowed_while_enrolling=True, allowed_without_database=True
)
_READ: Final = RouteRule("read_records")
_WRITE: Final = RouteRule("write_records")
_OPERATE: Final = RouteRule("operate", own_station_only=True)
_OPERATE_WITHOUT_DATABASE: Final = RouteRule("operate", own_station_only=True, allowed_without_database=True)
_DIAGNOSE: Final = RouteRule("diagnose", own_station_only=True, allowed_without_database=True)
_ADMINISTER: Final = RouteRule("administer")
_SEE_STATION: Final = RouteRule("see_station", allowed_while_locked=True, allowed_without_database=True)

_RENAMED: Final[Mapping[str, str]] = MappingProxyType(
    {
        "get_sign_in_options": "get_ways_in",
        "set_side": "turn",
        "reduce_range": "less",
        "request_erasure": "note_erasure",
        "approve_erasure": "erase_patient",
        "get_session_report_html": "get_session_page",
        "get_session_report_pdf": "get_session_pdf",
        "get_episode_report_html": "get_episode_page",
        "get_episode_report_pdf": "get_episode_pdf",
        "export_patient": "get_whole_patient",
        "list_ready_patients": "list_ready",
        "get_session_filter_options": "list_session_choices",
        "confirm_check": "tick_check",
        "list_break_glass_accesses": "list_broken_glass",
        "review_break_glass_access": "review_broken_glass",
        "get_note_draft": "get_draft",
    }
)
"""Former names of renamed routes. The audit trail still uses them as action codes, because stored rows contain them."""


def audit_action(route: str) -> str:
    """Return the audit trail's action code of a route: its name, or its former name if it was renamed."""
    return _RENAMED.get(route, route)


ROUTE_RULES: Final[Mapping[str, RouteRule]] = MappingProxyType(
    {
        # The page itself, and the description of the interface.
        "page": _PUBLIC,
        "openapi": _PUBLIC,
        # For watchdogs, proxies and browsers without a login; the answers contain no personal data.
        "get_health_live": _PUBLIC,
        "get_health_ready": _PUBLIC,
        "get_health_idle": _PUBLIC,
        # Signing in and out.
        "sign_in_by_password": _PUBLIC,
        "sign_in_by_link": _PUBLIC,
        "get_sign_in_options": _PUBLIC,
        "begin_openid": _PUBLIC,
        "sign_in_by_openid": _PUBLIC,
        "confirm_openid": _PUBLIC,
        "set_up_clinic": _PUBLIC,
        "set_password_by_code": _PUBLIC,
        "sign_out": _PUBLIC,
        "get_me": _OWN_ACCOUNT,
        "lock_screen": _OWN_ACCOUNT,
        "unlock_screen": _OWN_ACCOUNT,
        "begin_second_factor": RouteRule("own_account", allowed_while_enrolling=True),
        "confirm_second_factor": RouteRule("own_account", allowed_while_enrolling=True),
        "remove_second_factor": RouteRule("own_account"),
        "change_password": RouteRule("own_account"),
        "choose_language": RouteRule("own_account"),
        "mark_notifications_read": RouteRule("own_account"),
        "list_own_sign_ins": RouteRule("own_account"),
        "end_own_sign_in": RouteRule("own_account"),
        "list_own_access_tokens": RouteRule("own_account"),
        "create_access_token": RouteRule("own_account"),
        "revoke_own_access_token": RouteRule("own_account"),
        # Accounts.
        "list_accounts": _ADMINISTER,
        "create_account": _ADMINISTER,
        "update_account": _ADMINISTER,
        "reset_account": _ADMINISTER,
        "list_access_tokens": _ADMINISTER,
        "revoke_access_token": _ADMINISTER,
        # Patients.
        "list_patients": _READ,
        "create_patient": _WRITE,
        "get_patient": _READ,
        "update_patient": _WRITE,
        "get_patient_banner": RouteRule("read_records", allowed_without_database=True),
        "list_contraindication_kinds": _READ,
        "list_contraindications": _READ,
        "add_contraindication": _WRITE,
        "sign_off_contraindication": _WRITE,
        "resolve_contraindication": _WRITE,
        "get_record_access": RouteRule("read_records", allowed_for_restricted=True),
        "change_record_access": RouteRule("administer", allowed_for_restricted=True),
        "break_glass": RouteRule("read_records", allowed_for_restricted=True),
        "list_break_glass_accesses": _ADMINISTER,
        "review_break_glass_access": _ADMINISTER,
        # Episodes, assessments, progress.
        "list_episodes": _READ,
        "open_episode": _WRITE,
        "get_episode": _READ,
        "update_episode": _WRITE,
        "close_episode": _WRITE,
        "reopen_episode": _WRITE,
        "add_stage": _WRITE,
        "remove_stage": _WRITE,
        "get_assessment_form": _READ,
        "list_assessments": _READ,
        "create_assessment": _WRITE,
        "list_patient_assessments": _READ,
        "get_assessment": _READ,
        "update_assessment": _WRITE,
        "withdraw_assessment": _WRITE,
        "list_questionnaires": _READ,
        "start_patient_mode": _WRITE,
        # The only routes for the patient, in addition to those of a locked screen.
        "get_patient_questionnaire": RouteRule("own_account", allowed_while_locked=True),
        "answer_patient_questionnaire": RouteRule("own_account", allowed_while_locked=True),
        "get_adherence": _READ,
        "get_progress": _READ,
        # Recordings and programmes.
        "list_recordings": _READ,
        "get_recording": _READ,
        "update_recording": _WRITE,
        "derive_recording": _WRITE,
        "preview_derived_recording": _WRITE,
        "get_recording_figure": _READ,
        "get_recording_motion": _READ,
        "get_recording_rhythm": _READ,
        "get_sound_rhythm": _READ,
        "list_programmes": _READ,
        "create_programme": _WRITE,
        "preview_programme": _WRITE,
        "get_programme": _READ,
        "update_programme": _WRITE,
        "create_programme_version": _WRITE,
        # Sessions and runs.
        "list_sessions": _READ,
        "get_session_filter_options": _READ,
        "list_patient_sessions": _READ,
        "create_session": RouteRule("write_records", own_station_only=True, allowed_without_database=True),
        "get_session": RouteRule("read_records", allowed_without_database=True),
        "update_session": RouteRule("write_records", allowed_without_database=True),
        "get_session_plan": _READ,
        "list_ready_patients": RouteRule("read_records", own_station_only=True, allowed_without_database=True),
        "get_checklist": RouteRule("read_records", allowed_without_database=True),
        "confirm_check": RouteRule("write_records", own_station_only=True, allowed_without_database=True),
        "get_teaching_checklist": _READ,
        "end_session": RouteRule("write_records", allowed_without_database=True),
        "get_note_draft": _READ,
        "sign_session": _WRITE,
        "add_addendum": _WRITE,
        "add_goniometer_reading": _WRITE,
        "remove_goniometer_reading": _WRITE,
        "get_run": _READ,
        "get_run_figures": _READ,
        "get_run_motion": _READ,
        "get_played_motion": _READ,
        "get_run_rhythm": _READ,
        "get_end_feel_guide": _READ,
        "get_end_feel": _READ,
        "get_end_feel_csv": _READ,
        # The clinic's figures. Those of the stations name no patient and no therapist.
        "get_worklist": _READ,
        "get_outcomes": _READ,
        "get_clinic_adherence": _READ,
        "get_patient_adherence": _READ,
        "get_usage": RouteRule("see_operation"),
        "get_tracking_quality": RouteRule("see_operation"),
        "get_stop_counts": RouteRule("see_operation"),
        "get_operation": RouteRule("see_operation"),
        # Export and import.
        "get_session_report_html": _READ,
        "get_session_report_pdf": _READ,
        "get_episode_report_html": _READ,
        "get_episode_report_pdf": _READ,
        "get_rehabilitation_plan_pdf": _READ,
        "get_recording_samples": _READ,
        "get_recording_parquet": _READ,
        "get_recording_mcap": _READ,
        "get_run_samples": _READ,
        "get_run_parquet": _READ,
        "get_run_mcap": _READ,
        "get_run_lerobot": _READ,
        "get_patient_fhir": _READ,
        "export_patient": _READ,
        "preview_imported_motion": RouteRule("write_records", upload_media_type="text/csv"),
        "import_motion": RouteRule("write_records", upload_media_type="text/csv"),
        "import_fhir_patients": RouteRule("write_records", upload_media_type="application/fhir+json"),
        # Requests for erasure: recorded by a therapist, decided by an administrator.
        "list_erasures": _READ,
        "list_patient_erasures": _READ,
        "request_erasure": _WRITE,
        "refuse_erasure": _ADMINISTER,
        "approve_erasure": _ADMINISTER,
        "get_clinic_profile": _ADMINISTER,
        "update_clinic_profile": _ADMINISTER,
        "list_backups": _ADMINISTER,
        "make_backup": _ADMINISTER,
        # Administrators must be able to search the audit trail for a restricted record without access to that record.
        "list_audit": RouteRule("administer", allowed_for_restricted=True),
        # The state of the service.
        "list_station_versions": RouteRule("see_operation"),
        "list_commissionings": RouteRule("see_operation"),
        "get_commissioning": RouteRule("see_operation"),
        "get_commissioning_report_pdf": RouteRule("see_operation"),
        "get_station_settings": RouteRule("see_operation"),
        "preview_station_settings": RouteRule("commission", own_station_only=True),
        "import_station_settings": RouteRule("commission", own_station_only=True),
        "get_commissioning_run": RouteRule("see_operation"),
        "start_commissioning": RouteRule("commission", own_station_only=True),
        "confirm_commissioning": RouteRule("commission", own_station_only=True, allowed_without_database=True),
        "get_metrics": RouteRule("see_operation", accepts_metrics_token=True),
        "get_support_bundle": RouteRule("see_operation"),
        # The apparatus.
        "live": _SEE_STATION,
        "live_stations": _SEE_STATION,
        "list_stations": _SEE_STATION,
        "get_station": _SEE_STATION,
        "get_drive_trend": RouteRule("see_station", allowed_without_database=True),
        "get_commissioning_status": RouteRule("see_station", allowed_without_database=True),
        "list_events": RouteRule("see_station"),
        # Counts and ids. Pages request them at intervals.
        "list_notifications": RouteRule("see_station"),
        "stop": RouteRule(
            "stop", allowed_while_locked=True, allowed_while_enrolling=True, allowed_without_database=True
        ),
        "take_lease": _OPERATE_WITHOUT_DATABASE,
        "release_lease": _OPERATE_WITHOUT_DATABASE,
        "set_side": _OPERATE,
        "teach": _OPERATE,
        "finish_teaching": _OPERATE_WITHOUT_DATABASE,
        "load": _OPERATE_WITHOUT_DATABASE,
        "load_end_feel": _OPERATE,
        "unload": _OPERATE_WITHOUT_DATABASE,
        "approach": _OPERATE_WITHOUT_DATABASE,
        "play": _OPERATE_WITHOUT_DATABASE,
        "pause": _OPERATE_WITHOUT_DATABASE,
        "reduce_range": _OPERATE_WITHOUT_DATABASE,
        "return_to_rest": _OPERATE_WITHOUT_DATABASE,
        "release_torque": _OPERATE_WITHOUT_DATABASE,
        "acknowledge": _OPERATE_WITHOUT_DATABASE,
        "get_simulator": RouteRule("diagnose", allowed_without_database=True),
        "set_pedal": _DIAGNOSE,
        "set_estop": _DIAGNOSE,
        "set_effort": _DIAGNOSE,
        "guide_arm": _DIAGNOSE,
        "release_arm": _DIAGNOSE,
        "upload_motion": RouteRule(
            "diagnose", own_station_only=True, allowed_without_database=True, upload_media_type="text/csv"
        ),
    }
)
