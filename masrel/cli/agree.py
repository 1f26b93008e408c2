"""``masrel agree``: agreement of any CSV file of ratings, no study needed."""

import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli.agreement_figure import check_figure, write_figure
from masrel.cli.agreement_rows import Row, Wanted, estimate_session, scale_notes
from masrel.cli.agreement_table import agreement_table
from masrel.errors import MasrelWarning, ParameterError, RatingsError
from masrel.estimates import Target, as_document

if TYPE_CHECKING:
    from masrel.agreement.weights import WeightName
    from masrel.ratings import Ratings
    from masrel.report.tables import Table

__all__ = ["command"]

_UNNAMED = ("percent_agreement", "fleiss_kappa")
NO_INTERVAL = (
    "no interval: say what a new study would draw anew, with --target raters, items "
    "or both"
)


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
    show_default=",".join(_UNNAMED),
    help="Names of coefficients, separated by commas, or all.",
)
@click.option(
    "--weights",
    default="identity",
    show_default=True,
    help="identity, linear, quadratic, ordinal, radical, ratio, circular or bipolar.",
)
@click.option(
    "--target",
    type=click.Choice(["items", "raters", "both"]),
    help="What a new study would draw anew; no interval without it.",
)
@click.option(
    "--interval",
    type=click.Choice(["auto", "analytic", "jackknife", "bootstrap", "posterior"]),
    default="auto",
    show_default=True,
    help="Kind of interval; auto chooses by target and size.",
)
@click.option("--level", default=0.95, show_default=True, help="Level of intervals.")
@click.option("--resamples", "n_resamples", default=10_000, show_default=True)
@click.option("--seed", default=0, show_default=True, help="Seed of resampling.")
@click.option(
    "--words",
    type=click.Choice(["landis_koch", "altman", "fleiss", "cicchetti"]),
    help="Name the best band that the true value reaches with 95 % probability.",
)
@click.option("--by", type=click.Choice(["session"]), help="Estimate each session.")
@click.option(
    "--json",
    "json_file",
    type=click.Path(path_type=Path, allow_dash=True),
    help="Write the estimates here; - prints them, and nothing else, on stdout.",
)
@click.option(
    "--figure",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Draw the intervals into this .png, .svg or .pdf; needs --target.",
)
@click.option("--csv", "csv", is_flag=True, help="Print every digit as CSV.")
@click.option("--latex", "latex", is_flag=True, help="Print a LaTeX table.")
def command(
    file: Path,
    item: str | None,
    rater: str | None,
    grade: str | None,
    categories: str | None,
    coefficients: str | None,
    weights: "WeightName",  # checked where the weights are made
    target: Target | None,
    interval: str,
    level: float,
    n_resamples: int,
    seed: int,
    words: str | None,
    by: str | None,
    json_file: Path | None,
    figure: Path | None,
    csv: bool,
    latex: bool,
) -> None:
    """Estimate the agreement of the raters in FILE.

    FILE is a CSV table, one row a rating (columns item, rater, grade, or those
    named) or one row an item and one column a rater. Missing grades are empty or NA.
    Grades that are all numbers weigh by value, others by their place in the scale.
    """
    forms = {"--json -": json_file == Path("-"), "--csv": csv, "--latex": latex}
    printed = [name for name, wanted in forms.items() if wanted]
    if len(printed) > 1:
        both = " and ".join(printed)
        raise ParameterError(f"{both} want the same stdout: choose one")
    if figure is not None:
        check_figure(figure, target)
    names = _UNNAMED if coefficients is None else tuple(_listed(coefficients))
    wanted = Wanted(
        coefficients=names,
        named=coefficients is not None and names != ("all",),
        weights=weights,
        target=target,
        interval=interval,
        level=level,
        n_resamples=n_resamples,
        seed=seed,
        words=words,
    )
    from masrel.ratings import read_ratings

    ratings = read_ratings(
        file,
        item=item,
        rater=rater,
        grade=grade,
        categories=None if categories is None else _listed(categories),
    )
    about = scale_notes(ratings, wanted.weights)
    with warnings.catch_warnings():
        # Every note is in the result, and so below the table or in the JSON.
        warnings.simplefilter("ignore", MasrelWarning)
        rows = [
            row
            for session in _sessions(ratings, file, by)
            for row in estimate_session(ratings, session, wanted)
        ]
    if json_file is not None:
        _write_json(rows, by, json_file)
    if json_file == Path("-"):
        click.echo("".join(f"{note}\n" for note in about), err=True, nl=False)
    else:
        data = "simulated" if ratings.simulated else "foreign"
        _print(agreement_table(rows, file, by, wanted, about, data), printed)
    if target is None:
        click.echo(NO_INTERVAL, err=True)
    elif figure is not None:
        write_figure(rows, ratings, by, target, figure)
        click.echo(f"figure: {figure}", err=True)


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


def _write_json(rows: list[Row], by: str | None, file: Path) -> None:
    documents = [
        {**({} if by is None else {by: row.session}), **as_document(row.estimate)}
        for row in rows
    ]
    text = json.dumps(
        {"estimates": documents}, indent=1, ensure_ascii=False, allow_nan=False
    )
    if file == Path("-"):
        click.echo(text)
    else:
        file.write_text(text + "\n", encoding="utf-8", newline="\n")


def _print(table: "Table", printed: list[str]) -> None:
    from masrel.report.latex import as_latex
    from masrel.report.tables import as_csv, as_text

    form = {"--csv": as_csv, "--latex": as_latex}
    shown = form[printed[0]](table) if printed else as_text(table)
    click.echo(shown.rstrip("\n"))
    if printed == ["--csv"]:  # which has no place for notes
        for note in table.notes:
            click.echo(note, err=True)
