"""A patient's complete record as one ZIP file, for the patient, another clinic or the archive. Each file is built while the ZIP is sent."""

import csv
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final
from uuid import UUID
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

from sqlalchemy import inspect, select
from sqlalchemy.orm import Session

from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.contraindications.tables import ContraindicationRow
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patients.tables import ErasureRow, PatientRow
from kata.clinic.programmes import adherence
from kata.clinic.programmes.tables import ProgrammeRow
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions.tables import EndFeelRow, GoniometerReadingRow, RunRow, SessionRow, SessionStopRow
from kata.database.base import Base, column_name
from kata.database.engine import Database
from kata.database.series import Series
from kata.errors import ProblemError
from kata.interop import bundle, sample_file, service
from kata.interop.codes import ExportSettings
from kata.interop.sample_file import Origin
from kata.plotting.figures import FigureWorker

_CHUNK_BYTES: Final = 1 << 18
_README: Final = """All data that Kata stores about one patient.

patient.json      who it is; contraindications; episodes of care with stages and limits, programmes with versions, assessments, requests
sessions.json     every session: checklist, pain, note, signature and addenda, stops, runs with their tracking error
                  played_min_deg and played_max_deg are angles of the apparatus, not of the patient: the arm can slip in its cuff
events.json       events of the apparatus during this patient's sessions
fhir.json         the same as an HL7 FHIR R4 transaction, for other systems
recordings.csv    taught, imported and derived recordings: one line each, with the name of the file of its samples
recordings/       samples: time and the five motors' angles (Apache Parquet; units and clock are in each file)
goniometer.csv    goniometer readings: patient_deg beside apparatus_deg, the apparatus angle of the same motion at that moment
runs.csv          playbacks and end-feel tests: one line each, with the name of the file of its samples
                  worst_peak_deg and worst_rmse_deg are tracking errors: played minus requested motion.
                  They are empty where compared_percent, the share of the playing time that was compared, is below 90, and where
                  the playback ended before its first repetition was complete
                  change_by_settings_deg is requested minus taught: what range and Reduce range changed, not an error
                  end_feel is empty for a playback. For an end-feel test it is test or baseline; the figures are in end-feel.csv.
                  A baseline moves a weight, not the patient
                  range_percent is the share of the taught range that was asked for, least_range_percent the smallest share of it after
                  Reduce range (empty: not reduced). Both are the therapist's choice and no measure of what the patient can do
                  motion_3_end_range_s to motion_6_end_range_s are end-range times. Their band and torque are in sessions.json
                  (end_range_band_deg, end_range_torque_nm)
                  self_paced is true where the patient's effort set the pace. work_j (joules) and mean_effort_nm are then the patient's work
                  along the path and the mean torque while the arm moved: estimates from the torque of the drives. mean_pace_percent is
                  the mean pace, percent of the asked speed; waiting for the patient counts as 0, pauses do not count
                  clock_offset_s is how far the wall clock is ahead of the motion's clock, by which the errors are compared
end-range.csv     end-range times: one line for each motion of a session and of a week: counted and prescribed seconds. A week begins on Monday
                  of time_zone; preliminary is true while the session or the week is not over, so that its seconds can still grow
end-feel.csv      end-feel tests and their baselines, one line each: figures with half of their 95 % intervals, or the reason why there are none
                  range_deg and onset_deg count outwards; times outward (1 or -1) they are the apparatus angle of the motion, which is
                  not the patient's angle: the arm can slip in its cuff
runs/             samples: time, phase, position on the motion, setpoint, measured angle and torque of each motor

Where "simulated" is true or 1 (column, metadata, file name), the apparatus was simulated and the values are invented.
Angles are degrees, torques newton metres, times seconds; moments are UTC. Motors are counted 1 to 5: two of the scapula,
abduction, flexion, external rotation. Text is UTF-8. In the CSV files an apostrophe stands before a text that begins like a formula.
"""
_FORMULA: Final = ("=", "+", "-", "@", "＝", "＋", "－", "＠", "|", "%")
"""First characters of a cell that a spreadsheet runs as a formula or command. Japanese spreadsheets also accept the wide forms (OWASP,
CSV injection).
"""


