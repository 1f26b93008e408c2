"""``masrel grading``: what grades follow, by ordered regression."""

from pathlib import Path
from typing import Literal

import click

from masrel.cli._options import (
    OutputOptions,
    level_option,
    output_options,
    split_commas,
    write_output,
)
from masrel.lab.analysis import Effect, GradeRegression, grade_regression
from masrel.lab.analysis._grading import PREDICTORS
from masrel.lab.analysis._results import as_plain
from masrel.lab.cli._study_options import ratings_option, read_study, warnings_as_notes
from masrel.tables._tables import Column, Table, interval_text, number


@click.command("grading")
@click.argument("study", type=click.Path(path_type=Path))
@ratings_option
@click.option(
    "--on",
    "predictors",
    default="L,H,Q,D,speed",
    show_default=True,
    help="Predictors of the grades; the first one is kept when some are redundant.",
)
@click.option(
    "--models",
    type=click.Choice(["standard", "dummy", "all"]),
    default="all",
    show_default=True,
    help="Use only ratings of these models.",
)
@click.option("--session", help="Use only ratings of this session.")
@level_option
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints nothing '
    "else.",
)
def grading(
    study: Path,
    ratings_file: Path | None,
    predictors: str,
    models: Literal["standard", "dummy", "all"],
    session: str | None,
    level: float,
    output: OutputOptions,
) -> None:
    """Regress the grades of STUDY on the models' L, H, Q, D and the speed.

    Prints the factor by which one standard deviation of each predictor multiplies the
    odds of a higher grade, with the others held constant.
    """
    data = read_study(study, ratings_file)
    with warnings_as_notes():
        regression = grade_regression(
            data.protocol,
            data.ratings,
            predictors=tuple(split_commas(predictors)),
            models=models,
            session=session,
            level=level,
            excluded=data.excluded,
        )
    write_output(
        output,
        document=lambda: as_plain(regression),
        text=lambda: _table(regression),
    )


def _table(regression: GradeRegression) -> Table:
    return Table(
        name="grading",
        caption="Odds of a higher grade, per standard deviation",
        columns=(
            Column(key="predictor", heading="Predictor", align="left"),
            Column(key="per", heading="Standard deviation"),
            Column(key="odds_ratio", heading="Odds ratio", digits=2),
            Column(key="interval", heading=f"{100.0 * regression.level:g} % interval"),
        ),
        rows=tuple(_row(effect) for effect in regression.effects),
        notes=(
            f"{regression.n_ratings} ratings of {regression.n_models} models by "
            f"{regression.n_raters} raters, {regression.n_missing} without a grade or "
            "speed left out; errors are clustered by rater.",
            *(f"{name} is left out: {why}." for name, why in regression.dropped),
        ),
        data="simulated" if regression.simulated else "foreign",
    )


def _row(effect: Effect) -> tuple[str, str, float, str]:
    unit = PREDICTORS[effect.predictor][1]
    return (
        effect.predictor,
        number(effect.per, 3) + ("" if unit == "1" else f" {unit}"),
        effect.odds_ratio,
        interval_text(effect.low, effect.high, 2),
    )
