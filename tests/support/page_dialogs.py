"""The dialogs of the pages: the button of each in both languages, and the dialogs that other tests open."""

import json
import re
from collections.abc import Iterator
from functools import cache
from typing import Any, Final

from playwright.sync_api import Locator, Page, expect

from tests.support.browser_clinic import LONG_MS
from tests.support.paths import ROOT

_LOCALES: Final = ROOT / "frontend/src/locales"

DIALOGS: Final = {
    "home": ("search:dialog.title", "notifications:list.open"),
    "patients": ("patients:patients.add", "import-export:fhir.open"),
    "patient": ("patients:patient.edit",),
    "patient-data": ("auth:record.restrict", "import-export:erasure.add", "import-export:data.motion"),
    "patient-episodes": ("episodes:care.change", "episodes:care.close", "episodes:care.open.left"),
    "patient-assessments": ("patient-mode:start.open",),
    "programme": ("programmes:programme.rename",),
    "accounts": ("administration:accounts.add", "administration:accounts.changeOf"),
    "station": ("station:side.setUp",),
}  # fmt: skip
"""By page, the text of each button that opens a dialog. A text with several forms, such as one for each side, has a button of one form."""

OPENED_BY: Final = {
    "features/administration/AccountsPage.tsx": DIALOGS["accounts"],
    "features/auth/RecordAccess.tsx": ("auth:record.restrict",),
    "features/episodes/Episodes.tsx": DIALOGS["patient-episodes"],
    "features/import-export/DataSection.tsx": ("import-export:data.motion",),
    "features/import-export/ErasureRequests.tsx": ("import-export:erasure.add",),
    "features/import-export/ImportPatients.tsx": ("import-export:fhir.open",),
    "features/notifications/NotificationList.tsx": ("notifications:list.open",),
    "features/patient-mode/StartPatientMode.tsx": DIALOGS["patient-assessments"],
    "features/patients/PatientPage.tsx": ("patients:patient.edit",),
    "features/patients/PatientsPage.tsx": ("patients:patients.add",),
    "features/programmes/ProgrammePage.tsx": DIALOGS["programme"],
    "features/search/SearchDialog.tsx": ("search:dialog.title",),
    "features/station/ApparatusSideCard.tsx": DIALOGS["station"],
}
"""Files with dialogs, and the buttons that open them in the walk. `frontend/src/app/shownNumbers.test.tsx` fills in some of them."""
OPENED_ELSEWHERE: Final = {
    "features/auth/AccountMenu.tsx": "no number: signing out while torque is on",
    "features/commissioning/RecordsTab.tsx": "frontend/src/app/shownNumbers.test.tsx",
    "features/programmes/ProgrammeEditor.tsx": "frontend/src/app/shownNumbers.test.tsx",
    "features/search/ShortcutSheet.tsx": "no number: names of keys",
    "features/station/LeaseBar.tsx": "no number: taking over the control, tests/e2e/test_lease.py",
}
"""Files whose dialogs the walk does not open, and the test that does, or why none has to."""


def files_with_dialogs() -> set[str]:
    """Return the files of the page that show a dialog."""
    sources = ROOT / "frontend/src"
    return {
        file.relative_to(sources).as_posix()
        for file in sources.rglob("*.tsx")
        if "<Modal" in file.read_text(encoding="utf-8") and not file.name.endswith(".test.tsx")
    }


def opened_dialogs(page: Page, name: str, language: str) -> Iterator[tuple[str, Locator]]:
    """Open each dialog of a page in turn. Yield its button's text and the dialog, and close it afterwards."""
    for key in DIALOGS.get(name, ()):
        page.get_by_role("button", name=_label(key, language)).first.click()
        dialog = page.get_by_role("dialog")
        expect(dialog).to_be_visible(timeout=LONG_MS)
        yield key, dialog
        # Not by the Escape key, which first closes an open list of a field.
        dialog.locator(".mantine-Modal-close").click()
        expect(dialog).to_have_count(0, timeout=LONG_MS)


def _label(key: str, language: str) -> re.Pattern[str]:
    """Return the pattern of a text of the page, in any of its forms and with any parameters."""
    file, _, path = key.partition(":")
    part: Any = _catalogue(file, language)
    *parents, last = path.split(".")
    for parent in parents:
        part = part[parent]
    forms = part[last].values() if isinstance(part.get(last), dict) else [
        text for form, text in part.items() if form == last or form.startswith(f"{last}_")
    ]  # fmt: skip
    written = [
        "".join(".+" if piece.startswith("{{") else re.escape(piece) for piece in _pieces(text)) for text in forms
    ]
    assert written, key
    return re.compile(f"^(?:{'|'.join(written)})$")


def _pieces(text: str) -> list[str]:
    return [piece for piece in re.split(r"(\{\{[^}]*\}\})", text) if piece]


@cache
def _catalogue(file: str, language: str) -> Any:
    return json.loads((_LOCALES / language / f"{file}.json").read_text(encoding="utf-8"))
