"""Report contents of a treated patient."""

from datetime import UTC, datetime
from typing import Any

from kata.database.engine import Database
from kata.reporting import episode, session
from kata.reporting.content import EpisodeContent, SessionContent
from kata.reporting.letterhead import Letterhead
from kata.reporting.phrases import Language
from kata.reporting.rendering import PrintOptions
from tests.support.treatment import PLAIN, Texts, treat

CLINIC = Letterhead("みどり整形外科", ("宮城県仙台市青葉区1-2-3",), "022-000-0000")


AT = datetime(2026, 11, 30, 3, 4, tzinfo=UTC)


def print_options(language: Language = "en") -> PrintOptions:
    return PrintOptions(CLINIC, language, "Asia/Tokyo", AT)


def contents(database: Database, texts: Texts = PLAIN, **kinds: Any) -> tuple[SessionContent, EpisodeContent]:
    with database.write() as writing:
        treated = treat(writing, texts, **kinds)
    with database.read() as reading:
        return (
            session.read_content(reading, treated.session_ids[0], UTC),
            episode.read_content(reading, treated.episode_id, UTC),
        )
