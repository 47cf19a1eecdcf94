"""The pinned Python packages."""

import re

from tests.support.paths import ROOT


def pins(name: str) -> dict[str, str]:
    """Return the block of each pin in a file of requirements, by package name."""
    blocks = re.split(r"\n(?=\S)", (ROOT / name).read_text())
    return {block.split("==")[0].split("[")[0]: block for block in blocks if "==" in block}
