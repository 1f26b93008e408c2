"""``masrel analyze``: compute the agreement tables a study asks for."""

import json
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli.material import StudyMaterial, read_material
from masrel.cli.notes import notes

if TYPE_CHECKING:
    from masrel.analysis import Analysis

__all__ = ["command"]


@click.command("analyze")
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--ratings",
    "ratings_file",
    type=click.Path(path_type=Path),
    help="File of ratings; default: the study's ratings.csv, else published.csv.",
)
@click.option(
    "--json",
    "json_file",
    type=click.Path(path_type=Path, allow_dash=True),
    help="Write the analysis here; - prints it, and nothing else, on stdout.",
)
@click.option("--csv", "as_csv_text", is_flag=True, help="Print the tables as CSV.")
def command(
    study: Path, ratings_file: Path | None, json_file: Path | None, as_csv_text: bool
) -> None:
    """Compute what the plan of STUDY asks for.

    Prints the tables and writes STUDY/analysis.json, or the file of --json.
    """
    to_stdout = json_file == Path("-")
    if to_stdout and as_csv_text:
        raise click.UsageError("--json - and --csv both want stdout: choose one")
    from masrel.analysis import analyze, as_analysis_document, write_analysis

    material = read_material(study, ratings_file)
    with notes():
        analysis = analyze(
            material.protocol, material.ratings, in_person=material.in_person
        )
    if to_stdout:
        document = as_analysis_document(analysis)
        click.echo(json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False))
        return
    destination = json_file or material.paths.analysis_file
    write_analysis(analysis, destination)
    _show(material, analysis, as_csv_text=as_csv_text)
    click.echo(f"analysis: {destination}", err=True)


def _show(material: StudyMaterial, analysis: "Analysis", *, as_csv_text: bool) -> None:
    from masrel.report._tables import Table, as_csv, as_text
    from masrel.report.contents import SECTIONS
    from masrel.report.material import Material, Paragraph

    shown = Material(
        protocol=material.protocol,
        ratings=material.ratings,
        analysis=analysis,
        in_person=material.in_person,
    )
    for name in _computed(analysis):
        for block in SECTIONS[name](shown).blocks:
            if isinstance(block, Table):
                click.echo(as_csv(block) if as_csv_text else as_text(block) + "\n")
            elif isinstance(block, Paragraph) and block.absent:
                click.echo(f"{name}: {block.text}\n", err=as_csv_text)
            elif isinstance(block, Paragraph) and not as_csv_text:
                click.echo(textwrap.fill(block.text, 88) + "\n")


def _computed(analysis: "Analysis") -> list[str]:
    # Sections of the report that show what an analysis holds; a trace is not one.
    kinds = {planned.line.kind for planned in analysis.estimates}
    asked = {
        "agreement": "inter-rater" in kinds,
        "test-retest": "test-retest" in kinds,
        "intended": analysis.intended is not None,
        "in-person": analysis.in_person is not None,
        "speeds": analysis.speeds is not None,
    }
    return [name for name, wanted in asked.items() if wanted]
