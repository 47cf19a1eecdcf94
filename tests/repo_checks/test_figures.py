"""Rules of the figures: their colours stand in one module and have counterparts on the page, and the page's Plotly can draw their traces."""

import re
from typing import Final

from tests.support.paths import ROOT

_HEX: Final = re.compile(r"#[0-9a-f]{6}\b")
_TRACE: Final = re.compile(r"""\btype"?(?::|=) ?["'](\w+)["']""")
_OTHERS: Final = frozenset(
    {
        "box",
        "contour",
        "heatmap",
        "histogram",
        "histogram2d",
        "image",
        "scattergl",
        "scatterpolar",
        "barpolar",
        "violin",
        "waterfall",
    }
)
"""Kinds of traces that plotly.js-basic-dist lacks (README of plotly.js-basic-dist: scatter, bar and pie)."""


def test_every_figure_colour_has_a_dark_counterpart() -> None:
    used = _HEX.findall((ROOT / "backend/kata/plotting/colours.py").read_text())
    counterparts = (ROOT / "frontend/src/ui/plotColours.ts").read_text()
    assert len(set(used)) == 10
    assert [colour for colour in used if f'"{colour}":' not in counterparts] == []


def test_modules_that_draw_figures_contain_no_colour() -> None:
    modules = list((ROOT / "backend/kata").rglob("*figure*.py"))
    assert len(modules) >= 3
    assert {str(path): found for path in modules if (found := _HEX.findall(path.read_text()))} == {}


def test_figures_have_only_traces_that_the_basic_bundle_draws() -> None:
    """Of other kinds the page would draw a line."""
    modules = [*(ROOT / "backend/kata").rglob("*figure*.py"), *(ROOT / "frontend/src").rglob("*[cC]hart*.ts*")]
    modules += [*(ROOT / "frontend/src").rglob("*[fF]igure*.ts*"), *(ROOT / "backend/kata/plotting").glob("*.py")]
    kinds = {kind for path in modules for kind in _TRACE.findall(path.read_text())}
    assert kinds >= {"scatter", "bar"}
    assert kinds & _OTHERS == set()
