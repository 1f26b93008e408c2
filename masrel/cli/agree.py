"""``masrel agree``: agreement of the raters in a file."""

import click

from masrel.cli._file_answers import by_option, clusters_option, file_command

agree = file_command(
    "agree",
    """Estimate the agreement of the raters in FILE.

    FILE is a table as a program saved it: text, a workbook, Parquet, JSON, SPSS, Stata
    or SAS, compressed or not. It has one row per item and one column per rater, or one
    row per rating. "-" reads standard input. The command shows what it read. If a file
    is ambiguous, the command names the option that decides.
    """,
    by_option,
    click.option(
        "--stream/--no-stream",
        default=None,
        help="Read in batches, for files larger than memory (Parquet, text). Default: "
        "depends on the size of the file.",
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
            help="Agreement of each rater with themselves between the two sessions of "
            "--session, and of all raters together, by stratified_kappa, and by "
            "pooled_kappa if it is named.",
        ),
        click.option(
            "--each-category",
            is_flag=True,
            help="Kappa of each category against all other categories.",
        ),
        click.option(
            "--symmetry",
            is_flag=True,
            help="Tests of change between two raters: McNemar, Bowker, "
            "Stuart-Maxwell, Bhapkar.",
        ),
        click.option(
            "--indices",
            is_flag=True,
            help="For two raters and two categories: PABAK, prevalence, bias, largest "
            "kappa, positive and negative agreement.",
        ),
    ],
    figure="Draw the intervals to this .png, .svg or .pdf file; needs --target.",
    sentence="Print one sentence per estimate, for a paper, instead of the table.",
)
