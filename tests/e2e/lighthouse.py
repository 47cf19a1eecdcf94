"""``python -m tests.e2e.lighthouse --program PATH``: Lighthouse's scores of home, patient, session and station of a seeded clinic.

Each page is loaded as a telephone, a tablet and a desktop. ``--page`` and ``--device`` choose some of them; each may be repeated.
``--keep`` stores the whole reports. A line has the device, the page, the scores, the layout shift, the time of the largest paint, how long
the page was blocked, and the audits below full score outside of performance.
Build the page first. ``KATA_CHROMIUM`` names the browser. Lighthouse is an npm package; ``npm install --prefix FOLDER lighthouse`` fetches it.
"""

import json
import os
import subprocess
import tempfile
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import httpx2
import typer

from kata.auth.login_session import COOKIE
from tests.support.browser_clinic import Clinic, seeded_clinic
from tests.support.login import signed_in_at
from tests.support.paths import ROOT

_DEVICES: Final = {
    "telephone": (),
    # Lighthouse has no tablet. This is its telephone, with its slow processor and network, with another screen.
    "tablet": ("--screenEmulation.width=800", "--screenEmulation.height=1280", "--screenEmulation.deviceScaleFactor=2"),
    "desktop": ("--preset=desktop",),
}
_CATEGORIES: Final = ("performance", "accessibility", "best-practices")
_LIMIT_S: Final = 300.0


def main(
    program: Annotated[Path, typer.Option(help="The program lighthouse.")],
    page: Annotated[list[str] | None, typer.Option(help="Only this page, for example patient.")] = None,
    device: Annotated[list[str] | None, typer.Option(help=f"Only one of {', '.join(_DEVICES)}.")] = None,
    runs: Annotated[int, typer.Option(help="Number of runs of each page.")] = 1,
    keep: Annotated[Path | None, typer.Option(help="Folder for Lighthouse's whole reports.")] = None,
) -> None:
    """Print Lighthouse's scores of four pages of a seeded clinic."""
    with (
        tempfile.TemporaryDirectory(prefix="kata-") as name,
        seeded_clinic(Path(name), partial(signed_in_at, Path(name))) as (clinic, cookie),
    ):
        folder = Path(name)
        (folder / "headers.json").write_text(json.dumps({"Cookie": f"{COOKIE}={cookie}"}))
        pages = {name: path for name, path in _pages(clinic, cookie).items() if name in (page or [name])}
        for form in device or _DEVICES:
            for name_of_page, path in pages.items():
                for run in range(runs):
                    result = _result(program, clinic.url + path, folder, _DEVICES[form])
                    if keep:
                        keep.mkdir(parents=True, exist_ok=True)
                        (keep / f"{form}-{name_of_page}-{run + 1}.json").write_text(json.dumps(result))
                    typer.echo(f"{form} {name_of_page}: {_summary(result)}; load {os.getloadavg()[0]:.1f}")


def _pages(clinic: Clinic, cookie: str) -> dict[str, str]:
    """Return the address of each page by name."""
    with httpx2.Client(base_url=clinic.url, cookies={COOKIE: cookie}, timeout=30) as client:
        patient = client.get("/api/patients", params={"search": "DEMO-001"}).json()["items"][0]["id"]
        session = client.get(f"/api/patients/{patient}/sessions").json()["items"][0]["id"]
    return {"home": "/", "patient": f"/patients/{patient}", "session": f"/sessions/{session}", "station": "/station"}


def _result(program: Path, url: str, folder: Path, options: tuple[str, ...]) -> dict[str, Any]:
    """Run Lighthouse on one page. Return its report."""
    output = folder / "result.json"
    browser = os.environ.get("KATA_CHROMIUM") or str(ROOT / ".cache/chromium/chromium")
    command = [
        str(program), url, "--quiet", "--output=json", f"--output-path={output}", f"--only-categories={','.join(_CATEGORIES)}",
        f"--extra-headers={folder / 'headers.json'}", "--chrome-flags=--headless --no-sandbox", *options,
    ]  # fmt: skip
    subprocess.run(command, check=True, timeout=_LIMIT_S, env=os.environ | {"CHROME_PATH": browser})
    result: dict[str, Any] = json.loads(output.read_text())
    return result


def _summary(result: dict[str, Any]) -> str:
    """Return the scores, layout shift, largest paint, blocking time, and audits without full score outside of performance."""
    categories, audits = result["categories"], result["audits"]
    scores = ", ".join(f"{name} {100 * (categories[name]['score'] or 0):.0f}" for name in _CATEGORIES)
    named = {reference["id"] for name in _CATEGORIES[1:] for reference in categories[name]["auditRefs"]}
    failed = sorted(name for name in named if (audits[name]["score"] is not None and audits[name]["score"] < 1))
    shift, paint_ms, blocked_ms = (
        audits[name].get("numericValue", 0)
        for name in ("cumulative-layout-shift", "largest-contentful-paint", "total-blocking-time")
    )
    shifted = [item["node"]["selector"] for item in audits["layout-shifts"].get("details", {}).get("items", [])]
    moved = f" of {shifted[0]}" if shifted else ""
    paint = f"largest paint {paint_ms / 1000:.1f} s, blocked {blocked_ms:.0f} ms"
    return f"{scores}; shift {shift:.3f}{moved}; {paint}; below full score: {', '.join(failed) or 'none'}"


if __name__ == "__main__":
    typer.run(main)
