"""Journals into rows: exactly once, and never lost."""

import base64
import json
import threading
from datetime import UTC, datetime
from pathlib import Path
from uuid import UUID, uuid4

import numpy as np
import pytest
from sqlalchemy import func, select

from kata.clinic import figures
from kata.clinic.importer import Importer, Saved
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.clinic.problems import ProblemError
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow, RecordingSamplesRow, TeachingRow
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.tables import RunRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.device import journal
from kata.device.journal import Files, JournalEnd, JournalHeader, JournalWriter

STARTED = datetime(2026, 11, 21, 9, 0, tzinfo=UTC)


class Clinic:
    """A database with a patient, and journals as a device would leave them."""

    def __init__(self, folder: Path, database: Database) -> None:
        self.folder = folder / "journal"
        self.folder.mkdir()
        self.database = database
        self.saved: list[Saved] = []
        self.importer = Importer(self.database, self.folder, self.saved.append)
        with self.database.write() as session:
            new = PatientCreate(clinic_number="1", name="N", affected_side="right")
            self.patient_id = patients.create(session, new).id

    def begin_teaching(self) -> UUID:
        row = TeachingRow(id=uuid4(), patient_id=self.patient_id, name="Flexion", side="right", started_at=utc_now())
        with self.database.write() as session:
            session.add(row)
        return row.id

    def begin_run(self, recording_id: UUID) -> UUID:
        with self.database.write() as session:
            visit = sessions.begin(session, self.patient_id)
            return sessions.begin_run(session, visit.id, recording_id).id

    def journal(
        self, kind: str, identity: UUID, takes: list[float], *, error_deg: float = 0.0, end: JournalEnd | None = None
    ) -> Path:
        """``takes``: their lengths in seconds; a run has one."""
        header = JournalHeader(
            kind="teaching" if kind == "teaching" else "run",
            id=str(identity), recording_id=None, station="Station 1", rate_hz=100, started_at=STARTED, started_ns=0,
        )  # fmt: skip
        writer = JournalWriter(self.folder, header, Files())
        t_ns = 5_000_000_000
        for take, seconds in enumerate(takes, start=1):
            for n in range(round(seconds * 100) + 1):
                writer.sample(
                    t_ns,
                    take=take,
                    phase=journal.PHASE_PLAYING if kind == "run" else 0,
                    path_s=n / 100,
                    setpoint_deg=[n * 0.1] * 5,
                    measured_deg=[n * 0.1 + error_deg] * 5,
                    torque_nm=[0.0] * 5,
                )
                t_ns += 10_000_000
            t_ns += 1_000_000_000
        if end:
            writer.finish(end)
        writer.write()
        return writer.path

    def count(self, table: type[RecordingRow] | type[RunRow]) -> int:
        with self.database.read() as session:
            return session.scalar(select(func.count()).select_from(table)) or 0

    def recording(self) -> UUID:
        self.journal("teaching", self.begin_teaching(), [2.0], end=JournalEnd(reason="finished"))
        self.importer.run()
        return self.saved[-1].id


@pytest.fixture
def clinic(tmp_path: Path, database: Database) -> Clinic:
    return Clinic(tmp_path, database)


def test_each_take_becomes_a_recording(clinic: Clinic) -> None:
    teaching = clinic.begin_teaching()
    path = clinic.journal("teaching", teaching, [2.0, 0.3, 1.0], end=JournalEnd(reason="finished"))
    clinic.importer.run(path)

    with clinic.database.read() as session:
        rows = recordings.of_patient(session, clinic.patient_id)
        assert [(row.name, row.take) for row in rows] == [("Flexion (3)", 3), ("Flexion", 1)]
        first = rows[1]
        assert (first.side, first.samples, first.rate_hz) == ("right", 201, 100)
        assert first.duration_s == pytest.approx(2.0)
        assert first.taught_at == STARTED.replace(second=5)
        samples = recordings.samples(session, first.id)
        assert samples.times_s[-1] == pytest.approx(2.0)
        assert samples.angles_deg[100] == pytest.approx([10.0] * 5)
    assert [saved.what for saved in clinic.saved] == ["recording", "recording"]
    assert (clinic.folder / "imported" / path.name).exists()


