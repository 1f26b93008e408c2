"""``masrel report``: write the report of a study."""

from pathlib import Path

import click
from tqdm import tqdm

from masrel.cli.material import read_material
from masrel.cli.notes import notes

__all__ = ["command"]


@click.command("report")
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    "destination",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder to write into; default: STUDY/report.",
)
@click.option(
    "--ratings",
    "ratings_file",
    type=click.Path(path_type=Path),
    help="File of ratings; default: the study's ratings.csv, else published.csv.",
)
@click.option("--quiet", is_flag=True, help="No progress bar.")
def command(
    study: Path, destination: Path | None, ratings_file: Path | None, quiet: bool
) -> None:
    """Write the report of STUDY: HTML, Markdown, tables and figures.

    The analysis is computed from the protocol's plan; the same inputs give the
    same bytes.
    """
    from masrel.analysis import analyze
    from masrel.report import write_report

    material = read_material(study, ratings_file)
    with notes():
        analysis = analyze(
            material.protocol, material.ratings, in_person=material.in_person
        )
    with tqdm(desc="report", unit=" parts", disable=quiet or None) as bar:

        def progress(part: str) -> None:
            bar.set_postfix_str(part, refresh=False)
            bar.update()

        files = write_report(
            material.protocol,
            material.ratings,
            analysis,
            destination or material.paths.root / "report",
            in_person=material.in_person,
            progress=progress,
        )
    click.echo(files.html)
