"""Checks of error responses."""

from typing import Any

from httpx2 import Response


def problem(answer: Response, status: int, code: str) -> dict[str, Any]:
    """Assert that the response is a problem document (RFC 9457) with this code."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem: dict[str, Any] = answer.json()
    assert problem["status"] == status
    assert problem["code"] == code
    assert problem["title"]
    assert problem["detail"].endswith(".")
    assert "Traceback" not in answer.text
    return problem
