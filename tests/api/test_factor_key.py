"""Second factors are encrypted in the database: it reveals no codes, and users can sign in after the key is lost."""

import logging
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy import select

from kata.auth.factor_key import FactorKey
from kata.auth.tables import AccountRow
from kata.settings import Settings
from tests.support.login_service import PASSWORD, Clinic, clinic, code
from tests.support.second_factor import enrol
from tests.support.service import replaced, running


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("factor-key")


@pytest.fixture(scope="module")
def shared(folder: Path) -> Iterator[Clinic]:
    with clinic(folder) as made:
        yield made


def sealed_of(clinic: Clinic, username: str) -> str:
    with clinic.database.read() as session:
        sealed = session.scalars(select(AccountRow.totp_sealed).where(AccountRow.username == username)).one()
    assert sealed
    return sealed


def test_database_reveals_no_codes_and_does_not_contain_the_key(shared: Clinic, folder: Path) -> None:
    username = shared.account()
    app, _ = enrol(shared.sign_in(username), shared.clock.seconds())
    written = b"".join(file.read_bytes() for file in folder.glob("kata.db*"))
    assert sealed_of(shared, username).encode() in written, "the database contains the sealed secret"
    assert app.secret.encode() not in written
    key = folder / "second-factor-key.txt"
    assert key.stat().st_mode & 0o777 == 0o600
    assert key.read_text().splitlines()[-1].encode() not in written


def test_sealed_secret_in_anothers_row_opens_nothing(shared: Clinic) -> None:
    mine, hers = shared.account(), shared.account()
    app, _ = enrol(shared.sign_in(mine), shared.clock.seconds())
    enrol(shared.sign_in(hers), shared.clock.seconds())
    with shared.database.write() as session:
        rows = {
            row.username: row
            for row in session.scalars(select(AccountRow).where(AccountRow.username.in_([mine, hers])))
        }
        rows[hers].totp_sealed = rows[mine].totp_sealed
    shared.clock.forward(60)
    given = {"username": hers, "password": PASSWORD, "code": app.at(shared.clock.seconds())}
    assert code(shared.browser().post("/api/sign-in", json=given), 403) == "second_factor_unreadable"
    shared.sign_in(mine, code=given["code"])


def test_without_the_key_recovery_codes_work_and_reset_enrols_again(shared: Clinic) -> None:
    username = shared.account()
    app, recovery = enrol(shared.sign_in(username), shared.clock.seconds())
    shared.clock.forward(60)
    auth = replace(shared.app.state.services.auth, factor_key=FactorKey())
    with replaced(shared.app, auth=auth):
        given = {"username": username, "password": PASSWORD, "code": app.at(shared.clock.seconds())}
        assert code(shared.browser().post("/api/sign-in", json=given), 403) == "second_factor_unreadable"
        shared.sign_in(username, code=recovery[0])
        path = f"/api/accounts/{shared.id_of(username)}/reset"
        one_time = shared.administrator.post(path, json={"second_factor": True}).json()["code"]
        setting = {"username": username, "code": one_time, "password": PASSWORD}
        assert shared.browser().post("/api/set-password", json=setting).status_code == 204
        fresh, _ = enrol(shared.sign_in(username), shared.clock.seconds())
        shared.clock.forward(60)
        shared.sign_in(username, code=fresh.at(shared.clock.seconds()))


def test_start_with_another_key_lists_factors_it_cannot_open(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with clinic(tmp_path) as first:
        enrol(first.sign_in(first.account()), first.clock.seconds())
    settings = Settings(data=tmp_path)
    settings.effective_second_factor_key.unlink()
    with caplog.at_level(logging.ERROR), running(tmp_path, simulate=False):
        answer = [record.getMessage() for record in caplog.records if record.name == "kata.auth.login"]
    assert len(answer) == 1
    assert answer[0].startswith("the second factors of 1 accounts were encrypted with a key that is not in ")
    assert settings.effective_second_factor_key.exists()


def test_services_on_one_database_open_each_others_secrets(tmp_path: Path, services_url: str) -> None:
    key = tmp_path / "shared" / "key.txt"
    with running(tmp_path / "1", simulate=False, database_url=services_url, second_factor_key=key) as client:
        first = Clinic(client)
        username = first.account()
        app, _ = enrol(first.sign_in(username), first.clock.seconds())
        with running(tmp_path / "2", simulate=False, database_url=services_url, second_factor_key=key) as other:
            second = Clinic(other)
            second.clock.forward(60)
            second.sign_in(username, code=app.at(second.clock.seconds()))
