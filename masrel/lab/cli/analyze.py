"""``masrel analyze``: compute the agreement tables a study asks for."""

import textwrap
from pathlib import Path

import click

from masrel.cli._options import (
    STDOUT,
    GroupedHelp,
    OutputOptions,
    output_options,
    write_json,
)
from masrel.lab import analysis as library
from masrel.lab.analysis import Analysis
from masrel.lab.cli._gating import GateOptions, conclude, gate_options, verdict_of
from masrel.lab.cli._study_options import ratings_option, read_study, warnings_as_notes
from masrel.lab.ratings import StudyData
from masrel.lab.report._agreement import estimate_tables, judge_tables
from masrel.lab.report._conduct import StudyConduct, study_conduct
from masrel.lab.report._document import made_section
from masrel.lab.report._grade_sections import felt_sentences
from masrel.lab.report._material import gather, lacking
from masrel.lab.report._trace_section import speed_tables
from masrel.pages._sections import Content, Paragraph
from masrel.tables._tables import Table, as_csv, as_text


@click.command("analyze", cls=GroupedHelp)
@click.argument("study", type=click.Path(path_type=Path))
@ratings_option
@gate_options()
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints nothing '
    "else.",
    csv="Print the tables as CSV.",
    makes_folder=True,
)
def analyze(
    study: Path,
    ratings_file: Path | None,
    gating: GateOptions,
    output: OutputOptions,
) -> None:
    """Compute the analysis that the plan of STUDY asks for.

    Prints the tables and writes STUDY/analysis.json, or the file named by --json.
    """
    data = read_study(study, ratings_file)
    gates = gating.gates(data.protocol)
    with warnings_as_notes():
        analysis = library.analyze(
            data.protocol,
            data.ratings,
            in_person=data.in_person,
            answers=data.answers,
            excluded=data.excluded,
            changes=data.changes,
        )
    if output.json_file == STDOUT:
        write_json(library.as_analysis_document(analysis), STDOUT)
        conclude(verdict_of(analysis, gates), gating)
        return
    destination = output.json_file or data.paths.analysis_file
    conduct = study_conduct(data.paths, data.protocol, file=ratings_file)
    library.write_analysis(
        analysis,
        destination,
        within=None if output.json_file else study,
        is_private=conduct is not None and conduct.goes_on,
    )
    _show(data, analysis, conduct, csv=bool(output.csv), raw=output.raw_csv)
    click.echo(f"read: {data.read}\nanalysis: {destination}", err=True)
    conclude(verdict_of(analysis, gates), gating)


def _show(
    data: StudyData,
    analysis: Analysis,
    conduct: StudyConduct | None,
    *,
    csv: bool,
    raw: bool,
) -> None:
    of_study = (data.protocol, data.ratings, analysis, data.in_person)
    material = gather(*of_study, conduct=conduct)
    felt = felt_sentences(material)
    if felt:
        click.echo(textwrap.fill(felt, 88) + "\n", err=csv)
    contents: list[Content] = [table for _, table in estimate_tables(material)]
    contents += judge_tables(material)
    for name in ("intended", "in-person", "questionnaires"):
        _, section, reason = made_section(name, material)
        if reason not in ("", lacking(None).text):
            click.echo(f"{name} is not in these data: {reason}\n", err=csv)
        contents += section.blocks
    for block in (*contents, *speed_tables(material)):
        if isinstance(block, Table) and block.rows:
            click.echo(as_csv(block, raw=raw) if csv else as_text(block) + "\n")
        elif isinstance(block, Paragraph) and not csv:
            click.echo(textwrap.fill(block.text, 88) + "\n")
