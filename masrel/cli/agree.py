"""``masrel agree``: agreement of any CSV file of ratings, no study needed."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli.agreement_output import Output, output_options, put
from masrel.cli.agreement_rows import (
    USUAL,
    Row,
    Wanted,
    estimate_session,
    scale_notes,
)
from masrel.cli.columns import Columns, column_options
from masrel.cli.options import grouped
from masrel.errors import MasrelWarning, RatingsError

if TYPE_CHECKING:
    from masrel.ratings import Ratings

__all__ = ["command"]

_wanted_options = grouped(
    "wanted",
    Wanted,
    click.option(
        "--coefficients",
        show_default=",".join(USUAL),
        help="Names of coefficients, separated by commas, or all.",
    ),
    click.option(
        "--weights",
        default="identity",
        show_default=True,
        help="identity, linear, quadratic, ordinal, radical, ratio, circular or "
        "bipolar.",
    ),
    click.option(
        "--target",
        type=click.Choice(["items", "raters", "both"]),
        help="What a new study would draw anew; no interval without it.",
    ),
    click.option(
        "--interval",
        type=click.Choice(["auto", "analytic", "jackknife", "bootstrap", "posterior"]),
        default="auto",
        show_default=True,
        help="Kind of interval; auto chooses by target and size.",
    ),
    click.option(
        "--level", default=0.95, show_default=True, help="Level of intervals."
    ),
    click.option("--resamples", "n_resamples", default=10_000, show_default=True),
    click.option("--seed", default=0, show_default=True, help="Seed of resampling."),
    click.option(
        "--words",
        type=click.Choice(["landis_koch", "altman", "fleiss", "cicchetti"]),
        help="Name the best band that the true value reaches with 95 % probability.",
    ),
)


@click.command("agree")
@click.argument("file", type=click.Path(path_type=Path))
@column_options
@_wanted_options
@click.option("--by", type=click.Choice(["session"]), help="Estimate each session.")
@output_options
def command(
    file: Path, columns: Columns, wanted: Wanted, by: str | None, output: Output
) -> None:
    """Estimate the agreement of the raters in FILE.

    FILE is a CSV table, one row a rating (columns item, rater, grade, or those
    named) or one row an item and one column a rater. Missing grades are empty or NA.
    Grades that are all numbers weigh by value, others by their place in the scale.
    """
    output.check(wanted)
    ratings = columns.read(file)
    about = scale_notes(ratings, wanted.weights)
    sessions = _sessions(ratings, file, by)
    rows = _estimates(ratings, sessions, wanted)
    put(output, rows, ratings, wanted, file=file, by=by, about=about)


def _estimates(ratings: "Ratings", sessions: list[str], wanted: Wanted) -> list[Row]:
    with warnings.catch_warnings():
        # Every note is in the result, and so below the table or in the JSON.
        warnings.simplefilter("ignore", MasrelWarning)
        return [
            row
            for session in sessions
            for row in estimate_session(ratings, session, wanted)
        ]


def _sessions(ratings: "Ratings", file: Path, by: str | None) -> list[str]:
    sessions = list(dict.fromkeys(ratings.table["session"]))
    if by is None and len(sessions) > 1:
        raise RatingsError(
            f"{file}: holds {len(sessions)} sessions ({', '.join(sessions)}), so that "
            "raters graded the same item more than once; --by session estimates each"
        )
    return sessions