def test_a_journal_found_again_after_a_crash_changes_nothing(clinic: Clinic) -> None:
    path = clinic.journal("teaching", clinic.begin_teaching(), [2.0], end=JournalEnd(reason="finished"))
    kept = path.read_bytes()
    clinic.importer.run()
    path.write_bytes(kept)  # the rows were committed, the file not yet moved
    clinic.importer.run()

    assert clinic.count(RecordingRow) == 1
    assert list(clinic.folder.glob("*.journal")) == []


def test_a_run_is_completed_and_compared(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    clinic.journal("run", run_id, [2.0], error_deg=0.5, end=JournalEnd(reason="completed"))
    clinic.importer.run()

    with clinic.database.read() as session:
        run = sessions.as_run(sessions.get_run(session, run_id))
    assert run.outcome == "completed"
    assert run.comparison is not None
    assert run.comparison.samples == 201
    for motor in run.comparison.motors:
        assert motor.peak_deg == pytest.approx(0.5, abs=1e-3)
        assert motor.rmse_deg == pytest.approx(0.5, abs=1e-3)
        assert motor.start_deg == pytest.approx(0.5, abs=1e-3)
    assert clinic.saved[-1].session_id == run.session_id


def test_a_run_imported_twice_is_compared_once(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    path = clinic.journal("run", run_id, [2.0], error_deg=0.5, end=JournalEnd(reason="completed"))
    kept = path.read_bytes()
    clinic.importer.run()
    path.write_bytes(kept)
    clinic.importer.run()
    with clinic.database.read() as session:
        assert len(sessions.get_run(session, run_id).tracking) == 5
    assert list(clinic.folder.glob("*.journal")) == []


def test_a_stopped_run_keeps_its_cause(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    end = JournalEnd(reason="stopped", cause_code="estop_pressed", cause_message="The emergency stop was pressed.")
    clinic.journal("run", run_id, [1.0], end=end)
    clinic.importer.run()
    with clinic.database.read() as session:
        run = sessions.as_run(sessions.get_run(session, run_id))
    assert run.outcome == "stopped"
    assert run.stop is not None
    assert run.stop.code == "estop_pressed"


def test_a_run_whose_process_died_is_interrupted_and_keeps_what_it_measured(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    path = clinic.journal("run", run_id, [1.0])
    path.write_bytes(path.read_bytes()[:-30])
    clinic.importer.run_at_start()
    with clinic.database.read() as session:
        run = sessions.as_run(sessions.get_run(session, run_id))
    assert run.outcome == "interrupted"
    assert run.comparison is not None
    assert run.comparison.samples == 100


def test_a_journal_that_a_last_device_process_still_writes_is_waited_for(clinic: Clinic) -> None:
    """A service that was killed and is started again at once finds the old device process on its ramp."""
    run_id = clinic.begin_run(clinic.recording())
    path = clinic.journal("run", run_id, [1.0], end=JournalEnd(reason="stopped", cause_code="service_silent"))
    whole = path.read_bytes()
    path.write_bytes(whole[:-30])
    holding, may_end = threading.Event(), threading.Event()

    def end_it() -> None:
        with journal.claimed(clinic.folder, 0.0):
            holding.set()
            may_end.wait(10)
            path.write_bytes(whole)

    device = threading.Thread(target=end_it)
    device.start()
    assert holding.wait(10)
    starting = threading.Thread(target=clinic.importer.run_at_start)
    starting.start()
    starting.join(0.2)
    assert starting.is_alive()
    may_end.set()
    starting.join(10)
    device.join(10)
    with clinic.database.read() as session:
        assert sessions.get_run(session, run_id).outcome == "stopped"


def test_a_folder_that_another_kata_uses_is_left_alone(clinic: Clinic, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kata.clinic.importer._LAST_DEVICE_S", 0.0)
    run_id = clinic.begin_run(clinic.recording())
    with journal.claimed(clinic.folder, 0.0), pytest.raises(journal.FolderInUseError):
        clinic.importer.run_at_start()
    with clinic.database.read() as session:
        assert sessions.get_run(session, run_id).ended_at is None


def test_a_run_without_any_journal_is_interrupted_at_the_next_start(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    clinic.importer.run_at_start()
    with clinic.database.read() as session:
        assert sessions.get_run(session, run_id).outcome == "interrupted"


def test_what_cannot_be_read_or_belongs_to_nobody_is_kept_aside(clinic: Clinic) -> None:
    (clinic.folder / "run-broken.journal").write_bytes(b"\0" * 100)
    stranger = clinic.journal("teaching", uuid4(), [1.0], end=JournalEnd(reason="finished"))
    clinic.importer.run()

    kept = {path.name for path in (clinic.folder / "unreadable").iterdir()}
    assert kept == {"run-broken.journal", stranger.name}
    assert clinic.saved == []


@pytest.mark.parametrize("left", [b"", b'{"format":"kata-journal/2","kind":"r', b"\0" * 4096])
def test_a_journal_of_which_not_even_the_header_reached_the_disk_says_that_nothing_was_measured(
    clinic: Clinic, left: bytes
) -> None:
    """At once, not only at the next start: the session could not be ended otherwise."""
    run_id = clinic.begin_run(clinic.recording())
    other_id = clinic.begin_run(clinic.saved[-1].id)
    names = {f"run-{run_id}.journal", f"teaching-{clinic.begin_teaching()}.journal"}
    for name in names:
        (clinic.folder / name).write_bytes(left)
    clinic.importer.run()
    clinic.importer.run()

    with clinic.database.read() as session:
        run = sessions.as_run(sessions.get_run(session, run_id))
        assert sessions.get_run(session, other_id).outcome == "loaded"
    assert (run.outcome, run.comparison) == ("interrupted", None)
    assert run.ended_at is not None
    assert clinic.count(RecordingRow) == 1
    assert {path.name for path in (clinic.folder / "unreadable").iterdir()} == names


def test_one_journal_that_fails_does_not_keep_the_next_from_it(clinic: Clinic, monkeypatch: pytest.MonkeyPatch) -> None:
    bad = clinic.journal("run", clinic.begin_run(clinic.recording()), [1.0])
    clinic.journal("teaching", clinic.begin_teaching(), [1.0], end=JournalEnd(reason="finished"))

    def full_disk(*_: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(sessions, "keep_run", full_disk)
    clinic.importer.run()
    assert clinic.count(RecordingRow) == 2
    assert bad.exists()


def test_a_damaged_recording_is_told_and_does_not_break_the_list(clinic: Clinic) -> None:
    recording_id = clinic.recording()
    with clinic.database.write() as session:
        session.get_one(RecordingSamplesRow, recording_id).data = b"damaged"
    with clinic.database.read() as session:
        assert len(recordings.of_patient(session, clinic.patient_id)) == 1
        with pytest.raises(ProblemError) as caught:
            recordings.samples(session, recording_id)
    assert caught.value.code == "unreadable_samples"


def test_the_figure_has_angles_on_the_left_and_the_error_on_the_right(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    clinic.journal("run", run_id, [2.0], error_deg=-0.5, end=JournalEnd(reason="completed"))
    clinic.importer.run()
    worker = figures.FigureWorker()
    try:
        with clinic.database.read() as session:
            blobs = sessions.figure_blobs(session, run_id)
        told = json.loads(worker.build(figures.run, *blobs))
        with pytest.raises(ProblemError) as caught:
            worker.build(figures.run, b"damaged", blobs[1])
    finally:
        worker.close()
    assert caught.value.status == 410
    assert [one["motor"] for one in told["motors"]] == [1, 2, 3, 4, 5]
    figure = told["motors"][2]["figure"]
    assert [(trace["name"], trace.get("yaxis", "y")) for trace in figure["data"]] == [
        ("Teaching", "y"),
        ("Playback", "y"),
        ("Error", "y2"),
    ]
    assert figure["layout"]["yaxis2"]["side"] == "right"
    assert "deg" in figure["layout"]["yaxis"]["title"]["text"]
    encoded = figure["data"][2]["y"]
    error = np.frombuffer(base64.b64decode(encoded["bdata"]), dtype=encoded["dtype"])
    assert error == pytest.approx(-0.5, abs=1e-3)
