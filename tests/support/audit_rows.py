"""Rows of the audit trail, by the API."""

from typing import Any

from fastapi.testclient import TestClient


def audit_log(client: TestClient, **wanted: Any) -> list[dict[str, Any]]:
    """Return the audit rows, newest first."""
    answer = client.get("/api/audit", params={"limit": 200} | wanted)
    assert answer.status_code == 200, answer.text
    items: list[dict[str, Any]] = answer.json()["items"]
    return items
