"""Edits of a recording over REST: each makes a new recording, which is checked and saved or refused."""

import io
import re
from typing import Any
from uuid import UUID, uuid4

import numpy as np
import pytest
from fastapi.testclient import TestClient

from kata.clinic.recordings.tables import RecordingSamplesRow
from kata.motion.linkage import Floats, pose_deg
from tests.support.recordings import LASTS_S, lifted, taught
from tests.support.responses import problem
from tests.support.station_api import load, until_mode


@pytest.fixture
def recording(client: TestClient, patient: dict[str, Any]) -> dict[str, Any]:
    return taught(client, patient, lifted())


def derive(client: TestClient, recording: dict[str, Any], **edit: Any) -> dict[str, Any]:
    answer = client.post(f"/api/recordings/{recording['id']}/derived", json=edit)
    assert answer.status_code == 201, answer.text
    made: dict[str, Any] = answer.json()
    return made


def samples(client: TestClient, recording: dict[str, Any]) -> tuple[Floats, Floats]:
    text = client.get(f"/api/recordings/{recording['id']}/samples.csv").text
    table = np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1, usecols=range(6))
    return table[:, 0], table[:, 1:]


def listed(client: TestClient, recording: dict[str, Any]) -> list[dict[str, Any]]:
    items: list[dict[str, Any]] = client.get(f"/api/patients/{recording['patient_id']}/recordings").json()["items"]
    return items


def test_trimmed_recording_is_new_and_names_its_parent(client: TestClient, recording: dict[str, Any]) -> None:
    made = derive(client, recording, do="trim", start_s=1.0, end_s=5.5)

    assert made["parent_id"] == recording["id"]
    assert made["done"] == ["trimmed to 1.0 s to 5.5 s"]
    assert made["name"] == "Lift, trimmed to 1.0 s to 5.5 s"
    assert (made["teaching_id"], made["take"]) == (None, None)
    assert (made["patient_id"], made["side"]) == (recording["patient_id"], "right")
    assert made["duration_s"] == pytest.approx(4.5)
    (_, before), (times_s, after) = samples(client, recording), samples(client, made)
    assert times_s[[0, -1]] == pytest.approx([0.0, 4.5])
    assert after == pytest.approx(before[100:551], abs=1e-3)
    # The original is unchanged and has no edits.
    assert client.get(f"/api/recordings/{recording['id']}").json() == recording
    assert (recording["parent_id"], recording["done"]) == (None, [])
    assert [row["id"] for row in listed(client, recording)] == [made["id"], recording["id"]]


def test_hold_pauses_at_one_point(client: TestClient, recording: dict[str, Any]) -> None:
    made = derive(client, recording, do="hold", at_s=2.0, hold_s=3.0)
    # Stopping and starting take 0.2 s each.
    assert made["duration_s"] == pytest.approx(LASTS_S + 3.4)
    assert made["done"] == ["held for 3 s at 2.0 s"]
    (_, before), (times_s, after) = samples(client, recording), samples(client, made)
    standing = after[(times_s > 2.25) & (times_s < 5.15)]
    assert standing == pytest.approx(np.repeat(before[200:201], len(standing), axis=0), abs=1e-3)
    # The parts have different sample periods. The highest speed is that of the original.
    assert made["ranges"][2]["max_speed_deg_s"] == pytest.approx(recording["ranges"][2]["max_speed_deg_s"], rel=0.02)


def test_scale_takes_range_from_the_motors_that_are_named(client: TestClient, recording: dict[str, Any]) -> None:
    made = derive(client, recording, do="scale", percent=50, motors=[3])
    assert made["done"] == ["50 % of the range of motor 3"]
    third = made["ranges"][2]
    assert (third["min_deg"], third["max_deg"]) == pytest.approx((10.0, 50.0), abs=0.01)
    assert made["ranges"][3] == recording["ranges"][3]


def test_isolation_moves_no_other_motor(client: TestClient, recording: dict[str, Any]) -> None:
    made = derive(client, recording, do="isolate", motors=[4, 3])
    assert made["done"] == ["motors 3, 4 only"]
    (_, before), (_, after) = samples(client, recording), samples(client, made)
    assert after[:, 2:4] == pytest.approx(before[:, 2:4])
    assert np.ptp(after[:, [0, 1, 4]], axis=0) == pytest.approx([0.0] * 3)
    assert np.ptp(before[:, 1]) > 1.0


