"""``masrel diagnose``: the raters, pairs and categories that disagree."""

import click

from masrel.cli._file_answers import by_option, file_command

diagnose = file_command(
    "diagnose",
    """Find the raters, pairs and categories of FILE that disagree.

    The command shows the agreement of every pair of raters, of all raters without each
    one, and on each category, and each rater's grades by those of another rater. FILE
    can be any file that masrel agree reads.
    """,
    by_option,
    click.option(
        "--reference",
        metavar="RATER",
        help="The rater to compare the others with; not included in estimates between "
        "raters.",
    ),
    estimating=("weights", "metric", "level"),
    questions=[
        click.option(
            "--coefficients",
            metavar="NAME",
            show_default="fleiss_kappa",
            help="Name of the coefficient; masrel agree --coefficients list shows all "
            "names.",
        ),
        click.option(
            "--target",
            type=click.Choice(["items"]),
            help="Generalise to other items graded by these raters. Without it no "
            "interval is given.",
        ),
    ],
    figure="Draw raters, pairs and confusions to this .png, .svg or .pdf file.",
)