class _Outgoing:
    """Buffer of a ZIP file that is being sent. It does not support seeking, so sent data need not be kept."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def write(self, data: bytes) -> int:
        """Add data to the buffer."""
        self._buffer += data
        return len(data)

    def flush(self) -> None:
        """Do nothing, because there is no file behind the buffer."""

    def take(self) -> bytes:
        """Return the buffered data and empty the buffer."""
        data, self._buffer = bytes(self._buffer), bytearray()
        return data


def chunks(database: Database, worker: FigureWorker, patient_id: UUID, clinic: ExportSettings) -> Iterator[bytes]:
    """Yield the ZIP in chunks. No file is completely in memory, and no transaction stays open while a client reads."""
    outgoing = _Outgoing()
    with TemporaryDirectory(prefix="kata-") as folder, ZipFile(outgoing, "w", ZIP_DEFLATED) as archive:  # type: ignore[call-overload]
        for name, path in _files(database, worker, patient_id, Path(folder), clinic):
            info = ZipInfo(name)
            # Parquet is already compressed.
            info.compress_type = ZIP_STORED if name.endswith(".parquet") else ZIP_DEFLATED
            with path.open("rb") as file, archive.open(info, "w", force_zip64=True) as member:
                while chunk := file.read(_CHUNK_BYTES):
                    member.write(chunk)
                    yield outgoing.take()
            path.unlink()
    yield outgoing.take()


def _files(
    database: Database, worker: FigureWorker, patient_id: UUID, folder: Path, clinic: ExportSettings
) -> Iterator[tuple[str, Path]]:
    path = folder / "file"
    path.write_text(_README, encoding="utf-8")
    yield "README.txt", path
    with database.read() as session:
        _write_json(path, _record(session, service.identified_patient(session, patient_id)))
    yield "patient.json", path
    with database.read() as session:
        _write_sessions(path, session, service.identified_patient(session, patient_id))
    yield "sessions.json", path
    with database.read() as session:
        events = select(DeviceEventRow).where(DeviceEventRow.patient_id == patient_id).order_by(DeviceEventRow.at)
        _write_json(path, [_plain(row) for row in session.scalars(events)])
    yield "events.json", path
    bundle.export(database, patient_id, path, clinic)
    yield "fhir.json", path
    with database.read() as session:
        readings = select(GoniometerReadingRow).join(SessionRow, SessionRow.id == GoniometerReadingRow.session_id)
        readings = readings.where(SessionRow.patient_id == patient_id).order_by(GoniometerReadingRow.read_at)
        columns = [*_columns(GoniometerReadingRow), *_ORIGIN]
        rows = [_plain(row) | _origin(session, row.session_id) for row in session.scalars(readings)]
        _write_table(path, rows, columns_if_empty=columns)
    yield "goniometer.csv", path
    with database.read() as session:
        tests = select(EndFeelRow).join(RunRow, RunRow.id == EndFeelRow.run_id)
        tests = tests.join(SessionRow, SessionRow.id == RunRow.session_id).where(SessionRow.patient_id == patient_id)
        columns = ["started_at", *(name for name in _columns(EndFeelRow) if name != "curve"), *_ORIGIN]
        exported_rows = (
            _plain(row) | {"started_at": run.started_at.isoformat()} | _origin(session, run.session_id, run)
            for row, run in session.execute(tests.add_columns(RunRow).order_by(RunRow.started_at))
        )
        _write_table(path, [{name: row[name] for name in columns} for row in exported_rows], columns_if_empty=columns)
    yield "end-feel.csv", path
    with database.read() as session:
        patient = service.identified_patient(session, patient_id)
        _write_table(path, list(_end_range_rows(session, patient, clinic)), columns_if_empty=_END_RANGE)
    yield "end-range.csv", path
    yield from _recordings(database, worker, patient_id, path)
    yield from _runs(database, worker, patient_id, path)


def _recordings(database: Database, worker: FigureWorker, patient_id: UUID, path: Path) -> Iterator[tuple[str, Path]]:
    with database.read() as session:
        query = select(RecordingRow).where(RecordingRow.patient_id == patient_id).order_by(RecordingRow.taught_at)
        rows = [_plain(row) for row in session.scalars(query)]
    for row in rows:
        with database.read() as session:
            series, origin = service.of_recording(session, UUID(row["id"]))
        row["file"] = _write_samples(worker, series, origin, path)
        if row["file"]:
            yield row["file"], path
    _write_table_with_file_column(path, rows)
    yield "recordings.csv", path


_FOR_LISTS: Final = ("search_text", "sort_key")
"""Columns that are derived from others for searching and sorting."""
_ORIGIN: Final = ("side", "simulated")
"""Columns that a table needs to be read without the other files."""


def _columns(table: type[Base]) -> list[str]:
    return [column_name(attribute) for attribute in inspect(table).column_attrs]


def _origin(session: Session, session_id: UUID, run: RunRow | None = None) -> dict[str, Any]:
    """Return the shoulder (of the run's recording, else of the session) and True if the session's apparatus was simulated."""
    clinic_session = session.get_one(SessionRow, session_id)
    side = run.recording.side if run else clinic_session.side
    return dict(zip(_ORIGIN, (side, bool(clinic_session.simulated)), strict=True))


_END_RANGE: Final = (
    "period", "begins_at", "time_zone", "session_id", "motion", "counted_s", "prescribed_s", "preliminary", *_ORIGIN,
)  # fmt: skip


def _end_range_rows(session: Session, patient: PatientRow, clinic: ExportSettings) -> Iterator[dict[str, Any]]:
    """Yield the counted and prescribed end-range times of each session and week."""
    for episode in patient.episodes:
        for times in adherence.end_range_times(session, episode.id, clinic.zone):
            period, done = times.period, times.done
            labels = (
                ("session", period.started_at.isoformat(), "UTC", period.session_id)
                if isinstance(period, adherence.EndRangeSession)
                else ("week", period.begins_on.isoformat(), str(clinic.zone), None)
            )
            figures = (done.motion, done.counted_s, done.prescribed_s, not times.is_complete)
            values = (*labels, *figures, episode.side, times.is_simulated)
            yield dict(zip(_END_RANGE, values, strict=True))


def _end_range_times(row: RunRow) -> dict[str, float | None]:
    """Return the end-range time of each motion of the shoulder joint, None if it was not counted."""
    times = {motion.motion: motion.end_range_s for motion in row.motions}
    return {f"motion_{number}_end_range_s": times.get(number) for number in range(3, 7)}


def _runs(database: Database, worker: FigureWorker, patient_id: UUID, path: Path) -> Iterator[tuple[str, Path]]:
    with database.read() as session:
        query = select(RunRow).join(SessionRow, SessionRow.id == RunRow.session_id)
        query = query.where(SessionRow.patient_id == patient_id).order_by(RunRow.started_at)
        rows = [
            _plain(row)
            | {"change_by_settings_deg": row.change_deg, "end_feel": row.end_feel.kind if row.end_feel else ""}
            | _end_range_times(row)
            | _origin(session, row.session_id, row)
            for row in session.scalars(query)
        ]
    for row in rows:
        row["file"] = ""
        with database.read() as session:
            measured = service.measured(session, UUID(row["id"]))
        if measured:
            row["file"] = _write_samples(worker, *measured, path)
        if row["file"]:
            yield row["file"], path
    _write_table_with_file_column(path, rows)
    yield "runs.csv", path


def _write_samples(worker: FigureWorker, series: Series, origin: Origin, path: Path) -> str:
    """Write the samples and return the name of their file. Return an empty name if they are damaged, so that the rest is still exported."""
    try:
        worker.build(sample_file.write, series, origin, "parquet", path)
    except ProblemError:
        return ""
    return f"{origin.kind}s/{origin.marked_id}.parquet"


def _record(session: Session, patient: PatientRow) -> dict[str, Any]:
    episodes = [episode.id for episode in patient.episodes]
    programmes = select(ProgrammeRow).where(ProgrammeRow.episode_id.in_(episodes))
    assessments = select(AssessmentRow).where(AssessmentRow.episode_id.in_(episodes))
    query = select(ContraindicationRow).where(ContraindicationRow.patient_id == patient.id)
    erasures = select(ErasureRow).where(ErasureRow.patient_id == patient.id)
    return {
        "patient": _plain(patient),
        "contraindications": [_plain(row) for row in session.scalars(query.order_by(ContraindicationRow.noted_at))],
        "episodes": [_plain(row, stages=row.stages) for row in patient.episodes],
        "programmes": [
            _plain(row) | {"versions": [_plain(version, items=version.items) for version in row.versions]}
            for row in session.scalars(programmes.order_by(ProgrammeRow.created_at))
        ],
        "assessments": [
            _plain(row, rom=row.rom) for row in session.scalars(assessments.order_by(AssessmentRow.assessed_at))
        ],
        "requests_for_erasure": [_plain(row) for row in session.scalars(erasures.order_by(ErasureRow.asked_at))],
    }


def _write_sessions(path: Path, session: Session, patient: PatientRow) -> None:
    with path.open("w", encoding="utf-8") as file:
        file.write("[")
        for number, clinic_session in enumerate(bundle.clinic_sessions(session, patient)):
            stops = session.scalars(select(SessionStopRow).where(SessionStopRow.session_id == clinic_session.id))
            record = _plain(
                clinic_session,
                addenda=clinic_session.addenda,
                stops=list(stops),
                goniometer_readings=clinic_session.goniometer_readings,
            )
            record["runs"] = [_plain(run, motors=run.tracking, motions=run.motions) for run in clinic_session.runs]
            file.write((",\n" if number else "\n") + json.dumps(record, ensure_ascii=False))
        file.write("\n]\n")


def _write_json(path: Path, content: object) -> None:
    path.write_text(json.dumps(content, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")


def _write_table_with_file_column(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write a table whose first column names the file with the row's samples."""
    _write_table(path, [{"file": row.get("file", "")} | row for row in rows], columns_if_empty=["file"])


def _write_table(path: Path, rows: list[dict[str, Any]], columns_if_empty: Sequence[str] = ()) -> None:
    """Write a CSV table. ``columns_if_empty``: its columns if there are no rows."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]) if rows else list(columns_if_empty))
        writer.writeheader()
        writer.writerows({name: _cell(value) for name, value in row.items()} for row in rows)


def _cell(value: object) -> object:
    """Return a value as a cell. An apostrophe is put before a text that a spreadsheet would interpret as a formula."""
    return f"'{value}" if isinstance(value, str) and value.lstrip().startswith(_FORMULA) else value


def _plain(row: Base, **parts: list[Any]) -> dict[str, Any]:
    """Return every column of a row and of its parts. Columns that are added later are exported automatically."""
    columns = {column_name(attribute): getattr(row, attribute.key) for attribute in inspect(type(row)).column_attrs}
    plain = {name: _as_json(value) for name, value in columns.items() if name not in _FOR_LISTS}
    return plain | {name: [_plain(part) for part in some] for name, some in parts.items()}


def _as_json(value: Any) -> Any:
    if hasattr(value, "isoformat"):
        return value.isoformat()
    return str(value) if isinstance(value, UUID) else value