def test_warm_up_widens_to_the_whole(client: TestClient, recording: dict[str, Any]) -> None:
    made = derive(client, recording, do="warm_up", less_deg=20, step_deg=10, pause_s=1)
    times_s, angles = samples(client, made)
    # From 20 deg less at the end away from rest, in three repetitions.
    assert [angles[(times_s > n * 9) & (times_s < n * 9 + 9), 2].max() for n in (0, 1, 2)] == pytest.approx(
        [70.0, 80.0, 90.0], abs=0.1
    )
    # Every repetition begins at rest, so nothing joins them.
    assert made["duration_s"] == pytest.approx(3 * LASTS_S + 2)


def test_stretch_goes_beyond_the_end_and_holds_there(client: TestClient, recording: dict[str, Any]) -> None:
    made = derive(client, recording, do="stretch", further_deg=3, back_deg=6, hold_s=4)
    times_s, angles = samples(client, made)
    beyond = times_s[np.abs(angles[:, 2] - 93.0) < 1e-3]
    # The minimum-jerk motion is slow near the end position.
    assert 4.0 <= beyond[-1] - beyond[0] < 4.3
    assert angles[:, 2].max() == pytest.approx(93.0)


def test_retouch_lowers_a_peak_between_two_marks(client: TestClient, recording: dict[str, Any]) -> None:
    point = {"motor": 3, "at_s": 4.0, "change_deg": -8}
    made = derive(client, recording, do="retouch", start_s=2, end_s=6, points=[point])
    assert made["done"] == ["motor 3 changed by up to -8.0° between 2.0 s and 6.0 s"]
    (_, before), (times_s, after) = samples(client, recording), samples(client, made)
    outside = (times_s <= 2.0) | (times_s >= 6.0)
    assert after[outside] == pytest.approx(before[outside], abs=1e-3)
    assert (after - before)[400] == pytest.approx([0, 0, -8, 0, 0], abs=1e-3)
    assert made["parent_id"] == recording["id"]


@pytest.mark.parametrize(
    ("point", "reason"),
    [
        (
            {"motor": 5, "at_s": 2.4, "change_deg": 30},
            r"motor 5 would move at \d+°/s at 2\.\d s; its limit is 100°/s",
        ),
        ({"motor": 4, "at_s": 2.4, "change_deg": -30}, r"motor 4 would go to -\d+\.\d° at 2\.\d s; its range is"),
    ],
)
def test_retouch_beyond_a_limit_is_refused_with_its_place(
    client: TestClient, recording: dict[str, Any], point: dict[str, Any], reason: str
) -> None:
    edit = {"do": "retouch", "start_s": 2, "end_s": 2.8, "points": [point]}
    refusal = problem(client.post(f"/api/recordings/{recording['id']}/derived", json=edit), 422, "unplayable")
    assert re.search(reason, refusal["detail"]), refusal["detail"]
    assert [row["id"] for row in listed(client, recording)] == [recording["id"]]


def test_mirror_gives_the_same_pose_of_the_other_shoulder(client: TestClient, recording: dict[str, Any]) -> None:
    made = derive(client, recording, do="mirror")
    assert (made["side"], made["done"]) == ("left", ["mirrored for the left shoulder"])
    (_, before), (_, after) = samples(client, recording), samples(client, made)
    assert pose_deg(after, "left") == pytest.approx(pose_deg(before, "right"), abs=1e-2)
    assert np.abs(after[:, :2] - before[:, :2]).max() > 1.0


def test_derived_recording_can_be_derived_again(client: TestClient, recording: dict[str, Any]) -> None:
    once = derive(client, recording, do="mirror", name=" For the left ")
    assert once["name"] == "For the left"
    twice = derive(client, once, do="trim", start_s=0, end_s=4)
    back = derive(client, twice, do="mirror")
    assert back["parent_id"] == twice["id"]
    assert back["done"] == [
        "mirrored for the left shoulder",
        "trimmed to 0.0 s to 4.0 s",
        "mirrored for the right shoulder",
    ]
    assert back["side"] == "right"
    (_, before), (_, after) = samples(client, recording), samples(client, back)
    assert after == pytest.approx(before[:401], abs=1e-2)


def test_long_name_is_replaced_by_the_edits(client: TestClient, patient: dict[str, Any]) -> None:
    made = derive(client, taught(client, patient, lifted(), name="N" * 100), do="isolate", motors=[3])
    assert len(made["name"]) == 100
    assert made["name"].endswith("N, motor 3 only")


