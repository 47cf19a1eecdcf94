"""Series in blocks: which blocks a window reads, and which samples a damaged block affects."""

import json
from uuid import UUID, uuid4

import numpy as np
import pytest
from sqlalchemy import delete, event, select

from kata.clinic.patients.tables import PatientRow
from kata.clinic.recordings.tables import (
    RECORDING_COLUMNS,
    RECORDING_SAMPLES,
    RecordingRow,
    RecordingSampleBlockRow,
    RecordingSamplesRow,
    TeachingRow,
)
from kata.database.arrays import Floats, UnreadableError, encode
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.database.series import BLOCK_SAMPLES, Series, numbers_within, pack, unpack, unpack_within

COUNT = 3 * BLOCK_SAMPLES + 100
WINDOW = ("time_s", 70.0, 80.0)


def taught(count: int = COUNT) -> dict[str, Floats]:
    time_s = np.arange(count) * 0.01
    return {"time_s": time_s, "angle_deg": np.rint(500 * np.sin(time_s[:, None] * np.arange(1, 6))) * 360 / 4096}


@pytest.fixture(scope="module")
def series() -> Series:
    return pack(taught(), RECORDING_COLUMNS)


def test_series_is_restored_whole_with_its_description(series: Series) -> None:
    assert len(series.blocks) == 4
    back = unpack(series)
    for name, values in taught().items():
        assert back[name] == pytest.approx(values, abs=0.5001e-4)
    head = json.loads(series.head[:-4])
    assert (head["samples"], head["rate_hz"]) == (COUNT, 100.0)
    assert "monotonic" in head["clock"]
    assert [(column["name"], column["unit"], column["axes"]) for column in head["columns"]] == [
        ("time_s", "s", None),
        ("angle_deg", "deg", [1, 2, 3, 4, 5]),
    ]


@pytest.mark.parametrize("count", [0, 1, 2, BLOCK_SAMPLES, BLOCK_SAMPLES + 1])
def test_series_of_any_length_is_stored(count: int) -> None:
    back = unpack(pack(taught(count), RECORDING_COLUMNS))
    assert {name: values.shape for name, values in back.items()} == {"time_s": (count,), "angle_deg": (count, 5)}


def test_window_reads_only_the_blocks_that_cover_it(series: Series) -> None:
    assert numbers_within(series.head, *WINDOW) == [1]
    assert numbers_within(series.head, "time_s", 59.0, 61.0) == [0, 1]
    assert numbers_within(series.head, "time_s", 1000.0, 1001.0) == []
    some = Series(series.head, {1: series.blocks[1]})
    back = unpack_within(some, *WINDOW)
    assert (back["time_s"][0], back["time_s"][-1], len(back["angle_deg"])) == (
        pytest.approx(70.0),
        pytest.approx(80.0),
        1001,
    )
    assert unpack_within(series, "time_s", 1000.0, 1001.0)["angle_deg"].shape == (0, 5)
    with pytest.raises(UnreadableError):
        unpack(some)


def test_damage_affects_one_block_and_is_never_hidden(series: Series) -> None:
    damaged = bytearray(series.blocks[2])
    damaged[len(damaged) // 2] ^= 1
    for blocks in (
        dict(series.blocks) | {2: bytes(damaged)},
        dict(series.blocks) | {2: b""},
        # Given: an intact block of another series.
        dict(series.blocks) | {2: series.blocks[1]},
    ):
        hurt = Series(series.head, blocks)
        with pytest.raises(UnreadableError):
            unpack(hurt)
        with pytest.raises(UnreadableError):
            unpack_within(hurt, "time_s", 120.0, 130.0)
        assert len(unpack_within(hurt, *WINDOW)["time_s"]) == 1001


def test_damaged_head_is_detected_wherever_it_is_damaged(series: Series) -> None:
    for place in range(0, len(series.head), 3):
        head = series.head[:place] + bytes([series.head[place] ^ 0x10]) + series.head[place + 1 :]
        with pytest.raises(UnreadableError):
            unpack(Series(head, series.blocks))
    with pytest.raises(UnreadableError):
        unpack(Series(b""))


def test_series_stored_in_one_piece_is_read_unchanged() -> None:
    before = Series(encode(taught(1000), RECORDING_COLUMNS))
    assert numbers_within(before.head, *WINDOW) == []
    assert len(unpack(before)["time_s"]) == 1000
    assert len(unpack_within(before, "time_s", 1.0, 2.0)["time_s"]) == 101


def test_a_window_loads_nothing_of_the_rest(database: Database, series: Series) -> None:
    key = keep(database, series)

    with database.read() as session:
        some = RECORDING_SAMPLES.read_within(session, key, *WINDOW)
        assert list(some.blocks) == [1]
        assert len(unpack_within(some, *WINDOW)["time_s"]) == 1001
        assert list(RECORDING_SAMPLES.read(session, key).blocks) == [0, 1, 2, 3]
        assert RECORDING_SAMPLES.read_overview(session, key) == b"overview"


def test_overview_loads_only_when_requested(database: Database, series: Series) -> None:
    key = keep(database, series)
    answer: list[str] = []
    event.listen(database.reader, "before_cursor_execute", lambda *of: answer.append(of[2]))
    with database.read() as session:
        RECORDING_SAMPLES.read(session, key)
    assert answer
    assert not [statement for statement in answer if "overview" in statement]


def test_missing_samples_cannot_be_read(database: Database) -> None:
    with database.read() as session:
        for found in (
            RECORDING_SAMPLES.read(session, uuid4()),
            RECORDING_SAMPLES.read_within(session, uuid4(), *WINDOW),
        ):
            with pytest.raises(UnreadableError):
                unpack(found)
        assert RECORDING_SAMPLES.read_overview(session, uuid4()) is None


def test_blocks_are_deleted_with_their_owner(database: Database, series: Series) -> None:
    key = keep(database, series)
    with database.write() as session:
        session.execute(delete(RecordingSamplesRow).where(RecordingSamplesRow.recording_id == key))
        assert session.scalars(select(RecordingSampleBlockRow)).all() == []


def keep(database: Database, series: Series) -> UUID:
    now = utc_now()
    fields = {"name": "N", "side": "left"}
    with database.write() as session:
        patient = PatientRow(
            id=uuid4(), clinic_number="1", name="N", sex="unknown", notes="", created_at=now, updated_at=now
        )
        session.add(patient)
        session.flush()
        session.add(teaching := TeachingRow(id=uuid4(), patient_id=patient.id, started_at=now, **fields))
        session.flush()
        recording = RecordingRow(
            id=uuid4(), patient_id=patient.id, teaching_id=teaching.id, take=1, station="S", taught_at=now,
            duration_s=1.0, rate_hz=100, samples=101, note="", archived_at=None, **fields,
        )  # fmt: skip
        session.add(recording)
        session.flush()
        RECORDING_SAMPLES.store(session, recording.id, series, b"overview")
        return recording.id
