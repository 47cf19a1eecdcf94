"""``python -m tests.e2e.screenshots --out FOLDER``: screenshots of every page of a seeded clinic, to be looked at.

Both schemes, both languages (a Japanese clinic for the Japanese pictures), five sizes. Besides the pages: the home page of each role, the dialogs, the station during the checklist,
playback and a stop, the patient's questionnaire, the components, and reports. Some pages of the desktop are also printed.
A file is called ``page-language-scheme-size.png``. ``--page``, ``--language``, ``--scheme`` and ``--size`` choose some of them; each may be
repeated. Errors and warnings of the browser's console are printed. Build the page first; ``KATA_CHROMIUM`` names the browser.
"""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated, Final

import typer
from playwright.sync_api import Browser, sync_playwright

from kata.actor import Role
from kata.cli.seed_people import INVENTED_TEXTS
from kata.database.engine import Database
from tests.support.browser_clinic import seeded_clinic
from tests.support.development_page import development_page
from tests.support.login import signed_in_at
from tests.support.paths import ROOT
from tests.support.questionnaires import store_words
from tests.support.shown_pages import LOCALES, SCHEMES, SIZES, ShownPages, View
from tests.support.shown_station import ShownStation

ROLES: Final[tuple[Role, ...]] = ("therapist", "technician", "viewer")
"""Besides the administrator, who sees every page."""
PRINTED: Final = ("home", "patient", "patient-assessments", "session", "session-numbers", "outcomes")


def main(
    out: Annotated[Path, typer.Option(help="Folder for the screenshots.")],
    page: Annotated[list[str] | None, typer.Option(help="Only this page, for example patient.")] = None,
    language: Annotated[list[str] | None, typer.Option(help="Only en or ja.")] = None,
    scheme: Annotated[list[str] | None, typer.Option(help="Only light or dark.")] = None,
    size: Annotated[list[str] | None, typer.Option(help=f"Only one of {', '.join(SIZES)}.")] = None,
) -> None:
    """Make screenshots of every page of a seeded clinic."""
    out.mkdir(parents=True, exist_ok=True)
    for words in LOCALES:
        if words in (language or LOCALES):
            _take_all(
                [
                    View(words, colours, name)
                    for colours in SCHEMES
                    if colours in (scheme or SCHEMES)
                    for name in size or SIZES
                ],
                page,
                out,
            )


def _take_all(views: list[View], chosen: list[str] | None, out: Path) -> None:
    """Make the screenshots of one language, whose clinic is seeded in that language."""
    words = views[0].language
    with (
        tempfile.TemporaryDirectory(prefix="kata-") as folder,
        seeded_clinic(Path(folder), partial(_prepare, Path(folder), views), words) as (clinic, (homes, tablets)),
        development_page(clinic) as components,
    ):
        for view, tablet in zip(views, tablets, strict=True):
            # A browser of its own for each appearance: none inherits the memory of the one before.
            with _browser() as browser, ShownStation(clinic) as station:
                shown = ShownPages(browser, clinic, station, view)
                pages = shown.drawn(homes, tablet, components)
                _take(shown, {name: draw for name, draw in pages.items() if chosen is None or name in chosen}, out)
                shown.leave()


def _take(shown: ShownPages, pages: dict[str, Callable[[], object]], out: Path) -> None:
    """Draw each page and save it."""
    view = shown.view
    for name, draw in pages.items():
        draw()
        file = out / f"{name}-{view.language}-{view.scheme}-{view.size}.png"
        shown.page.screenshot(path=file, full_page=True)
        typer.echo(file)
        if name in PRINTED and view.size == "desktop":
            shown.page.pdf(path=file.with_suffix(".pdf"), format="A4", print_background=True)


def _prepare(folder: Path, views: list[View]) -> tuple[dict[str, str], list[str]]:
    """Import a questionnaire's texts. Return the cookie of a user of each role, and of a tablet for each view."""
    with closing(Database(f"sqlite:///{folder / 'kata.db'}")) as database:
        for language in LOCALES:
            store_words(database, "spadi", language)
    # The therapist has patients in the clinic.
    therapist = INVENTED_TEXTS[views[0].language].therapists[-1]
    homes = {
        f"home-{role}": signed_in_at(folder, role, name=therapist if role == "therapist" else "") for role in ROLES
    }
    return homes, [signed_in_at(folder, "therapist") for _ in views]


@contextmanager
def _browser() -> Iterator[Browser]:
    program = os.environ.get("KATA_CHROMIUM") or ROOT / ".cache/chromium/chromium"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program)
        try:
            yield browser
        finally:
            browser.close()


if __name__ == "__main__":
    typer.run(main)
