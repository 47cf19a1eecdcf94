"""How much script the first page loads before anything is drawn."""

import gzip
import json
from typing import Any

from tests.conftest import ROOT

DIST = ROOT / "frontend/dist"
LIMIT_KB = 250


def test_the_first_page_loads_no_more_than_a_quarter_of_a_megabyte_of_script() -> None:
    manifest: dict[str, Any] = json.loads((DIST / ".vite/manifest.json").read_text())
    loaded: set[str] = set()

    def load(name: str) -> None:
        if name not in loaded:
            loaded.add(name)
            for other in manifest[name].get("imports", []):
                load(other)

    load("index.html")
    sizes = {name: len(gzip.compress((DIST / manifest[name]["file"]).read_bytes())) / 1000 for name in loaded}
    assert sum(sizes.values()) <= LIMIT_KB, sizes
