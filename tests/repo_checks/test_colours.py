"""The colours of the service's figures stand in one module, and each has a counterpart on the page."""

import re
from typing import Final

from tests.support.paths import ROOT

_HEX: Final = re.compile(r"#[0-9a-f]{6}\b")


def test_every_figure_colour_has_a_dark_counterpart() -> None:
    used = _HEX.findall((ROOT / "backend/kata/plotting/colours.py").read_text())
    counterparts = (ROOT / "frontend/src/ui/plotColours.ts").read_text()
    assert len(set(used)) == 10
    assert [colour for colour in used if f'"{colour}":' not in counterparts] == []


def test_modules_that_draw_figures_contain_no_colour() -> None:
    modules = list((ROOT / "backend/kata").rglob("*figure*.py"))
    assert len(modules) >= 3
    assert {str(path): found for path in modules if (found := _HEX.findall(path.read_text()))} == {}
