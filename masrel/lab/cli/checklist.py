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
    help="GRRAS (15 items), or the design standards of COSMIN (6 items).",
)
@click.option(
    "-o",
    "--output",
    type=OutputFile(path_type=Path),
    help="File to write (.html, .md or .docx); without it Markdown is printed.",
)
def checklist(
    study: StudyPaths, protocol: Protocol, guideline: str, output: Path | None
) -> None:
    """Fill in the checklist of a reporting guideline for STUDY.

    Each item is filled in from the protocol, schedules, logs and analysis, with the
    files used and their hashes. What only the authors know is left for them to add.
    """
    from masrel.lab.checklist import checklist_markdown, fill_checklist, write_checklist

    with warnings_as_notes():
        filled = fill_checklist(study, protocol, guideline)
    if output is None:
        click.echo(checklist_markdown(filled), nl=False)
    else:
        write_checklist(filled, output)
        click.echo(output)
