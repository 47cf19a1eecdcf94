"""Journals into rows: exactly once, and never lost."""

import base64
import json
import subprocess
import sys
import threading
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

import numpy as np
import pytest
from numpy.typing import NDArray

from kata.clinic.importer import Importer
from kata.clinic.programmes import service as programmes
from kata.clinic.programmes.schemas import ProgrammeCreate, ProgrammeItemRequest
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow, RecordingSampleBlockRow, RecordingSamplesRow
from kata.clinic.sessions import lists, runs, stored_corrections
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.lists import SessionFilter
from kata.clinic.sessions.run_results import calculate
from kata.clinic.sessions.schemas import EndRangePrescription
from kata.clinic.sessions.tables import RunCorrectionRow, SessionRow
from kata.database.availability import DatabaseUnavailableError
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.database.series import Series
from kata.device import journal
from kata.device.config import StationConfig
from kata.device.journal import JournalEnd
from kata.errors import ProblemError
from kata.motion.arm_load import ArmLoad
from kata.motion.edit import AS_TAUGHT, PlaybackSettings
from kata.motion.ilc import Correction
from kata.motion.method import Method
from kata.plotting import figures
from tests.support.databases import SQLITE_FIRST
from tests.support.figure_worker import SharedFigureWorker, calculate_or_die
from tests.support.imported_runs import STARTED, Clinic, pose
from tests.support.paths import ROOT


@pytest.fixture
def clinic(tmp_path: Path, database: Database) -> Clinic:
    return Clinic(tmp_path, database)


def test_each_take_becomes_a_recording(clinic: Clinic) -> None:
    teaching = clinic.begin_teaching()
    path = clinic.journal("teaching", teaching, [2.0, 0.3, 1.0], end=JournalEnd(reason="finished"))
    clinic.importer.run(path)

    with clinic.database.read() as session:
        rows, _ = recordings.of_patient(session, clinic.patient_id, 10, None)
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


@SQLITE_FIRST
def test_a_journal_found_again_after_a_crash_changes_nothing(clinic: Clinic) -> None:
    path = clinic.journal("teaching", clinic.begin_teaching(), [2.0], end=JournalEnd(reason="finished"))
    original = path.read_bytes()
    clinic.importer.run()
    path.write_bytes(original)  # the rows were committed, the file not yet moved
    clinic.importer.run()

    assert clinic.count(RecordingRow) == 1
    assert list(clinic.folder.glob("*.journal")) == []


