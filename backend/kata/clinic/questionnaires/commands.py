"""``kata questionnaires``. The commands import their modules when they run."""

from pathlib import Path
from typing import Annotated

import typer

from kata.settings import Settings
from kata.system.console import fail

app = typer.Typer(no_args_is_help=True, help="Add questionnaires, and import their licensed texts.")


@app.command("add")
def add(
    file: Annotated[Path, typer.Argument(help="The definition: a TOML file.", exists=True, dir_okay=False)],
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
) -> None:
    """Check a questionnaire's definition and add it to the clinic, in place of an earlier one. The service uses it after its next start."""
    from kata.clinic.questionnaires.definitions import check_new, clinic_folder, read_definition

    settings = Settings(data=data) if data else Settings()
    try:
        definition = read_definition(file)
        check_new(definition)
        folder = clinic_folder(settings.data)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{definition.code}.toml").write_bytes(file.read_bytes())
    except (ValueError, OSError) as error:
        fail(f"{file} is not added: {error}.")
    typer.echo(f"{definition.title}: {len(definition.item_scales)} items. Restart the service to use it.")


@app.command("import")
def import_texts(
    code: Annotated[str, typer.Argument(help="The questionnaire, such as spadi or quickdash.")],
    file: Annotated[Path, typer.Argument(help="The texts: a FHIR Questionnaire.", exists=True, dir_okay=False)],
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    may_be_exported: Annotated[
        bool,
        typer.Option(
            "--may-be-exported", help="The licence allows the clinic to export the texts with a patient's answers."
        ),
    ] = False,
) -> None:
    """Import the texts of a questionnaire in one language, in place of earlier ones. The clinic needs a licence for them."""
    from kata.actor import by_program
    from kata.clinic.questionnaires.definitions import DEFINITIONS, clinic_folder, use_folder
    from kata.clinic.questionnaires.licensed_texts import read_texts
    from kata.clinic.questionnaires.service import store_texts
    from kata.database.base import utc_now
    from kata.database.engine import Database, DatabaseError
    from kata.database.upgrade import upgrade

    settings = Settings(data=data) if data else Settings()
    use_folder(clinic_folder(settings.data))
    definition = DEFINITIONS.get(code)
    if definition is None:
        fail(f"There is no questionnaire {code}. The questionnaires are {', '.join(DEFINITIONS)}.")
    try:
        licensed = read_texts(file.read_bytes(), definition)
    except (ValueError, OSError) as error:
        fail(f"{file} is not imported: {error}.")
    database = Database(settings.effective_database_url)
    try:
        upgrade(database)
        with by_program("import_questionnaire_texts"), database.write() as session:
            store_texts(session, code, licensed, utc_now(), may_be_exported=may_be_exported)
    except DatabaseError as error:
        fail(str(error))
    finally:
        database.close()
    typer.echo(f"{licensed.title} ({licensed.language}): {len(licensed.items)} items. {licensed.copyright}")
