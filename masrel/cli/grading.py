"""``masrel grading``: what grades follow, by ordered regression."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from masrel.cli.columns import listed
from masrel.cli.folders import check_folders
from masrel.cli.material import read_material
from masrel.cli.notes import notes
from masrel.cli.output import write_json

if TYPE_CHECKING:
    from masrel.analysis.grading import Effect, GradeRegression

__all__ = ["command"]


@click.command("grading")
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--ratings",
    "ratings_file",
    type=click.Path(path_type=Path),
    help="File of ratings; default: the study's ratings.csv, else published.csv.",
)
@click.option(
    "--on",
    "predictors",
    default="L,H,Q,D,speed",
    show_default=True,
    help="What grades are regressed on, in the order of their claim.",
)
@click.option(
    "--models",
    type=click.Choice(["standard", "dummy", "all"]),
    default="all",
    show_default=True,
)
@click.option("--session", help="Ratings of this session alone.")
@click.option("--level", type=float, default=0.95, show_default=True)
@click.option(
    "--json",
    "json_file",
    type=click.Path(path_type=Path, allow_dash=True),
    help="Write the result here; - prints it, and nothing else, on stdout.",
)
def command(
    study: Path,
    ratings_file: Path | None,
    predictors: str,
    models: Literal["standard", "dummy", "all"],
    session: str | None,
    level: float,
    json_file: Path | None,
) -> None:
    """Regress the grades of STUDY on the models' L, H, Q, D and the speed.

    Prints by how much one standard deviation of each multiplies the odds of a higher
    grade, the others held.
    """
    check_folders(json=json_file)
    from masrel.analysis.grading import grade_regression

    material = read_material(study, ratings_file)
    with notes():
        found = grade_regression(
            material.protocol,
            material.ratings,
            predictors=tuple(listed(predictors)),
            models=models,
            session=session,
            level=level,
        )
    if json_file is not None:
        write_json(_document(found), json_file)
    if json_file != Path("-"):
        click.echo(_table(found))


def _document(found: "GradeRegression") -> dict[str, object]:
    from dataclasses import asdict

    def known(value: object) -> object:
        if isinstance(value, float) and not math.isfinite(value):
            return None
        if isinstance(value, dict):
            return {key: known(part) for key, part in value.items()}
        if isinstance(value, list | tuple):
            return [known(part) for part in value]
        return value

    return {key: known(value) for key, value in asdict(found).items()}


def _table(found: "GradeRegression") -> str:
    from masrel.report._tables import Column, Table, as_text

    table = Table(
        name="grading",
        caption="Odds of a higher grade, per standard deviation",
        columns=(
            Column(key="predictor", heading="Predictor", align="left"),
            Column(key="per", heading="Standard deviation"),
            Column(key="odds_ratio", heading="Odds ratio", digits=2),
            Column(key="interval", heading=f"{100.0 * found.level:g} % interval"),
        ),
        rows=tuple(_row(effect) for effect in found.effects),
        notes=(
            f"{found.n_ratings} ratings of {found.n_models} models by "
            f"{found.n_raters} raters, {found.n_missing} without a grade or speed left "
            "out; errors are clustered by rater.",
            *(f"{name} is left out: {why}." for name, why in found.dropped),
        ),
        data="simulated" if found.simulated else "foreign",
    )
    return as_text(table)


def _row(effect: "Effect") -> tuple[str, str, float, str]:
    from masrel.report._tables import interval_text, number

    return (
        effect.predictor,
        f"{number(effect.per, 3)} {_unit(effect.predictor)}".strip(),
        effect.odds_ratio,
        interval_text(effect.low, effect.high, 2),
    )


def _unit(predictor: str) -> str:
    from masrel.analysis.predictors import PREDICTORS

    unit = PREDICTORS[predictor][1]
    return "" if unit == "1" else unit