@SQLITE_FIRST
def test_a_run_is_completed_and_compared(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    clinic.journal("run", run_id, [2.0], error_deg=0.5, end=JournalEnd(reason="completed"))
    clinic.importer.run()

    with clinic.database.read() as session:
        run = runs.as_run(runs.get(session, run_id))
    assert run.outcome == "completed"
    assert run.comparison is not None
    assert run.comparison.samples == 201
    for motor in run.comparison.motors:
        assert motor.peak_deg == pytest.approx(0.5, abs=1e-3)
        assert motor.rmse_deg == pytest.approx(0.5, abs=1e-3)
        assert motor.start_deg == pytest.approx(0.5, abs=1e-3)
    assert clinic.saved[-1].session_id == run.session_id


# Where the results are calculated does not depend on the database.
@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
# A worker that was killed once is replaced by one that is never killed.
@pytest.mark.parametrize("broken", [1, *(pytest.param(broken, marks=pytest.mark.campaign) for broken in (0, 2))])
def test_the_figure_worker_calculates_the_same_results(
    clinic: Clinic, broken: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Given a worker that is killed never, once or twice: the run waits in the last case, and otherwise its results are the same."""
    recording_id = clinic.recording(4.0, pose)
    asked = PlaybackSettings(speed_percent=80.0, repetitions=2, pause_s=0.5, range_percent=90.0)

    def play() -> UUID:
        run_id = clinic.begin_run(recording_id, asked, "learned")
        clinic.journal("run", run_id, [4.0], at=pose, error_deg=0.5, end=JournalEnd(reason="completed"))
        return run_id

    def results(run_id: UUID) -> dict[str, Any]:
        with clinic.database.read() as session:
            run = runs.as_run(runs.get(session, run_id)).model_dump()
            correction = stored_corrections.correction(session, run_id)
        assert correction is not None
        return {name: value for name, value in run.items() if name not in ("id", "session_id", "started_at")} | {
            "correction": correction.angles_deg.tolist()
        }

    first, second = play(), play()
    paths = {run_id: clinic.folder / f"run-{run_id}{journal.SUFFIX}" for run_id in (first, second)}
    clinic.importer.run(paths[first])
    worker = clinic.importer.worker = figures.FigureWorker()

    monkeypatch.setattr(
        "kata.clinic.importer.calculate", partial(calculate_or_die, calculate, clinic.folder / "deaths", broken)
    )
    try:
        clinic.importer.run(paths[second])
        if broken == 2:
            assert (clinic.importer.waiting, paths[second].exists()) == (1, True)
            clinic.importer.run_due()
    finally:
        worker.close()
    assert (clinic.importer.waiting, paths[second].exists()) == (0, False)
    assert results(second) == results(first)


@pytest.mark.campaign
def test_a_process_with_a_worker_imports_a_run_without_scipy(tmp_path: Path) -> None:
    """The service must answer a Stop. To import scipy would delay its answer, and would cost it 55 MB."""
    program = """
import sys
from pathlib import Path
from kata.database.engine import Database
from kata.device.journal import JournalEnd
from kata.motion.edit import PlaybackSettings
from kata.plotting.figures import FigureWorker
from tests.support.databases import upgraded_file
from tests.support.figure_worker import SharedFigureWorker, calculate_or_die
from tests.support.imported_runs import Clinic, pose

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    clinic = Clinic(folder, Database(upgraded_file(folder / "kata.db")))
    recording_id = clinic.recording(4.0, pose)
    run_id = clinic.begin_run(recording_id, PlaybackSettings(repetitions=2), "learned")
    clinic.journal("run", run_id, [4.0], at=pose, end=JournalEnd(reason="completed"))
    scipy = [name for name in sys.modules if name.startswith("scipy")]
    assert not scipy, f"imported before the run: {scipy}"
    clinic.importer.worker = FigureWorker()
    clinic.importer.run()
    clinic.importer.worker.close()
    print(clinic.saved[-1].id == run_id, [name for name in sys.modules if name.startswith("scipy")])
"""
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.stdout.strip() == "True []", done.stderr


@SQLITE_FIRST
def test_end_range_time_is_stored_if_the_load_is_known(clinic: Clinic) -> None:
    weightless = StationConfig(arm=ArmLoad(inertia=(1e-6,) + (0.0,) * 9))
    clinic.journal("teaching", clinic.begin_teaching(), [4.0], at=pose, end=JournalEnd(reason="finished"))
    clinic.importer.run()
    recording_id, found = clinic.saved[-1].id, []
    for config in (weightless, StationConfig()):
        run_id = clinic.begin_run(recording_id)
        clinic.journal(
            "run", run_id, [4.0], at=pose, torque_nm=lambda time_s: [0.0, 0.0, 2.0 if 1.5 < time_s < 2.5 else 0.0, 0.0, 0.0],
            end=JournalEnd(reason="completed"),
        )  # fmt: skip
        Importer(clinic.database, clinic.folder, config, clinic.saved.append).run()
        with clinic.database.read() as session:
            run = runs.as_run(runs.get(session, run_id))
        assert run.comparison is not None
        found.append({motion.motion: motion.end_range_s for motion in run.comparison.motions})
    # From 80 to 90 deg and back.
    near_s = 4 / np.pi * np.arccos(0.75)
    assert found == [{2: None, 4: pytest.approx(near_s, abs=0.03)}, {2: None, 4: None}]


def test_prescribed_band_and_torque_are_counted_and_stored(clinic: Clinic) -> None:
    weightless = StationConfig(arm=ArmLoad(inertia=(1e-6,) + (0.0,) * 9))
    recording_id = clinic.recording(4.0, pose)
    item = ProgrammeItemRequest(
        recording_id=recording_id, resistance_level=8,
        end_range=EndRangePrescription(motion=4, minutes=5.0, band_deg=5.0, torque_nm=1.5),
    )  # fmt: skip
    with clinic.database.write() as session:
        wanted = ProgrammeCreate(name="Morning", made_by="Aoki", items=[item])
        version = programmes.create(session, clinic.patient_id, wanted, [4.0]).versions[0]
        visit = sessions.begin(session, clinic.patient_id, station="Station 1")
        visit.programme_version = version
        session.flush()
        planned_run, other_run = (
            runs.begin(session, runs.RunRequest(visit.id, recording_id, programme_position=position), "Station 1").id
            for position in (1, None)
        )
    found: list[tuple[Any, ...]] = []
    for run_id in (planned_run, other_run):
        clinic.journal(
            "run", run_id, [4.0], at=pose, torque_nm=lambda time_s: [0.0, 0.0, 2.0 if 1.5 < time_s < 2.5 else 0.0, 0.0, 0.0],
            end=JournalEnd(reason="completed"),
        )  # fmt: skip
        Importer(clinic.database, clinic.folder, weightless, clinic.saved.append).run()
        with clinic.database.read() as session:
            [_, motion] = runs.get(session, run_id).motions
            found.append((motion.end_range_s, motion.end_range_band_deg, motion.end_range_torque_nm))
    # From 85 deg to 90 deg and back, and from 80 deg outside the programme.
    assert found == [
        (pytest.approx(4 / np.pi * np.arccos(0.875), abs=0.03), 5.0, 1.5),
        (pytest.approx(4 / np.pi * np.arccos(0.75), abs=0.03), 10.0, 0.5),
    ]


@SQLITE_FIRST
def test_run_is_compared_with_body_motions_and_table_2(clinic: Clinic) -> None:
    finished = JournalEnd(reason="finished")
    clinic.journal("teaching", clinic.begin_teaching(), [4.0], at=pose, end=finished)
    clinic.importer.run()
    run_id = clinic.begin_run(clinic.saved[-1].id)
    clinic.journal(
        "run", run_id, [4.0], at=lambda time_s: pose(time_s - 0.05), torque_nm=[0.0, 0.0, -2.5, 0.0, 0.0],
        end=JournalEnd(reason="completed"),
    )  # fmt: skip
    clinic.importer.run()

    with clinic.database.read() as session:
        run = runs.as_run(runs.get(session, run_id))
    assert run.comparison is not None
    third = run.comparison.motors[2]
    assert third.lag_ms == pytest.approx(50.0, abs=1.0)
    assert third.torque_peak_nm == -2.5
    assert (third.taught_min_deg, third.taught_max_deg) == pytest.approx((10.0, 90.0), abs=1e-3)
    assert (third.played_min_deg, third.played_max_deg) == pytest.approx((10.0, 90.0), abs=0.2)
    assert third.played_smoothness == pytest.approx(third.taught_smoothness, abs=0.05)
    assert run.comparison.motors[4].lag_ms is None
    scapula, arm = run.comparison.motions
    assert (scapula.motion, arm.motion) == (2, 4)
    assert arm.name == "Abduction / adduction of the shoulder"
    assert (arm.apparatus_max_deg, arm.reference_max_deg) == (120.0, 180.0)
    assert (arm.peak_deg, arm.lag_ms) == pytest.approx((third.peak_deg, third.lag_ms))
    # A right shoulder was taught, so psi has the sign of the pose.
    assert (scapula.taught_min_deg, scapula.taught_max_deg) == pytest.approx((0.0, 10.0), abs=1e-3)


@SQLITE_FIRST
def test_run_is_compared_with_its_requested_motion(clinic: Clinic) -> None:
    asked = PlaybackSettings(speed_percent=50.0, repetitions=2, pause_s=1.0, range_percent=80.0)
    run_id = clinic.begin_run(clinic.recording(), asked)
    with clinic.database.read() as session:
        motion = runs.motion_of(session, runs.get(session, run_id))
    # 20 deg at 10 deg/s: at half the speed twice as long, and the ends in full motion are eased by 0.2 s each; between
    # the repetitions a pause, the way back of 16 deg, a pause.
    way_s = 1.875 * 16 / 15
    assert motion.duration_s == pytest.approx(2 * (4.0 + 0.4) + way_s + 2 * 1.0, abs=1e-3)
    clinic.journal(
        "run", run_id, [motion.duration_s], error_deg=0.5, end=JournalEnd(reason="completed"),
        at=lambda time_s: motion.at(np.array([time_s]))[0].tolist(),
    )  # fmt: skip
    clinic.importer.run()

    with clinic.database.read() as session:
        run = runs.as_run(runs.get(session, run_id))
        parts = runs.figure_samples(session, run_id)
    assert (run.speed_percent, run.repetitions, run.pause_s, run.range_percent) == (50.0, 2, 1.0, 80.0)
    assert run.comparison is not None
    # No pose of the scapula has these angles of motors 1 and 2. They are compared nevertheless.
    assert run.comparison.motions == []
    for motor in run.comparison.motors:
        assert motor.peak_deg == pytest.approx(0.5, abs=0.01)
        assert motor.lag_ms == pytest.approx(0.0, abs=1.0)
        assert (motor.taught_min_deg, motor.taught_max_deg) == pytest.approx((0.0, 16.0), abs=1e-3)
    run_figures = json.loads(figures.run(parts))
    assert trace(run_figures, motor=1, name="Requested").max() == pytest.approx(16.0, abs=0.01)
    assert trace(run_figures, motor=1, name="Error") == pytest.approx(0.5, abs=0.01)


@SQLITE_FIRST
def test_learned_run_teaches_only_the_next_of_its_kind(clinic: Clinic) -> None:
    """Each run falls short by a degree, so the correction grows by what the previous run has taught."""
    clinic.journal("teaching", clinic.begin_teaching(), [4.0], at=pose, end=JournalEnd(reason="finished"))
    clinic.importer.run()
    recording_id = clinic.saved[-1].id

    def play(asked: PlaybackSettings = AS_TAUGHT, method: Method = "learned", reason: Any = "completed") -> UUID:
        run_id = clinic.begin_run(recording_id, asked, method)
        clinic.journal("run", run_id, [4.0], at=pose, error_deg=-1.0, end=JournalEnd(reason=reason))
        clinic.importer.run()
        return run_id

    def learning_of(run_id: UUID) -> tuple[UUID | None, Correction | None, Correction | None]:
        with clinic.database.read() as session:
            row = runs.get(session, run_id)
            assert runs.as_run(row).method == row.method
            return (
                row.corrected_by,
                stored_corrections.correction(session, row.corrected_by),
                stored_corrections.correction(session, row.id),
            )

    play(method="smooth")
    first = play()
    assert learning_of(first)[:2] == (None, None)
    taught = learning_of(first)[2]
    assert taught is not None
    middle = len(taught.angles_deg) // 2
    # Motor 3 is in the middle of its range there. Its error was a degree.
    assert 0.3 < taught.angles_deg[middle, 2] < 1.0

    # The run's row contains the size of its correction, because a chart shows hundreds of runs.
    def size(run_id: UUID) -> float | None:
        with clinic.database.read() as session:
            return runs.get(session, run_id).learned_rms_deg

    assert size(first) == pytest.approx(np.sqrt(np.mean(taught.angles_deg**2, axis=0)).max(), abs=1e-5)
    assert size(play(method="smooth")) is None

    # No correction is learned from an incomplete run, and none is used at another speed or with another method.
    assert learning_of(play(reason="returned"))[2] is None
    assert learning_of(play(PlaybackSettings(speed_percent=90.0)))[0] is None
    assert learning_of(play(method="smooth"))[0] is None

    second = play()
    before, used, more = learning_of(second)
    assert before == first
    assert used is not None
    assert np.array_equal(used.angles_deg, taught.angles_deg)
    assert more is not None
    assert more.angles_deg[middle, 2] > used.angles_deg[middle, 2] + 0.3
    assert learning_of(clinic.begin_run(recording_id, method="learned"))[0] == second


@SQLITE_FIRST
def test_damaged_correction_is_learned_again(clinic: Clinic) -> None:
    clinic.journal("teaching", clinic.begin_teaching(), [4.0], at=pose, end=JournalEnd(reason="finished"))
    clinic.importer.run()
    recording_id = clinic.saved[-1].id
    run_id = clinic.begin_run(recording_id, method="learned")
    clinic.journal("run", run_id, [4.0], at=pose, error_deg=-1.0, end=JournalEnd(reason="completed"))
    clinic.importer.run()
    with clinic.database.write() as session:
        session.get_one(RunCorrectionRow, run_id).data = b"damaged"
    with clinic.database.read() as session:
        assert stored_corrections.correction(session, run_id) is None


@SQLITE_FIRST
def test_playback_that_lasts_too_long_is_refused(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording(), PlaybackSettings(speed_percent=10.0, repetitions=200))
    with clinic.database.read() as session, pytest.raises(ProblemError) as caught:
        runs.motion_of(session, runs.get(session, run_id))
    assert (caught.value.status, caught.value.code) == (422, "unplayable")
    assert "longer than an hour" in str(caught.value)


def trace(run_figures: dict[str, Any], *, motor: int, name: str) -> NDArray[np.float64]:
    """Return the values of one line of one motor's figure."""
    lines = run_figures["motors"][motor - 1]["figure"]["data"]
    return numbers(next(line["y"] for line in lines if line["name"] == name))


def numbers(encoded: dict[str, str]) -> NDArray[np.float64]:
    return np.frombuffer(base64.b64decode(encoded["bdata"]), dtype=encoded["dtype"]).astype(np.float64)


def test_long_recording_is_saved_with_an_overview_for_plotting(clinic: Clinic, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kata.plotting.downsampling.BLOCK_SAMPLES", 100)
    recording_id = clinic.recording()
    run_id = clinic.begin_run(recording_id)
    clinic.journal("run", run_id, [2.0], error_deg=0.5, end=JournalEnd(reason="completed"))
    clinic.importer.run()
    with clinic.database.read() as session:
        seen = runs.figure_samples(session, run_id)
        closer = runs.figure_samples(session, run_id, (0.5, 1.0))
        taught = recordings.figure_samples(session, recording_id, None)
        taught_closer = recordings.figure_samples(session, recording_id, (0.5, 1.0))
        assert len(runs.samples(session, run_id)["time_s"]) == 201
    assert (seen.played, taught.taught, closer.downsampled, taught_closer.downsampled) == (None, None, None, None)
    assert trace(json.loads(figures.run(seen)), motor=3, name="Error") == pytest.approx(0.5, abs=2e-3)
    assert len(trace(json.loads(figures.run(closer)), motor=3, name="Error")) == 51
    drawn = [json.loads(figures.recording(parts))["data"][0] for parts in (taught, taught_closer)]
    assert [len(numbers(line["y"])) for line in drawn] == [201, 51]


@SQLITE_FIRST
def test_a_run_imported_twice_is_compared_once(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    path = clinic.journal("run", run_id, [2.0], error_deg=0.5, end=JournalEnd(reason="completed"))
    original = path.read_bytes()
    clinic.importer.run()
    path.write_bytes(original)
    clinic.importer.run()
    with clinic.database.read() as session:
        assert len(runs.get(session, run_id).tracking) == 5
    assert list(clinic.folder.glob("*.journal")) == []


@SQLITE_FIRST
def test_stopped_run_keeps_its_cause(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    end = JournalEnd(reason="stopped", cause_code="estop_pressed", cause_message="The emergency stop was pressed.")
    clinic.journal("run", run_id, [1.0], end=end)
    clinic.importer.run()
    with clinic.database.read() as session:
        run = runs.as_run(runs.get(session, run_id))
    assert run.outcome == "stopped"
    assert run.stop is not None
    assert run.stop.code == "estop_pressed"


def test_stopped_run_is_found_by_its_cause_and_session(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    end = JournalEnd(reason="stopped", cause_code="estop_pressed", cause_message="The emergency stop was pressed.")
    clinic.journal("run", run_id, [1.0], end=end)
    clinic.importer.run()

    def found(therapist: str) -> list[UUID]:
        with clinic.database.read() as session:
            return [
                row.id
                for row in lists.find(session, SessionFilter(stop="estop_pressed", therapist=therapist), 2, None)[0]
            ]

    with clinic.database.read() as session:
        visit = session.get_one(SessionRow, runs.get(session, run_id).session_id)
    assert (found("Sato"), found("Ito")) == ([], [])
    # The therapist is named once, during the session.
    for therapist in ("Sato", "Ito"):
        with clinic.database.write() as session:
            sessions.begin(session, visit.patient_id, therapist)
    assert (found("Sato"), found("Ito")) == ([visit.id], [])


@SQLITE_FIRST
def test_run_of_a_dead_process_is_interrupted_with_its_samples(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    path = clinic.journal("run", run_id, [1.0])
    path.write_bytes(path.read_bytes()[:-30])
    clinic.importer.run_at_start()
    with clinic.database.read() as session:
        run = runs.as_run(runs.get(session, run_id))
    assert run.outcome == "interrupted"
    assert run.comparison is not None
    assert run.comparison.samples == 100


@SQLITE_FIRST
def test_journal_still_being_written_is_waited_for(clinic: Clinic) -> None:
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
        assert runs.get(session, run_id).outcome == "stopped"


@SQLITE_FIRST
def test_folder_used_by_another_process_is_left_alone(clinic: Clinic, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kata.clinic.importer._JOURNAL_LOCK_LIMIT_S", 0.0)
    run_id = clinic.begin_run(clinic.recording())
    with journal.claimed(clinic.folder, 0.0), pytest.raises(journal.FolderInUseError):
        clinic.importer.run_at_start()
    with clinic.database.read() as session:
        assert runs.get(session, run_id).ended_at is None


@SQLITE_FIRST
def test_run_without_a_journal_is_interrupted_at_next_start(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    clinic.importer.run_at_start()
    with clinic.database.read() as session:
        assert runs.get(session, run_id).outcome == "interrupted"


@SQLITE_FIRST
def test_unreadable_or_unknown_journals_are_set_aside(clinic: Clinic) -> None:
    (clinic.folder / "run-broken.journal").write_bytes(b"\0" * 100)
    stranger = clinic.journal("teaching", uuid4(), [1.0], end=JournalEnd(reason="finished"))
    clinic.importer.run()

    unreadable = {path.name for path in (clinic.folder / "unreadable").iterdir()}
    assert unreadable == {"run-broken.journal", stranger.name}
    assert clinic.saved == []


@SQLITE_FIRST
@pytest.mark.parametrize("left", [b"", b'{"format":"kata-journal/2","kind":"r', b"\0" * 4096])
def test_journal_without_a_header_reports_that_nothing_was_measured(clinic: Clinic, left: bytes) -> None:
    """The run ends at once, not only at the next start, because otherwise the session could not be ended."""
    run_id = clinic.begin_run(clinic.recording())
    other_id = clinic.begin_run(clinic.saved[-1].id)
    names = {f"run-{run_id}.journal", f"teaching-{clinic.begin_teaching()}.journal"}
    for name in names:
        (clinic.folder / name).write_bytes(left)
    clinic.importer.run()
    clinic.importer.run()

    with clinic.database.read() as session:
        run = runs.as_run(runs.get(session, run_id))
        assert runs.get(session, other_id).outcome == "loaded"
    assert (run.outcome, run.comparison) == ("interrupted", None)
    assert run.ended_at is not None
    assert clinic.count(RecordingRow) == 1
    assert {path.name for path in (clinic.folder / "unreadable").iterdir()} == names


@SQLITE_FIRST
def test_failed_journal_does_not_block_the_next_one(clinic: Clinic, monkeypatch: pytest.MonkeyPatch) -> None:
    bad = clinic.journal("run", clinic.begin_run(clinic.recording()), [1.0])
    clinic.journal("teaching", clinic.begin_teaching(), [1.0], end=JournalEnd(reason="finished"))

    def full_disk(*_: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(runs, "complete", full_disk)
    clinic.importer.run()
    assert clinic.count(RecordingRow) == 2
    assert bad.exists()


def test_damaged_recording_is_reported_and_does_not_break_the_list(clinic: Clinic) -> None:
    recording_id = clinic.recording()
    with clinic.database.write() as session:
        session.get_one(RecordingSamplesRow, recording_id).data = b"damaged"
    with clinic.database.read() as session:
        assert len(recordings.of_patient(session, clinic.patient_id, 10, None)[0]) == 1
        with pytest.raises(ProblemError) as caught:
            recordings.samples(session, recording_id)
    assert caught.value.code == "unreadable_samples"


@SQLITE_FIRST
def test_a_recording_that_lacks_a_minute_is_not_played(clinic: Clinic, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kata.database.series.BLOCK_SAMPLES", 100)
    recording_id = clinic.recording()
    run_id = clinic.begin_run(recording_id)
    with clinic.database.write() as session:
        assert len(runs.motion_of(session, runs.get(session, run_id)).times_s) == 201
        session.delete(session.get_one(RecordingSampleBlockRow, (recording_id, 1)))
    with clinic.database.read() as session, pytest.raises(ProblemError) as caught:
        runs.motion_of(session, runs.get(session, run_id))
    assert caught.value.code == "unreadable_samples"


@SQLITE_FIRST
def test_figure_has_angles_on_the_left_and_error_right(clinic: Clinic) -> None:
    run_id = clinic.begin_run(clinic.recording())
    clinic.journal("run", run_id, [2.0], error_deg=-0.5, end=JournalEnd(reason="completed"))
    clinic.importer.run()
    worker = SharedFigureWorker()
    with clinic.database.read() as session:
        parts = runs.figure_samples(session, run_id)
    run_figures = json.loads(worker.build(figures.run, parts))
    with pytest.raises(ProblemError) as caught:
        worker.build(figures.run, replace(parts, taught=Series(b"damaged")))
    assert caught.value.status == 410
    assert [motor["motor"] for motor in run_figures["motors"]] == [1, 2, 3, 4, 5]
    figure = run_figures["motors"][2]["figure"]
    assert [(trace["name"], trace.get("yaxis", "y")) for trace in figure["data"]] == [
        ("Requested", "y"),
        ("Playback", "y"),
        ("Error", "y2"),
    ]
    assert figure["layout"]["yaxis2"]["side"] == "right"
    assert "°" in figure["layout"]["yaxis"]["title"]["text"]
    assert trace(run_figures, motor=3, name="Error") == pytest.approx(-0.5, abs=1e-3)


def test_journal_waits_for_a_run_not_stored_yet(clinic: Clinic) -> None:
    recording_id = clinic.recording()
    has_undelivered = [True]
    importer = Importer(
        clinic.database, clinic.folder, StationConfig(), clinic.saved.append, lambda: has_undelivered[0]
    )
    run_id = uuid4()
    path = clinic.journal("run", run_id, [2.0], end=JournalEnd(reason="completed"))
    importer.run(path)
    assert path.exists()
    assert importer.waiting == 1
    with clinic.database.write() as session:
        visit = sessions.begin(session, clinic.patient_id)
        runs.begin(session, runs.RunRequest(visit.id, recording_id)).id = run_id
    importer.run_due()
    assert (importer.waiting, clinic.saved[-1].id) == (0, run_id)

    has_undelivered[0] = False
    lost = clinic.journal("run", uuid4(), [2.0], end=JournalEnd(reason="completed"))
    importer.run(lost)
    assert (clinic.folder / "unreadable" / lost.name).exists()


@SQLITE_FIRST
def test_loaded_run_ends_when_its_device_process_ended(clinic: Clinic) -> None:
    recording_id = clinic.recording()
    lost = clinic.begin_run(recording_id)
    ended_at = utc_now()
    with clinic.database.write() as session:
        visit_id = runs.get(session, lost).session_id
        # The next process begins this run before the import.
        goes_on = runs.begin(session, runs.RunRequest(visit_id, recording_id)).id

    clinic.importer.run_ended(ended_at)

    with clinic.database.read() as session:
        assert runs.get(session, lost).outcome == "interrupted"
        assert runs.get(session, goes_on).outcome == "loaded"


@SQLITE_FIRST
def test_run_ends_although_the_database_answers_later(clinic: Clinic, monkeypatch: pytest.MonkeyPatch) -> None:
    lost = clinic.begin_run(clinic.recording())

    def away(*_: object) -> int:
        raise DatabaseUnavailableError(utc_now())

    with monkeypatch.context() as while_away:
        while_away.setattr(runs, "mark_unended_interrupted", away)
        clinic.importer.run_ended(utc_now())
    clinic.importer.run_due()

    with clinic.database.read() as session:
        assert runs.get(session, lost).outcome == "interrupted"


@SQLITE_FIRST
def test_run_with_a_waiting_journal_is_not_interrupted(clinic: Clinic) -> None:
    has_undelivered = [True]
    importer = Importer(
        clinic.database, clinic.folder, StationConfig(), clinic.saved.append, lambda: has_undelivered[0]
    )
    run_id = clinic.begin_run(clinic.recording())
    importer.run_ended(utc_now())
    with clinic.database.read() as session:
        assert runs.get(session, run_id).outcome == "loaded"

    has_undelivered[0] = False
    importer.run_due()

    with clinic.database.read() as session:
        assert runs.get(session, run_id).outcome == "interrupted"
