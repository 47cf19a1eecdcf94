"""``kata audit``: verify the audit trail. The command imports its modules when it runs."""

import json
import os
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
    """Work with the audit trail: who saw or changed which record, who moved the apparatus, and what was refused."""


@app.command("verify")
def verify_trail(
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    anchor: Annotated[
        list[Path] | None,
        typer.Option(help="The anchor of each service on this database. Default: the anchor of this computer."),
    ] = None,
    anchor_copy: Annotated[
        list[Path] | None,
        typer.Option(help="The copy of each anchor on another disk or computer. Default: KATA_AUDIT_ANCHOR_COPY."),
    ] = None,
    head: Annotated[
        str,
        typer.Option(help="NUMBER:HASH from the service's log or an earlier verification."),
    ] = "",
    export: Annotated[Path | None, typer.Option(help="Write all rows to this file, one JSON object per line.")] = None,
    json_out: Annotated[bool, typer.Option("--json", help="Print JSON instead.")] = False,
) -> None:
    """Verify the audit trail and print every gap and change. The exit status is 1 if the trail is not intact, and 2 if the trail or the
    anchor's copy cannot be read.
    """
    from sqlalchemy.exc import SQLAlchemyError

    from kata.audit.audit_log import format_head
    from kata.audit.verify import verify
    from kata.database.engine import Database, DatabaseError

    options: dict[str, Any] = {"data": data} if data else {}
    settings = Settings(**options)
    anchors = anchor or [settings.effective_audit_anchor]
    copies = anchor_copy or ([settings.audit_anchor_copy] if settings.audit_anchor_copy else [])
    unreadable = [file for file in copies if not os.access(file, os.R_OK)]
    known_head = _parse_head(head)
    began_s = time.perf_counter()
    try:
        database = Database(settings.effective_database_url)
        with ExitStack() as stack:
            stack.callback(database.close)
            session = stack.enter_context(database.read())
            file = stack.enter_context(export.open("w", encoding="utf-8")) if export else None
            verdict = verify(session, anchors, known_head, file, copies=copies)
    except (DatabaseError, SQLAlchemyError, OSError) as error:
        typer.echo(f"The audit trail cannot be read: {getattr(error, 'orig', None) or error}", err=True)
        raise typer.Exit(2) from error
    if json_out:
        typer.echo(json.dumps(_as_json(verdict, format_head(verdict.head)), indent=2))
    else:
        _print_verdict(verdict, format_head(verdict.head), anchors, time.perf_counter() - began_s)
        typer.echo(_describe_proof(settings.data, [*copies, *anchors], unreadable, with_head=known_head is not None))
    for unread in unreadable:
        typer.echo(f"The anchor's copy {unread} cannot be read, so the audit trail was not compared with it.", err=True)
    if not verdict.intact or unreadable:
        raise typer.Exit(2 if verdict.intact else 1)


def _parse_head(text: str) -> "Head | None":
    if not text:
        return None
    match = re.fullmatch(r"(\d+):([0-9a-f]{64})", text)
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


def _print_verdict(verdict: "Verdict", head: str, anchors: list[Path], took_s: float) -> None:
    for file in anchors:
        if not file.exists():
            typer.echo(f"There is no anchor at {file}. Without it, the removal of the last rows cannot be detected.")
    for remark in verdict.remarks:
        typer.echo(remark)
    for finding in verdict.findings:
        typer.echo(f"NOT INTACT  {finding.message}")
    state = "No gap and no change was found" if verdict.intact else "The audit trail is not intact"
    typer.echo(f"{state}: {verdict.rows} rows, {verdict.lines} anchors, in {took_s:.1f} s.")
    typer.echo(f"The audit trail ends at {head}")


def _describe_proof(data: Path, files: list[Path], unreadable: list[Path], *, with_head: bool) -> str:
    """Return a text that says what the verification proves and what it does not prove."""
    from kata.audit.anchor_copy import is_elsewhere

    elsewhere = [file for file in files if file not in unreadable and file.exists() and is_elsewhere(file, data)]
    if elsewhere:
        return f"Compared with {', '.join(map(str, elsewhere))}. Not proven: that this file was not changed together with database and anchor."
    if with_head:
        return "Compared with the given head. Later rows were compared only with the anchor on this computer."
    return (
        "Not proven: that the audit trail is complete. A user with full access to this computer can shorten database and anchor together. "
        "Store the line above elsewhere and give it with --head, or set KATA_AUDIT_ANCHOR_COPY to a file on another disk or computer."
    )
