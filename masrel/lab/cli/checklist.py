"""``masrel checklist``: a reporting guideline, filled from the record of a study."""

from pathlib import Path

import click

from masrel.cli._paths import OutputFile
from masrel.lab._study_files import read_once
from masrel.lab.cli._study_options import of_study, warnings_as_notes
from masrel.lab.protocol import Protocol, StudyPaths


@click.command("checklist")
@read_once()
@of_study
@click.option(
    "--guideline",
    required=True,
    type=click.Choice(["grras", "cosmin"]),
    help="GRRAS, 15 items; or the design standards of COSMIN, 6 items.",
)
@click.option(
    "-o",
    "--output",
    type=OutputFile(path_type=Path),
    help="File to write: .html, .md or .docx; Markdown on the screen unless given.",
)
def checklist(
    study: StudyPaths, protocol: Protocol, guideline: str, output: Path | None
) -> None:
    """Fill the checklist of a reporting guideline for STUDY.

    Each item has what the protocol, the schedules, the logs and the analysis say of it,
    with the files and their hashes; what only the authors know is left to them.
    """
    from masrel.lab.checklist import checklist_markdown, fill_checklist, write_checklist

    with warnings_as_notes():
        filled = fill_checklist(study, protocol, guideline)
    if output is None:
        click.echo(checklist_markdown(filled), nl=False)
    else:
        write_checklist(filled, output)
        click.echo(output)
