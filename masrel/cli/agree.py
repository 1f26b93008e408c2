"""``masrel agree``: agreement of any CSV file of ratings, no study needed."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from masrel.cli._options import (
    OutputOptions,
    grouped,
    output_options,
    split_commas,
    write_output,
)
from masrel.cli._reading import (
    ReadingOptions,
    read_file,
    reading_options,
    table_options,
    what_was_read,
)
from masrel.errors import MasrelError, MasrelWarning, ParameterError, RatingsError
from masrel.estimates import Target, as_document

if TYPE_CHECKING:
    from masrel.agreement import BandScale, Coefficient, WeightName
    from masrel.ratings import RatingsFile, RatingsPart
    from masrel.report._agreement_table import AgreementRow

_USUAL = ["percent_agreement", "fleiss_kappa"]

_NO_INTERVAL = (
    "no interval: say what a new study would draw anew, with --target raters, items "
    "or both"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _EstimateOptions:
    """What is estimated of every session."""

    coefficients: str | None  # names, separated by commas, or "all"; None for `_USUAL`
    weights: "WeightName"  # for coefficients that take any; checked where they are made
    target: Target | None  # what a new study would draw anew; no interval when None
    # kind of interval; "auto" chooses one
    interval: Literal["auto", "analytic", "jackknife", "bootstrap", "posterior"]
    level: float
    # n_resamples, seed: for intervals that draw
    n_resamples: int
    seed: int
    words: "BandScale | None"  # whose words for values


_estimate_options = grouped(
    "options",
    _EstimateOptions,
    click.option(
        "--coefficients",
        show_default=",".join(_USUAL),
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
@grouped(
    "reading",
    ReadingOptions,
    *reading_options,
    *table_options,
    click.option("--by", metavar="COL", help="Estimate each group of this column."),
)
@_estimate_options
@output_options(
    json="Write the estimates here; - prints them, and nothing else, on stdout.",
    figure="Draw the intervals into this .png, .svg or .pdf; needs --target.",
    csv="Print every digit as CSV.",
    latex="Print a LaTeX table.",
)
def agree(
    file: Path,
    reading: ReadingOptions,
    options: _EstimateOptions,
    output: OutputOptions,
) -> None:
    """Estimate the agreement of the raters in FILE.

    FILE is a CSV table, one row a rating (columns item, rater, grade, or those
    named) or one row an item and one column a rater. Missing grades are empty or NA.
    Grades that are all numbers weigh by value, others by their place in the scale.
    """
    target = options.target
    output.check_files()
    if output.figure is not None and target is None:
        raise ParameterError(
            "--figure: shows intervals, so it needs --target raters, items or both"
        )
    ratings = read_file(file, reading)
    by = reading.by
    notes = (*what_was_read(ratings), *(f"warning: {w}" for w in ratings.warnings))
    rows = _estimate(ratings, options, file)
    from masrel.report._agreement_table import agreement_forest, agreement_table
    from masrel.report._tables import SIMULATED

    write_output(
        output,
        document=lambda: {**_document(rows, by), "read": ratings.read},
        text=lambda: agreement_table(
            rows,
            caption=f"Agreement of the raters in {file}",
            by=by,
            bands=options.words,
            notes=notes,
            data="simulated" if ratings.simulated else "foreign",
        ),
        figure=None if target is None else lambda: agreement_forest(rows, target),
        stamp=SIMULATED if ratings.simulated else "",
        notes=notes,
    )
    if target is None:
        click.echo(_NO_INTERVAL, err=True)


def _estimate(
    ratings: "RatingsFile", options: _EstimateOptions, file: Path
) -> "list[AgreementRow]":
    sessions = list(dict.fromkeys(str(part.session) for part in ratings.parts))
    if len(sessions) > 1:
        raise RatingsError(
            f"{file}: holds {len(sessions)} sessions ({', '.join(sessions)}), so that "
            "raters graded the same item more than once; "
            f"--by {ratings.read['session']} estimates each"
        )
    with warnings.catch_warnings():
        # Every note is in the result, and so below the table or in the JSON.
        warnings.simplefilter("ignore", MasrelWarning)
        return [
            row
            for part in ratings.parts
            for row in _estimate_session(ratings, part, options)
        ]


def _estimate_session(
    ratings: "RatingsFile", part: "RatingsPart", options: _EstimateOptions
) -> "list[AgreementRow]":
    from masrel.report._agreement_table import AgreementRow

    is_named = options.coefficients is not None
    names = (
        _USUAL if options.coefficients is None else split_commas(options.coefficients)
    )
    takes_all = names == ["all"]
    rows: list[AgreementRow] = []
    refused: list[MasrelError] = []
    for entry in _entries(names, options.weights, ratings, part):
        title, notes = entry.title, []
        counted = part.ratings if entry.kernel is None else part.counted
        weights: WeightName = options.weights if entry.weighted else "identity"
        if weights != "identity":
            title += f", {weights}"
        elif weights != options.weights and not takes_all:
            notes.append("unweighted, there are no weights for it")
        # An interval that a coefficient comes with is not computed a second time.
        is_done = entry.has_interval and (options.interval == "auto" or takes_all)
        estimate = None
        if options.target is not None and not is_done:
            from masrel import intervals

            try:
                estimate = intervals.estimate(
                    entry,
                    counted,
                    target=options.target,
                    method=options.interval,
                    categories=counted.categories,
                    weights=weights,
                    level=options.level,
                    n_resamples=options.n_resamples,
                    rng=options.seed,
                )
            except MasrelError as error:
                if is_named and not takes_all:
                    raise  # just these were named: each must have the interval
                refused.append(error)
                notes.append(f"no interval: {error}")
        if estimate is None:
            estimate = entry(
                counted,
                categories=counted.categories,
                weights=weights,
                level=options.level,
            )
        rows.append(
            AgreementRow(
                session=part.group or "",
                title=title,
                estimate=estimate,
                notes=tuple(notes),
            )
        )
    if not takes_all and refused and len(refused) == len(rows):
        raise refused[0]
    return rows


_NEED_ORDER = ("icc", "kendall_w", "robinson_a")
"""How names of coefficients begin that are of values or of ranks."""


def _entries(
    names: list[str], weights: str, ratings: "RatingsFile", part: "RatingsPart"
) -> list["Coefficient"]:
    from masrel.agreement import COEFFICIENTS, coefficient

    n_raters = len(part.raters) or ratings.read["n_raters"]
    if weights != "identity" and not ratings.is_ordered:
        raise ParameterError(
            f"--weights {weights}: needs --categories with every grade of the scale in "
            f"order, the grades met are text: {', '.join(ratings.scale.grades)}"
        )
    if names == ["all"]:
        return [
            entry
            for entry in COEFFICIENTS.values()
            if entry.shape == "ratings" and n_raters <= (entry.n_raters[1] or n_raters)
        ]
    entries = [coefficient(name) for name in names]
    for entry in entries:
        if entry.name.startswith(_NEED_ORDER) and not ratings.is_ordered:
            raise ParameterError(
                f"--coefficients: {entry.name} needs grades that are numbers, or "
                "--categories with every grade in order, got text: "
                f"{', '.join(ratings.scale.grades[:6])}"
            )
        if entry.shape == "pairs":
            raise ParameterError(
                f"--coefficients: {entry.name} takes each rater's grades of two "
                "sessions; masrel analyze computes it from a study's plan"
            )
    return entries


def _document(rows: "list[AgreementRow]", by: str | None) -> dict[str, object]:
    documents = [
        {**({} if by is None else {by: row.session}), **as_document(row.estimate)}
        for row in rows
    ]
    return {"estimates": documents}
