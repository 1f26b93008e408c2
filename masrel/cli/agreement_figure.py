"""The figure of a table of agreement: a file that a paper can take as it is."""

from pathlib import Path
from typing import TYPE_CHECKING

from masrel.cli.agreement_rows import Row
from masrel.cli.output import figure_form
from masrel.errors import ParameterError
from masrel.estimates import Interval, Target

if TYPE_CHECKING:
    from masrel.ratings import Ratings
    from masrel.report.figures import ForestRow

__all__ = ["check_figure", "write_figure"]

_POPULATION = {
    "items": "other items",
    "raters": "other raters",
    "both": "other items and raters",
}


def check_figure(file: Path, target: Target | None) -> None:
    """Check that a figure can be made, before anything is computed for it."""
    figure_form(file)
    if target is None:
        raise ParameterError(
            "--figure: shows intervals, so it needs --target raters, items or both"
        )


def write_figure(
    rows: list[Row], ratings: "Ratings", by: str | None, target: Target, file: Path
) -> None:
    """Draw the estimates with their intervals."""
    # Imported here: a table loads nothing that draws.
    from masrel.report.figures import forest_file

    several = by is not None and len({row.session for row in rows}) > 1
    drawn = forest_file(
        [_line(row, several, target) for row in rows],
        axis_label=f"agreement (1 is perfect); intervals for {_POPULATION[target]}",
        stamp="SIMULATED DATA" if ratings.simulated else "",
        form=figure_form(file),
    )
    file.write_bytes(drawn)


def _line(row: Row, several: bool, target: Target) -> "ForestRow":
    from masrel.report.estimate_words import as_words, has_zero
    from masrel.report.figures import ForestRow

    estimate = row.estimate
    return ForestRow(
        label=row.title,
        detail=_detail(estimate.interval, target),
        value=estimate.value,
        interval=estimate.interval,
        text=as_words(estimate),
        has_zero=has_zero(estimate.coefficient),
        group=row.session if several else "",
    )


def _detail(interval: Interval | None, target: Target) -> str:
    # what the axis and the legend do not say of it
    from masrel.report.meaning import aside

    if interval is None:
        return ""
    whom = "" if interval.target == target else _POPULATION[interval.target]
    return ", ".join(text for text in (aside(interval), whom) if text)
