"""Prints the outcomes to the terminal."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from kata.evaluation import tables
from kata.evaluation.outcome import Outcome


def show(outcomes: Sequence[Outcome], console: Console, *, simulated: bool) -> None:
    """Print the tables and the problems."""
    where = "simulated" if simulated else "measured on the apparatus"
    for table in (tables.by_motor(outcomes), tables.compared_to_paper(outcomes), tables.by_method(outcomes)):
        if table.rows:
            console.print(_rich_table(table, where))
    for outcome in outcomes:
        if outcome.problem:
            play = f"{outcome.case.name}, {outcome.case.side}, {outcome.method}, play {outcome.repetition}"
            seed = "" if outcome.seed is None else f", seed {outcome.seed}"
            console.print(f"{play}{seed}: {outcome.problem}", highlight=False)


def _rich_table(content: tables.TextTable, where: str) -> Table:
    table = Table(title=f"{content.title} ({where})")
    for name in content.columns:
        table.add_column(name, justify="right" if name.endswith((", deg", ", ms")) else "left")
    for row in content.rows:
        table.add_row(*row)
    return table
