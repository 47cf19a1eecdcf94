"""The live state names the patient only to users who may open the record; all users see the apparatus."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

import pytest

from kata.actor import CURRENT_ACTOR, Role
from kata.api.redaction import Redaction
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.clinic.restricted.tables import CareTeamRow
from kata.clinic.sessions.schemas import CheckConfirmation, SessionSign
from kata.database.engine import Database
from tests.support.databases import upgraded_file
from tests.support.login import signed_in_actor


@pytest.fixture
def clinic(tmp_path: Path) -> Iterator[Database]:
    made = Database(upgraded_file(tmp_path / "kata.db"))
    yield made
    made.close()


def patient(database: Database, *, restricted: bool = False, team: tuple[UUID, ...] = ()) -> UUID:
    with database.write() as session:
        wanted = PatientCreate(clinic_number=uuid4().hex[:8], name="Yamada Hanako", affected_side="left")
        row = patients.create(session, wanted)
        row.restricted = restricted
        session.flush()
        session.add_all(CareTeamRow(patient_id=row.id, account_id=account_id) for account_id in team)
        return row.id


def playing(patient_id: UUID) -> dict[str, Any]:
    """Return a live state with a patient and other fields."""
    whose = {"id": str(patient_id), "name": "Yamada Hanako"}
    run = {
        "run_id": str(uuid4()),
        "patient": whose,
        "recording_name": "Hanako's",
        "session_id": str(uuid4()),
        "left_s": 2.5,
    }
    return {"mode": "playing", "run": run, "teaching": {"patient": whose, "takes": 1}}


def shown(database: Database, role: Role, patient_id: UUID) -> dict[str, Any]:
    return asyncio.run(Redaction(signed_in_actor(database, role), database).apply(playing(patient_id)))


@pytest.mark.parametrize("role", ["viewer", "therapist", "administrator"])
def test_record_readers_see_the_patient_on_the_apparatus(clinic: Database, role: Role) -> None:
    answer = shown(clinic, role, patient(clinic))
    assert answer["run"]["patient"]["name"] == answer["teaching"]["patient"]["name"] == "Yamada Hanako"


def test_technician_sees_the_apparatus_state_without_names(clinic: Database) -> None:
    answer = shown(clinic, "technician", patient(clinic))
    assert "Hanako" not in str(answer)
    assert (answer["mode"], answer["run"]["left_s"], answer["teaching"]["takes"]) == ("playing", 2.5, 1)
    assert answer["run"]["session_id"] is None


@pytest.mark.parametrize("role", ["viewer", "therapist", "administrator", "technician"])
def test_restricted_patient_stays_unnamed(clinic: Database, role: Role) -> None:
    assert "Hanako" not in str(shown(clinic, role, patient(clinic, restricted=True)))


def test_the_care_team_sees_its_patient(clinic: Database) -> None:
    member = signed_in_actor(clinic, "therapist")
    whose = patient(clinic, restricted=True, team=(member.account_id,))
    answer = asyncio.run(Redaction(member, clinic).apply(playing(whose)))
    assert answer["run"]["patient"]["name"] == "Yamada Hanako"


def test_save_notices_reach_only_users_with_the_patient(clinic: Database) -> None:
    everybodys, restricted = patient(clinic), patient(clinic, restricted=True)

    def hears(role: Role, of: UUID) -> bool:
        return asyncio.run(Redaction(signed_in_actor(clinic, role), clinic).may_be_notified_of(of))

    assert [hears(role, everybodys) for role in ("viewer", "therapist", "technician")] == [True, True, False]
    assert [hears(role, restricted) for role in ("viewer", "therapist", "technician")] == [False, False, False]


def test_unattributed_action_shows_the_requesting_user(clinic: Database) -> None:
    before = CURRENT_ACTOR.set(signed_in_actor(clinic, "therapist"))
    try:
        assert CheckConfirmation().checked_by == "Test therapist"
        assert SessionSign(signed_by=" ", note="Went well.").signed_by == "Test therapist"
        assert CheckConfirmation(checked_by="Ito Mai").checked_by == "Ito Mai"
    finally:
        CURRENT_ACTOR.reset(before)
    assert CheckConfirmation().checked_by == ""
