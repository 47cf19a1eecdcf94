"""Export of samples as CSV, Parquet, MCAP and LeRobotDataset, and import of a motion from CSV: exported files are accepted, invalid ones refused."""

import csv
import io
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4
from zipfile import ZipFile

import numpy as np
import pytest
from arro3.core import DataType
from arro3.io import read_parquet
from fastapi.testclient import TestClient
from mcap.reader import make_reader

from kata.clinic.recordings.tables import RecordingSamplesRow
from kata.clinic.sessions.tables import RUN_COLUMNS, RunRow, RunSamplesRow, SessionRow
from kata.database import arrays
from kata.device.journal import PHASE_APPROACHING, PHASE_PLAYING
from kata.motion.axes import POSE_COLUMNS
from kata.motion.linkage import Floats, motor_angles_deg
from tests.support.recordings import LASTS_S, lifted, taught
from tests.support.responses import problem
from tests.support.validators import judge_parquet

pytestmark = pytest.mark.no_apparatus

HEADER = "time_s," + ",".join(POSE_COLUMNS)


def poses_csv(
    seconds: float = 4.0, separator: str = ",", change: dict[tuple[int, int], str] | None = None, end: str = "\n"
) -> str:
    """Return a CSV file of a right arm that is lifted. ``change`` replaces cells by line and column, both from 1."""
    times_s = np.arange(0, seconds + 0.005, 0.01)
    table = np.column_stack([times_s, lifted()(times_s)])
    lines = [HEADER.split(","), *([f"{value:.4f}" for value in row] for row in table)]
    for (line, column), value in (change or {}).items():
        lines[line - 1][column - 1] = value
    return end.join(separator.join(cells) for cells in lines) + end


def sent(client: TestClient, patient: dict[str, Any], csv: str | bytes, side: str = "right", to: str = "") -> Any:
    params = {"side": side} | ({} if to else {"name": "From home", "taught_by": "Suzuki Aya"})
    return client.post(
        f"/api/patients/{patient['id']}/recordings/import{to}",
        params=params,
        content=csv,
        headers={"content-type": "text/csv"},
    )


def refused(client: TestClient, patient: dict[str, Any], csv: str | bytes, side: str = "right") -> dict[str, Any]:
    """Check that preview and import refuse the file alike and save nothing. Return the problem."""
    refusal = problem(sent(client, patient, csv, side), 422, "not_a_motion")
    assert problem(sent(client, patient, csv, side, to="/preview"), 422, "not_a_motion") == refusal
    assert refusal["next_step"]
    assert client.get(f"/api/patients/{patient['id']}/recordings").json()["items"] == []
    return refusal


def table(text: str) -> Floats:
    return np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1)


def test_recording_survives_a_csv_export_and_import_unchanged(client: TestClient, patient: dict[str, Any]) -> None:
    recording = taught(client, patient, lifted())
    answer = client.get(f"/api/recordings/{recording['id']}/samples.csv")
    assert answer.headers["content-type"].startswith("text/csv")
    assert f'filename="recording-{recording["id"]}.csv"' in answer.headers["content-disposition"]

    made = sent(client, patient, answer.text)
    assert made.status_code == 201, made.text
    found = made.json()["understood"]
    assert (found["layout"], found["separator"], found["samples"], found["rate_hz"]) == ("motors", "comma", 801, 100)
    again = client.get(f"/api/recordings/{made.json()['recording']['id']}/samples.csv").text
    assert table(again) == pytest.approx(table(answer.text), abs=1e-4)


@pytest.mark.parametrize("side", ["left", "right"])
def test_pose_file_becomes_the_motor_angles_of_its_side(client: TestClient, patient: dict[str, Any], side: Any) -> None:
    made = sent(client, patient, poses_csv(), side).json()
    recording, answer = made["recording"], made["understood"]
    assert (recording["teaching_id"], recording["parent_id"], recording["take"]) == (None, None, None)
    assert recording["done"] == ["imported from a CSV file"]
    assert (recording["name"], recording["side"], recording["samples"]) == ("From home", side, 401)
    assert answer["layout"] == "poses"
    assert answer["duration_s"] == pytest.approx(4.0)
    assert client.get(f"/api/recordings/{recording['id']}").json()["ranges"] == answer["ranges"]
    stored = table(client.get(f"/api/recordings/{recording['id']}/samples.csv").text)
    times_s = np.arange(0, 4.005, 0.01)
    assert stored[:, 1:] == pytest.approx(motor_angles_deg(lifted()(times_s), side), abs=2e-3)


