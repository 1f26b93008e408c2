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
    """Compare judges in FILE with its humans, and correct a rate for a judge's errors.

    A judge, such as a language model, can replace a human if it agrees with the other
    humans almost as well as the human does. This is tested by the alternative annotator
    test. --rate estimates how often a grade is right, from a judge's grades of many
    items and labels of a few. FILE can be any file that masrel agree reads; judges are
    raters in it.
    """,
    by_option,
    clusters_option,
    click.option(
        "--reference",
        metavar="RATER",
        help="Rater with the correct grades, which are the labels of --rate; not "
        "counted as a human.",
    ),
    estimating=("level", "seed"),
    questions=[
        click.option(
            "--target",
            type=click.Choice(["items", "both"]),
            help="Generalise the advantage to other items, or to other humans as "
            "well?  [default: no interval]",
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
            help="Rater that is a judge; can be given several times.",
        ),
        click.option(
            "--humans",
            type=split_names,
            metavar="NAMES",
            help="Raters who are humans.  [default: all except the judges]",
        ),
        click.option(
            "--epsilon",
            type=float,
            metavar="SHARE",
            help="How much worse than a human a judge may be because it costs less.",
        ),
        click.option(
            "--annotators",
            type=click.Choice(["expert", "skilled", "crowd"]),
            help="Kind of humans, instead of --epsilon: it becomes 0.2, 0.15 or 0.1.",
        ),
        click.option(
            "--score",
            default="accuracy",
            metavar="accuracy|neg_rmse|WEIGHTS",
            show_default=True,
            help="How to measure the closeness of two grades: same or not, by "
            "distance, or by weights, such as linear.",
        ),
        click.option(
            "--test",
            type=click.Choice(["auto", "exact", "score", "t"]),
            default="auto",
            show_default=True,
            help="auto is the exact test, or Tango's score test for many items; t is "
            "the published test, which rejects too often.",
        ),
        click.option(
            "--min-items",
            default=30,
            show_default=True,
            help="Test a human only with at least this many items.",
        ),
        click.option(
            "--rate",
            metavar="GRADE",
            help="Estimate how often this grade is right; the labels are from "
            "--reference, or from the only human.",
        ),
        click.option(
            "--truth",
            is_flag=True,
            help="Estimate the class of each item and the errors of each rater "
            "without labels (Dawid and Skene); --json has the classes.",
        ),
        click.option(
            "--order",
            metavar="COL",
            help="Column with the answer that was shown first, if each grade is the "
            "preferred one of two answers, or a tie; tests the effect of the order "
            "and ranks the answers.",
        ),
        click.option(
            "--require",
            multiple=True,
            metavar="GATE",
            help="Exit with 1 unless a number meets a limit, as 'gpt-4o.winning_rate "
            ">= 0.5'. Numbers: winning_rate, advantage, low or high of a judge; "
            "value, low or high of rate; agreement of preferences.",
        ),
    ),
    figure="Draw the judge and each human, or rates, to this .png, .svg or .pdf file.",
    sentence="Print the result as sentences instead of tables.",
)
