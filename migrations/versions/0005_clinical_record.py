"""Episodes, programmes, assessments, what a session is from its checklist to its signature, device events, stations

Revision ID: 0005
Revises: 0004
"""

import unicodedata
from typing import Any
from uuid import uuid4

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

_MOMENT = sa.DateTime(timezone=True)
_SEARCHED = (*(sa.column(name) for name in ("name", "kana", "clinic_number")), sa.column("birth_date", sa.Date()))


def upgrade() -> None:
    _new_tables()
    _patients()
    _recordings()
    _sessions()
    _check()


def downgrade() -> None:
    _as_it_was()
    for name in (
        "addenda", "session_stops", "device_events", "stations", "programme_items", "rom_measurements", "assessments",
        "erasures",
    ):  # fmt: skip
        op.drop_table(name)
    with op.batch_alter_table("sessions") as table:
        for name in (
            "started_at_id",
            "patient_id_started_at",
            "therapist_started_at",
            "station_started_at",
            "therapist_station_started_at",
        ):
            table.drop_index(f"ix_sessions_{name}")
        table.drop_index("ix_sessions_episode_id")
        table.drop_constraint("fk_sessions_episode_id_episodes", type_="foreignkey")
        table.drop_constraint("fk_sessions_programme_version_id_programme_versions", type_="foreignkey")
        for name in (
            "episode_id", "programme_version_id", "therapist", "station", "checks", "pain_before", "pain_during",
            "pain_after", "end_reason", "signed_at", "signed_by", "updated_at", "run_count", "stop_count",
        ):  # fmt: skip
            table.drop_column(name)
        table.create_index("ix_sessions_patient_id", ["patient_id"])
        table.create_index("ix_sessions_started_at", ["started_at"])
    with op.batch_alter_table("runs") as table:
        for name in (
            "programme_position", "worst_rmse_deg", "worst_peak_deg", "reversals", "least_range_percent", "learned_rms_deg",
            "repetitions_done", "played_s",
        ):  # fmt: skip
            table.drop_column(name)
    with op.batch_alter_table("recordings") as table:
        for name in ("taught_by", "fixtures", "updated_at"):
            table.drop_column(name)
    with op.batch_alter_table("teachings") as table:
        for name in ("taught_by", "fixtures"):
            table.drop_column(name)
    for name in ("programme_versions", "programmes", "stages", "episodes"):
        op.drop_table(name)
    with op.batch_alter_table("patients") as table:
        table.drop_index("ix_patients_name_id")
        table.create_index("ix_patients_name", ["name"])
        table.alter_column("affected_side", existing_type=sa.String(length=8), nullable=False)
        for name in ("dominant_side", "erased_at", "search_text"):
            table.drop_column(name)
    _check()