def test_derived_recording_loads_like_any_recording(client: TestClient, patient: dict[str, Any]) -> None:
    made = derive(client, taught(client, patient, lifted()), do="warm_up", less_deg=6, step_deg=3)
    until_mode(client, "idle")
    load(client, patient, made)
    live = until_mode(client, "ready")
    assert live["run"]["recording_name"] == "Lift, warm-up from 6° less, 3° more per repetition"
    assert live["run"]["duration_s"] == pytest.approx(made["duration_s"], abs=0.01)
    assert client.post("/api/station/unload").status_code == 200
    until_mode(client, "idle")


def test_derived_recording_beyond_limits_is_refused_with_motor_and_time(
    client: TestClient, patient: dict[str, Any]
) -> None:
    recording = taught(client, patient, lifted(top_deg=118.0))
    url = f"/api/recordings/{recording['id']}/derived"
    edit = {"do": "stretch", "further_deg": 10, "back_deg": 5, "hold_s": 0}
    for path in (url, f"{url}/preview"):
        refusal = problem(client.post(path, json=edit), 422, "unplayable")
        assert "motor 3 would go to 128.0° at " in refusal["detail"]
        assert "its range is 0 to 120°" in refusal["detail"]
        assert refusal["next_step"]
    assert [row["id"] for row in listed(client, recording)] == [recording["id"]]


def test_mirrored_recording_beyond_limits_is_refused_with_motor_and_time(
    client: TestClient, patient: dict[str, Any]
) -> None:
    """The linkage is not symmetric: the motors of one side reach scapula angles that those of the other cannot."""

    def rotated(times_s: Floats) -> Floats:
        share = 0.5 - 0.5 * np.cos(2 * np.pi * times_s / LASTS_S)
        return np.stack([25 * share, 25 * share, *[10 + 0 * share] * 3], axis=1)

    recording = taught(client, patient, rotated)
    answer = client.post(f"/api/recordings/{recording['id']}/derived", json={"do": "mirror"})
    assert answer.status_code == 422
    assert " at 4.0 s" in answer.json()["detail"]
    assert "motor " in answer.json()["detail"]


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        ({"do": "trim", "start_s": 5, "end_s": 9}, "within the motion's 8.0 s"),
        ({"do": "trim", "start_s": 5, "end_s": 5.2}, "at least 0.5 s"),
        ({"do": "hold", "at_s": 8.5, "hold_s": 1}, "the motion lasts 8.0 s"),
        ({"do": "warm_up", "less_deg": 100, "step_deg": 10}, "the motion covers only 80.0°"),
        ({"do": "warm_up", "less_deg": 79, "step_deg": 0.5, "pause_s": 120}, "longer than an hour"),
    ],
)
def test_impossible_edit_is_refused_with_a_sentence(
    client: TestClient, recording: dict[str, Any], edit: dict[str, Any], sentence: str
) -> None:
    refusal = problem(client.post(f"/api/recordings/{recording['id']}/derived", json=edit), 422, "impossible")
    assert sentence in refusal["detail"]
    assert [row["id"] for row in listed(client, recording)] == [recording["id"]]


@pytest.mark.parametrize(
    ("edit", "pointers"),
    [
        ({"do": "isolate", "motors": []}, ["#/motors"]),
        ({"do": "isolate"}, ["#/motors"]),
        ({"do": "isolate", "motors": [3, 6]}, ["#/motors/1"]),
        ({"do": "scale", "percent": 100, "motors": [1]}, ["#/percent"]),
        ({"do": "trim", "start_s": -1, "end_s": 3}, ["#/start_s"]),
        ({"do": "mirror", "percent": 50}, ["#/percent"]),
        ({"do": "mirror", "name": " "}, ["#/name"]),
        ({"do": "retouch", "start_s": 1, "end_s": 3, "points": []}, ["#/points"]),
        (
            {"do": "retouch", "start_s": 1, "end_s": 3, "points": [{"motor": 6, "at_s": 2, "change_deg": 31}]},
            ["#/points/0/motor", "#/points/0/change_deg"],
        ),
    ],
)
def test_invalid_request_is_reported_field_by_field(
    client: TestClient, recording: dict[str, Any], edit: dict[str, Any], pointers: list[str]
) -> None:
    refusal = problem(client.post(f"/api/recordings/{recording['id']}/derived", json=edit), 422, "invalid")
    assert [error["pointer"] for error in refusal["errors"]] == pointers


