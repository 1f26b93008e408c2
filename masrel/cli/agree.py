"""``masrel agree``: agreement of any CSV file of ratings, no study needed."""

import hashlib
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli._agreement_output import WithArguments, order_notes, write_agreement
from masrel.cli._agreement_rows import (
    EstimateOptions,
    estimate_options,
    estimate_rows,
)
from masrel.cli._options import (
    ColumnOptions,
    OutputOptions,
    column_options,
    output_options,
    scale_notes,
)
from masrel.errors import ParameterError, RatingsError

if TYPE_CHECKING:
    from masrel.agreement import CountedRatings
    from masrel.ratings import Ratings
    from masrel.report._agreement_table import AgreementRow
    from masrel.scales import Scale


@click.command("agree", cls=WithArguments)
@click.argument("file", type=click.Path(path_type=Path))
@column_options
@estimate_options
@click.option("--by", type=click.Choice(["session"]), help="Estimate each session.")
@click.option(
    "--explain", is_flag=True, help="Say in notes what every interval promises."
)
@output_options(
    json="Write a record of all here; - prints it, and nothing else, on stdout.",
    figure="Draw the intervals into this .png, .svg or .pdf; needs --target.",
    csv="Print every digit as CSV.",
    latex="Print a LaTeX table.",
    sentence="Print a sentence for a paper instead of the table, one an estimate.",
)
def agree(
    file: Path,
    columns: ColumnOptions,
    options: EstimateOptions,
    by: str | None,
    explain: bool,
    output: OutputOptions,
) -> None:
    """Estimate the agreement of the raters in FILE.

    FILE is a CSV table, one row a rating (columns item, rater, grade, or those
    named) or one row an item and one column a rater. Missing grades are empty or NA.
    Grades that are all numbers weigh by value, others by their place in the scale.
    """
    output.check_files()
    if output.figure is not None and options.target is None:
        raise ParameterError(
            "--figure: shows intervals, so it needs --target raters, items or both"
        )
    from masrel.ratings import read_ratings

    ratings = read_ratings(file, **asdict(columns))
    notes = scale_notes(ratings, options.weights)
    is_ordered = _has_order(ratings.scale)
    write_agreement(
        _estimate(ratings, options, by, file, is_ordered),
        output,
        file=file,
        sha256=hashlib.sha256(file.read_bytes()).hexdigest(),
        scale=ratings.scale,
        options=options,
        by=by,
        read={},
        notes=(*notes, *order_notes(is_ordered, options)),
        explain=explain,
        simulated=ratings.simulated,
    )


def _has_order(scale: "Scale") -> bool:
    """Return whether grades have an order: a declared one, or as numbers."""
    if scale.name != "observed":
        return True
    try:
        return all(math.isfinite(float(grade)) for grade in scale.grades)
    except ValueError:
        return False


@dataclass(frozen=True, slots=True, kw_only=True)
class _Part:
    # of one session
    ratings: "CountedRatings"
    counted: "CountedRatings"


def _estimate(
    ratings: "Ratings",
    options: EstimateOptions,
    by: str | None,
    file: Path,
    is_ordered: bool,
) -> "list[AgreementRow]":
    from masrel.agreement import count_ratings
    from masrel.ratings import rating_matrix

    sessions = list(dict.fromkeys(ratings.table["session"]))
    if by is None and len(sessions) > 1:
        raise RatingsError(
            f"{file}: holds {len(sessions)} sessions ({', '.join(sessions)}), so that "
            "raters graded the same item more than once; --by session estimates each"
        )
    rows, scale = [], ratings.scale
    for session in sessions:
        matrix = rating_matrix(ratings, session=session)
        counted = count_ratings(scale.weigh(matrix.grades), scale.values)
        rows += estimate_rows(
            _Part(ratings=counted, counted=counted),
            group=session,
            n_raters=len(matrix.raters),
            scale=scale,
            is_ordered=is_ordered,
            options=options,
        )
    return rows
