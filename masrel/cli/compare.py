"""``masrel compare``: whether groups of ratings differ in agreement."""

import click

from masrel.cli._file_answers import clusters_option, file_command

compare = file_command(
    "compare",
    """Compare the agreement of groups in FILE.

    The difference of every two groups of --by has an interval for other items, a
    p-value, and Holm's adjustment of it; of three groups or more it is tested whether
    all agree as well. FILE is whatever masrel agree reads.
    """,
    click.option("--by", metavar="COL", help="Column of the groups."),
    clusters_option,
    estimating=("coefficients", "weights", "metric", "level"),
    figure="Draw each group's intervals into this .png, .svg or .pdf.",
    target="items",
)
