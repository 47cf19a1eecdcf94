"""The page has words for every code that the service can write to the audit trail."""

import ast
import json
import re
from collections.abc import Iterator
from typing import Final, get_args

from kata.audit.changes import NOT_COLLECTED
from kata.auth.permissions import ROUTE_RULES, audit_action
from kata.backups.catalogue import Kind
from kata.clinic.restricted.objects import PATIENT_QUERY_BY_ID_NAME
from kata.database.base import Base
from tests.support.paths import ROOT

KATA: Final = ROOT / "backend/kata"
LOCALES: Final = ROOT / "frontend/src/locales"
LANGUAGES: Final = ("en", "ja")
PLACE: Final = {"note": 1, "entry": 0, "by_program": 0, "RequestContext": 0}
"""Position of the action among the arguments of each function that writes an entry."""
_CALL: Final = re.compile(rf"\b({'|'.join(PLACE)})\(")
ELSEWHERE: Final = {
    "action": {"pause_without_browser", "stop_without_browser", "unnamed"},
    "context.action": set(map(audit_action, ROUTE_RULES)),
    "audit_action(route)": set(map(audit_action, ROUTE_RULES)),
    "audit_action(request.scope['route'].name)": set(map(audit_action, ROUTE_RULES)),
    "f'backup_{record.kind}'": {f"backup_{kind}" for kind in get_args(Kind)},
    "_UNAUTHENTICATED": {"at_the_door"},
    "_ACTION": {"backup_restored"},
}
"""Suffixes that are added to an action."""
OTHER_NOTES: Final = {"patient_id", "values", "resource"}
"""Functions of the same name that do not write to the audit trail."""


def texts(language: str, table: str) -> dict[str, str]:
    """Return one table of the administration's catalogue: code to text."""
    catalogue = json.loads((LOCALES / language / "administration.json").read_text("utf-8"))
    found: dict[str, str] = catalogue[table]
    return found


def actions() -> Iterator[str]:
    """Return every action that the service's source can write."""
    yield from map(audit_action, ROUTE_RULES)
    sources = (file.read_text("utf-8") for file in sorted(KATA.rglob("*.py")))
    for source in (text for text in sources if _CALL.search(text)):
        for node in ast.walk(ast.parse(source)):
            if not isinstance(node, ast.Call):
                continue
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            place = PLACE.get(name)
            if place is None or len(node.args) <= place:
                continue
            given = node.args[place]
            if isinstance(given, ast.Constant):
                yield str(given.value)
            elif (said := ast.unparse(given)) not in OTHER_NOTES:
                yield from ELSEWHERE[said]


def test_every_action_has_a_text_in_both_languages() -> None:
    written = set(actions())
    for language in LANGUAGES:
        assert texts(language, "actions").keys() == written


def test_every_record_kind_has_a_text_in_both_languages() -> None:
    kinds = (Base.metadata.tables.keys() - NOT_COLLECTED) | {
        name.removesuffix("_id") for name in PATIENT_QUERY_BY_ID_NAME
    }
    for language in LANGUAGES:
        assert kinds - texts(language, "kinds").keys() == set()
