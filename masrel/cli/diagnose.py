"""``masrel diagnose``: which rater, pair and category agreement is lost by."""

import click

from masrel.cli._file_answers import by_option, file_command

diagnose = file_command(
    "diagnose",
    """Say which rater, which pair and which category of FILE disagree.

    Every pair of raters, all raters without each, every category, and what each rater
    says where another says something else. FILE is whatever masrel agree reads.
    """,
    by_option,
    click.option(
        "--reference",
        metavar="RATER",
        help="The rater that the others are held against, and that is in no estimate "
        "between raters.",
    ),
    estimating=("weights", "metric", "level"),
    questions=[
        click.option(
            "--coefficients",
            metavar="NAME",
            show_default="fleiss_kappa",
            help="Name of the coefficient; masrel agree --coefficients list has all.",
        ),
        click.option(
            "--target",
            type=click.Choice(["items"]),
            help="Intervals for other items, graded by these raters; none without it.",
        ),
    ],
    figure="Draw raters, pairs and confusions into this .png, .svg or .pdf.",
)
