"""Route of the support bundle. ``kata support-bundle`` makes it in a separate process; the service adds its log and metrics."""

import asyncio
import os
import sys
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from fastapi import APIRouter, Request, Response
from prometheus_client import generate_latest

from kata import __version__
from kata.api import logs, texts
from kata.api.services import services_of
from kata.dependencies import PROBLEMS
from kata.errors import ProblemError
from kata.settings import Settings

router = APIRouter(prefix="/api/support-bundle", tags=["operation"])

_WITHIN_S: Final = 60.0
_FROM_SERVICE: Final = "log.txt"
"""File that the service replaces: the command cannot read the log of a service that systemd does not run."""


@router.get(
    "",
    response_class=Response,
    responses={200: {"content": {"application/zip": {}}}, **PROBLEMS.of(503)},
    summary="Download the support bundle",
)
async def get_support_bundle(request: Request) -> Response:
    """Return a ZIP file that describes this installation to its maintainers. It contains no patient data, user names or secrets."""
    services = services_of(request)
    figures = generate_latest(services.metrics.registry)
    with TemporaryDirectory(prefix="kata-support-") as folder:
        command_bundle = Path(folder) / "made.zip"
        await _run(services.settings, command_bundle)
        content = await asyncio.to_thread(_completed, command_bundle, figures)
    name = f"kata-support-{__version__}.zip"
    return Response(
        content, media_type="application/zip", headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )


async def _run(settings: Settings, out: Path) -> None:
    """Make the bundle at ``out`` by the command.

    :raises ProblemError: 503 when the command fails or takes too long.
    """
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "kata", "support-bundle", "--out", str(out)),
        env=os.environ | settings.as_environment(),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.DEVNULL,
    )
    try:
        async with asyncio.timeout(_WITHIN_S):
            failed = await process.wait()
    except TimeoutError:
        failed = 1
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
    if failed:
        raise ProblemError(503, "no_support_bundle", texts.NO_SUPPORT_BUNDLE(), texts.RUN_SUPPORT_COMMAND())


def _completed(command_bundle: Path, figures: bytes) -> bytes:
    """Return the command's bundle with the service's log and metrics."""
    completed = command_bundle.with_name("whole.zip")
    with zipfile.ZipFile(command_bundle) as parts, zipfile.ZipFile(completed, "w", zipfile.ZIP_DEFLATED) as bundle:
        for part in parts.infolist():
            if part.filename != _FROM_SERVICE:
                bundle.writestr(part, parts.read(part))
        bundle.writestr(_FROM_SERVICE, logs.RECENT.text())
        bundle.writestr("metrics.txt", figures)
    return completed.read_bytes()
