"""``masrel judge``: whether a judge, such as a model, rates as well as the humans."""

from typing import Any

import click

from masrel._input import split_names
from masrel.analysis._judging import Judging
from masrel.cli._file_answers import by_option, clusters_option, file_command
from masrel.cli._options import grouped


def _judged(*args: Any) -> Any:
    from masrel.analysis._file_judges import judging_answers  # of this command alone

    return judging_answers(*args)


judge = file_command(
    "judge",
    """Hold judges in FILE against its humans, and correct a rate for a judge.

    A judge, such as a language model, may stand for a human if it is shown to agree
    with the other humans not much worse than the human does: the alternative annotator
    test. --rate estimates how often a grade is right, from a judge's grades of many
    items and labels of few. FILE is whatever masrel agree reads; judges are raters.
    """,
    by_option,
    clusters_option,
    click.option(
        "--reference",
        metavar="RATER",
        help="Rater with the right grades: the labels of --rate, and no human.",
    ),
    estimating=("level", "seed"),
    questions=[
        click.option(
            "--target",
            type=click.Choice(["items", "both"]),
            help="Whom the interval of the advantage is for: other items, or other "
            "humans, too.  [default: no interval]",
        ),
    ],
    of_judges=[_judged],
    judging=grouped(
        "judging",
        Judging,
        click.option(
            "--judge",
            "judges",
            multiple=True,
            metavar="RATER",
            help="Rater that is a judge; may be given several times.",
        ),
        click.option(
            "--humans",
            type=split_names,
            metavar="NAMES",
            help="Raters who are humans.  [default: all that are no judge]",
        ),
        click.option(
            "--epsilon",
            type=float,
            metavar="SHARE",
            help="How much worse than a human a judge may be, as its price is low.",
        ),
        click.option(
            "--annotators",
            type=click.Choice(["expert", "skilled", "crowd"]),
            help="Who the humans are, in place of --epsilon: 0.2, 0.15 or 0.1.",
        ),
        click.option(
            "--score",
            default="accuracy",
            metavar="accuracy|neg_rmse|WEIGHTS",
            show_default=True,
            help="How near two grades are: the same or not, by their distance, or by "
            "weights, such as linear.",
        ),
        click.option(
            "--test",
            type=click.Choice(["auto", "exact", "score", "t"]),
            default="auto",
            show_default=True,
            help="auto is exact, and Tango's score test of many items; t is the one "
            "that was published, and rejects too often.",
        ),
        click.option(
            "--min-items",
            default=30,
            show_default=True,
            help="Items that a human needs to be tested.",
        ),
        click.option(
            "--rate",
            metavar="GRADE",
            help="Estimate how often this grade is right; labels are those of "
            "--reference, or of the one human.",
        ),
        click.option(
            "--truth",
            is_flag=True,
            help="Estimate the class of each item and the errors of each rater without "
            "labels (Dawid and Skene); classes are in --json.",
        ),
        click.option(
            "--order",
            metavar="COL",
            help="Column of which of two answers was shown first; grades are the one "
            "preferred, or a tie: how far the order decides, and which is better.",
        ),
        click.option(
            "--require",
            multiple=True,
            metavar="GATE",
            help="Exit with 1 unless a number keeps a limit, as 'gpt-4o.winning_rate "
            ">= 0.5': winning_rate, advantage, low or high of a judge; value, low or "
            "high of rate; agreement of preferences.",
        ),
    ),
    figure="Draw the judge beside each human, or rates, into this .png, .svg or .pdf.",
    sentence="Print the result in sentences instead of tables.",
)
