"""The local day of a time as a SQL expression for SQLite and PostgreSQL."""

from typing import Any

from sqlalchemy import Date, Integer, cast
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.sql.compiler import SQLCompiler
from sqlalchemy.sql.elements import ColumnElement
from sqlalchemy.sql.functions import FunctionElement


class local_day(FunctionElement[Any]):  # noqa: N801 - a SQL function
    """The local day of a UTC time, in a zone that is ``minutes`` ahead of UTC."""

    type = Date()
    inherit_cache = True

    def __init__(self, moment: ColumnElement[Any], minutes: int) -> None:
        super().__init__(moment, cast(minutes, Integer))


@compiles(local_day, "sqlite")
def _sqlite(element: local_day, compiler: SQLCompiler, **options: Any) -> str:
    moment, minutes = element.clauses
    return f"date({compiler.process(moment, **options)}, {compiler.process(minutes, **options)} || ' minutes')"


@compiles(local_day, "postgresql")
def _postgresql(element: local_day, compiler: SQLCompiler, **options: Any) -> str:
    moment, minutes = element.clauses
    zone = f"{compiler.process(moment, **options)} AT TIME ZONE 'UTC'"
    return f"CAST({zone} + {compiler.process(minutes, **options)} * INTERVAL '1 minute' AS DATE)"
