"""Commands as a page sends them: a command that can start motion carries the last state that the page received."""

from typing import Any, Protocol

from kata.bench.running_service import GUARDED


class _Client(Protocol):
    def get(self, url: str, /, *, headers: Any = None) -> Any: ...

    def post(self, url: str, /, *, json: Any = None, headers: Any = None) -> Any: ...


def seen(client: _Client, headers: dict[str, str] | None = None) -> dict[str, Any]:
    """Return the body of a guarded command that is based on the newest state."""
    live = client.get("/api/station", headers=headers).json()["live"]
    return {"stops": live["stops"], "seen_at": live["at"]}


def operate(client: _Client, command: str, body: Any = None, headers: dict[str, str] | None = None) -> Any:
    """Post a command to the station and return the answer."""
    if command in GUARDED and body is None:
        body = seen(client, headers)
    return client.post(f"/api/station/{command}", json=body, headers=headers)
