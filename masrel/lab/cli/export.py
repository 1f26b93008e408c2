"""``masrel export``: a study in a form that archives and other programs read."""

from pathlib import Path

import click
from tqdm import tqdm

from masrel._files import refuse_record
from masrel.cli._options import OutputOptions, output_options
from masrel.lab.cli._study_options import of_study
from masrel.lab.protocol import Protocol, StudyPaths


@click.command("export")
@of_study
@click.option(
    "--as",
    "form",
    required=True,
    type=click.Choice(["bids", "ro-crate"]),
    help="Standard of the data set: BIDS or RO-Crate.",
)
@click.option(
    "-o",
    "--output",
    "folder",
    required=True,
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder to create; it must be new or empty.",
)
@click.option(
    "--include",
    multiple=True,
    metavar="NAME",
    help="Also export something private: notes (on raters), logs, or a field of raters "
    "or a QUESTIONNAIRE.QUESTION that is not public. Repeatable.",
)
@output_options(quiet="Show no progress bar.")
def export(
    study: StudyPaths,
    protocol: Protocol,
    form: str,
    folder: Path,
    include: tuple[str, ...],
    output: OutputOptions,
) -> None:
    """Write STUDY as a standard data set for archiving or sharing.

    Ratings, raters and recordings are described with units and levels and written in
    the chosen form, together with the protocol. The data set names the models.
    """
    from masrel.lab.export import export_study

    refuse_record(folder)
    with tqdm(desc="export", unit=" files", disable=output.quiet or None) as bar:
        left_out = export_study(
            study,
            protocol,
            form,
            folder,
            include=include,
            progress=lambda _: bar.update(),
        )
    for what in left_out:
        click.echo(f"left out: {what}", err=True)
    click.echo(folder)
