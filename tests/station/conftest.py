"""Stations without a device process."""

from typing import Any

import pytest

from kata.station import station as module
from tests.support.silent_device import Silent


@pytest.fixture
def silent(monkeypatch: pytest.MonkeyPatch) -> list[Silent]:
    """Return the control programs of the stations that a test makes. Stations do not wait for their answers."""
    made: list[Silent] = []

    def make(*args: Any, **kwargs: Any) -> Silent:
        made.append(Silent(*args, **kwargs))
        return made[-1]

    monkeypatch.setattr(module, "DeviceProcess", make)
    monkeypatch.setattr(module, "_REPLY_LIMIT_S", 0.0)
    monkeypatch.setattr(module, "_LOAD_LIMIT_S", 0.0)
    return made
