"""The pages of the documentation that are drawn from the code: ``python -m kata.device.documentation docs``."""

import sys
from pathlib import Path
from typing import Final

from kata.device.config_page import configuration
from kata.device.faults import FAULTS
from kata.device.modes import TRANSITIONS

_CATEGORIES: Final = {
    0: "torque off at once",
    1: "ramp down, then torque off",
    2: "ramp down and hold, torque off when acknowledged",
}


def state_machine() -> str:
    """Modes, and the ways between them, as a Mermaid diagram."""
    ways = "\n".join(f"    {start} --> {end}: {why}" for (start, end), why in TRANSITIONS.items())
    return f"""# Modes

Drawn from the table of transitions in `backend/kata/device/modes.py`; there is no other way from one mode to another.
Torque is on in approaching, playing, paused and returning, and in stopped while a category 1 stop ramps down or a
category 2 stop holds the arm.

```mermaid
stateDiagram-v2
    [*] --> offline
{ways}
```

A stop latches. Its reset takes two acts: the cause goes (the switch is released), then somebody acknowledges. Neither
starts a motion; a new start loads the recording again and goes through the slow approach.
"""


def faults() -> str:
    """The fault table."""
    rows = "\n".join(
        f"| `{fault.code}` | {fault.category}: {_CATEGORIES[fault.category]} | {_shown(fault.message.english)} | {fault.next_step.english} |"
        for fault in FAULTS
    )
    return f"""# Faults

Drawn from the fault table in `backend/kata/device/faults.py`, most telling first. Each row is a pure function of what is
known at the beginning of one cycle; what it leads to for each kind of fault of each signal in each mode is the table in
`tests/support/fault_matrix.py`, of which every cell is run.

| Code | Stop | What the therapist reads | What to do |
|---|---|---|---|
{rows}
"""


def _shown(message: str) -> str:
    return message.replace("{motor:d}", "*n*")


PAGES: Final = {"state-machine.md": state_machine, "faults.md": faults, "configuration.md": configuration}


def main() -> None:
    """Write the pages into the folder that is named."""
    for name, page in PAGES.items():
        (Path(sys.argv[1]) / name).write_text(page())


if __name__ == "__main__":
    main()