@pytest.mark.parametrize("edit", [{}, {"do": "reverse"}])
def test_an_unknown_thing_to_do_is_refused(client: TestClient, recording: dict[str, Any], edit: dict[str, Any]) -> None:
    problem(client.post(f"/api/recordings/{recording['id']}/derived", json=edit), 422, "invalid")


def test_preview_shows_both_motions_and_saves_nothing(client: TestClient, recording: dict[str, Any]) -> None:
    answer = client.post(f"/api/recordings/{recording['id']}/derived/preview", json={"do": "isolate", "motors": [3]})
    assert answer.status_code == 200, answer.text
    assert [trace["name"] for trace in answer.json()["data"]] == ["Before", "After"] * 5
    assert [row["id"] for row in listed(client, recording)] == [recording["id"]]


def test_damaged_or_missing_recording_cannot_be_derived(client: TestClient, recording: dict[str, Any]) -> None:
    app: Any = client.app
    with app.state.services.database.write() as session:
        session.get_one(RecordingSamplesRow, UUID(recording["id"])).data = b"damaged"
    for path in ("derived", "derived/preview"):
        body = {"do": "mirror"}
        problem(client.post(f"/api/recordings/{recording['id']}/{path}", json=body), 410, "unreadable_samples")
        problem(client.post(f"/api/recordings/{uuid4()}/{path}", json=body), 404, "not_found")


def test_second_of_two_editors_of_a_recording_is_refused(client: TestClient, recording: dict[str, Any]) -> None:
    url = f"/api/recordings/{recording['id']}"
    renamed = client.patch(url, json={"name": "Lift, slowly", "updated_at": recording["updated_at"]})
    assert renamed.status_code == 200
    problem(client.patch(url, json={"note": "Mine", "updated_at": recording["updated_at"]}), 409, "edited_meanwhile")
    assert client.get(url).json()["note"] == ""
    again = {"note": "Mine", "updated_at": renamed.json()["updated_at"]}
    assert client.patch(url, json=again).json()["name"] == "Lift, slowly"


def test_derived_recording_names_its_teacher_and_fixtures(client: TestClient, patient: dict[str, Any]) -> None:
    given = {"taught_by": "Sato", "fixtures": ["arm_fixer_1"]}
    recording = taught(client, patient, lifted(), **given)
    made = derive(client, recording, do="trim", start_s=1.0, end_s=4.0)
    for archived in (recording, made):
        assert {name: archived[name] for name in given} == given


def test_part_of_a_recording_can_be_plotted_alone(client: TestClient, recording: dict[str, Any]) -> None:
    url = f"/api/recordings/{recording['id']}/figure"
    closer = client.get(url, params={"start_s": 1.0, "end_s": 1.5}).json()
    assert closer["layout"]["xaxis"]["range"] == [1.0, 1.5]
    assert len(closer["data"][0]["x"]["bdata"]) < len(client.get(url).json()["data"][0]["x"]["bdata"]) / 3
    refused = client.get(url, params={"start_s": 2.0, "end_s": 1.0})
    assert (refused.status_code, refused.json()["code"]) == (422, "empty_window")
    assert client.get(url, params={"start_s": "NaN"}).status_code == 422


def test_part_that_was_taught_again_replaces_the_old_part(
    client: TestClient, patient: dict[str, Any], recording: dict[str, Any]
) -> None:
    part = taught(client, patient, lifted())
    made = derive(client, recording, do="reteach", start_s=1.0, end_s=7.0, recording_id=part["id"])
    assert made["parent_id"] == recording["id"]
    assert made["done"] == [f"1.0 s to 7.0 s taught again, {part['name']}"]
    assert client.get(f"/api/recordings/{recording['id']}").json() == recording
    assert client.get(f"/api/recordings/{part['id']}").json() == part


def test_part_of_another_shoulder_or_patient_is_refused(client: TestClient, recording: dict[str, Any]) -> None:
    mirrored = derive(client, recording, do="mirror")
    edit = {"do": "reteach", "start_s": 1.0, "end_s": 5.0}
    path = f"/api/recordings/{recording['id']}/derived"
    refused = problem(client.post(path, json=edit | {"recording_id": mirrored["id"]}), 422, "impossible")
    assert "not taught for this patient and shoulder" in refused["detail"]
    problem(client.post(path, json=edit | {"recording_id": str(uuid4())}), 404, "not_found")
    assert [row["id"] for row in listed(client, recording)] == [mirrored["id"], recording["id"]]
