"""``masrel compare``: whether groups of ratings differ in agreement."""

from dataclasses import replace
from pathlib import Path

import click

from masrel.analysis._file_estimates import Questions
from masrel.cli._file_answers import answering, clusters_option, show_answers
from masrel.cli._options import OutputOptions
from masrel.ratings._findings import Reading


@click.command("compare")
@answering(
    click.option("--by", metavar="COL", required=True, help="Column of the groups."),
    clusters_option,
    estimating=("coefficients", "weights", "metric", "level"),
    figure="Draw each group's intervals into this .png, .svg or .pdf.",
)
def compare(
    file: Path,
    reading: Reading,
    questions: Questions,
    explain: bool,
    output: OutputOptions,
) -> None:
    """Compare the agreement of groups in FILE.

    The difference of every two groups of --by has an interval for other items, a
    p-value, and Holm's adjustment of it; of three groups or more it is tested whether
    all agree as well. FILE is whatever masrel agree reads.
    """
    questions = replace(questions, command="compare", target="items")
    show_answers(file, reading, questions, explain=explain, output=output)
