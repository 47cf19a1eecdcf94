"""Scapulohumeral rhythm of a recording and of a run over HTTP."""

import re
from dataclasses import dataclass
from typing import Any
from uuid import UUID

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select

from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.sessions.tables import RunRow
from kata.device.journal import PHASE_APPROACHING, PHASE_PLAYING
from kata.motion.linkage import Floats
from tests.support.responses import problem
from tests.support.rhythm_motions import abduction, as_csv, damage, evenly, store_poses, wave
from tests.support.treatment import DAY, treat

pytestmark = pytest.mark.no_apparatus

ELEVATION = wave(12.0, 75.0, 10.0)
SOUND = abduction(ELEVATION, (ELEVATION - 12.0) / 5)


@dataclass(frozen=True)
class Played:
    """A run of the left, affected shoulder."""

    patient_id: UUID
    run_id: UUID
    recording_id: UUID


def play(client: TestClient, poses: Floats, phase: int = PHASE_PLAYING) -> Played:
    app: Any = client.app
    with app.state.services.database.write() as session:
        made = treat(session, runs=1)
        run = session.scalars(select(RunRow).where(RunRow.session_id == made.session_ids[0])).one()
        found = Played(run.recording.patient_id, run.id, run.recording_id)
        store_poses(session, run, poses, phase, "left")
    return found


def teach_other_side(client: TestClient, played: Played, poses: Floats, side: str = "right") -> str:
    answer = client.post(
        f"/api/patients/{played.patient_id}/recordings/import",
        params={"name": "Sound side", "side": side},
        content=as_csv(poses),
        headers={"content-type": "text/csv"},
    )
    assert answer.status_code == 201, answer.text
    found: str = answer.json()["recording"]["id"]
    return found


def rhythm(client: TestClient, path: str) -> dict[str, Any]:
    answer = client.get(f"/api/{path}/rhythm")
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def test_run_has_the_rhythm_that_was_played_and_taught(client: TestClient) -> None:
    played = play(client, evenly(ELEVATION, 4.0))
    found = rhythm(client, f"runs/{played.run_id}")
    assert [(curve["of"], curve["direction"], curve["plane"]) for curve in found["curves"]] == [
        ("played", "raising", "abduction"), ("played", "lowering", "abduction"),
        ("taught", "raising", "abduction"), ("taught", "lowering", "abduction"),
    ]  # fmt: skip
    assert [curve["whole"]["ratio"] for curve in found["curves"]] == pytest.approx([4.0] * 4, abs=0.1)
    assert [band["reason"] for band in found["curves"][0]["bands"]] == [None, "not_covered", "not_covered"]
    assert found["curves"][0]["reference"] == {"source": "giphart_2013", "ratio": 2.0, "ratio_deviation": 0.4}
    assert found["curves"][1]["reference"] is None
    assert (found["side"], found["run_id"], found["no_sound"]) == ("left", str(played.run_id), "no_recording")
    recording = rhythm(client, f"recordings/{played.recording_id}")
    assert [curve["of"] for curve in recording["curves"]] == ["taught", "taught"]
    assert recording["run_id"] is None


def test_scapula_that_runs_ahead_of_sound_side_is_named(client: TestClient) -> None:
    shrug = 8.0 * ((ELEVATION - 12.0) / 20.0).clip(0.0, 1.0)
    played = play(client, abduction(ELEVATION, (ELEVATION - 12.0) / 5 + shrug))
    other = teach_other_side(client, played, SOUND)
    teach_other_side(client, played, SOUND[:2].repeat(60, axis=0))
    found = rhythm(client, f"runs/{played.run_id}")
    assert found["sound"]["recording_id"] == other
    assert found["no_sound"] is None
    assert [lead["of"] for lead in found["leads"]] == ["played", "taught"]
    for lead in found["leads"]:
        assert lead["largest_deg"] == pytest.approx(8.0, abs=0.3)
        assert lead["ahead_from_deg"] == pytest.approx(22.0, abs=2.0)
    assert {curve["of"] for curve in found["curves"]} == {"played", "taught", "sound"}
    assert rhythm(client, f"recordings/{other}")["no_sound"] == "sound_side"


def test_same_rhythm_on_both_sides_does_not_run_ahead(client: TestClient) -> None:
    played = play(client, SOUND)
    teach_other_side(client, played, SOUND)
    (lead,) = rhythm(client, f"recordings/{played.recording_id}")["leads"]
    assert lead["largest_deg"] == pytest.approx(0.0, abs=0.2)
    assert lead["ahead_from_deg"] is None


def test_mirrored_and_archived_recordings_are_not_the_sound_side(client: TestClient) -> None:
    played = play(client, SOUND)
    mirrored = client.post(f"/api/recordings/{played.recording_id}/derived", json={"do": "mirror"})
    assert mirrored.status_code == 201 and mirrored.json()["side"] == "right", mirrored.text
    assert rhythm(client, f"recordings/{played.recording_id}")["no_sound"] == "no_recording"
    archived = teach_other_side(client, played, SOUND)
    assert rhythm(client, f"recordings/{played.recording_id}")["no_sound"] is None
    assert client.patch(f"/api/recordings/{archived}", json={"archived": True}).status_code == 200
    assert rhythm(client, f"recordings/{played.recording_id}")["no_sound"] == "no_recording"


