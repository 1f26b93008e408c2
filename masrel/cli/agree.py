"""``masrel agree``: agreement of any file of ratings, no study needed."""

import click

from masrel.cli._file_answers import by_option, clusters_option, file_command

agree = file_command(
    "agree",
    """Estimate the agreement of the raters in FILE.

    FILE is a table in whatever shape a program left it: text, a workbook, Parquet,
    JSON, SPSS, Stata, SAS, packed or not; one row an item and a column a rater, or
    one row a rating. "-" reads standard input. What was read is shown; what could be
    read in two ways is refused with the option that decides.
    """,
    by_option,
    click.option(
        "--stream/--no-stream",
        default=None,
        help="Read batch by batch, as files larger than memory are (Parquet, text); by "
        "size unless given.",
    ),
    clusters_option,
    estimating=(
        *("coefficients", "weights", "metric", "target", "interval"),
        *("convention", "level", "resamples", "seed", "words"),
    ),
    questions=[
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
            help="Tests of change of two raters: McNemar, Bowker, Stuart-Maxwell, "
            "Bhapkar.",
        ),
        click.option(
            "--indices",
            is_flag=True,
            help="Of two raters and two categories: PABAK, prevalence, bias, largest "
            "kappa, positive and negative agreement.",
        ),
    ],
    figure="Draw the intervals into this .png, .svg or .pdf; needs --target.",
    sentence="Print a sentence for a paper instead of the table, one an estimate.",
)
