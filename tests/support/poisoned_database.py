"""A clinic with hostile texts in every text column: one text per row, one row per text."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import timedelta
from itertools import count
from typing import Any, Final, cast
from uuid import UUID, uuid4

from sqlalchemy import JSON, Column, String, Table, Text, bindparam, insert, inspect, select, update
from sqlalchemy.orm import Session

from kata.actor import Actor
from kata.audit import entries
from kata.auth.tables import AccessTokenRow, AccountRow, AccountStationRow, LoginSessionRow
from kata.backups.tables import BackupRow
from kata.clinic import tables
from kata.clinic.contraindications.tables import ContraindicationRow
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patients.tables import ErasureRow, PatientRow
from kata.clinic.recordings.tables import TeachingRow
from kata.clinic.restricted.tables import BreakGlassAccessRow
from kata.clinic.sessions.tables import AddendumRow, SessionStopRow
from kata.clinic.stations.tables import StationRow
from kata.database.base import Base, utc_now
from tests.support.treatment import treat

TOGETHER: Final = 50
"""Number of texts in one note of a place; the page must show each unchanged."""

NOT_WRITTEN: Final = frozenset(
    {
        # An enumeration; other words cannot be read.
        "accounts.role", "accounts.language", "backups.kind", "contraindications.code", "device_events.kind", "episodes.side",
        "episodes.diagnosis_code", "episodes.verification", "erasures.decision",
        "patients.dominant_side", "patients.sex", "programme_items.method", "recordings.side", "rom_measurements.side",
        "rom_measurements.motion", "rom_measurements.kind", "rom_measurements.position", "runs.method", "runs.outcome",
        "end_feel_runs.kind", "end_feel_runs.unmeasured",
        "sessions.end_reason", "sign_ins.end_reason", "sign_ins.method", "stages.stage", "teachings.side",
        # Secrets and their hashes.
        "accounts.code_hash", "accounts.password_hash", "accounts.totp_sealed", "recovery_codes.code_hash",
        "access_tokens.secret_hash", "sign_ins.before_hash", "sign_ins.secret_hash", "accounts.oidc_subject",
        # Derived by the program from other columns.
        "patients.search_text", "patients.sort_key", "stations.config", "run_corrections.station", "end_feel_runs.station", "spools.station", "schemas.oldest", "schemas.revision",
        "station_versions.software", "station_versions.station", "station_versions.config",
        "exported_statements.final_digest", "session_stops.therapist", "session_stops.station", "station_hours.station",
        # Imported on the service's computer; shown only in the patient's mode, which no record page shows.
        "questionnaire_texts.questionnaire", "questionnaire_texts.language", "questionnaire_texts.title", "questionnaire_texts.copyright",
        "patient_modes.questionnaire", "patient_modes.language",
        # Read from records that a command wrote on the service's computer, or the name of the account that did it.
        "commissionings.station", "commissionings.kind", "commissionings.done_by", "commissionings.software", "commissionings.fault",
        "commissionings.digest", "commissionings.configuration_digest", "commissionings.record", "station_versions.changed_by",
        # An administrator's own words on printed reports, which no record page shows.
        "clinic_profile.name", "clinic_profile.address", "clinic_profile.phone", "clinic_profile.time_zone", "clinic_profile.updated_by",
        # Append-only tables, which fill() writes.
        *(f"audit.{name}" for name in ("who", "role", "address", "action", "outcome", "subject", "station", "detail", "anchor")),
    }
)  # fmt: skip
"""Text columns without free text; every other text column, also a new one, gets hostile texts."""


@dataclass(frozen=True)
class Place:
    """The record of one patient, for pages that show one object."""

    patients: UUID
    episodes: UUID
    recordings: UUID
    sessions: UUID
    programmes: UUID


@dataclass
class Poison:
    """The inserted texts and their places."""

    places: list[Place] = field(default_factory=list)
    together: list[str] = field(default_factory=list)
    """The note of each place, which contains many texts."""
    planted: dict[str, list[str]] = field(default_factory=dict)
    """Texts by ``table.column``, one per row."""
    ids: dict[str, str] = field(default_factory=dict)
    """Ids of the first place and of records without a place, by their names in the API."""


def poison(session: Session, texts: list[str]) -> Poison:
    """Fill the database: ``session`` is one of :meth:`Database.write`."""
    made = Poison(together=[" | ".join(texts[at : at + TOGETHER]) for at in range(0, len(texts), TOGETHER)])
    for _ in made.together:
        made.places.append(_place(session))
        for row in _of_a_place(session, made.places[-1]):
            _copy(session, row, min(TOGETHER, len(texts)))
    for row in _of_the_clinic(session, made.places[0]):
        _copy(session, row, len(texts))
    made.ids = _ids(session, made.places[0])
    _give_versions(session)
    session.expire_all()
    for table in Base.metadata.sorted_tables:
        _spoil(session, table, texts, made)
    for place, together in zip(made.places, made.together, strict=True):
        _write_notes(session, place, together)
    for text in texts:
        actor = Actor(uuid4(), uuid4(), text, "therapist", frozenset())
        entries.add_entry(
            session,
            entries.entry(text, patient_id=made.places[0].patients, subject=text, detail={"reason": text}, actor=actor),
        )
    return made


def _place(session: Session) -> Place:
    treated = treat(session, runs=2)
    episode = session.get_one(tables.EpisodeRow, treated.episode_id)
    recording = session.scalars(select(tables.RecordingRow).filter_by(patient_id=episode.patient_id)).one()
    programme = session.scalars(select(tables.ProgrammeRow).filter_by(episode_id=episode.id)).one()
    return Place(episode.patient_id, episode.id, recording.id, treated.session_ids[0], programme.id)


def _of_a_place(session: Session, place: Place) -> list[Base]:
    """Insert a row of each kind that the patient's pages list, in order of references."""
    now = utc_now()
    run = session.scalars(select(tables.RunRow).filter_by(session_id=place.sessions)).first()
    assert run
    erasure = ErasureRow(
        id=uuid4(), patient_id=place.patients, asked_at=now, reason="", noted_by="", decided_by="", explanation=""
    )
    alarm = DeviceEventRow(
        id=uuid4(), station="", at=now, kind="alarm", code="", message="", patient_id=place.patients,
        session_id=place.sessions, run_id=run.id,
    )  # fmt: skip
    teaching = TeachingRow(id=uuid4(), patient_id=place.patients, name="", side="left", started_at=now)
    stop = SessionStopRow(session_id=place.sessions, code="", started_at=now)
    contraindication = ContraindicationRow(
        id=uuid4(), patient_id=place.patients, code="pacemaker", noted_at=now, noted_by="", signed_off_at=now, resolved_at=now,
    )  # fmt: skip
    session.add_all([erasure, alarm, teaching, stop, contraindication])
    session.flush()
    return [
        session.get_one(tables.EpisodeRow, place.episodes),
        session.get_one(tables.RecordingRow, place.recordings),
        session.get_one(tables.ProgrammeRow, place.programmes),
        session.scalars(select(tables.ProgrammeVersionRow).filter_by(programme_id=place.programmes)).one(),
        session.get_one(tables.SessionRow, place.sessions),
        session.scalars(select(AddendumRow).filter_by(session_id=place.sessions)).one(),
        session.scalars(select(tables.GoniometerReadingRow).filter_by(session_id=place.sessions)).all()[0],
        session.scalars(select(tables.AssessmentRow).filter_by(episode_id=place.episodes)).all()[0],
        erasure,
        alarm,
        contraindication,
    ]


