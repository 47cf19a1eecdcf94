"""The page as `npm run dev` serves it, which has the page of components."""

import os
import signal
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from tests.support.browser_clinic import START_LIMIT_S, Clinic
from tests.support.paths import ROOT
from tests.support.ports import free_port

_POLL_S: Final = 0.1


@contextmanager
def development_page(clinic: Clinic) -> Iterator[str]:
    """Serve the page of a running clinic from its sources. Yield its address."""
    port = free_port()
    url = f"http://127.0.0.1:{port}"
    server = subprocess.Popen(
        ["npm", "run", "dev", "--silent", "--", "--host", "127.0.0.1", "--port", str(port), "--strictPort"],
        cwd=ROOT / "frontend",
        env=os.environ | {"KATA_SERVICE": clinic.url},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        _wait(server, url)
        yield url
    finally:
        os.killpg(server.pid, signal.SIGTERM)
        server.wait(20)


def _wait(server: "subprocess.Popen[bytes]", url: str) -> None:
    limit = time.monotonic() + START_LIMIT_S
    while True:
        try:
            with urllib.request.urlopen(url, timeout=5):
                return
        except (urllib.error.URLError, OSError):
            assert server.poll() is None, "the page is not served"
            assert time.monotonic() < limit, url
            time.sleep(_POLL_S)
