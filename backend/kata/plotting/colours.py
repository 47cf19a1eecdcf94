"""Colours of the figures in the light scheme and on paper.

They can be distinguished by colour-blind people and by their brightness. Red, yellow and cyan are reserved for alarms. The page replaces each
by its counterpart in the dark scheme (``DARK_COLOURS`` in ``frontend/src/ui/plotColours.ts``).
"""

from typing import Final

INDIGO: Final = "#1f3a93"
"""Taught or requested."""
ORANGE: Final = "#d67500"
"""Played or measured."""
PALE_GREEN: Final = "#5e9c76"
"""Their difference."""
GREEN: Final = "#2f7d4f"
VIOLET: Final = "#7b3fa0"
BROWN: Final = "#7f5539"
SLATE: Final = "#64748b"
GRID: Final = {"gridcolor": "#e2e8f0", "zerolinecolor": "#cbd5e1", "linecolor": "#94a3b8"}
"""Colours of an axis in Plotly's layout."""