def _of_the_clinic(session: Session, first: Place) -> list[Base]:
    """Insert a row of each kind that is listed for all patients or belongs to none."""
    now = utc_now()
    account = session.scalars(select(AccountRow)).one()
    break_glass_access = BreakGlassAccessRow(
        id=uuid4(), patient_id=first.patients, account_id=account.id, reason="", at=now, until=now, reviewed_at=now
    )
    backup = BackupRow(id=uuid4(), at=now, kind="asked", file="", bytes=1, tested_at=now)
    station = AccountStationRow(account_id=account.id, station="")
    known = StationRow(name="", config="", registered_at=now, started_at=now)
    token = AccessTokenRow(
        id=uuid4(), account_id=account.id, name="", secret_hash="0", created_at=now, expires_at=now + timedelta(days=1)
    )
    session.add_all([break_glass_access, backup, station, known, token])
    session.flush()
    patient = session.get_one(PatientRow, first.patients)
    return [
        account,
        session.scalars(select(LoginSessionRow)).one(),
        patient,
        break_glass_access,
        backup,
        station,
        known,
        token,
    ]


def _ids(session: Session, place: Place) -> dict[str, str]:
    version = session.scalars(select(tables.ProgrammeVersionRow.id).filter_by(programme_id=place.programmes)).first()
    run = session.scalars(select(tables.RunRow.id).filter_by(session_id=place.sessions)).first()
    assessment = session.scalars(select(tables.AssessmentRow.id).filter_by(episode_id=place.episodes)).first()
    return {
        "patient_id": str(place.patients), "episode_id": str(place.episodes), "recording_id": str(place.recordings),
        "session_id": str(place.sessions), "programme_id": str(place.programmes), "run_id": str(run),
        "assessment_id": str(assessment), "programme_version_id": str(version),
    }  # fmt: skip


