"""Second-factor enrolment through the API."""

import pyotp
from fastapi.testclient import TestClient


def enrol(browser: TestClient, at: float) -> tuple[pyotp.TOTP, list[str]]:
    """Set up a second factor; return the app and the recovery codes."""
    begun = browser.post("/api/me/second-factor", json={}).json()
    assert begun["picture"].startswith("data:image/svg+xml")
    app = pyotp.parse_uri(begun["address"])
    assert isinstance(app, pyotp.TOTP)
    confirmed = browser.put("/api/me/second-factor", json={"code": app.at(at)})
    assert confirmed.status_code == 200, confirmed.text
    return app, confirmed.json()["codes"]
