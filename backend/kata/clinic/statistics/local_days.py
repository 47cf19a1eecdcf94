"""The local day of a time, and the Monday of its week, as SQL expressions for SQLite and PostgreSQL."""

from datetime import date, datetime, timedelta, tzinfo
from typing import Any, Final

from sqlalchemy import Dialect, Integer, case, cast
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.sql.compiler import SQLCompiler
from sqlalchemy.sql.elements import ColumnElement
from sqlalchemy.sql.functions import FunctionElement
from sqlalchemy.types import TypeDecorator

from kata.clinic.local_time import offset_changes, offset_minutes

_FIRST_DAY: Final = date(1970, 1, 1)


class _DayNumber(TypeDecorator[date]):
    """A day, in SQL the number of days since 1970. SQLite groups thousands of numbers faster than texts."""

    impl = Integer
    cache_ok = True

    def process_result_value(self, value: int | None, dialect: Dialect) -> date | None:
        """Return the day."""
        return None if value is None else _FIRST_DAY + timedelta(days=value)


class local_day(FunctionElement[Any]):  # noqa: N801 - a SQL function
    """The local day of a UTC time between ``since`` and ``until``, in a time zone."""

    type = _DayNumber()
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
    # Not unixepoch(), which SQLite has since 3.38 only. Julian days have milliseconds.
    unix_s = f"CAST((julianday({compiler.process(moment, **options)}) - 2440587.5) * 86400 + 0.0004 AS INTEGER)"
    seconds = f"{unix_s} + ({compiler.process(minutes, **options)}) * 60"
    day = f"({seconds}) / 86400"
    # The first Monday is day 4.
    return f"({day} - 4) / 7 * 7 + 4" if isinstance(element, local_week) else day


@compiles(local_day, "postgresql")
def _postgresql(element: local_day, compiler: SQLCompiler, **options: Any) -> str:
    moment, minutes = element.clauses
    zone = f"{compiler.process(moment, **options)} AT TIME ZONE 'UTC'"
    local = f"{zone} + ({compiler.process(minutes, **options)}) * INTERVAL '1 minute'"
    begin = f"date_trunc('week', {local})" if isinstance(element, local_week) else local
    return f"CAST({begin} AS DATE) - DATE '1970-01-01'"
