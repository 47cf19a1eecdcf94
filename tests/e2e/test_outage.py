"""A session of today's patient begins, is played and ends during a database outage, and is stored afterwards."""

import re
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from uuid import UUID, uuid4

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from benchmarks import postgresql
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeRow, ProgrammeVersionRow
from kata.clinic.recordings.tables import RECORDING_COLUMNS, RECORDING_SAMPLES, RecordingRow, TeachingRow
from kata.database.engine import Database
from kata.database.series import pack
from kata.motion.linkage import motor_angles_deg
from tests.support.browser_clinic import LONG_MS, Clinic
from tests.support.page_actions import confirm_identity, load_and_play, try_estop, wait_until_idle
from tests.support.recordings import LASTS_S, lifted

FETCHED_MS = 20_000
"""Limit of the first prefetch. The service prefetches every ten seconds."""


@pytest.fixture
def server() -> Iterator[postgresql.Server]:
    try:
        with postgresql.serving() as url:
            yield postgresql.Server(url)
    except postgresql.MissingError as error:
        pytest.skip(str(error))


@pytest.fixture
def clinic(tmp_path: Path, server: postgresql.Server) -> Iterator[Clinic]:
    started = Clinic(tmp_path, database_url=server.url)
    yield started
    started.close()


def of_today(page: Page, clinic: Clinic, server: postgresql.Server, name: str) -> str:
    """Create a patient with a programme of one recording. Return the patient's id."""
    given = {"clinic_number": "K-1", "name": name, "affected_side": "right"}
    patient_id: str = page.request.post(f"{clinic.url}/api/patients", data=given).json()["id"]
    database = Database(server.url)
    now = datetime.now(UTC)
    times_s = np.arange(0, LASTS_S + 0.005, 0.01)
    try:
        with database.write() as session:
            patient = session.get_one(PatientRow, UUID(patient_id))
            patient.episodes[0].contraindications = "No traction."
            common = {"patient_id": patient.id, "name": "Lift", "side": "right", "fixtures": ["arm_fixer_1"]}
            teaching = TeachingRow(id=uuid4(), started_at=now, **common)
            session.add(teaching)
            session.flush()
            recording = RecordingRow(
                id=uuid4(), teaching_id=teaching.id, take=1, station="Station 1", taught_at=now, duration_s=LASTS_S,
                rate_hz=100, samples=len(times_s), note="", archived_at=None, **common,
            )  # fmt: skip
            session.add(recording)
            session.flush()
            angles_deg = motor_angles_deg(lifted()(times_s), "right")
            RECORDING_SAMPLES.store(
                session, recording.id, pack({"time_s": times_s, "angle_deg": angles_deg}, RECORDING_COLUMNS), None
            )
            programme = ProgrammeRow(
                id=uuid4(), episode_id=patient.episodes[0].id, name="Morning", created_at=now, updated_at=now
            )
            version = ProgrammeVersionRow(id=uuid4(), number=1, made_at=now, made_by="T", note="")
            programme.versions = [version]
            session.add(programme)
            session.flush()
            session.add(
                ProgrammeItemRow(
                    version_id=version.id, position=1, recording_id=recording.id, speed_percent=150.0, repetitions=1,
                    pause_s=0.0, range_percent=100.0, resistance_level=25, method="smooth",
                )
            )  # fmt: skip
    finally:
        database.close()
    return patient_id


@pytest.mark.campaign
def test_session_is_completed_in_the_browser_during_a_database_outage(
    page: Page, clinic: Clinic, server: postgresql.Server
) -> None:
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    patient_id = of_today(page, clinic, server, "Yamada Hanako")
    # Opening the record makes the patient one of today.
    page.goto(f"{clinic.url}/patients/{patient_id}")
    expect(page.get_by_role("heading", name="Yamada Hanako")).to_be_visible(timeout=LONG_MS)
    page.get_by_role("link", name="Go to the station").click()
    expect(page.get_by_role("button", name="Begin the session")).to_be_visible(timeout=LONG_MS)

    def is_ready() -> bool:
        return "kata_ready_patients 1.0" in page.request.get(f"{clinic.url}/metrics").text()

    for _ in range(FETCHED_MS // 500):
        if is_ready():
            break
        page.wait_for_timeout(500)
    assert is_ready()
    page.goto(f"{clinic.url}/station")
    with server.killed():
        expect(page.get_by_text("You can start or continue sessions")).to_be_visible(timeout=LONG_MS)
        page.get_by_role("combobox", name="Patient").click()
        offered = page.get_by_role("option")
        expect(offered).to_have_text(["Yamada Hanako (K-1)"], timeout=LONG_MS)
        offered.click()
        expect(page.get_by_text("Contraindications: No traction.")).to_be_visible(timeout=LONG_MS)
        visit = page.get_by_role("region", name="Session")
        expect(visit.get_by_text("1. Lift")).to_be_visible(timeout=LONG_MS)
        visit.get_by_role("button", name="Begin the session").click()

        expect(visit.get_by_role("heading", name="Checklist")).to_be_visible(timeout=LONG_MS)
        try_estop(page)
        expect(visit.get_by_test_id("check-estop")).to_contain_text("Detected by the apparatus", timeout=LONG_MS)
        confirm_identity(visit, page)
        visit.get_by_role("button", name="Confirm all 3 checks").click()
        visit.get_by_role("button", name="Pain before: 4").click()
        expect(visit.get_by_role("heading", name="Play")).to_be_visible(timeout=LONG_MS)
        load_and_play(page)
        wait_until_idle(page)
        # The page knows that the run has ended and that the plan is complete.
        expect(visit.get_by_role("combobox", name="Recording")).to_have_value("", timeout=LONG_MS)
        visit.get_by_role("button", name="Finish playing: go to pain after").click()
        visit.get_by_role("button", name="Worst pain during the session: 5").click()
        visit.get_by_role("button", name="Pain after: 3").click()
        visit.get_by_role("combobox", name="Reason for ending").click()
        page.get_by_role("option", name="Completed as planned").click()
        visit.get_by_role("button", name="End the session").click()
        expect(visit.get_by_role("button", name="Sign as")).to_be_visible(timeout=LONG_MS)

    # The page continues with the database's state on its own.
    expect(page.get_by_text("You can start or continue sessions")).to_be_hidden(timeout=LONG_MS)
    note = visit.get_by_role("textbox", name="Note of this session")
    expect(note).to_have_value(re.compile("Lift"), timeout=LONG_MS)
    visit.get_by_role("button", name="Sign as").click()
    visit.get_by_role("link", name="View it").click(timeout=LONG_MS)
    expect(page.get_by_test_id("signed")).to_contain_text("Signed by Test administrator", timeout=LONG_MS)
    expect(page.get_by_test_id("pain")).to_have_text("Pain (0 to 10): 4 before, 5 during, 3 after")
    there = page.request.get(f"{clinic.url}/api/patients/{patient_id}/sessions").json()["items"]
    assert len(there) == 1
    session = page.request.get(f"{clinic.url}/api/sessions/{there[0]['id']}").json()
    assert [session[name] for name in ("pain_before", "pain_during", "pain_after")] == [4, 5, 3]
    assert [run["outcome"] for run in session["runs"]] == ["completed"]
    assert wrong == []