def _new_tables() -> None:
    op.create_table(
        "episodes",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("patient_id", sa.Uuid(), nullable=False),
        sa.Column("side", sa.String(length=8), nullable=False),
        sa.Column("diagnosis", sa.String(length=200), nullable=False),
        sa.Column("onset_on", sa.Date(), nullable=True),
        sa.Column("contraindications", sa.Text(), nullable=False),
        sa.Column("limits", sa.JSON(), nullable=False),
        sa.Column("max_load_level", sa.Integer(), nullable=True),
        sa.Column("limits_by", sa.String(length=100), nullable=False),
        sa.Column("opened_at", _MOMENT, nullable=False),
        sa.Column("closed_at", _MOMENT, nullable=True),
        sa.Column("closing_note", sa.Text(), nullable=False),
        sa.Column("updated_at", _MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["patient_id"], ["patients.id"], name="fk_episodes_patient_id_patients"),
        sa.PrimaryKeyConstraint("id", name="pk_episodes"),
    )
    op.create_index("ix_episodes_patient_id", "episodes", ["patient_id"])
    op.create_table(
        "stages",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("episode_id", sa.Uuid(), nullable=False),
        sa.Column("stage", sa.String(length=16), nullable=False),
        sa.Column("since", sa.Date(), nullable=False),
        sa.Column("noted_at", _MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["episode_id"], ["episodes.id"], name="fk_stages_episode_id_episodes"),
        sa.PrimaryKeyConstraint("id", name="pk_stages"),
    )
    op.create_index("ix_stages_episode_id", "stages", ["episode_id"])
    op.create_table(
        "programmes",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("episode_id", sa.Uuid(), nullable=False),
        sa.Column("name", sa.String(length=100), nullable=False),
        sa.Column("created_at", _MOMENT, nullable=False),
        sa.Column("updated_at", _MOMENT, nullable=False),
        sa.Column("archived_at", _MOMENT, nullable=True),
        sa.ForeignKeyConstraint(["episode_id"], ["episodes.id"], name="fk_programmes_episode_id_episodes"),
        sa.PrimaryKeyConstraint("id", name="pk_programmes"),
    )
    op.create_index("ix_programmes_episode_id", "programmes", ["episode_id"])
    op.create_table(
        "programme_versions",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("programme_id", sa.Uuid(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("made_at", _MOMENT, nullable=False),
        sa.Column("made_by", sa.String(length=100), nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        sa.Column("timer_minutes", sa.Double(), nullable=True),
        sa.Column("sessions_per_week", sa.Integer(), nullable=True),
        sa.ForeignKeyConstraint(
            ["programme_id"], ["programmes.id"], name="fk_programme_versions_programme_id_programmes"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_programme_versions"),
        sa.UniqueConstraint("programme_id", "number", name="uq_programme_versions_programme_id"),
    )
    op.create_table(
        "programme_items",
        sa.Column("version_id", sa.Uuid(), nullable=False),
        sa.Column("position", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("recording_id", sa.Uuid(), nullable=False),
        sa.Column("speed_percent", sa.Double(), nullable=False),
        sa.Column("repetitions", sa.Integer(), nullable=False),
        sa.Column("pause_s", sa.Double(), nullable=False),
        sa.Column("range_percent", sa.Double(), nullable=False),
        sa.Column("load_level", sa.Integer(), nullable=False),
        sa.Column("method", sa.String(length=16), nullable=False),
        sa.Column("duration_s", sa.Double(), nullable=False),
        sa.ForeignKeyConstraint(
            ["version_id"], ["programme_versions.id"], name="fk_programme_items_version_id_programme_versions"
        ),
        sa.ForeignKeyConstraint(["recording_id"], ["recordings.id"], name="fk_programme_items_recording_id_recordings"),
        sa.PrimaryKeyConstraint("version_id", "position", name="pk_programme_items"),
    )
    op.create_table(
        "assessments",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("episode_id", sa.Uuid(), nullable=False),
        sa.Column("assessed_at", _MOMENT, nullable=False),
        sa.Column("assessed_by", sa.String(length=100), nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        *(sa.Column(f"pain_{when}", sa.Integer(), nullable=True) for when in ("rest", "active", "passive", "average")),
        sa.Column("spadi", sa.JSON(), nullable=True),
        sa.Column("spadi_score", sa.Double(), nullable=True),
        sa.Column("updated_at", _MOMENT, nullable=False),
        sa.Column("withdrawn_at", _MOMENT, nullable=True),
        sa.ForeignKeyConstraint(["episode_id"], ["episodes.id"], name="fk_assessments_episode_id_episodes"),
        sa.PrimaryKeyConstraint("id", name="pk_assessments"),
    )
    op.create_index("ix_assessments_episode_id", "assessments", ["episode_id"])
    op.create_table(
        "rom_measurements",
        sa.Column("assessment_id", sa.Uuid(), nullable=False),
        sa.Column("side", sa.String(length=8), nullable=False),
        sa.Column("motion", sa.String(length=32), nullable=False),
        sa.Column("kind", sa.String(length=8), nullable=False),
        sa.Column("position", sa.String(length=32), nullable=False),
        sa.Column("angle_deg", sa.Double(), nullable=False),
        sa.ForeignKeyConstraint(
            ["assessment_id"], ["assessments.id"], name="fk_rom_measurements_assessment_id_assessments"
        ),
        sa.PrimaryKeyConstraint("assessment_id", "side", "motion", "kind", "position", name="pk_rom_measurements"),
    )
    op.create_table(
        "erasures",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("patient_id", sa.Uuid(), nullable=False),
        sa.Column("asked_at", _MOMENT, nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("noted_by", sa.String(length=100), nullable=False),
        sa.Column("decided_at", _MOMENT, nullable=True),
        sa.Column("decided_by", sa.String(length=100), nullable=False),
        sa.Column("decision", sa.String(length=8), nullable=True),
        sa.Column("explanation", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["patient_id"], ["patients.id"], name="fk_erasures_patient_id_patients"),
        sa.PrimaryKeyConstraint("id", name="pk_erasures"),
    )
    op.create_index("ix_erasures_patient_id", "erasures", ["patient_id"])
    op.create_table(
        "addenda",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("session_id", sa.Uuid(), nullable=False),
        sa.Column("written_at", _MOMENT, nullable=False),
        sa.Column("written_by", sa.String(length=100), nullable=False),
        sa.Column("text", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["session_id"], ["sessions.id"], name="fk_addenda_session_id_sessions"),
        sa.PrimaryKeyConstraint("id", name="pk_addenda"),
    )
    op.create_index("ix_addenda_session_id", "addenda", ["session_id"])
    op.create_table(
        "session_stops",
        sa.Column("session_id", sa.Uuid(), nullable=False),
        sa.Column("code", sa.String(length=32), nullable=False),
        sa.Column("started_at", _MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["session_id"], ["sessions.id"], name="fk_session_stops_session_id_sessions"),
        sa.PrimaryKeyConstraint("session_id", "code", name="pk_session_stops"),
    )
    op.create_index("ix_session_stops_code_started_at", "session_stops", ["code", "started_at", "session_id"])
    op.create_table(
        "device_events",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("station", sa.String(length=100), nullable=False),
        sa.Column("at", _MOMENT, nullable=False),
        sa.Column("kind", sa.String(length=8), nullable=False),
        sa.Column("code", sa.String(length=32), nullable=False),
        sa.Column("message", sa.Text(), nullable=False),
        sa.Column("category", sa.Integer(), nullable=True),
        sa.Column("axis", sa.Integer(), nullable=True),
        sa.Column("patient_id", sa.Uuid(), nullable=True),
        sa.Column("session_id", sa.Uuid(), nullable=True),
        sa.Column("run_id", sa.Uuid(), nullable=True),
        sa.Column("ended_at", _MOMENT, nullable=True),
        sa.ForeignKeyConstraint(["patient_id"], ["patients.id"], name="fk_device_events_patient_id_patients"),
        sa.ForeignKeyConstraint(["session_id"], ["sessions.id"], name="fk_device_events_session_id_sessions"),
        sa.PrimaryKeyConstraint("id", name="pk_device_events"),
    )
    op.create_index("ix_device_events_at", "device_events", ["at"])
    op.create_index("ix_device_events_station_at", "device_events", ["station", "at"])
    op.create_index("ix_device_events_patient_id", "device_events", ["patient_id"])
    op.create_index("ix_device_events_session_id", "device_events", ["session_id"])
    op.create_table(
        "stations",
        sa.Column("name", sa.String(length=100), nullable=False),
        sa.Column("config", sa.Text(), nullable=False),
        sa.Column("registered_at", _MOMENT, nullable=False),
        sa.Column("started_at", _MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_stations"),
    )


def _patients() -> None:
    """Set the first episode's side to the patient's treated shoulder."""
    connection = op.get_bind()
    patients = sa.table(
        "patients", sa.column("id", sa.Uuid()), sa.column("affected_side"), sa.column("created_at", _MOMENT)
    )
    episodes = sa.table(
        "episodes",
        *(sa.column(name, sa.Uuid()) for name in ("id", "patient_id")),
        *(sa.column(name) for name in ("side", "diagnosis", "contraindications", "limits_by", "closing_note")),
        sa.column("limits", sa.JSON()),
        *(sa.column(name, _MOMENT) for name in ("opened_at", "updated_at")),
    )
    nothing = {"diagnosis": "", "contraindications": "", "limits_by": "", "closing_note": "", "limits": []}
    made = [
        {
            "id": uuid4(),
            "patient_id": row.id,
            "side": row.affected_side,
            "opened_at": row.created_at,
            "updated_at": row.created_at,
            **nothing,
        }
        for row in connection.execute(sa.select(patients))
    ]
    if made:
        connection.execute(sa.insert(episodes), made)
    with op.batch_alter_table("patients") as table:
        table.add_column(sa.Column("dominant_side", sa.String(length=8), nullable=True))
        table.add_column(sa.Column("erased_at", _MOMENT, nullable=True))
        table.add_column(sa.Column("search_text", sa.String(length=400), nullable=False, server_default=""))
        table.drop_column("affected_side")
        table.drop_index("ix_patients_name")
        table.create_index("ix_patients_name_id", ["name", "id", "archived_at", "search_text"])
    found = sa.table("patients", sa.column("id", sa.Uuid()), sa.column("search_text"), *_SEARCHED)
    texts = [{"key": row.id, "text": _search_text(row)} for row in connection.execute(sa.select(found))]
    if texts:
        connection.execute(
            sa.update(found).where(found.c.id == sa.bindparam("key")).values(search_text=sa.bindparam("text")), texts
        )


def _search_text(row: Any) -> str:
    """Return the search text, as the program's first version with a search formed it."""
    folded = []
    for part in (row.name, row.kana, row.clinic_number, row.birth_date and row.birth_date.isoformat()):
        plain = "".join(one for one in unicodedata.normalize("NFKD", part or "") if not "\u0300" <= one <= "\u036f")
        hiragana = {katakana: katakana - 0x60 for katakana in range(0x30A1, 0x30F7)}
        folded.append("".join(unicodedata.normalize("NFC", plain).casefold().translate(hiragana).split()))
    return "\n".join(part for part in folded if part)[:400]


def _recordings() -> None:
    for name in ("teachings", "recordings"):
        with op.batch_alter_table(name) as table:
            table.add_column(sa.Column("taught_by", sa.String(length=100), nullable=False, server_default=""))
            table.add_column(sa.Column("fixtures", sa.JSON(), nullable=False, server_default="[]"))
            if name == "recordings":
                table.add_column(sa.Column("updated_at", _MOMENT, nullable=True))
    op.execute("UPDATE recordings SET updated_at = taught_at")
    with op.batch_alter_table("recordings") as table:
        table.alter_column("updated_at", existing_type=_MOMENT, nullable=False)


def _sessions() -> None:
    with op.batch_alter_table("runs") as table:
        table.add_column(sa.Column("programme_position", sa.Integer(), nullable=True))
        for name in ("reversals", "repetitions_done"):
            table.add_column(sa.Column(name, sa.Integer(), nullable=True))
        for name in ("worst_rmse_deg", "worst_peak_deg", "least_range_percent", "learned_rms_deg", "played_s"):
            table.add_column(sa.Column(name, sa.Double(), nullable=True))
    with op.batch_alter_table("sessions") as table:
        table.drop_index("ix_sessions_patient_id")
        table.drop_index("ix_sessions_started_at")
        for name in ("episode_id", "programme_version_id"):
            table.add_column(sa.Column(name, sa.Uuid(), nullable=True))
        for name in ("therapist", "station", "signed_by"):
            table.add_column(sa.Column(name, sa.String(length=100), nullable=False, server_default=""))
        table.add_column(sa.Column("checks", sa.JSON(), nullable=False, server_default="[]"))
        for name in ("pain_before", "pain_during", "pain_after"):
            table.add_column(sa.Column(name, sa.Integer(), nullable=True))
        table.add_column(sa.Column("end_reason", sa.String(length=16), nullable=True))
        for name in ("signed_at", "updated_at"):
            table.add_column(sa.Column(name, _MOMENT, nullable=True))
        for name in ("run_count", "stop_count"):
            table.add_column(sa.Column(name, sa.Integer(), nullable=False, server_default="0"))
        table.create_foreign_key("fk_sessions_episode_id_episodes", "episodes", ["episode_id"], ["id"])
        table.create_foreign_key(
            "fk_sessions_programme_version_id_programme_versions",
            "programme_versions",
            ["programme_version_id"],
            ["id"],
        )
    for sentence in (
        "UPDATE sessions SET updated_at = COALESCE(ended_at, started_at),"
        " episode_id = (SELECT id FROM episodes WHERE episodes.patient_id = sessions.patient_id),"
        " run_count = (SELECT COUNT(*) FROM runs WHERE runs.session_id = sessions.id),"
        " stop_count = (SELECT COUNT(*) FROM runs WHERE runs.session_id = sessions.id AND runs.outcome = 'stopped')",
        "INSERT INTO session_stops (session_id, code, started_at) SELECT DISTINCT s.id, r.stop_code, s.started_at"
        " FROM runs r JOIN sessions s ON s.id = r.session_id WHERE r.outcome = 'stopped' AND r.stop_code IS NOT NULL",
        "UPDATE runs SET worst_rmse_deg = (SELECT MAX(t.rmse_deg) FROM motor_tracking t WHERE t.run_id = runs.id),"
        " worst_peak_deg = (SELECT MAX(ABS(t.peak_deg)) FROM motor_tracking t WHERE t.run_id = runs.id)",
        "UPDATE runs SET repetitions_done = repetitions WHERE outcome = 'completed'",
        "UPDATE runs SET repetitions_done = 0, played_s = 0 WHERE outcome = 'unloaded'",
        "UPDATE runs SET played_s = samples * 1.0 / rate_hz WHERE samples IS NOT NULL AND rate_hz IS NOT NULL",
    ):
        op.execute(sentence)
    with op.batch_alter_table("sessions") as table:
        table.alter_column("updated_at", existing_type=_MOMENT, nullable=False)
        table.create_index("ix_sessions_started_at_id", ["started_at", "id"])
        table.create_index("ix_sessions_patient_id_started_at", ["patient_id", "started_at", "id"])
        table.create_index("ix_sessions_therapist_started_at", ["therapist", "started_at", "id"])
        table.create_index("ix_sessions_station_started_at", ["station", "started_at", "id"])
        table.create_index("ix_sessions_therapist_station_started_at", ["therapist", "station", "started_at", "id"])
        table.create_index("ix_sessions_episode_id", ["episode_id"])


def _as_it_was() -> None:
    """Set the patient's side to that of the newest episode, or to the right one if there is no episode."""
    op.add_column("patients", sa.Column("affected_side", sa.String(length=8), nullable=True))
    op.execute(
        "UPDATE patients SET affected_side = COALESCE((SELECT side FROM episodes e WHERE e.patient_id = patients.id"
        " ORDER BY e.closed_at IS NOT NULL, e.opened_at DESC LIMIT 1), 'right')"
    )


def _check() -> None:
    """Check foreign keys, which SQLite does not enforce while tables change."""
    connection = op.get_bind()
    if connection.dialect.name == "sqlite":
        lost = connection.exec_driver_sql("PRAGMA foreign_key_check").all()
        if lost:
            raise RuntimeError(f"records would refer to missing rows: {lost}")
