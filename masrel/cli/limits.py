"""``masrel limits``: between which limits the measurements of two raters differ."""

from dataclasses import replace
from pathlib import Path

import click

from masrel.analysis._file_estimates import OF_MEASUREMENTS, Questions
from masrel.cli._file_answers import answering, by_option, show_answers
from masrel.cli._options import OutputOptions
from masrel.ratings._findings import Reading


@click.command("limits")
@answering(
    by_option,
    estimating=("level",),
    questions=[
        click.option(
            "--unit", metavar="UNIT", help="Unit of the measurements, such as deg."
        )
    ],
    figure="Draw the differences and limits into this .png, .svg or .pdf.",
)
def limits(
    file: Path,
    reading: Reading,
    questions: Questions,
    explain: bool,
    output: OutputOptions,
) -> None:
    """Give the limits of agreement of two raters who measured the items of FILE.

    The mean of their differences, and Bland and Altman's limits, with exact intervals;
    ICC(A,1) and Lin's concordance beside them. FILE is whatever masrel agree reads.
    """
    names = list(OF_MEASUREMENTS)
    questions = replace(questions, command="limits", coefficients=names)
    show_answers(file, reading, questions, explain=explain, output=output)
