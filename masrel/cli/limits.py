"""``masrel limits``: limits of agreement of raters who measured the same items."""

import click

from masrel.analysis._file_estimates import OF_MEASUREMENTS
from masrel.cli._file_answers import by_option, clusters_option, file_command

limits = file_command(
    "limits",
    """Compute limits of agreement of raters who measured the items of FILE.

    For two raters, the command gives the mean of their differences and Bland and
    Altman's limits, with exact intervals. For more raters, it gives limits of agreement
    with their mean, SEM and MDC95. ICC(A,1) and Lin's concordance are also shown. FILE
    can be any file that masrel agree reads. If a rater measured items more than once,
    add --truth.
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
            help="Treat several measurements of an item, also in several sessions, as "
            "repeats: with one true value, or in pairs of rows between which the true "
            "value may change.",
        ),
        click.option(
            "--kind",
            type=click.Choice(["proportional", "ratio"]),
            help="Limits that follow a line over the mean of both raters, or limits "
            "of ratios. Default: the same limits for all values.",
        ),
    ],
    figure="Draw differences and limits to this .png, .svg or .pdf file.",
    coefficients=list(OF_MEASUREMENTS),
)
