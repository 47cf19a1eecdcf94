"""Messages about invalid fields of a request: names of fields, units and validation errors."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal

from kata import texts
from kata.messages import Template, Text, message, with_key

Language = Literal["en", "ja"]

_SENTENCES: Final = {
    "missing": "is required",
    "extra_forbidden": "is not a known field",
    "string_type": "must be text",
    "string_empty": "must not be empty",
    "string_too_short": "must have {min_length:d} characters or more",
    "string_too_long": "must have {max_length:d} characters or fewer",
    "string_pattern_mismatch": "contains characters that are not allowed",
    "string_unicode": "contains characters that cannot be read",
    "int_type": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_parsing_size": "is too large",
    "int_from_float": "must be a whole number",
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "finite_number": "must be a finite number",
    "greater_than": "must be more than {gt:g}",
    "greater_than_equal": "must be {ge:g} or more",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be {le:g} or less",
    "angle_implausible": "must be between {lowest:g}° and {highest:g}° for this motion",
    "position_of_another_motion": "must be {allowed:name} for this motion",
    "measured_twice": "must contain each side, motion, kind and position once",
    "nothing_found": "must contain at least one finding",
    "moment_out_of_range": "must be between {year:d} and now",
    "bool_type": "must be true or false",
    "bool_parsing": "must be true or false",
    "uuid_type": "is not an identifier",
    "uuid_parsing": "is not an identifier",
    "date_type": "must be a date, such as 1968-04-12",
    "date_parsing": "must be a date, such as 1968-04-12",
    "date_from_datetime_parsing": "must be a date, such as 1968-04-12",
    "date_from_datetime_inexact": "must be a date without a time",
    "datetime_type": "must be a time, such as 2026-11-21T09:30:00Z",
    "datetime_parsing": "must be a time, such as 2026-11-21T09:30:00Z",
    "datetime_from_date_parsing": "must be a time, such as 2026-11-21T09:30:00Z",
    "datetime_object_invalid": "is not a valid time",
    "timezone_aware": "must have a time zone",
    "literal_error": "must be {expected:name}",
    "enum": "must be {expected:name}",
    "list_type": "must be a list",
    "set_type": "must be a list",
    "dict_type": "must be an object",
    "too_short": "must have {min_length:d} entries or more",
    "too_long": "must have {max_length:d} entries or fewer",
    "model_type": "must be an object",
    "model_attributes_type": "must be an object",
    "union_tag_not_found": "must name its kind in {discriminator:name}",
    "union_tag_invalid": "must be one of {expected_tags:name}",
    "json_invalid": "is not JSON",
    "json_type": "is not JSON",
    "bytes_type": "must be a file",
    "bytes_too_long": "must have {max_length:d} bytes or fewer",
    "value_error": "{error:name}",
    # Kata's own types of error.
    "day_out_of_range": "must be between 1900 and today",
    "limit_without_angle": "must have a lowest or a highest angle",
    "limits_crossed": "must have a lowest angle below the highest one",
    "motion_twice": "must name each motion once",
}
SENTENCES: Final[dict[str, Template]] = {
    kind: message(f"invalid_{kind}", english) for kind, english in _SENTENCES.items()
}
"""Message template by type of error, which is pydantic's or Kata's own. The parameters are bounds."""

_NAMES: Final = (
    "access_token_id",
    "account_id",
    "account_ids",
    "action",
    "address",
    "affected_side",
    "after",
    "angle",
    "answers",
    "apparatus",
    "archived",
    "assessed_at",
    "assessed_by",
    "assessment_id",
    "at",
    "back",
    "band",
    "based_on",
    "begin",
    "birth_date",
    "by",
    "change",
    "chart",
    "check",
    "checked_by",
    "clinic_number",
    "clock",
    "closing_note",
    "code",
    "columns",
    "commissioning_id",
    "config",
    "contraindication_id",
    "contraindications",
    "d",
    "decided_by",
    "diagnosis",
    "diagnosis_code",
    "disabled",
    "do",
    "doctor",
    "dominant_side",
    "down",
    "effort",
    "end",
    "end_range",
    "episode_id",
    "erasure_id",
    "explanation",
    "finished",
    "fixtures",
    "further",
    "gains",
    "glass_id",
    "highest",
    "hold",
    "i",
    "identifiers",
    "iss",
    "items",
    "kana",
    "kind",
    "language",
    "largest",
    "less",
    "limit",
    "limits",
    "limits_by",
    "looked_at",
    "lowest",
    "made_by",
    "max_resistance_level",
    "max_speed",
    "method",
    "minutes",
    "motion",
    "motion_id",
    "motor",
    "motors",
    "name",
    "note",
    "noted_by",
    "notes",
    "notification_ids",
    "number",
    "offset",
    "old_password",
    "onset_on",
    "openid",
    "outcome",
    "p",
    "pain_active",
    "pain_after",
    "pain_average",
    "pain_before",
    "pain_during",
    "pain_passive",
    "pain_rest",
    "password",
    "patient",
    "patient_id",
    "pause",
    "percent",
    "phone",
    "points",
    "position",
    "pressed",
    "programme_id",
    "programme_position",
    "programme_version_id",
    "questionnaire",
    "range",
    "read_by",
    "reading_id",
    "reason",
    "recording_id",
    "repetitions",
    "resistance_level",
    "resolved_by",
    "restricted",
    "role",
    "rom",
    "run_id",
    "search",
    "second_factor",
    "secret",
    "seen_at",
    "self_paced",
    "self_paced_permitted",
    "session_id",
    "sessions_per_week",
    "sex",
    "side",
    "sign_in_id",
    "signed_by",
    "since",
    "spadi",
    "speed",
    "stage",
    "stage_id",
    "start",
    "state",
    "station",
    "stations",
    "step",
    "stop",
    "stops",
    "take_over",
    "taught_by",
    "text",
    "therapist",
    "time_zone",
    "timer",
    "to",
    "torque",
    "unsigned",
    "until",
    "updated_at",
    "username",
    "valid_days",
    "verification",
    "version",
    "written_by",
)
_PLAIN_NAMES: Final = {
    "after": "position in the list",
    "apparatus": "apparatus angle",
    "at": "time",
    "back": "return angle",
    "band": "largest distance before the end",
    "based_on": "original version",
    "begin": "first step",
    "by": "interval",
    "config": "file",
    "d": "derivative gain",
    "decided_by": "decision by",
    "do": "type of edit",
    "down": "pedal",
    "end_range": "prescribed end-range time",
    "further": "angle beyond the range",
    "glass_id": "emergency access id",
    "i": "integral gain",
    "iss": "issuer",
    "kana": "kana reading",
    "largest": "largest angle",
    "less": "reduction",
    "limit": "number of entries",
    "limits": "doctor's limits",
    "limits_by": "doctor who set the limits",
    "looked_at": "confirmed checks",
    "made_by": "prescribed by",
    "max_resistance_level": "maximum resistance level",
    "max_speed": "maximum speed",
    "noted_by": "recorded by",
    "offset": "skipped entries",
    "minutes": "time per session in minutes",
    "old_password": "current password",
    "onset_on": "day of onset",
    "openid": "OpenID identity",
    "p": "proportional gain",
    "pain_active": "pain on active movement",
    "pain_after": "pain after the session",
    "pain_average": "average pain",
    "pain_before": "pain before the session",
    "pain_during": "worst pain during the session",
    "pain_passive": "pain on passive movement",
    "pain_rest": "pain at rest",
    "patient": "goniometer reading",
    "pressed": "emergency stop",
    "reading_id": "reading number",
    "rom": "range of motion",
    "run_id": "playback id",
    "secret": "code of the link",
    "seen_at": "time of the displayed state",
    "self_paced": "pace set by the patient",
    "self_paced_permitted": "permission that the patient sets the pace",
    "side": "shoulder",
    "sign_in_id": "login session id",
    "since": "start date",
    "spadi": "SPADI",
    "stop": "cause of stop",
    "stops": "number of stops",
    "to": "destination",
    "unsigned": "only unsigned notes",
    "until": "end date",
    "updated_at": "time of the last change",
    "verification": "certainty of the diagnosis",
}
"""English name of a field whose identifier does not say what a form asks for."""

NAMES: Final[dict[str, Template]] = {
    name: message(f"field_{name}", _PLAIN_NAMES.get(name, name.replace("_", " "))) for name in _NAMES
}
"""Name of a field by its identifier without the unit."""

_UNITS: Final = {
    "_deg_s": "°/s",
    "_deg": "°",
    "_percent": "percent",
    "_minutes": "minutes",
    "_ms": "milliseconds",
    "_s": "seconds",
    "_hz": "Hz",
    "_nm": "newton metres",
}
UNITS: Final[dict[str, Template]] = {ending: message(f"unit{ending}", english) for ending, english in _UNITS.items()}
"""Unit by the suffix of a field's name."""


