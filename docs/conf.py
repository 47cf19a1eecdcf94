"""Sphinx builds the site from docs/ in English, and the manual in docs/manual/ja in Japanese (``make docs``)."""

from pathlib import Path

_HERE = Path(__file__).parent

project = "Kata"
author = "The Kata project"
copyright = ""  # noqa: A001 - Sphinx's name
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build", "_templates", "manual/ja"]
language = "en"

# Anchors as GitHub makes them, so that a link works in both.
myst_heading_anchors = 3
myst_enable_extensions = ["colon_fence"]
# "text" marks blocks without a program.
highlight_language = "text"
# A TOML file with an ellipsis is no TOML.
suppress_warnings = ["misc.highlighting_failure"]

html_theme = "alabaster"
html_title = "Kata"
html_theme_options = {
    "fixed_sidebar": False,
    "show_powered_by": False,
    "font_family": "system-ui, sans-serif",
    "head_font_family": "system-ui, sans-serif",
    "page_width": "1100px",
    "sidebar_width": "260px",
}
html_static_path = [str(_HERE / "_static")]
templates_path = [str(_HERE / "_templates")]
html_css_files = ["kata.css"]
html_sidebars = {"**": ["kata.html", "navigation.html", "searchbox.html"]}
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_show_copyright = False
html_use_index = False
html_domain_indices = False
# The date of a build would make every build another one.
html_last_updated_fmt = None