def test_file_beyond_the_reachable_set_is_refused_at_its_line(client: TestClient, patient: dict[str, Any]) -> None:
    """With the upper arm level, motor 4 has its whole range, but the arm would go through the trunk beyond the limit of motion 3."""
    times_s = np.arange(0, 8.005, 0.01)
    flexion_deg = 95 + 45 * (1 - np.cos(np.pi * times_s / 4))
    rows = [f"{at:.2f},0,0,90,{angle:.3f},0" for at, angle in zip(times_s, flexion_deg, strict=True)]
    refusal = refused(client, patient, "\n".join([HEADER, *rows]) + "\n")
    (error,) = refusal["errors"]
    assert error["pointer"].startswith("line 402")
    assert "in this pose the plane of elevation would be 185.0°, and its limit is 130.0°" in error["detail"]


def test_spreadsheet_variants_of_a_csv_are_understood(client: TestClient, patient: dict[str, Any]) -> None:
    text = "\ufeff" + poses_csv(separator=";", end="\r\n").replace("\r\n", ";ok\r\n").replace(";ok", ";remark", 1)
    answer = sent(client, patient, text + ";;;;;;\r\n", to="/preview").json()
    assert (answer["separator"], answer["left_alone"], answer["samples"]) == ("semicolon", ["remark"], 401)
    assert sent(client, patient, poses_csv(separator="\t"), to="/preview").json()["separator"] == "tab"
    assert client.get(f"/api/patients/{patient['id']}/recordings").json()["items"] == []


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        ({(3, 4): "nan"}, "line 3, column shoulder_abduction", "'nan' is not a number"),
        ({(3, 4): ""}, "line 3, column shoulder_abduction", "'' is not a number"),
        ({(3, 4): "10 deg"}, "line 3, column shoulder_abduction", "'10 deg' is not a number"),
        ({(3, 4): "1_0"}, "line 3, column shoulder_abduction", "'1_0' is not a number"),
        ({(3, 4): "inf"}, "line 3, column shoulder_abduction", "'inf' is not a number"),
        ({(3, 6): "0,oops"}, "line 3, column after external_rotation", "'oops' is in a column without a name in the first line"),
        ({(5, 1): "0.01"}, "line 5, column time_s", "the time must increase, but 0.01 s follows 0.02 s"),
        ({(5, 1): "0.02"}, "line 5, column time_s", "the time must increase, but 0.02 s follows 0.02 s"),
        ({(402, 1): "5.5"}, "line 402, column time_s", "there is a gap of 1.5 s before this row"),
        ({(402, 1): "4000"}, "line 402, column time_s", "from this row on, the motion is longer than an hour"),
        ({(9, 5): "195"}, "line 9, column shoulder_flexion", "195° is outside the apparatus' range of -20 to 190"),
        ({(200, 4): "60"}, "line 200, column shoulder_abduction", "motor 3 would jerk at"),
        ({(1, 5): "Shoulder_flexion (rad)"}, "line 1, column Shoulder_flexion (rad)", "the unit is wrong"),
        ({(1, 1): "time_ms"}, "line 1, column time_ms", "the unit is wrong; the column must be called time_s"),
        ({(1, 5): "bending"}, "line 1, column shoulder_flexion", "this column is missing"),
        ({(1, 6): "shoulder_flexion"}, "line 1, column external_rotation", "this column is missing"),
    ],
)  # fmt: skip
def test_error_is_reported_with_line_and_column(
    client: TestClient, patient: dict[str, Any], change: dict[tuple[int, int], str], where: str, what: str
) -> None:
    refusal = refused(client, patient, poses_csv(change=change))
    first = refusal["errors"][0]
    found_line, found_column = first["pointer"].split(", column ")
    line, column = where.split(", column ")
    assert found_column == column
    # If the spline is too fast, its highest speed may be one line further.
    assert abs(int(found_line.removeprefix("line ")) - int(line.removeprefix("line "))) <= (1 if "jerk" in what else 0)
    assert first["detail"].startswith(what)
    # The page translates the place by its code.
    assert (first["field"], first["field_key"]["code"]) == (first["pointer"], "line_and_column")
    assert first["field_key"]["params"]["line"] == int(found_line.removeprefix("line "))
    assert first["field_key"]["params"]["column"]["text"] == column
    assert bool(first["field_key"]["params"]["column"]["code"]) == column.startswith("after ")


