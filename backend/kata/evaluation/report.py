"""The figures on the terminal."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from kata.evaluation import tables
from kata.evaluation.outcome import Outcome


def show(outcomes: Sequence[Outcome], console: Console, *, simulated: bool) -> None:
    """Print what came of it."""
    where = "simulated" if simulated else "measured on the apparatus"
    for one in (tables.by_motor(outcomes), tables.beside_the_paper(outcomes), tables.by_method(outcomes)):
        if one.rows:
            console.print(_drawn(one, where))
    for outcome in outcomes:
        if outcome.problem:
            what = f"{outcome.case.name}, {outcome.case.side}, {outcome.method}, play {outcome.repetition}"
            seed = "" if outcome.seed is None else f", seed {outcome.seed}"
            console.print(f"{what}{seed}: {outcome.problem}", highlight=False)


def _drawn(told: tables.Table, where: str) -> Table:
    table = Table(title=f"{told.title} ({where})")
    for name in told.columns:
        table.add_column(name, justify="right" if name.endswith((", deg", ", ms")) else "left")
    for row in told.rows:
        table.add_row(*row)
    return table
