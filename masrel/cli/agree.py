"""``masrel agree``: agreement of any CSV file of ratings, no study needed."""

import json
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.errors import MasrelWarning, ParameterError, RatingsError
from masrel.estimates import Estimate, Interval, Target, as_document

if TYPE_CHECKING:
    from masrel.ratings import Ratings

__all__ = ["command"]

NO_INTERVAL = (
    "no interval: say what a new study would draw anew, with --target raters, items "
    "or both"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Asked:
    # what the caller wants of every session
    coefficients: tuple[str, ...]
    target: Target | None
    interval: str
    level: float
    n_resamples: int
    seed: int


@click.command("agree")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--item", help="Column of the rated items (long format).")
@click.option("--rater", help="Column of the raters (long format).")
@click.option("--grade", help="Column of the grades (long format).")
@click.option(
    "--categories", help="Every grade of the scale in order, such as 0,1,1+,2,3,4."
)
@click.option(
    "--coefficients",
    default="percent_agreement,fleiss_kappa",
    show_default=True,
    help="Names of coefficients, separated by commas.",
)
@click.option(
    "--target",
    type=click.Choice(["items", "raters", "both"]),
    help="What a new study would draw anew; no interval without it.",
)
@click.option(
    "--interval",
    type=click.Choice(["default", "analytic", "jackknife", "bootstrap", "posterior"]),
    default="default",
    show_default=True,
    help="Kind of interval; default: jackknife, for items analytic.",
)
@click.option("--level", default=0.95, show_default=True, help="Level of intervals.")
@click.option("--resamples", "n_resamples", default=10_000, show_default=True)
@click.option("--seed", default=0, show_default=True, help="Seed of resampling.")
@click.option("--by", type=click.Choice(["session"]), help="Estimate each session.")
@click.option(
    "--json",
    "json_file",
    type=click.Path(path_type=Path, allow_dash=True),
    help="Write the estimates here; - prints them, and nothing else, on stdout.",
)
def command(
    file: Path,
    item: str | None,
    rater: str | None,
    grade: str | None,
    categories: str | None,
    coefficients: str,
    target: Target | None,
    interval: str,
    level: float,
    n_resamples: int,
    seed: int,
    by: str | None,
    json_file: Path | None,
) -> None:
    """Estimate the agreement of the raters in FILE.

    FILE is a CSV table, one row a rating (columns item, rater, grade, or those
    named) or one row an item and one column a rater. Missing grades are empty or NA.
    """
    asked = _Asked(
        coefficients=tuple(name.strip() for name in coefficients.split(",")),
        target=target,
        interval=interval,
        level=level,
        n_resamples=n_resamples,
        seed=seed,
    )
    from masrel.ratings import read_ratings

    ratings = read_ratings(
        file,
        item=item,
        rater=rater,
        grade=grade,
        categories=None if categories is None else _listed(categories),
    )
    sessions = _sessions(ratings, file, by)
    with warnings.catch_warnings():
        # Every note is in the result, and so below the table or in the JSON.
        warnings.simplefilter("ignore", MasrelWarning)
        found = [
            (session, estimate)
            for session in sessions
            for estimate in _estimates(ratings, session, asked)
        ]
    _write(found, file, by, json_file)
    if target is None:
        click.echo(NO_INTERVAL, err=True)


def _listed(text: str) -> list[str]:
    return [part.strip() for part in text.split(",")]


def _sessions(ratings: "Ratings", file: Path, by: str | None) -> list[str]:
    sessions = list(dict.fromkeys(ratings.table["session"]))
    if by is None and len(sessions) > 1:
        raise RatingsError(
            f"{file}: holds {len(sessions)} sessions ({', '.join(sessions)}), so that "
            "raters graded the same item more than once; --by session estimates each"
        )
    return sessions


def _estimates(ratings: "Ratings", session: str, asked: _Asked) -> list[Estimate]:
    from masrel.agreement import coefficient
    from masrel.ratings import rating_matrix

    matrix = rating_matrix(ratings, session=session)
    categories = ratings.scale.grades
    found = []
    for name in asked.coefficients:
        entry = coefficient(name)
        if entry.shape == "pairs":
            raise ParameterError(
                f"--coefficients: {name} takes each rater's grades of two sessions; "
                "masrel analyze computes it from a study's plan"
            )
        estimate = entry(matrix.grades, categories=categories)
        if asked.target is not None:
            interval = _interval(name, matrix.grades, categories, asked.target, asked)
            estimate = replace(estimate, interval=interval)
        found.append(estimate)
    return found


def _interval(
    name: str,
    grades: list[list[str | None]],
    categories: tuple[str, ...],
    target: Target,
    asked: _Asked,
) -> Interval | None:
    from masrel.analysis.interval import planned_interval

    usual = "analytic" if target == "items" else "jackknife"
    return planned_interval(
        usual if asked.interval == "default" else asked.interval,
        name,
        grades,
        target=target,
        categories=categories,
        level=asked.level,
        n_resamples=asked.n_resamples,
        seed=asked.seed,
    )


def _write(
    found: list[tuple[str, Estimate]],
    file: Path,
    by: str | None,
    json_file: Path | None,
) -> None:
    documents = [
        as_document(estimate) if by is None else {by: session, **as_document(estimate)}
        for session, estimate in found
    ]
    text = json.dumps(
        {"estimates": documents}, indent=1, ensure_ascii=False, allow_nan=False
    )
    if json_file == Path("-"):
        click.echo(text)
        return
    if json_file is not None:
        json_file.write_text(text + "\n", encoding="utf-8", newline="\n")
    click.echo(_as_screen(found, file, by))


def _as_screen(found: list[tuple[str, Estimate]], file: Path, by: str | None) -> str:
    from masrel.agreement import COEFFICIENTS
    from masrel.report.tables import Column, Table, as_text, interval_words

    columns = (
        *([] if by is None else [Column(key=by, heading=by.title(), align="left")]),
        Column(key="coefficient", heading="Coefficient", align="left"),
        Column(key="value", heading="Value", digits=3),
        Column(key="standard_error", heading="SE", digits=3),
        Column(key="interval", heading="Interval", align="left"),
        Column(key="n_items", heading="Items"),
        Column(key="n_raters", heading="Raters"),
        Column(key="n_categories", heading="Categories"),
    )
    rows = tuple(
        (
            *([] if by is None else [session]),
            COEFFICIENTS[estimate.coefficient].title,
            estimate.value,
            estimate.standard_error,
            None
            if estimate.interval is None
            else interval_words(estimate.interval.low, estimate.interval.high),
            estimate.n_items,
            estimate.n_raters,
            estimate.n_categories,
        )
        for session, estimate in found
    )
    return as_text(
        Table(
            name="agreement",
            caption=f"Agreement of the raters in {file}",
            columns=columns,
            rows=rows,
            notes=_below([estimate for _, estimate in found]),
            data="foreign",
        )
    )


def _below(estimates: list[Estimate]) -> tuple[str, ...]:
    # How each interval was made, what to know of it, and why a value is undefined.
    said = ["SE: delta method, items as the sample."]
    for estimate in estimates:
        interval = estimate.interval
        name = estimate.coefficient
        if estimate.reason is not None:
            said.append(f"{name}: undefined: {estimate.reason}.")
        if interval is None:
            continue
        said.append(
            f"Interval: {100 * interval.level:g} % {interval.kind}, {interval.method}; "
            f"speaks of other {_OTHERS[interval.target]}."
        )
        said += [f"{name}: {note}." for note in interval.notes]
        if interval.reason not in (None, estimate.reason):
            said.append(f"{name}: no interval: {interval.reason}.")
    return tuple(dict.fromkeys(said))


_OTHERS = {"items": "items", "raters": "raters", "both": "items and raters"}