def test_other_motion_and_two_treated_sides_are_not_compared(client: TestClient) -> None:
    played = play(client, SOUND)
    flexion = SOUND.copy()
    flexion[:, [2, 3]] = flexion[:, [3, 2]]
    teach_other_side(client, played, flexion)
    assert rhythm(client, f"recordings/{played.recording_id}")["no_sound"] == "no_like_motion"
    app: Any = client.app
    with app.state.services.database.write() as session:
        session.add(
            EpisodeRow(id=played.run_id, patient_id=played.patient_id, side="right", opened_at=DAY, updated_at=DAY)
        )
    assert rhythm(client, f"recordings/{played.recording_id}")["no_sound"] == "sides_unknown"


def test_run_without_playback_or_pose_has_no_rhythm(client: TestClient) -> None:
    approached = play(client, SOUND, PHASE_APPROACHING)
    problem(client.get(f"/api/runs/{approached.run_id}/rhythm"), 409, "nothing_played")
    app: Any = client.app
    with app.state.services.database.write() as session:
        damage(session, approached.recording_id)
        elsewhere = session.scalars(
            select(RunRow).where(RunRow.session_id == treat(session, runs=1).session_ids[0])
        ).one()
        run_id = elsewhere.id
    problem(client.get(f"/api/recordings/{approached.recording_id}/rhythm"), 410, "unreadable_samples")
    # The angles of motors 1 and 2 of this run are those of no position of the scapula.
    problem(client.get(f"/api/runs/{run_id}/rhythm"), 422, "no_pose")
    assert rhythm(client, f"recordings/{play(client, SOUND).recording_id}")["curves"]


def test_sound_side_gives_curves_for_the_live_comparison(client: TestClient) -> None:
    played = play(client, SOUND)
    path = f"/api/patients/{played.patient_id}/sound-rhythm"
    assert client.get(path).json() == {"side": "right", "no_sound": "no_recording", "motions": []}
    other = teach_other_side(client, played, SOUND)
    # Another simulated recording of the treated side is no recording of the sound side.
    teach_other_side(client, played, SOUND, "left")
    found = client.get(path).json()
    assert (found["side"], found["no_sound"]) == ("right", None)
    (motion,) = found["motions"]
    assert motion["recording"]["recording_id"] == other
    assert (motion["start_elevation_deg"], motion["start_scapula_deg"]) == pytest.approx((12.0, 0.0), abs=0.01)
    assert [(curve["of"], curve["direction"]) for curve in motion["curves"]] == [
        ("sound", "raising"),
        ("sound", "lowering"),
    ]
    assert motion["curves"][0]["whole"]["ratio"] == pytest.approx(4.0, abs=0.1)


def test_damaged_recording_of_the_sound_side_is_left_out(client: TestClient) -> None:
    played = play(client, SOUND)
    other = teach_other_side(client, played, SOUND)
    app: Any = client.app
    with app.state.services.database.write() as session:
        damage(session, UUID(other))
    found = client.get(f"/api/patients/{played.patient_id}/sound-rhythm").json()
    assert (found["no_sound"], found["motions"]) == (None, [])
    problem(client.get(f"/api/patients/{played.run_id}/sound-rhythm"), 404, "not_found")


def test_recording_can_be_guided_by_the_sound_side(client: TestClient) -> None:
    shrug = 8.0 * ((ELEVATION - 12.0) / 20.0).clip(0.0, 1.0)
    played = play(client, abduction(ELEVATION, (ELEVATION - 12.0) / 5 + shrug))
    path = f"/api/recordings/{played.recording_id}/derived"
    refused = problem(client.post(path, json={"do": "guide"}), 422, "impossible")
    assert "no motion of the unaffected side has been taught" in refused["detail"]
    other = teach_other_side(client, played, SOUND)
    answer = client.post(path, json={"do": "guide"})
    assert answer.status_code == 201, answer.text
    made = answer.json()
    assert (made["parent_id"], made["side"]) == (str(played.recording_id), "left")
    assert made["done"][-1] == "scapula guided by the unaffected side, Sound side"
    (lead,) = rhythm(client, f"recordings/{made['id']}")["leads"]
    assert lead["largest_deg"] == pytest.approx(0.0, abs=0.3)
    (before,) = rhythm(client, f"recordings/{played.recording_id}")["leads"]
    assert before["largest_deg"] == pytest.approx(8.0, abs=0.3)
    refused = problem(client.post(f"/api/recordings/{other}/derived", json={"do": "guide"}), 422, "impossible")
    assert "recording of the unaffected side" in refused["detail"]
    assert client.post(f"{path}/preview", json={"do": "guide"}).status_code == 200


def test_guided_recording_beyond_a_limit_is_refused(client: TestClient) -> None:
    # The board was fastened with the scapula turned up by 15 deg, so that there is no room for the sound side's 12 deg.
    played = play(client, abduction(ELEVATION, 15.0 + (ELEVATION - 12.0) / 20))
    teach_other_side(client, played, SOUND)
    path = f"/api/recordings/{played.recording_id}/derived"
    refused = problem(client.post(path, json={"do": "guide"}), 422, "unplayable")
    assert re.search(r"motor 2 would go to 1\d\d\.\d° at \d\.\d s; its range is 88 to 129°", refused["detail"])
