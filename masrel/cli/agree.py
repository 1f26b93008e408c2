"""``masrel agree``: agreement of any file of ratings, no study needed."""

from pathlib import Path

import click

from masrel.analysis._file_estimates import Questions
from masrel.cli._file_answers import answering, by_option, clusters_option, show_answers
from masrel.cli._options import OutputOptions
from masrel.ratings._findings import Reading

_TABLES = [
    click.option(
        "--retest",
        is_flag=True,
        help="Agreement of each rater with him- or herself in the two sessions of "
        "--session, and of all; stratified_kappa, and pooled_kappa if named.",
    ),
    click.option(
        "--each-category",
        is_flag=True,
        help="Kappa of each category against all others.",
    ),
    click.option(
        "--symmetry",
        is_flag=True,
        help="Tests of change of two raters: McNemar, Bowker, Stuart-Maxwell, Bhapkar.",
    ),
    click.option(
        "--indices",
        is_flag=True,
        help="Of two raters and two categories: PABAK, prevalence, bias, largest "
        "kappa, positive and negative agreement.",
    ),
]


@click.command("agree")
@answering(
    by_option,
    click.option(
        "--stream/--no-stream",
        default=None,
        help="Read batch by batch, as files larger than memory are (Parquet, text); by "
        "size unless given.",
    ),
    clusters_option,
    estimating=(
        *("coefficients", "weights", "metric", "target", "interval", "level"),
        *("resamples", "seed", "words"),
    ),
    questions=_TABLES,
    figure="Draw the intervals into this .png, .svg or .pdf; needs --target.",
    sentence="Print a sentence for a paper instead of the table, one an estimate.",
)
def agree(
    file: Path,
    reading: Reading,
    questions: Questions,
    explain: bool,
    output: OutputOptions,
) -> None:
    """Estimate the agreement of the raters in FILE.

    FILE is a table in whatever shape a program left it: text, a workbook, Parquet,
    JSON, SPSS, Stata, SAS, packed or not; one row an item and a column a rater, or
    one row a rating. "-" reads standard input. What was read is shown; what could be
    read in two ways is refused with the option that decides.
    """
    show_answers(file, reading, questions, explain=explain, output=output)
