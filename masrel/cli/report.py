"""``masrel report``: write the report of a study."""

from pathlib import Path

import click
from tqdm import tqdm

from masrel._files import check_inside, refuse_record
from masrel._once import read_once
from masrel.cli._gating import GateOptions, conclude, gate_options
from masrel.cli._options import (
    OutputOptions,
    output_options,
    ratings_option,
    read_study,
    warnings_as_notes,
)


@click.command("report")
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    "destination",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder to write into; default: STUDY/report.",
)
@ratings_option
@gate_options()
@click.option(
    "--include",
    multiple=True,
    metavar="NAME",
    help="Show what is private, too: who (recorded events), notes (their texts), or a "
    "field of raters that is not public. Repeatable.",
)
@output_options(
    raw_csv="No apostrophe before a text that a spreadsheet would run.",
    quiet="No progress bar.",
)
@read_once()
def report(
    study: Path,
    destination: Path | None,
    ratings_file: Path | None,
    gating: GateOptions,
    include: tuple[str, ...],
    output: OutputOptions,
) -> None:
    """Write the report of STUDY: HTML, Markdown, tables and figures.

    The analysis is computed from the protocol's plan; the same inputs give the
    same bytes.
    """
    from masrel.analysis import analyze
    from masrel.report import study_conduct, write_report
    from masrel.verification import anchors_of

    if destination is None:
        destination = study / "report"
        check_inside(destination, study)
    refuse_record(destination / "report.html")  # before anything is computed
    data = read_study(study, ratings_file)
    gates = gating.gates(data.protocol)
    conduct = study_conduct(
        data.paths, data.protocol, file=ratings_file, include=include
    )
    with warnings_as_notes():
        analysis = analyze(
            data.protocol,
            data.ratings,
            in_person=data.in_person,
            answers=data.answers,
            excluded=data.excluded,
        )
    with tqdm(desc="report", unit=" parts", disable=output.hides_progress) as bar:

        def progress(part: str) -> None:
            bar.set_postfix_str(part, refresh=False)
            bar.update()

        files = write_report(
            data.protocol,
            data.ratings,
            analysis,
            destination,
            in_person=data.in_person,
            recordings=data.paths.sessions,
            # of what is simulated none, so that it repeats byte for byte
            anchors=() if data.ratings.simulated else anchors_of(data.paths),
            conduct=conduct,
            progress=progress,
            raw_csv=output.raw_csv,
        )
    click.echo(f"read: {data.read}", err=True)
    click.echo(files.html)
    conclude(analysis, gates, gating)
