"""The list of stations, in a real browser: each station's state and patient. A silent station is shown as unknown."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from threading import Event, Thread
from typing import Any, Final
from uuid import UUID, uuid4

import psycopg
import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from kata.auth.login_session import COOKIE
from kata.database.engine import Database
from kata.station.fleet import PlaybackProgress, StationReport, as_json
from kata.station.schemas import PatientRef
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.login import signed_in

NAME: Final = "Yamada Hanako"
SILENT: Final = "The station does not answer; its state is unknown."


@pytest.fixture
def clinic(tmp_path: Path, services_url: str) -> Iterator[Clinic]:
    """Return a clinic on a database that stations share."""
    started = Clinic(tmp_path, database_url=services_url)
    yield started
    started.close()


class Elsewhere:
    """Sends the reports of another station, which plays for a patient, every second."""

    def __init__(self, database_url: str, patient_id: str) -> None:
        self._told = StationReport(
            station="Station 2", service=uuid4(), simulated=False, device="running", mode="playing", torque="on",
            estop="closed", causes=[], arm_held=False, operator="Sato Jun", patient=PatientRef(id=UUID(patient_id), name=NAME),
            recording_name="Her flexion", take_s=None,
            progress=PlaybackProgress(position_s=10, duration_s=40, left_s=30, reversing=False),
        )  # fmt: skip
        self._url = database_url.replace("postgresql+psycopg", "postgresql")
        self._quiet = Event()
        self._thread = Thread(target=self._speak)
        self._thread.start()

    def close(self) -> None:
        """Send no more reports."""
        self._quiet.set()
        self._thread.join()

    def _speak(self) -> None:
        with psycopg.connect(self._url, autocommit=True) as connection:
            while True:
                connection.execute("SELECT pg_notify('kata_stations', %s)", (as_json(self._told),))
                if self._quiet.wait(1.0):
                    return


def tile(page: Page, station: str) -> Locator:
    return page.get_by_role("article", name=station)


# `make test` has the messages in tests/api/test_stations.py and the tiles in stations.test.tsx.
@pytest.mark.campaign
def test_station_list_shows_patients_and_marks_silent_stations(
    page: Page,
    clinic: Clinic,
    services_url: str,
    browser: Browser,
    browser_context_args: dict[str, Any],
) -> None:
    patient = page.request.post(
        f"{clinic.url}/api/patients", data={"clinic_number": "S-1", "name": NAME, "affected_side": "left"}
    ).json()
    with closing(Database(services_url)) as database:
        cookie = signed_in(database, "technician")
    context = browser.new_context(**browser_context_args)
    context.add_cookies([{"name": COOKIE, "value": cookie, "url": clinic.url}])
    technicians = context.new_page()

    with closing(Elsewhere(services_url, patient["id"])):
        for watcher in (page, technicians):
            watcher.goto(f"{clinic.url}/stations")
            other = tile(watcher, "Station 2")
            for words in ("Playing, torque on", "E-stop ready", "30 s left", "Operated by Sato Jun"):
                expect(other.get_by_text(words, exact=True)).to_be_visible(timeout=LONG_MS)
            expect(tile(watcher, "Station 1").get_by_text("Idle, torque off")).to_be_visible()
        for words in (NAME, "Her flexion"):
            expect(tile(page, "Station 2").get_by_text(words)).to_be_visible()
            expect(technicians.get_by_text(words)).to_have_count(0)
        # A technician sees no name, and no statement that the station is free.
        expect(
            tile(technicians, "Station 2").get_by_text("A patient whose record you may not see is on the apparatus.")
        ).to_be_visible()

        for pressed, words in ((True, "E-stop pressed"), (False, "E-stop released")):
            page.request.post(f"{clinic.url}/api/simulator/estop", data={"pressed": pressed})
            for watcher in (page, technicians):
                expect(tile(watcher, "Station 1").get_by_text(words)).to_be_visible()

    for watcher in (page, technicians):
        other = tile(watcher, "Station 2")
        expect(other.get_by_text(SILENT)).to_be_visible(timeout=LONG_MS)
        expect(other.get_by_text("Last answer")).to_be_visible()
        for words in (NAME, "Playing", "E-stop", "left", "Sato Jun"):
            expect(other.get_by_text(words)).to_have_count(0)
        expect(tile(watcher, "Station 1").get_by_text(SILENT)).to_have_count(0)

    with closing(Elsewhere(services_url, patient["id"])):
        expect(tile(page, "Station 2").get_by_text("Playing, torque on")).to_be_visible(timeout=LONG_MS)
    context.close()
