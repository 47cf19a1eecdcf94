"""The clinic's letterhead and time zone: the service's settings until an administrator changes them on the page."""

from datetime import timedelta
from pathlib import Path
from typing import Any, Final

import pytest
from fastapi.testclient import TestClient
from markupsafe import escape

from kata.clinic.sessions import checks
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.database.base import utc_now
from tests.support.audit_rows import audit_log
from tests.support.service import running
from tests.support.treatment import treat

CHANGED: Final = {
    "name": "Sakura Clinic",
    "address": "1-2-3 Honcho\nTokyo",
    "phone": "03-0000-0000",
    "time_zone": "Asia/Tokyo",
}


@pytest.fixture
def client(tmp_path: Path) -> Any:
    with running(
        tmp_path,
        simulate=False,
        clinic_name="Midori Clinic",
        clinic_address="2-1 Aoba | Sendai",
        clinic_time_zone="Europe/Paris",
        backup_time="02:30",
    ) as made:
        yield made


def test_profile_is_that_of_the_settings_until_changed(client: TestClient) -> None:
    before = client.get("/api/clinic-profile").json()
    assert (before["name"], before["address"], before["time_zone"]) == (
        "Midori Clinic",
        "2-1 Aoba\nSendai",
        "Europe/Paris",
    )
    assert (before["updated_at"], before["updated_by"], before["has_logo"]) == (None, "", False)
    changed = client.put("/api/clinic-profile", json=CHANGED)
    assert changed.status_code == 200, changed.text
    after = client.get("/api/clinic-profile").json()
    assert {name: after[name] for name in CHANGED} == CHANGED
    assert after["updated_by"] == "Test administrator"
    again = client.put("/api/clinic-profile", json=CHANGED | {"phone": ""}).json()
    assert (again["phone"], again["name"]) == ("", "Sakura Clinic")
    assert audit_log(client, action="update_clinic_profile")[0]["detail"]["changed"] == {
        "clinic_profile": {"1": ["phone", "updated_at"]}
    }


def test_reports_and_backups_use_the_changed_profile(client: TestClient) -> None:
    app: Any = client.app
    with app.state.services.database.write() as writing:
        session_id = treat(writing, sessions=1).session_ids[0]
    in_paris = client.get("/api/backups").json()["next_at"]
    before = client.get(f"/api/sessions/{session_id}/report.html").text
    client.put("/api/clinic-profile", json=CHANGED)
    report = client.get(f"/api/sessions/{session_id}/report.html").text
    assert ("JST" in before, "JST" in report) == (False, True), "the time zone"
    assert "Sakura Clinic" in report and "Tokyo" in report and "03-0000-0000" in report
    assert "Midori" not in report and "Sendai" not in report
    assert client.get("/api/me").json()["time_zone"] == "Asia/Tokyo", "for the days on the page"
    in_tokyo = client.get("/api/backups").json()["next_at"]
    assert in_tokyo != in_paris
    assert in_tokyo.endswith("17:30:00Z"), "02:30 in Tokyo"


@pytest.mark.parametrize(
    ("field", "value", "code"),
    [
        ("time_zone", "Mars/Olympus", "no_time_zone"),
        ("time_zone", "../../etc/passwd", "no_time_zone"),
        ("name", "Two\nlines", "invalid"),
        ("phone", "0" * 51, "invalid"),
    ],
)
def test_impossible_profile_is_refused(client: TestClient, field: str, value: str, code: str) -> None:
    answer = client.put("/api/clinic-profile", json=CHANGED | {field: value})
    assert (answer.status_code, answer.json()["code"]) == (422, code)
    assert client.get("/api/clinic-profile").json()["updated_at"] is None


def test_hostile_letterhead_is_text_in_a_report(client: TestClient) -> None:
    app: Any = client.app
    with app.state.services.database.write() as writing:
        session_id = treat(writing, sessions=1).session_ids[0]
    for name in (
        "<script>hostile()</script>",
        '"><img src=x onerror=hostile()>',
        "<object data='file:///etc/hostname'>",
    ):
        hostile = {"name": name, "address": f"{name}\n{name}", "phone": name[:50], "time_zone": "Asia/Tokyo"}
        assert client.put("/api/clinic-profile", json=hostile).status_code == 200
        report = client.get(f"/api/sessions/{session_id}/report.html").text
        assert name not in report
        assert report.count(str(escape(name))) >= 3


def test_checklist_day_begins_in_the_clinics_zone(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two hours after the check it is the next day where it was 22 o'clock, and the same day where it was noon."""
    given = {"clinic_number": "K-1", "name": "Ito Mai", "birth_date": "1970-01-01", "affected_side": "left"}
    patient = client.post("/api/patients", json=given).json()
    url = f"/api/sessions/{client.post('/api/sessions', json={'patient_id': patient['id']}).json()['id']}/checklist"
    now = utc_now()
    confirmed = client.put(f"{url}/identity", json={"checked_by": "Ito", "identifiers": ["name", "birth_date"]})
    assert confirmed.status_code == 200, confirmed.text
    monkeypatch.setattr(checks, "utc_now", lambda: now + timedelta(hours=2))
    cache: OfflineCache = client.app.state.services.offline_cache  # type: ignore[attr-defined]

    def is_confirmed(local_hour: int) -> bool:
        ahead = (local_hour - now.hour + 11) % 24 - 11
        # The sign of these zones' names is reversed.
        profile = CHANGED | {"time_zone": f"Etc/GMT{-ahead:+d}"}
        assert client.put("/api/clinic-profile", json=profile).status_code == 200
        cache.refresh_soon()
        cache.refresh()
        (identity,) = (check for check in client.get(url).json()["checks"] if check["check"] == "identity")
        return identity["checked_by"] is not None

    assert [is_confirmed(12), is_confirmed(22)] == [True, False]
