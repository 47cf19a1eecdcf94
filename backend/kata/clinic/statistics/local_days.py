"""The local day of a time, and the Monday of its week, as SQL expressions for SQLite and PostgreSQL."""

from datetime import datetime, tzinfo
from typing import Any

from sqlalchemy import Date, Integer, case, cast
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.sql.compiler import SQLCompiler
from sqlalchemy.sql.elements import ColumnElement
from sqlalchemy.sql.functions import FunctionElement

from kata.clinic.local_time import offset_changes, offset_minutes


class local_day(FunctionElement[Any]):  # noqa: N801 - a SQL function
    """The local day of a UTC time between ``since`` and ``until``, in a time zone."""

    type = Date()
    inherit_cache = True

    def __init__(self, moment: ColumnElement[Any], since: datetime, until: datetime, zone: tzinfo) -> None:
        last = cast(offset_minutes(until, zone), Integer)
        changes = [(moment < at, cast(before, Integer)) for at, before in offset_changes(since, until, zone)]
        super().__init__(moment, case(*changes, else_=last) if changes else last)


class local_week(local_day):  # noqa: N801 - a SQL function
    """The Monday on or before the local day of a UTC time."""

    inherit_cache = True


@compiles(local_day, "sqlite")
def _sqlite(element: local_day, compiler: SQLCompiler, **options: Any) -> str:
    moment, minutes = element.clauses
    day = f"{compiler.process(moment, **options)}, ({compiler.process(minutes, **options)}) || ' minutes'"
    # "weekday 1" is the Monday on or after a day.
    return f"date({day}, '-6 days', 'weekday 1')" if isinstance(element, local_week) else f"date({day})"


@compiles(local_day, "postgresql")
def _postgresql(element: local_day, compiler: SQLCompiler, **options: Any) -> str:
    moment, minutes = element.clauses
    zone = f"{compiler.process(moment, **options)} AT TIME ZONE 'UTC'"
    local = f"{zone} + ({compiler.process(minutes, **options)}) * INTERVAL '1 minute'"
    begin = f"date_trunc('week', {local})" if isinstance(element, local_week) else local
    return f"CAST({begin} AS DATE)"
