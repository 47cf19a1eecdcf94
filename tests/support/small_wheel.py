"""Wheels of a few text files, in place of Kata's in tests of installations."""

import base64
import hashlib
import zipfile
from collections.abc import Mapping
from pathlib import Path


def small_wheel(folder: Path, version: str, files: Mapping[str, str]) -> Path:
    """Write a wheel named kata with these files. Its command ``kata`` calls ``kata_release.main``."""
    info = f"kata-{version}.dist-info"
    content = {
        **files,
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: kata\nVersion: {version}\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{info}/entry_points.txt": "[console_scripts]\nkata = kata_release:main\n",
    }
    wheel = folder / f"kata-{version}-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        record = []
        for name, text in content.items():
            archive.writestr(name, text)
            digest = base64.urlsafe_b64encode(hashlib.sha256(text.encode()).digest()).rstrip(b"=").decode()
            record.append(f"{name},sha256={digest},{len(text.encode())}\n")
        archive.writestr(f"{info}/RECORD", "".join(record) + f"{info}/RECORD,,\n")
    return wheel