def test_up_to_twenty_wrong_lines_are_reported(client: TestClient, patient: dict[str, Any]) -> None:
    refusal = refused(client, patient, poses_csv(change={(line, 3): "x" for line in range(10, 60)}))
    assert [error["pointer"].split(",")[0] for error in refusal["errors"]] == [f"line {n}" for n in range(10, 30)]


def test_radians_and_milliseconds_are_recognised_by_their_size(client: TestClient, patient: dict[str, Any]) -> None:
    lines = [line.split(",") for line in poses_csv().splitlines()[1:]]
    radians = [[cells[0], *(f"{np.radians(float(cell)):.6f}" for cell in cells[1:])] for cells in lines]
    refusal = refused(client, patient, "\n".join([HEADER, *(",".join(cells) for cells in radians)]))
    assert refusal["errors"][0]["pointer"] == "line 402, column shoulder_abduction"
    assert "looks like radians" in refusal["detail"]
    milliseconds = [[f"{1000 * float(cells[0]):.0f}", *cells[1:]] for cells in lines]
    refusal = refused(client, patient, "\n".join([HEADER, *(",".join(cells) for cells in milliseconds)]))
    assert refusal["errors"][0]["pointer"] == "line 3, column time_s"
    assert "look like milliseconds" in refusal["detail"]


@pytest.mark.parametrize(
    ("csv", "sentence"),
    [
        (b"\n", "the first line must name the columns time_s, "),
        (HEADER.encode() + b"\n", "the motion is too short"),
        (f"{HEADER}\n0,0,0,20,0,0\n0.1,0,0,20,0,0\n".encode(), "the motion is too short"),
        ("時間,肩\n0,1\n".encode("cp932"), "line 1 is in Shift-JIS; save the file as CSV in UTF-8"),
        (poses_csv().encode("utf-16"), "the file is in UTF-16"),
        (b"\x89PNG\r\n\x1a\n\xff\x00\xfd\xa0", "line 1 is not text in UTF-8"),
        (b'"' + poses_csv(40.0).encode(), "cannot be read as CSV"),
    ],
)
def test_file_without_motion_is_refused(client: TestClient, patient: dict[str, Any], csv: bytes, sentence: str) -> None:
    assert sentence in refused(client, patient, csv)["detail"]


def test_file_beyond_the_stations_limits_is_refused_with_its_line(client: TestClient, patient: dict[str, Any]) -> None:
    recording = taught(client, patient, lifted())
    lines = client.get(f"/api/recordings/{recording['id']}/samples.csv").text.splitlines()
    quick = [lines[0], *(f"{float(line.split(',')[0]) / 10:.6f},{line.partition(',')[2]}" for line in lines[1:])]
    refusal = problem(sent(client, patient, "\n".join(quick)), 422, "not_a_motion")
    assert "motor 3 would move at " in refusal["detail"]
    assert refusal["errors"][0]["pointer"].endswith("column motor_3_deg")


def test_an_angle_that_nothing_can_have_is_refused(client: TestClient, patient: dict[str, Any]) -> None:
    rows = "\n".join(f"{n / 100},0,0,{1e300 if n == 7 else 20},0,0" for n in range(100))
    refusal = refused(client, patient, f"time_s,{','.join(f'motor_{motor}_deg' for motor in range(1, 6))}\n{rows}\n")
    assert refusal["errors"] == [
        {
            "pointer": "line 9, column motor_3_deg",
            "field": "line 9, column motor_3_deg",
            "detail": "1e+300° is more than a whole turn",
            "field_key": {
                "code": "line_and_column",
                "params": {"line": 9, "column": {"code": "", "params": {}, "text": "motor_3_deg"}},
            },
            "detail_key": {"code": "more_than_a_turn", "params": {"angle_deg": 1e300}},
        }
    ]


