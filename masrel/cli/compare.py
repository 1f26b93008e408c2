"""``masrel compare``: whether groups of ratings differ in agreement."""

import click

from masrel.cli._file_answers import clusters_option, file_command

compare = file_command(
    "compare",
    """Compare the agreement of groups in FILE.

    The difference between every two groups of --by is given with an interval for other
    items and a p-value, which is also adjusted by Holm's method. With three groups or
    more, a test shows whether all of them agree equally well. FILE can be any file that
    masrel agree reads.
    """,
    click.option("--by", metavar="COL", help="Column of the groups."),
    clusters_option,
    estimating=("coefficients", "weights", "metric", "level"),
    figure="Draw each group's intervals to this .png, .svg or .pdf file.",
    target="items",
)
