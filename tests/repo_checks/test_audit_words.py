"""The page has words for every code that the service can write to the audit trail."""

import ast
import re
from collections.abc import Iterator
from typing import Final, get_args

from kata.audit.changes import QUIET
from kata.auth.permissions import RULES, audit_action
from kata.backups.book import Kind
from kata.clinic.restricted.objects import OF_A_PATIENT
from kata.database.base import Base
from tests.support.paths import ROOT

KATA: Final = ROOT / "backend/kata"
PAGE: Final = ROOT / "frontend/src/features/administration"
PLACE: Final = {"note": 1, "entry": 0, "by_program": 0, "RequestContext": 0}
"""Position of the action among the arguments of each function that writes an entry."""
ELSEWHERE: Final = {
    "action": {"pause_without_browser", "stop_without_browser", "unnamed"},
    "context.action": set(map(audit_action, RULES)),
    "audit_action(route)": set(map(audit_action, RULES)),
    "audit_action(request.scope['route'].name)": set(map(audit_action, RULES)),
    "f'backup_{note.kind}'": {f"backup_{kind}" for kind in get_args(Kind)},
    "_DOOR": {"at_the_door"},
    "_ACTION": {"backup_restored"},
}
"""Suffixes that are added to an action."""
OTHER_NOTES: Final = {"patient_id", "values", "resource"}
"""Functions of the same name that do not write to the audit trail."""


def worded(file: str, table: str) -> list[str]:
    """Return the codes of one table of words, once for each language."""
    text = (PAGE / file).read_text("utf-8").partition(f"export const {table} = ")[2].partition("\n);")[0]
    return re.findall(r"^    \"?(\w+)\"?:\s", text, re.MULTILINE)


def actions() -> Iterator[str]:
    """Return every action that the service's source can write."""
    yield from map(audit_action, RULES)
    for file in sorted(KATA.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
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
    words = worded("auditActions.ts", "ACTIONS")

    assert {action: words.count(action) for action in actions()} == dict.fromkeys(actions(), 2)


def test_every_record_kind_has_a_text_in_both_languages() -> None:
    kinds = (Base.metadata.tables.keys() - QUIET) | {name.removesuffix("_id") for name in OF_A_PATIENT}
    words = worded("auditKinds.ts", "KINDS")

    assert {kind: words.count(kind) for kind in kinds} == dict.fromkeys(kinds, 2)
