"""Every page of a seeded clinic in one language, scheme and size, complete enough for a screenshot."""

import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Literal

from playwright.sync_api import Browser, ConsoleMessage, Error, expect

from kata.auth.login_session import COOKIE
from kata.cli.seed_people import Language
from tests.support.accessibility import INCOMPLETE, SIGN_IN_PAGES, addresses
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.shown_station import ShownStation

SIZES: Final = {
    "telephone": (360, 740), "landscape": (740, 360), "tablet": (800, 1280), "desktop": (1280, 800), "wall": (2560, 1440),
}  # fmt: skip
LOCALES: Final[dict[Language, str]] = {"en": "en-GB", "ja": "ja-JP"}
SCHEMES: Final[tuple[Literal["light", "dark"], ...]] = ("light", "dark")
_DIALOGS: Final = {"search": "Control+K", "shortcuts": "Control+/"}
"""Their shortcuts, pressed on the home page."""
_MENUS: Final = {"notifications": "bell", "account-menu": "user"}
"""Icons of the header's buttons, pressed on the home page."""
_LAST_STEPS: Final = {"pain-after": 4, "note": 5}
"""Places of the steps that end a session."""
_COMPONENTS: Final = ("components-language", "components", "components-states")
"""Tabs of the page of components, in order."""
_TREATED: Final = "DEMO-002"
"""Clinic number of the patient on the apparatus. Other pages show another patient, whose newest session remains the same."""
_QUIET_MS: Final = 10_000
"""A page that still loads after this time is shown as it is."""
_INCOMPLETE: Final = f"{INCOMPLETE}, [data-testid=apparatus-canvas] canvas:not([data-drawn])"


@dataclass(frozen=True)
class View:
    """One appearance of the pages."""

    language: Language
    scheme: Literal["light", "dark"]
    size: str


def _report(message: ConsoleMessage) -> None:
    if message.type in ("error", "warning"):
        sys.stderr.write(f"{message.location.get('url')} {message.text}\n")


