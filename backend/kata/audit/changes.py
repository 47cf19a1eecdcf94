"""What a writing session changes, as far as the trail tells it: tables, ids and names of columns, and never what stands in them."""

from typing import Any, Final
from uuid import UUID

from sqlalchemy import event, inspect
from sqlalchemy.orm import Mapper, ORMExecuteState, Session

QUIET: Final = frozenset({"audit", "backups", "device_events", "recovery_codes", "sign_ins", "spools", "stations"})
"""Tables that are records of what happened themselves, or kept by the machinery; who changes them on purpose notes it."""
_QUIET_COLUMNS: Final = {"accounts": frozenset({"totp_last_step", "updated_at"})}
_MOST: Final = 8
"""Of a table whose rows change in greater numbers, only their number is told."""


class Changes:
    """Collects what is sent to the database in one session."""

    def __init__(self, session: Session) -> None:
        """From now on."""
        self.patient_id: UUID | None = None
        """Whose record it is, where a row says so."""
        self.subject = ""
        """The first row that was added, or else changed: kind and id."""
        self._rows: dict[str, dict[str, dict[str, set[str]]]] = {"added": {}, "changed": {}, "removed": {}}
        self._bulk: set[str] = set()
        event.listen(session, "after_flush", self._flushed)
        event.listen(session, "do_orm_execute", self._executed)

    def __bool__(self) -> bool:
        """Whether there is anything to tell."""
        return bool(self._bulk) or any(self._rows.values())

    def detail(self) -> dict[str, Any]:
        """For the trail."""
        told: dict[str, Any] = {}
        for kind, tables in self._rows.items():
            for table, rows in tables.items():
                if len(rows) > _MOST:
                    of_table: Any = len(rows)
                elif kind == "changed":
                    of_table = {key: sorted(columns) for key, columns in rows.items()}
                else:
                    of_table = list(rows)
                told.setdefault(kind, {})[table] = of_table
        if self._bulk:
            told["changed_many"] = sorted(self._bulk)
        return told

    def _flushed(self, session: Session, _: object) -> None:
        for row in session.new:
            self._note("added", row, set())
        for row in session.dirty:
            state = inspect(row)
            mapper: Mapper[Any] = state.mapper
            columns = {
                attribute.key for attribute in mapper.column_attrs if state.attrs[attribute.key].history.has_changes()
            }
            columns -= _QUIET_COLUMNS.get(_table(mapper), frozenset())
            if columns:
                self._note("changed", row, columns)
        for row in session.deleted:
            self._note("removed", row, set())

    def _note(self, kind: str, row: Any, columns: set[str]) -> None:
        mapper: Mapper[Any] = inspect(row).mapper
        table = _table(mapper)
        if table in QUIET:
            return
        key = " ".join(str(part) for part in mapper.primary_key_from_instance(row))
        self._rows[kind].setdefault(table, {}).setdefault(key, set()).update(columns)
        self.subject = self.subject or f"{table} {key}"
        if self.patient_id is None:
            whose = row.id if table == "patients" else getattr(row, "patient_id", None)
            self.patient_id = whose if isinstance(whose, UUID) else None

    def _executed(self, execution: ORMExecuteState) -> None:
        if not (execution.is_insert or execution.is_update or execution.is_delete):
            return
        name = getattr(getattr(execution.statement, "table", None), "name", "")
        if name not in QUIET:
            self._bulk.add(name)


def _table(mapper: Mapper[Any]) -> str:
    return str(getattr(mapper.local_table, "name", ""))