def sentence(kind: str, english: str, bounds: Mapping[str, Any]) -> Text:
    """Return the message of a validation error.

    :param kind: type of the error.
    :param english: pydantic's message, used for a type that is not in :data:`SENTENCES`.
    :param bounds: parameters of the error.
    """
    if kind == "string_too_short" and bounds.get("min_length") == 1:
        kind = "string_empty"
    if kind not in SENTENCES:
        kind, bounds = "value_error", {"error": english}
    parameters = {name: _lower(str(value)) if name == "error" else value for name, value in bounds.items()}
    template = SENTENCES[kind]
    return template(**{name: parameters[name] for name in template.params})


def name(path: Sequence[str | int]) -> Text:
    """Return the name of the field at a path in a request, for example ``limits 1, highest (degrees)``."""
    if not path:
        return texts.WHOLE_REQUEST()
    field: Text | None = None
    for part in path:
        if isinstance(part, int):
            number = part + 1
            field = texts.FIELD_NUMBERED(field=field, number=number) if field else with_key(str(number), None)
        else:
            field = texts.FIELD_WITHIN(outer=field, inner=_with_unit(part)) if field else _with_unit(part)
    assert field is not None
    return field


def _with_unit(field: str) -> Text:
    for suffix, unit in UNITS.items():
        if field.endswith(suffix):
            return texts.FIELD_WITH_UNIT(field=_name(field.removesuffix(suffix)), unit=unit())
    return _name(field)


def _name(field: str) -> Text:
    return NAMES[field]() if field in NAMES else with_key(field.replace("_", " "), None)


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]