def _copy(session: Session, row: Base, times: int) -> None:
    """Insert more rows with their own ids and unique values."""
    table, mapper, number = cast(Table, row.__table__), inspect(type(row)), count(1_000)
    values = {column.name: getattr(row, mapper.get_property_by_column(column).key) for column in table.columns}
    own = {"access_tokens": "secret_hash", "accounts": "username", "sign_ins": "secret_hash", "patients": "clinic_number", "account_stations": "station", "stations": "name"}  # fmt: skip
    copies: list[dict[str, Any]] = []
    for _ in range(times):
        n = next(number)
        changed: dict[str, Any] = {"id": uuid4()} if "id" in values else {}
        if table.name in own:
            changed[own[table.name]] = f"{n}"
        if table.name == "programme_versions":
            changed["number"] = n
        for name in ("at", "started_at", "opened_at", "taught_at", "assessed_at"):
            if name in values:
                changed[name] = values[name] - timedelta(seconds=n)
        copies.append(values | changed)
    session.execute(insert(table), copies)


def _give_versions(session: Session) -> None:
    """Add an item to each programme without one, so that lists contain it."""
    programmes, versions = tables.ProgrammeRow, tables.ProgrammeVersionRow
    without = session.scalars(select(programmes.id).where(programmes.id.not_in(select(versions.programme_id))))
    given = {"number": 1, "made_at": utc_now(), "made_by": "", "note": ""}
    session.execute(insert(versions), [{"id": uuid4(), "programme_id": id_, **given} for id_ in without])


def _spoil(session: Session, table: Table, texts: list[str], made: Poison) -> None:
    """Put another text into every row, cut to the column's length, with a mark that identifies the column."""
    columns = [column for column in table.columns if _is_written(column)]
    lists = [column for column in table.columns if isinstance(column.type, JSON)]
    keys = list(table.primary_key.columns)
    if not columns and not lists:
        return
    # A service may remove white space around a text.
    marks = {column.name: f"~{len(made.planted) + n:02}" for n, column in enumerate(columns)}
    changes = []
    for n, row in enumerate(session.execute(select(*keys, *lists)).mappings().all()):
        text = texts[n % len(texts)]
        change: dict[str, Any] = {f"key_{key.name}": row[key.name] for key in keys}
        change |= {f"new_{column.name}": _fitted(column, text, marks[column.name], n) for column in columns}
        change |= {f"new_{column.name}": _written_in(row[column.name], text) for column in lists}
        changes.append(change)
    if not changes:
        return
    statement = update(table).values(
        {column.name: bindparam(f"new_{column.name}", type_=column.type) for column in (*columns, *lists)}
    )
    for key in keys:
        statement = statement.where(key == bindparam(f"key_{key.name}", type_=key.type))
    session.connection().execute(statement, changes)
    for column in columns:
        made.planted[f"{table.name}.{column.name}"] = [change[f"new_{column.name}"] for change in changes]


def _is_written(column: Column[Any]) -> bool:
    return isinstance(column.type, String) and f"{column.table.name}.{column.name}" not in NOT_WRITTEN


def _fitted(column: Column[Any], text: str, mark: str, n: int) -> str:
    if column.unique or column.primary_key:
        mark = f"{n:03x}{mark}"
    longest = cast(String, column.type).length
    return text[: longest - len(mark)] + mark if longest else text + mark


def _written_in(value: Any, text: str) -> Any:
    """Fill the names within JSON: who confirmed a check, and the exercises done."""
    if isinstance(value, list):
        return [text if isinstance(item, str) and not _is_word(item) else _written_in(item, text) for item in value]
    if isinstance(value, dict):
        return {name: text if name == "by" and item else item for name, item in value.items()}
    return value


def _is_word(value: str) -> bool:
    return value.startswith(("arm_fixer", "elbow_fixer"))


def _write_notes(session: Session, place: Place, together: str) -> None:
    """Return a note of maximum length, so that one page shows many texts."""
    for table, column, id_ in (
        (PatientRow, "notes", place.patients),
        (tables.EpisodeRow, "contraindications", place.episodes),
        (tables.EpisodeRow, "closing_note", place.episodes),
        (tables.RecordingRow, "note", place.recordings),
        (tables.SessionRow, "note", place.sessions),
    ):
        setattr(session.get_one(table, id_), column, together)
    for run in session.scalars(select(tables.RunRow).filter_by(session_id=place.sessions)):
        run.stop_message = together


def text_columns() -> Iterator[str]:
    """Return every text column as ``table.column``."""
    for table in Base.metadata.sorted_tables:
        for column in table.columns:
            if isinstance(column.type, String | Text):
                yield f"{table.name}.{column.name}"
