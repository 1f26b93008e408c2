"""``masrel limits``: between which limits the measurements of two raters differ."""

import click

from masrel.analysis._file_estimates import OF_MEASUREMENTS
from masrel.cli._file_answers import by_option, file_command

limits = file_command(
    "limits",
    """Give the limits of agreement of two raters who measured the items of FILE.

    The mean of their differences, and Bland and Altman's limits, with exact intervals;
    ICC(A,1) and Lin's concordance beside them. FILE is whatever masrel agree reads.
    """,
    by_option,
    estimating=("level",),
    questions=[
        click.option(
            "--unit", metavar="UNIT", help="Unit of the measurements, such as deg."
        )
    ],
    figure="Draw the differences and limits into this .png, .svg or .pdf.",
    coefficients=list(OF_MEASUREMENTS),
)