class ShownPages:
    """One browser page that shows them one after the other."""

    def __init__(self, browser: Browser, clinic: Clinic, station: ShownStation, view: View) -> None:
        self.view = view
        self._clinic = clinic
        self._station = station
        self._treated: tuple[dict[str, Any], dict[str, Any]] | None = None
        """The open session and the recording that it plays."""
        self._teaches = False
        width, height = SIZES[view.size]
        context = browser.new_context(
            viewport={"width": width, "height": height},
            locale=LOCALES[view.language],
            color_scheme=view.scheme,
            reduced_motion="reduce",
        )
        # A clinic has hidden the guide of the simulated apparatus.
        context.add_init_script("localStorage.setItem('kata.first-steps-hidden', 'true')")
        self.page = context.new_page()
        self.page.set_default_timeout(LONG_MS)
        self.page.on("console", _report)
        self.page.on("pageerror", self._report_error)
        self._sign_in(clinic.cookie)
        station.make_idle()

    def drawn(self, homes: dict[str, str], tablet: str, components: str) -> dict[str, Callable[[], object]]:
        """Return how to draw each page, by name, in an order that must be kept.

        ``homes`` and ``tablet``: cookies of the users of home pages and of a questionnaire. ``components``: address of the
        development server.
        """
        pages = addresses(self.page, self._clinic)
        reports = self._reports(pages)
        return {
            **{name: partial(self._show, self._clinic.url + address) for name, address in pages.items()},
            **{name: partial(self._press, keys) for name, keys in _DIALOGS.items()},
            **{name: partial(self._open, icon) for name, icon in self._menus().items()},
            **{name: partial(self._show, address) for name, address in reports.items()},
            **{name: partial(self._component, components, tab) for tab, name in enumerate(_COMPONENTS)},
            "checklist": self._checklist,
            "playing": self._playing,
            "stopped": self._stopped,
            **{name: partial(self._step, place) for name, place in _LAST_STEPS.items()},
            "self-paced": partial(self._other_way, self._station.play_self_paced, "self-paced"),
            "stretch": partial(self._other_way, self._station.stretch, "stretch"),
            "teaching": self._teaching,
            **{name: partial(self._home, cookie) for name, cookie in homes.items()},
            "questionnaire": partial(self._questionnaire, tablet, pages),
            "sign-in": partial(self._home, ""),
            **{name: partial(self._show, self._clinic.url + address) for name, address in SIGN_IN_PAGES.items()},
        }

    def _show(self, address: str) -> None:
        if self._treated is None and not self._teaches:
            self._station.make_idle()
        self.page.goto(address)
        expect(self.page.get_by_role("heading", level=1)).to_be_visible(timeout=LONG_MS)
        if re.search(r"/station(\?|$)", address):
            expect(self.page.get_by_test_id("apparatus-canvas")).to_be_visible(timeout=LONG_MS)
        self._complete()

    def _complete(self) -> None:
        """Wait until texts, figures and the apparatus are drawn."""
        expect(self.page.locator(_INCOMPLETE)).to_have_count(0, timeout=LONG_MS)
        try:
            self.page.wait_for_load_state("networkidle", timeout=_QUIET_MS)
        except Error:
            sys.stderr.write(f"{self.page.url} still loads\n")
        expect(self.page.locator(_INCOMPLETE)).to_have_count(0, timeout=LONG_MS)

    def _press(self, keys: str) -> None:
        """Open the dialog of a shortcut."""
        self._show(self._clinic.url)
        self.page.keyboard.press(keys)
        expect(self.page.get_by_role("dialog")).to_be_visible(timeout=LONG_MS)

    def _menus(self) -> dict[str, str]:
        """Return the icons of the header's menus. Only telephones have a menu of pages."""
        return _MENUS | ({"page-menu": "menu-2"} if self.view.size in ("telephone", "landscape") else {})

    def _open(self, icon: str) -> None:
        """Open a menu of the header on the home page."""
        self._show(self._clinic.url)
        self.page.locator(f"header button:has(.tabler-icon-{icon})").click()
        expect(self.page.get_by_role("dialog").or_(self.page.get_by_role("menu"))).to_be_visible(timeout=LONG_MS)

    def _component(self, address: str, tab: int) -> None:
        """Show a tab of the page of components, which only the development server has. The last tab has a skeleton to be seen."""
        self._show(f"{address}/design")
        self.page.get_by_role("tab").nth(tab).click()
        expect(self.page.get_by_role("tab").nth(tab)).to_have_attribute("aria-selected", "true")

    def _checklist(self) -> None:
        """Show the station before a session, where identity and apparatus are checked."""
        self._treated = self._station.begin_session(_TREATED)
        self._show(f"{self._clinic.url}/station?patient={self._treated[0]['patient']['id']}")
        # On a busy computer the device can stop meanwhile. The check before teaching is hidden.
        self._station.make_idle()
        identity = self.page.get_by_test_id("check-identity").filter(visible=True)
        expect(identity).to_be_visible(timeout=LONG_MS)

    def _playing(self) -> None:
        if self._treated is None:
            self._checklist()
        assert self._treated
        self._station.play(*self._treated)
        expect(self.page.get_by_test_id("mode")).to_have_text(re.compile("^(Playing|再生中)"), timeout=LONG_MS)
        self._complete()

    def _home(self, cookie: str) -> None:
        """Show the home page of another user; without a cookie, the page to sign in."""
        self.leave()
        self._sign_in(cookie)
        self._show(self._clinic.url)

    def _stopped(self) -> None:
        if self._treated is None:
            self._playing()
        self._station.press_estop()
        expect(self.page.get_by_test_id("stop-banner")).to_be_visible(timeout=LONG_MS)

    def _step(self, place: int) -> None:
        """Show a step of the session after its playback was stopped."""
        if self._treated is None:
            self._stopped()
        self._station.release_estop()
        self.page.reload()
        self._complete()
        self.page.locator("main nav button").nth(place).click()
        expect(self.page.locator("main nav button").nth(place)).to_have_attribute("aria-current", "step")

    def _other_way(self, play: Callable[[dict[str, Any], dict[str, Any]], None], shown: str) -> None:
        """Show the station while the apparatus moves in another way. ``shown``: test id of its state."""
        if self._treated is None:
            self._playing()
        assert self._treated
        self._station.press_estop()
        self._station.release_estop()
        # Without a graphics card, the apparatus is not drawn for a page that is opened while the motors have torque.
        self._show(f"{self._clinic.url}/station?patient={self._treated[0]['patient']['id']}")
        play(*self._treated)
        expect(self.page.get_by_test_id(shown)).to_be_visible(timeout=LONG_MS)

    def _teaching(self) -> None:
        """Show the station while a motion is taught."""
        self.leave()
        patient = self._station.teach(_TREATED)
        self._teaches = True
        self._show(f"{self._clinic.url}/station?patient={patient['id']}")

    def leave(self) -> None:
        """Make the apparatus idle and end the teaching or the session."""
        if self._teaches:
            self._station.finish_teaching()
            self._teaches = False
        if self._treated:
            self._station.press_estop()
            self._station.release_estop()
            self._station.end_session(self._treated[0])
            self._treated = None

    def _questionnaire(self, cookie: str, pages: dict[str, str]) -> None:
        """Show the questionnaire that a patient answers on this browser."""
        self.leave()
        self._sign_in(cookie)
        episode = pages["progress"].split("/")[2].partition("?")[0]
        handed = self.page.request.post(
            f"{self._clinic.url}/api/episodes/{episode}/patient-mode",
            data={"questionnaire": "spadi", "language": self.view.language},
            headers={"origin": self._clinic.url},
        )
        assert handed.status == 204, handed.text()
        self._show(self._clinic.url)
        expect(self.page.get_by_test_id("patient-mode")).to_be_visible(timeout=LONG_MS)

    def _reports(self, pages: dict[str, str]) -> dict[str, str]:
        """Return the addresses of the printable reports."""
        session, progress = pages["session"], pages["progress"].partition("/progress")[0]
        return {
            name: f"{self._clinic.url}/api{path}/report.html?language={self.view.language}"
            for name, path in (("report-session", session), ("report-episode", progress))
        }

    def _report_error(self, error: Error) -> None:
        sys.stderr.write(f"{self.page.url} {error}\n")

    def _sign_in(self, cookie: str) -> None:
        self.page.context.clear_cookies()
        if cookie:
            self.page.context.add_cookies([{"name": COOKIE, "value": cookie, "url": self._clinic.url}])
