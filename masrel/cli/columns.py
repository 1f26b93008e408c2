"""The options that say where the ratings stand in a CSV file."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli.options import grouped

if TYPE_CHECKING:
    from masrel.ratings import Ratings

__all__ = ["Columns", "column_options", "listed"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Columns:
    """Columns of a file in long format, and its scale; None where nothing is said."""

    # item, rater, grade: names of columns
    item: str | None
    rater: str | None
    grade: str | None
    categories: str | None  # every grade of the scale in order, separated by commas

    def read(self, file: Path) -> "Ratings":
        """Read the ratings of a file."""
        from masrel.ratings import read_ratings

        return read_ratings(
            file,
            item=self.item,
            rater=self.rater,
            grade=self.grade,
            categories=None if self.categories is None else listed(self.categories),
        )


column_options = grouped(
    "columns",
    Columns,
    click.option("--item", help="Column of the rated items (long format)."),
    click.option("--rater", help="Column of the raters (long format)."),
    click.option("--grade", help="Column of the grades (long format)."),
    click.option(
        "--categories", help="Every grade of the scale in order, such as 0,1,1+,2,3,4."
    ),
)
"""The options of columns, given to a command as one argument `columns`."""


def listed(text: str) -> list[str]:
    """Split the parts of an option at its commas."""
    return [part.strip() for part in text.split(",")]
