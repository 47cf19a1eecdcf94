"""A clinic in its own process with texts of a test's choice in every text column; its user has such a name too."""

from pathlib import Path

from kata.audit.audit_log import AuditHook
from kata.clinic.statistics.derived_tables import DerivedTablesHook
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from tests.support.browser_clinic import Clinic
from tests.support.login import signed_in_at
from tests.support.poisoned_database import Poison, poison


class PoisonedClinic(Clinic):
    """``kata serve --simulate`` on a poisoned database."""

    def __init__(self, folder: Path, texts: list[str]) -> None:
        poisoned_user = signed_in_at(folder, name=texts[0])
        database = Database(f"sqlite:///{folder / 'kata.db'}")
        upgrade(database)
        DerivedTablesHook(database)
        AuditHook(database)
        with database.write() as session:
            self.poison: Poison = poison(session, texts)
        database.close()
        super().__init__(folder)
        self.cookie = poisoned_user
