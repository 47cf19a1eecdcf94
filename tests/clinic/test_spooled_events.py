"""The service reads events that an earlier version spooled. Stored names do not change with the names in the code."""

from datetime import UTC, datetime
from uuid import UUID

import msgspec
import pytest

from kata.clinic.event_spool import NotBegun
from kata.clinic.sessions.replay import (
    CheckAnswered,
    OfflineEvent,
    PainRecorded,
    RunStarted,
    SessionClosed,
    SessionOpened,
)
from kata.motion.edit import PlaybackSettings

AT = datetime(2026, 11, 24, 9, tzinfo=UTC)
SESSION, PATIENT, EPISODE, VERSION, RUN, RECORDING = (UUID(int=number) for number in range(1, 7))

# Written by commit 209efaf.
SPOOLED: list[tuple[str, OfflineEvent | NotBegun]] = [
    (
        '{"type":"opened","id":"00000000-0000-0000-0000-000000000001","patient_id":"00000000-0000-0000-0000-000000000002",'
        '"episode_id":"00000000-0000-0000-0000-000000000003","programme_version_id":"00000000-0000-0000-0000-000000000004",'
        '"therapist":"Ito Mai","station":"Station 1","started_at":"2026-11-24T09:00:00Z"}',
        SessionOpened(SESSION, PATIENT, EPISODE, VERSION, "Ito Mai", "Station 1", AT),
    ),
    (
        '{"type":"pained","session_id":"00000000-0000-0000-0000-000000000001","when":"pain_before","pain":4,'
        '"before":null,"at":"2026-11-24T09:00:00Z","station":"Station 1"}',
        PainRecorded(SESSION, "pain_before", 4, None, AT, "Station 1"),
    ),
    (
        '{"type":"closed","session_id":"00000000-0000-0000-0000-000000000001","reason":"completed",'
        '"at":"2026-11-24T09:00:00Z","station":"Station 1"}',
        SessionClosed(SESSION, "completed", AT, "Station 1"),
    ),
    (
        '{"type":"begun","id":"00000000-0000-0000-0000-000000000005","session_id":"00000000-0000-0000-0000-000000000001",'
        '"recording_id":"00000000-0000-0000-0000-000000000006","programme_position":1,"started_at":"2026-11-24T09:00:00Z",'
        '"load_level":8,"asked":{"speed_percent":80.0,"repetitions":2,"pause_s":1.0,"range_percent":90.0},"method":"smooth",'
        '"corrected_by":null,"allowed":"{}","station":"Station 1"}',
        RunStarted(
            id=RUN, session_id=SESSION, recording_id=RECORDING, programme_position=1, started_at=AT, resistance_level=8,
            settings=PlaybackSettings(80.0, 2, 1.0, 90.0), method="smooth", corrected_by=None, allowed="{}", station="Station 1",
        ),
    ),
    (
        '{"type":"ticked","session_id":"00000000-0000-0000-0000-000000000001","check":"belt","subject":"",'
        '"at":"2026-11-24T09:00:00Z","by":"Ito Mai"}',
        CheckAnswered(SESSION, "belt", "", AT, "Ito Mai"),
    ),
    ('{"type":"not_begun","what":"run","id":"00000000-0000-0000-0000-000000000005"}', NotBegun("run", RUN)),
]  # fmt: skip


@pytest.mark.parametrize(("spooled", "event"), SPOOLED, ids=[type(event).__name__ for _, event in SPOOLED])
def test_an_event_of_an_earlier_version_is_read(spooled: str, event: OfflineEvent | NotBegun) -> None:
    assert msgspec.json.decode(spooled, type=OfflineEvent | NotBegun) == event
    assert msgspec.json.decode(msgspec.json.encode(event)) == msgspec.json.decode(spooled)
