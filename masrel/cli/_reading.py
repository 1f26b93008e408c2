"""Options of the commands that read a file of ratings, and how they report it."""

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
        help="Column of the items; A,B if it takes several columns to name an item.",
    ),
    click.option(
        "--rater", metavar="COL", help="Column of the raters (one row per rating)."
    ),
    click.option(
        "--grade", metavar="COL", help="Column of the grades (one row per rating)."
    ),
    click.option(
        "--raters",
        multiple=True,
        metavar="COL,…",
        help="Columns of the raters (one row per item).",
    ),
    click.option("--ignore", multiple=True, metavar="COL,…", help="Columns to ignore."),
    click.option("--no-item", is_flag=True, help="No column names the items."),
    click.option(
        "--no-header",
        is_flag=True,
        help="There is no header; the columns are called 1, 2, 3 …",
    ),
    click.option(
        "--skip",
        type=click.IntRange(min=0),
        default=0,
        metavar="N",
        help="Number of lines, or rows of a sheet, above the header.",
    ),
    click.option(
        "--header",
        type=lambda text: tuple(map(int, filter(None, split_commas(text)))),
        default="",
        metavar="N,…",
        help="Lines that form the header; the data begin below the last of them.",
    ),
    click.option("--session", metavar="COL", help="Column of the sessions."),
    click.option(
        "--frequency",
        metavar="COL",
        help="Column with the number of items that have the pattern in the row.",
    ),
    click.option(
        "--repeated",
        type=click.Choice(["error", "first", "last", "mean"]),
        default="error",
        show_default=True,
        help="What to do with a second grade of an item by the same rater.",
    ),
    click.option(
        "--categories",
        type=split_commas,
        metavar="GRADE,…",
        help="All grades of the scale in order, such as 0,1,1+,2,3,4.",
    ),
    click.option(
        "--missing",
        "missing_codes",
        multiple=True,
        metavar="CODE,…",
        help="Cells that mean a missing grade, besides empty cells and NA.",
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
        help="Thousands separator, such as the comma in 1,200.",
    ),
    click.option(
        "--units",
        is_flag=True,
        help="Remove the unit, as in 5 mm or 78%; all numbers must have the same one.",
    ),
    click.option(
        "--set-separator",
        metavar="SEP",
        help="Separator of the labels in a cell, for --metric jaccard or masi.",
    ),
    click.option(
        "--delimiter",
        default="auto",
        show_default=True,
        metavar="CHAR",
        help="Separator of the cells: a character, or the word tab or blanks.",
    ),
    click.option(
        "--encoding",
        metavar="NAME",
        help="Encoding of the text, such as latin-1. Default: UTF-8, or what the byte "
        "order mark says.",
    ),
    click.option("--sheet", metavar="NAME", help="Sheet of a workbook."),
    click.option(
        "--transpose", is_flag=True, help="Each row is a rater and each column an item."
    ),
    click.option(
        "--from",
        "source",
        metavar="TOOL",
        help="Tool that exported the file: label-studio, doccano, prodigy, inception; "
        "inspect-ai, lm-eval, promptfoo, mlflow, langsmith, langfuse, mt-bench.",
    ),
]
"""Options of commands that read a file of ratings."""

table_options = [
    click.option(
        "--by-criterion",
        is_flag=True,
        help="Columns combine a criterion and a rater, as tone_Kim, tone_Lee, "
        "gait_Kim …: estimate each criterion separately; --raters then gives the "
        "names of the raters.",
    ),
    click.option(
        "--counts",
        is_flag=True,
        help="The table counts, for each item, how many raters chose each category.",
    ),
    click.option(
        "--table",
        is_flag=True,
        help="The file is a contingency table of two raters, with the first in rows.",
    ),
]
"""Options of commands that need not know who rated what."""


def options_of(*names: str) -> list[Decorator]:
    """Return the options of reading a file that set these."""
    made = {
        click.command()(option(lambda: None)).params[0].name: option
        for option in reading_options
    }
    return [made[name] for name in names]
