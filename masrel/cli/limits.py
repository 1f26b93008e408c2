"""``masrel limits``: between which limits the measurements of two raters differ."""

import click

from masrel.analysis._file_estimates import OF_MEASUREMENTS
from masrel.cli._file_answers import by_option, clusters_option, file_command

limits = file_command(
    "limits",
    """Give the limits of agreement of raters who measured the items of FILE.

    Of two raters the mean of their differences, and Bland and Altman's limits, with
    exact intervals; of more of them the limits with their mean, SEM and MDC95; ICC(A,1)
    and Lin's concordance beside them. FILE is whatever masrel agree reads; items that a
    rater measured more than once need --truth.
    """,
    by_option,
    clusters_option,
    estimating=("level",),
    questions=[
        click.option(
            "--unit", metavar="UNIT", help="Unit of the measurements, such as deg."
        ),
        click.option(
            "--truth",
            type=click.Choice(["constant", "varying"]),
            help="Take items that are there more than once, or in several sessions, as "
            "repeats: of one true value, or of pairs of rows whose value may move.",
        ),
        click.option(
            "--kind",
            type=click.Choice(["proportional", "ratio"]),
            help="Limits that follow the mean of both raters in a line, or of ratios; "
            "else of differences alike whatever is measured.",
        ),
    ],
    figure="Draw differences and limits into this .png, .svg or .pdf.",
    coefficients=list(OF_MEASUREMENTS),
)
