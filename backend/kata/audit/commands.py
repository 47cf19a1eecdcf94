"""``kata audit``: verify the audit trail. The command imports its modules when it runs."""

import json
import re
import time
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kata.settings import Settings

if TYPE_CHECKING:
    from kata.audit.chain import Head
    from kata.audit.verify import Verdict

app = typer.Typer(no_args_is_help=True)


@app.callback()
def _audit() -> None:
    """The audit trail: who saw or changed which record, who moved the apparatus, and what was refused."""


@app.command("verify")
def verify_trail(
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    anchor: Annotated[
        list[Path] | None,
        typer.Option(help="The anchor of each service on this database; default: this computer's."),
    ] = None,
    head: Annotated[
        str,
        typer.Option(help="NUMBER:HASH from the service's log or an earlier verification."),
    ] = "",
    export: Annotated[Path | None, typer.Option(help="Write all rows to this file, one JSON object per line.")] = None,
    json_out: Annotated[bool, typer.Option("--json", help="Print JSON instead.")] = False,
) -> None:
    """Verify the audit trail and print every gap and change. Status 1 when it is not intact, 2 when it cannot be read."""
    from sqlalchemy.exc import SQLAlchemyError

    from kata.audit.audit_log import named
    from kata.audit.verify import verify
    from kata.database.engine import Database, DatabaseError

    given: dict[str, Any] = {"data": data} if data else {}
    settings = Settings(**given)
    anchors = anchor or [settings.effective_audit_anchor]
    known_head = _head(head)
    began_s = time.perf_counter()
    try:
        database = Database(settings.effective_database_url)
        with ExitStack() as stack:
            stack.callback(database.close)
            session = stack.enter_context(database.read())
            file = stack.enter_context(export.open("w", encoding="utf-8")) if export else None
            verdict = verify(session, anchors, known_head, file)
    except (DatabaseError, SQLAlchemyError, OSError) as error:
        typer.echo(f"The audit trail cannot be read: {getattr(error, 'orig', None) or error}", err=True)
        raise typer.Exit(2) from error
    if json_out:
        typer.echo(json.dumps(_as_json(verdict, named(verdict.head)), indent=2))
    else:
        _print(verdict, named(verdict.head), anchors, time.perf_counter() - began_s)
    if not verdict.intact:
        raise typer.Exit(1)


def _head(given: str) -> "Head | None":
    if not given:
        return None
    match = re.fullmatch(r"(\d+):([0-9a-f]{64})", given)
    if match is None:
        raise typer.BadParameter("A head is a number, a colon and 64 hexadecimal characters, as verify prints it.")
    from kata.audit.chain import Head

    return Head(int(match[1]), bytes.fromhex(match[2]))


def _as_json(verdict: "Verdict", head: str) -> dict[str, Any]:
    return {
        "whole": verdict.intact,
        "rows": verdict.rows,
        "lines": verdict.lines,
        "head": head,
        "findings": [asdict(finding) for finding in verdict.findings],
        "remarks": verdict.remarks,
    }


def _print(verdict: "Verdict", head: str, anchors: list[Path], took_s: float) -> None:
    for file in anchors:
        if not file.exists():
            typer.echo(f"There is no anchor at {file}: without one, removed last rows cannot be detected.")
    for remark in verdict.remarks:
        typer.echo(remark)
    for finding in verdict.findings:
        typer.echo(f"NOT INTACT  {finding.message}")
    state = "intact" if verdict.intact else "not intact"
    typer.echo(f"The audit trail is {state}: {verdict.rows} rows, {verdict.lines} anchors, in {took_s:.1f} s.")
    typer.echo(f"It ends at {head}")
    typer.echo(
        "Keep this line on another computer or on paper. With --head it reveals that database and anchor were replaced together."
    )
