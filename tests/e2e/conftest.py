"""A whole clinic as `make run` starts it, and a real browser."""

import os
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import pytest
from playwright.sync_api import Browser, BrowserContext, Error, Page, ViewportSize

from kata.auth.login_session import COOKIE
from tests.support.browser_clinic import Clinic, SharedClinics, clinic_in
from tests.support.page_actions import first_page, wait_until_idle
from tests.support.paths import ROOT


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the tests that share a clinic one after another, after all other tests. Keep the tests of a file together.

    Pytest separates a file's tests with a browser from those without, and a fixture of the file would be set up twice. Files with many
    tests come first: a worker that begins one at the end leaves the other idle.
    """
    kinds = ["", *SharedClinics.KINDS]
    tests = Counter(item.path for item in items)
    items.sort(key=lambda item: (kinds.index(_shared_kind(item)), -tests[item.path], item.path))


def _shared_kind(item: pytest.Item) -> str:
    """Return the kind of clinic that the test shares, or ""."""
    mark = item.get_closest_marker("shared_clinic")
    return str(mark.args[0]) if mark else ""


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Generator[None, Any, Any]:
    """Store a picture of each open page when a journey fails. Playwright's option would take pictures in every journey."""
    report = yield
    if call.when == "call" and report.failed:
        browsers = [value for value in getattr(item, "funcargs", {}).values() if isinstance(value, Browser)]
        pages = [page for browser in browsers for context in browser.contexts for page in context.pages]
        name = re.sub(r"[^\w-]+", "-", item.name)
        for number, page in enumerate(pages):
            with suppress(Error):
                page.screenshot(path=ROOT / f"artefacts/journeys/{name}-{number}.png", timeout=5000)
    return report


@pytest.fixture(scope="session")
def shared_clinics(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SharedClinics]:
    clinics = SharedClinics(tmp_path_factory)
    yield clinics
    clinics.close()


@pytest.fixture
def clinic(request: pytest.FixtureRequest, shared_clinics: SharedClinics) -> Iterator[Clinic]:
    """Return an empty clinic for one test, or the clinic that the test's mark ``shared_clinic`` names.

    Tests that share a clinic use patients and accounts of their own. If one leaves the apparatus stopped, the next gets a new clinic.
    """
    if kind := _shared_kind(request.node):
        yield shared_clinics.lend(kind)
        shared_clinics.take_back()
        return
    with clinic_in(request.getfixturevalue("tmp_path")) as clinic:
        yield clinic


@pytest.fixture
def demonstration(tmp_path: Path) -> Iterator[Clinic]:
    """Return a clinic with a dozen invented patients and months of history."""
    command = [sys.executable, "-m", "kata", "seed", "--data", str(tmp_path), "--patients", "12"]
    subprocess.run(command, check=True, capture_output=True)
    with clinic_in(tmp_path, full_rate=True) as clinic:
        yield clinic


@pytest.fixture(scope="session")
def browser_context_args(browser_context_args: dict[str, Any]) -> dict[str, Any]:
    # Without animations, which Playwright would wait for before each click.
    return {
        **browser_context_args,
        "viewport": _SIZE,
        "locale": "en-GB",
        "reduced_motion": "reduce",
    }


@pytest.fixture(scope="session")
def browser_without_3d(
    launch_browser: Callable[..., Browser], browser_type_launch_args: dict[str, Any]
) -> Iterator[Browser]:
    """Return a browser without WebGL. ``--disable-3d-apis`` does not reach workers, which draw the apparatus."""
    launched = launch_browser(args=[*browser_type_launch_args["args"], "--disable-software-rasterizer"])
    yield launched
    launched.close()


@pytest.fixture(scope="module")
def module_browser(request: pytest.FixtureRequest) -> Browser:
    """Return the browser of a module's journeys: with WebGL if the module has the mark ``three_dimensions``.

    Without WebGL the station page shows a text instead of the picture, whose drawing in software takes half a processor.
    """
    has_3d = request.node.get_closest_marker("three_dimensions")
    browser: Browser = request.getfixturevalue("browser" if has_3d else "browser_without_3d")
    return browser


_SIZE: Final = ViewportSize(width=1280, height=900)


def _empty(context: BrowserContext) -> None:
    """Delete everything that a journey has left in its browser, and open a picture in the first page instead.

    The page keeps its process, and so the scripts that it has loaded and compiled.
    """
    context.clear_cookies()
    context.clear_permissions()
    for page in context.pages[1:]:
        page.close()
    for page in context.pages:
        page.unroute_all()
        page.set_viewport_size(_SIZE)
        page.emulate_media(media="null", color_scheme="null", reduced_motion="reduce")
        # A journey may have ended its service.
        with suppress(Error):
            page.goto("/".join([*page.url.split("/")[:3], "kata.svg"]))
            page.evaluate("localStorage.clear(); sessionStorage.clear()")


@pytest.fixture(scope="module")
def contexts(module_browser: Browser, browser_context_args: dict[str, Any]) -> Iterator[list[BrowserContext]]:
    """Return two browsers for the journeys of a module. Journeys that share a browser load and compile the page's scripts once."""
    both = [module_browser.new_context(**browser_context_args) for _ in range(2)]
    yield both
    for context in both:
        context.close()


@pytest.fixture
def context(contexts: list[BrowserContext]) -> Iterator[BrowserContext]:
    """Return an empty browser."""
    yield contexts[0]
    _empty(contexts[0])


@pytest.fixture
def another(contexts: list[BrowserContext]) -> Iterator[BrowserContext]:
    """Return a second empty browser."""
    yield contexts[1]
    _empty(contexts[1])


@pytest.fixture
def tab(context: BrowserContext, clinic: Clinic) -> Page:
    """Return an empty page of a browser that is signed in as an administrator."""
    context.add_cookies([{"name": COOKIE, "value": clinic.cookie, "url": clinic.url}])
    return first_page(context)


@pytest.fixture
def page(tab: Page, clinic: Clinic) -> Page:
    """Return the page with the list of patients, signed in as an administrator, with an idle apparatus."""
    tab.goto(f"{clinic.url}/patients")
    wait_until_idle(tab)
    return tab


@pytest.fixture
def artefacts() -> Path:
    """Return the folder for measured figures."""
    folder = ROOT / "artefacts"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture
def taught_name() -> str:
    """Return the name of the motion to choose in the simulator's panel: a recorded one if there are any."""
    folder = os.environ.get("KATA_TAUGHT")
    recorded = sorted(Path(folder).glob("*.csv"), key=lambda file: file.stat().st_size) if folder else []
    return recorded[0].stem if recorded else "1 Abduction / adduction of the scapula"
