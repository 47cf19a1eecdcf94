"""Ask the database whether it answers, with a time limit."""

import asyncio
import logging
from typing import Final

from sqlalchemy import text

from kata.database.engine import Database

log = logging.getLogger(__name__)

_ANSWERS_WITHIN_S: Final = 1.0


class DatabaseProbe:
    """Asks the database with at most one query at a time, so that a hanging database blocks only one thread, however many requests ask."""

    def __init__(self, database: Database, limit_s: float = _ANSWERS_WITHIN_S) -> None:
        """``limit_s``: seconds that :meth:`answers` waits."""
        self._database = database
        self._limit_s = limit_s
        self._query: asyncio.Task[bool] | None = None

    async def answers(self) -> bool:
        """Return whether the database answers within the limit."""
        if self._query is None or self._query.done():
            self._query = asyncio.create_task(asyncio.to_thread(self._ask), name="database probe")
        done, _ = await asyncio.wait({self._query}, timeout=self._limit_s)
        return bool(done) and self._query.result()

    def _ask(self) -> bool:
        try:
            with self._database.read() as session:
                session.execute(text("SELECT 1"))
        except Exception as error:
            log.info("the database does not answer: %s", error)
            return False
        return True
