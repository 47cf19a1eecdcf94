"""Prints the outcomes to the terminal."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from kata.evaluation import tables
from kata.evaluation.outcome import CaseResult
from kata.simulator.mechanics import PlantName


def show(outcomes: Sequence[CaseResult], console: Console, *, simulated: bool, plant: PlantName = "simple") -> None:
    """Print the tables and the problems. ``plant``: only the independent plant is compared with the goals."""
    source = f"simulated, plant {plant}" if simulated else "measured on the apparatus"
    text_tables = [tables.by_motor(outcomes), tables.compared_to_paper(outcomes), tables.by_method(outcomes)]
    for table in [*text_tables, tables.beside_goals(outcomes)] if plant == "mujoco" else text_tables:
        if table.rows:
            console.print(_rich_table(table, source))
    console.print(tables.plays_in_words(outcomes), highlight=False)
    for outcome in outcomes:
        if outcome.problem:
            play = f"{outcome.case.name}, {outcome.case.side}, {outcome.method}, play {outcome.repetition}"
            seed = "" if outcome.seed is None else f", seed {outcome.seed}"
            console.print(f"{play}{seed}: {outcome.problem}", highlight=False)


def _rich_table(content: tables.TextTable, source: str) -> Table:
    table = Table(title=f"{content.title} ({source})")
    for name in content.columns:
        table.add_column(name, justify="right" if name.endswith((", deg", ", ms")) else "left")
    for row in content.rows:
        table.add_row(*row)
    return table