def test_imported_motion_needs_an_existing_patient(client: TestClient, patient: dict[str, Any]) -> None:
    problem(sent(client, {"id": str(uuid4())}, poses_csv()), 404, "not_found")
    client.patch(f"/api/patients/{patient['id']}", json={"archived": True})
    problem(sent(client, patient, poses_csv()), 409, "archived")
    client.patch(f"/api/patients/{patient['id']}", json={"archived": False})


# -- Parquet, and runs ----------------------------------------------------------------------------------------------


def played(client: TestClient, patient: dict[str, Any], recording: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Store a run of the recording: half a second of approach, then the motion, 0.5 deg too high."""
    app: Any = client.app
    visit, key = uuid4(), uuid4()
    now = datetime.now(UTC)
    n = 200
    approach = np.arange(n) < 50
    angles = np.repeat(np.linspace(10, 20, n)[:, None], 5, axis=1)
    columns = {
        "time_s": np.arange(n) / 100,
        "phase": np.where(approach, PHASE_APPROACHING, PHASE_PLAYING),
        "path_s": np.where(approach, np.nan, np.arange(n) / 100 - 0.5),
        "setpoint_deg": angles,
        "measured_deg": angles + 0.5,
        "torque_nm": angles / 10,
    }
    with app.state.services.database.write() as session:
        session.add(SessionRow(id=visit, patient_id=UUID(patient["id"]), station="Room 2", started_at=now, note=""))
        session.flush()
        row = {"started_at": now, "ended_at": now, "outcome": "completed", "rate_hz": 100, "samples": 150}
        session.add(RunRow(id=key, session_id=visit, recording_id=UUID(recording["id"]), **row))
        session.add(RunRow(id=(empty := uuid4()), session_id=visit, recording_id=UUID(recording["id"]), **row))
        session.flush()
        session.add(RunSamplesRow(run_id=key, data=arrays.encode(columns, RUN_COLUMNS)))
    problem(client.get(f"/api/runs/{empty}/samples.csv"), 409, "nothing_played")
    return str(key), columns


def test_run_csv_leaves_unknown_values_empty(client: TestClient, patient: dict[str, Any]) -> None:
    key, columns = played(client, patient, taught(client, patient, lifted()))
    lines = client.get(f"/api/runs/{key}/samples.csv").text.splitlines()
    header = lines[0].split(",")
    assert header[:4] == ["time_s", "phase", "path_s", "wall_s"]
    assert header[4] == "motor_1_setpoint_deg"
    assert header[-1] == "motor_5_torque_nm"
    assert lines[1].split(",")[:4] == ["0.0", "1", "", ""]
    assert [float(cell) for cell in lines[51].split(",")[2:4]] == [columns["path_s"][50]] * 2


def test_run_parquet_is_readable_elsewhere_with_units_and_origin(
    client: TestClient, patient: dict[str, Any], tmp_path: Any
) -> None:
    key, columns = played(client, patient, taught(client, patient, lifted()))
    answer = client.get(f"/api/runs/{key}/samples.parquet")
    assert answer.headers["content-type"] == "application/vnd.apache.parquet"
    file = tmp_path / "run.parquet"
    file.write_bytes(answer.content)

    read = read_parquet(file).read_all()
    assert read["path_s"].null_count == 50
    assert read.schema.field("motor_3_torque_nm").metadata[b"unit"] == b"Nm"

    found = judge_parquet(file)
    metadata = found["metadata"]
    assert (metadata["schema"], metadata["patient_id"]) == ("kata-samples-table/1", patient["id"])
    assert (metadata["station"], metadata["side"], metadata["rate_hz"]) == ("Room 2", "right", "100")
    assert "monotonic clock" in metadata["clock"]
    assert metadata["axis_order"].startswith("motors 1 to 5")
    assert patient["name"] not in json.dumps(found)
    rows = found["columns"]
    assert rows["path_s"][:50] == [None] * 50
    assert rows["path_s"][50:] == pytest.approx(columns["path_s"][50:], abs=1e-6)
    for name, column in (("setpoint_deg", "setpoint"), ("measured_deg", "measured"), ("torque_nm", "torque")):
        unit = name.rpartition("_")[2]
        for motor in (1, 5):
            values = rows[f"motor_{motor}_{column}_{unit}"]
            # With the resolution of each column.
            assert values == pytest.approx(columns[name][:, motor - 1], abs=1.1e-3 if column == "setpoint" else 1e-4)


def test_recording_parquet_equals_its_csv(client: TestClient, patient: dict[str, Any], tmp_path: Any) -> None:
    recording = taught(client, patient, lifted())
    file = tmp_path / "recording.parquet"
    file.write_bytes(client.get(f"/api/recordings/{recording['id']}/samples.parquet").content)
    answer = judge_parquet(file)
    text = client.get(f"/api/recordings/{recording['id']}/samples.csv").text
    assert list(answer["columns"]) == text.splitlines()[0].split(",")
    same = np.array(list(answer["columns"].values())).T
    assert same == pytest.approx(table(text), abs=1e-9)
    assert answer["columns"]["time_s"][-1] == LASTS_S


@pytest.mark.parametrize("kind", ["recordings", "runs"])
def test_mcap_has_the_rows_of_the_csv(client: TestClient, patient: dict[str, Any], kind: str) -> None:
    recording = taught(client, patient, lifted())
    key = recording["id"] if kind == "recordings" else played(client, patient, recording)[0]
    reader = make_reader(io.BytesIO(client.get(f"/api/{kind}/{key}/samples.mcap").content))
    messages = list(reader.iter_messages())
    rows = list(csv.DictReader(io.StringIO(client.get(f"/api/{kind}/{key}/samples.csv").text)))
    found = [json.loads(message.data) for _, _, message in messages]
    assert found == [{name: float(cell) for name, cell in row.items() if cell} for row in rows]

    schema, channel, first = messages[0]
    assert schema is not None
    assert (schema.encoding, channel.message_encoding, channel.topic) == ("jsonschema", "json", kind.removesuffix("s"))
    described = json.loads(schema.data)["properties"]
    assert list(described) == list(rows[0])
    name = "motor_3_deg" if kind == "recordings" else "motor_3_torque_nm"
    assert described[name] == {"type": "number", "description": f"unit: {name.rpartition('_')[2].replace('nm', 'Nm')}"}
    (metadata,) = reader.iter_metadata()
    assert metadata.metadata["patient_id"] == patient["id"]
    begins = datetime.fromisoformat(metadata.metadata["begins_at"])
    assert first.log_time == pytest.approx(begins.timestamp() * 1e9, abs=1000)
    assert messages[-1][2].log_time - first.log_time == round(float(rows[-1]["time_s"]) * 1e9)


LEROBOT_COLUMNS = {
    "observation.state": "fixed_size_list<5> of float32",
    "observation.torque": "fixed_size_list<5> of float32",
    "action": "fixed_size_list<5> of float32",
    "observation.phase": "int64",
    "observation.path_s": "float64",
    "observation.time_s": "float64",
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
"""The last five are LeRobot's ``DEFAULT_FEATURES``. Its loader casts each column to the type that ``meta/info.json`` names."""


def test_run_is_a_lerobot_dataset_with_one_episode(client: TestClient, patient: dict[str, Any], tmp_path: Path) -> None:
    """LeRobot itself is not installed here, because it needs PyTorch. The test checks what LeRobot's loader reads, with two readers of Parquet."""
    key, columns = played(client, patient, taught(client, patient, lifted()))
    answer = client.get(f"/api/runs/{key}/samples.lerobot.zip")
    assert answer.headers["content-type"] == "application/zip"
    with ZipFile(io.BytesIO(answer.content)) as archive:
        archive.extractall(tmp_path)
    assert all(patient["name"].encode() not in path.read_bytes() for path in tmp_path.rglob("*.*"))

    info = json.loads((tmp_path / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["robot_type"]) == ("v3.0", 100, "kata-shoulder-apparatus")
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (1, 200, 1)
    data_path = tmp_path / info["data_path"].format(chunk_index=0, file_index=0)
    data = read_parquet(data_path).read_all()
    assert {name: arrow_type(data.schema.field(name).type) for name in data.schema.names} == LEROBOT_COLUMNS
    described = {
        name: feature["dtype"]
        if feature["shape"] == [1]
        else f"fixed_size_list<{feature['shape'][0]}> of {feature['dtype']}"
        for name, feature in info["features"].items()
    }
    assert described == LEROBOT_COLUMNS
    assert info["features"]["action"]["names"] == [f"motor_{motor}_setpoint_deg" for motor in range(1, 6)]

    rows = judge_parquet(data_path)["columns"]
    for feature, column, close in (
        ("observation.state", "measured_deg", 1e-4),
        ("action", "setpoint_deg", 1.1e-3),
        ("observation.torque", "torque_nm", 1e-4),
    ):
        assert np.array(rows[feature]) == pytest.approx(columns[column], abs=close)
    assert rows["timestamp"] == pytest.approx(np.arange(200) / 100, abs=1e-4)
    assert rows["index"] == rows["frame_index"] == list(range(200))
    assert rows["observation.path_s"][50:] == pytest.approx(columns["path_s"][50:], abs=1e-6)

    stats = json.loads((tmp_path / "meta/stats.json").read_text())
    assert set(stats) == set(LEROBOT_COLUMNS)
    assert stats["observation.state"]["max"] == pytest.approx([20.5] * 5, abs=1e-3)
    assert stats["observation.path_s"]["min"] == [0.0]


def test_lerobot_reads_the_task_as_the_index_of_its_table(
    client: TestClient, patient: dict[str, Any], tmp_path: Path
) -> None:
    key, _ = played(client, patient, taught(client, patient, lifted()))
    with ZipFile(io.BytesIO(client.get(f"/api/runs/{key}/samples.lerobot.zip").content)) as archive:
        archive.extractall(tmp_path)
    tasks = read_parquet(tmp_path / "meta/tasks.parquet").read_all()
    assert json.loads(tasks.schema.metadata[b"pandas"])["index_columns"] == ["task"]
    assert list(tasks["task"].to_pylist()) == ["Move the right arm of a patient along a taught motion"]
    assert list(tasks["task_index"].to_pylist()) == [0]
    episodes = read_parquet(tmp_path / "meta/episodes/chunk-000/file-000.parquet").read_all()
    row = {name: episodes[name].to_pylist()[0] for name in episodes.schema.names if not name.startswith("stats/")}
    assert row == {
        "episode_index": 0, "length": 200, "data/chunk_index": 0, "data/file_index": 0, "dataset_from_index": 0,
        "dataset_to_index": 200, "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0, "tasks": tasks["task"].to_pylist(),
    }  # fmt: skip


def arrow_type(found: DataType) -> str:
    if DataType.is_fixed_size_list(found):
        assert found.value_type is not None
        return f"fixed_size_list<{found.list_size}> of {arrow_type(found.value_type)}"
    names = {"float32": DataType.float32(), "float64": DataType.float64(), "int64": DataType.int64()}
    return next(name for name, known in names.items() if known == found)


def test_damaged_or_missing_samples_are_reported(client: TestClient, patient: dict[str, Any]) -> None:
    recording = taught(client, patient, lifted())
    app: Any = client.app
    with app.state.services.database.write() as session:
        session.get_one(RecordingSamplesRow, UUID(recording["id"])).data = b"damaged"
    for kind in ("csv", "parquet", "mcap"):
        problem(client.get(f"/api/recordings/{recording['id']}/samples.{kind}"), 410, "unreadable_samples")
        problem(client.get(f"/api/recordings/{uuid4()}/samples.{kind}"), 404, "not_found")
    for kind in ("csv", "parquet", "mcap", "lerobot.zip"):
        problem(client.get(f"/api/runs/{uuid4()}/samples.{kind}"), 404, "not_found")
