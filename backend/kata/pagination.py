"""The envelope of every list, and keyset pagination for lists that grow without bound.

A page begins after the last row of the previous page, so that every page costs the same. The total is not counted.
"""

from base64 import urlsafe_b64decode, urlsafe_b64encode
from collections.abc import Callable, Sequence
from typing import Annotated, Any, Final, Generic, Self, TypeVar

from fastapi import Query
from pydantic import Field, TypeAdapter
from sqlalchemy import ColumnElement, Select, literal, tuple_
from sqlalchemy.orm import InstrumentedAttribute

from kata import texts
from kata.errors import ProblemError
from kata.types import Schema

Item = TypeVar("Item")
Row = TypeVar("Row")
Keys = TypeVar("Keys", bound=tuple[Any, ...])
Selected = TypeVar("Selected", bound=Select[*tuple[Any, ...]])

Limit = Annotated[int, Query(ge=1, le=200, description="Maximum number of rows.")]
After = Annotated[
    str | None,
    Query(max_length=1000, description="`next` of the previous page; by default the list starts at its beginning."),
]
Next = Annotated[str | None, Field(description="Value of `after` for the next page; null at the end of the list.")]


class Page(Schema, Generic[Item]):
    """A list, or one page of a list that grows without bound."""

    items: list[Item]
    next: Next

    @classmethod
    def complete(cls, items: list[Item]) -> Self:
        """Return a whole list. Use it for lists that are short by nature and have no pages."""
        return cls(items=items, next=None)


class Keyset(Generic[Keys]):
    """The order of a list, given by columns whose combined values are unique."""

    def __init__(
        self, kinds: type[Keys], *columns: InstrumentedAttribute[Any] | ColumnElement[Any], descending: bool = False
    ) -> None:
        """``kinds``: the types of the columns' values, as a tuple."""
        self._adapter = TypeAdapter(kinds)
        self._columns = columns
        self._descending = descending

    def page(self, query: Selected, after: str | None, limit: int) -> Selected:
        """Return the query of a page and one more row, which shows whether another page follows.

        :raises ProblemError: 422 when ``after`` is not a valid cursor.
        """
        if after is not None:
            cursor_values = tuple_(
                *(literal(key, column.type) for key, column in zip(self._read(after), self._columns, strict=True))
            )
            row_values = tuple_(*self._columns)
            query = query.where(row_values < cursor_values if self._descending else row_values > cursor_values)
        order = (column.desc() if self._descending else column.asc() for column in self._columns)
        return query.order_by(*order).limit(limit + 1)

    def cut(self, rows: Sequence[Row], limit: int, keys: Callable[[Row], Keys]) -> tuple[Sequence[Row], str | None]:
        """Return the page's rows, and the cursor of the next page if :meth:`page` found one more row."""
        if len(rows) <= limit:
            return rows, None
        page_rows = rows[:limit]
        return page_rows, urlsafe_b64encode(self._adapter.dump_json(keys(page_rows[-1]))).decode()

    def _read(self, after: str) -> Keys:
        try:
            keys = self._adapter.validate_json(urlsafe_b64decode(after.encode()))
        except ValueError as error:
            raise _DAMAGED from error
        # No column contains this character, and PostgreSQL rejects it.
        if any("\0" in key for key in keys if isinstance(key, str)):
            raise _DAMAGED
        return keys


_DAMAGED: Final = ProblemError(422, "damaged_cursor", texts.LIST_POSITION_UNREADABLE(), texts.BEGIN_LIST_ANEW())
