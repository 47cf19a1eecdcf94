"""Collect the changes of a writing session for the audit trail: tables, ids and column names, but no values."""

from typing import Any, Final
from uuid import UUID

from sqlalchemy import event, inspect
from sqlalchemy.orm import Mapper, ORMExecuteState, Session

from kata.database.base import column_name

NOT_COLLECTED: Final = frozenset(
    {
        "audit", "backups", "device_events", "episode_outcomes", "exported_statements", "read_notifications", "recovery_codes",
        "sign_ins", "spools", "station_hours", "stations",
    }
)  # fmt: skip
"""Tables that are logs themselves, are derived from others, or belong to internal machinery. Code that changes them for a user adds its own audit entry."""
_COLUMNS_NOT_COLLECTED: Final = {
    "accounts": frozenset({"totp_last_step", "updated_at"}),
    "access_tokens": frozenset({"last_used_at"}),
}
_MAX_ROWS: Final = 8
"""If more rows of a table change, the trail contains only the number of rows."""


class Changes:
    """The changes of one session."""

    def __init__(self, session: Session) -> None:
        """Start to collect the changes of ``session``."""
        self.patient_id: UUID | None = None
        """Patient of the first changed row that has a patient."""
        self.subject = ""
        """Table and id of the first added row, else of the first changed row."""
        self._rows: dict[str, dict[str, dict[str, set[str]]]] = {"added": {}, "changed": {}, "removed": {}}
        self._bulk: set[str] = set()
        event.listen(session, "after_flush", self._on_flush)
        event.listen(session, "do_orm_execute", self._on_execute)

    def __bool__(self) -> bool:
        """Return whether anything has changed."""
        return bool(self._bulk) or any(self._rows.values())

    def detail(self) -> dict[str, Any]:
        """Return the changes as an entry's detail."""
        detail: dict[str, Any] = {}
        for kind, tables in self._rows.items():
            for table, rows in tables.items():
                if len(rows) > _MAX_ROWS:
                    of_table: Any = len(rows)
                elif kind == "changed":
                    of_table = {key: sorted(columns) for key, columns in rows.items()}
                else:
                    of_table = list(rows)
                detail.setdefault(kind, {})[table] = of_table
        if self._bulk:
            detail["changed_many"] = sorted(self._bulk)
        return detail

    def _on_flush(self, session: Session, _: object) -> None:
        for row in session.new:
            self._collect("added", row, set())
        for row in session.dirty:
            state = inspect(row)
            mapper: Mapper[Any] = state.mapper
            columns = {
                column_name(attribute)
                for attribute in mapper.column_attrs
                if state.attrs[attribute.key].history.has_changes()
            }
            columns -= _COLUMNS_NOT_COLLECTED.get(_table_name(mapper), frozenset())
            if columns:
                self._collect("changed", row, columns)
        for row in session.deleted:
            self._collect("removed", row, set())

    def _collect(self, kind: str, row: Any, columns: set[str]) -> None:
        mapper: Mapper[Any] = inspect(row).mapper
        table = _table_name(mapper)
        if table in NOT_COLLECTED:
            return
        key = " ".join(str(part) for part in mapper.primary_key_from_instance(row))
        self._rows[kind].setdefault(table, {}).setdefault(key, set()).update(columns)
        self.subject = self.subject or f"{table} {key}"
        if self.patient_id is None:
            patient_id = row.id if table == "patients" else getattr(row, "patient_id", None)
            self.patient_id = patient_id if isinstance(patient_id, UUID) else None

    def _on_execute(self, execution: ORMExecuteState) -> None:
        if not (execution.is_insert or execution.is_update or execution.is_delete):
            return
        name = getattr(getattr(execution.statement, "table", None), "name", "")
        if name not in NOT_COLLECTED:
            self._bulk.add(name)


def _table_name(mapper: Mapper[Any]) -> str:
    return str(getattr(mapper.local_table, "name", ""))
