"""The options of verbs that read any file of ratings, and what they say of it."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli._options import Decorator, progress, split_commas
from masrel.cli._paths import InputFile
from masrel.ratings._findings import Reading

if TYPE_CHECKING:
    from masrel.ratings import RatingsFile


def read_file(file: Path, options: Reading) -> "RatingsFile":
    """Read a file of ratings as the options say."""
    from masrel.ratings import read_ratings

    with progress("reading", "MB", is_quiet=False) as report:
        return read_ratings(
            file,
            options,
            progress=lambda n_bytes, n_all: report(n_bytes >> 20, n_all >> 20),
        )


def weights_of_option(text: str) -> "str | Path":
    """Return a name of weights, or the file of a matrix."""
    # no name has a dot or a slash
    return (
        text if text.isalpha() else InputFile(path_type=Path).convert(text, None, None)
    )


reading_options = [
    click.option(
        "--item",
        multiple=True,
        metavar="COL",
        help="Column of the items; A,B for several.",
    ),
    click.option(
        "--rater", metavar="COL", help="Column of the raters (one row a rating)."
    ),
    click.option(
        "--grade", metavar="COL", help="Column of the grades (one row a rating)."
    ),
    click.option(
        "--raters",
        multiple=True,
        metavar="COL,…",
        help="Columns that are raters (one row an item).",
    ),
    click.option(
        "--ignore", multiple=True, metavar="COL,…", help="Columns that are left aside."
    ),
    click.option("--no-item", is_flag=True, help="No column names the items."),
    click.option(
        "--no-header", is_flag=True, help="No line of names; columns are 1, 2, 3 …"
    ),
    click.option(
        "--skip",
        type=click.IntRange(min=0),
        default=0,
        metavar="N",
        help="Lines, or rows of a sheet, above the line of names.",
    ),
    click.option(
        "--header",
        type=lambda text: tuple(map(int, filter(None, split_commas(text)))),
        default="",
        metavar="N,…",
        help="Lines that make up the names; data begin below the last.",
    ),
    click.option("--session", metavar="COL", help="Column of the sessions."),
    click.option(
        "--frequency",
        metavar="COL",
        help="Column of how many items each row stands for (one row a pattern).",
    ),
    click.option(
        "--repeated",
        type=click.Choice(["error", "first", "last", "mean"]),
        default="error",
        show_default=True,
        help="What becomes of a second grade of an item by a rater.",
    ),
    click.option(
        "--categories",
        type=split_commas,
        metavar="GRADE,…",
        help="Every grade of the scale in order, such as 0,1,1+,2,3,4.",
    ),
    click.option(
        "--missing",
        "missing_codes",
        multiple=True,
        metavar="CODE,…",
        help="Cells that are missing grades, beside empty ones and NA.",
    ),
    click.option(
        "--decimal",
        metavar="CHAR",
        show_default="a point",
        help="Decimal mark of numbers.",
    ),
    click.option(
        "--thousands",
        metavar="CHAR",
        help="Mark between thousands, such as the comma of 1,200.",
    ),
    click.option(
        "--units",
        is_flag=True,
        help="Take the unit off, as of 5 mm or 78%: every number has the same.",
    ),
    click.option(
        "--set-separator",
        metavar="SEP",
        help="What stands between the labels of a cell, for --metric jaccard or masi.",
    ),
    click.option(
        "--delimiter",
        default="auto",
        show_default=True,
        metavar="CHAR",
        help="Separator of cells; tab and blanks by name.",
    ),
    click.option(
        "--encoding",
        metavar="NAME",
        help="Encoding of text, such as latin-1; UTF-8 or what its mark says.",
    ),
    click.option("--sheet", metavar="NAME", help="Sheet of a workbook."),
    click.option(
        "--transpose", is_flag=True, help="A row is a rater, a column an item."
    ),
    click.option(
        "--from",
        "source",
        metavar="TOOL",
        help="Tool whose export it is: label-studio, doccano, prodigy, inception; "
        "inspect-ai, lm-eval, promptfoo, mlflow, langsmith, langfuse, mt-bench.",
    ),
]
"""Options of verbs that read a file of ratings."""

table_options = [
    click.option(
        "--by-criterion",
        is_flag=True,
        help="Columns are criteria by raters, as tone_Kim, tone_Lee, gait_Kim …: "
        "estimate each criterion; --raters then names raters.",
    ),
    click.option(
        "--counts",
        is_flag=True,
        help="Items by categories: how many raters chose each.",
    ),
    click.option(
        "--table",
        is_flag=True,
        help="A contingency table of two raters, the first in rows.",
    ),
]
"""Options of verbs that need not know who rated what."""


def options_of(*names: str) -> list[Decorator]:
    """Return the options of reading a file that set these."""
    made = {
        click.command()(option(lambda: None)).params[0].name: option
        for option in reading_options
    }
    return [made[name] for name in names]
