"""Writing a table of ratings, and its hash; the same table gives the same bytes."""

import csv
import hashlib
import io
import math
from pathlib import Path

from masrel.ratings.table import RATING_COLUMNS, Ratings

__all__ = ["ratings_hash", "write_ratings"]


def write_ratings(ratings: Ratings, path: Path) -> None:
    """Write a table of ratings; the same table gives the same bytes.

    Parameters
    ----------
    ratings : Ratings
        The table.
    path : Path
        The CSV file; its folder is made when missing.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    head = "# Ratings, one row a rating; grades are text; NA is missing.\n"
    if ratings.simulated:
        head = f"# SIMULATED: not grades of persons on hardware.\n{head}"
    path.write_text(head + _body(ratings), encoding="utf-8", newline="")


def ratings_hash(ratings: Ratings) -> str:
    """Return the SHA-256 of a table's rows and of its scale.

    Parameters
    ----------
    ratings : Ratings
        The table.

    Returns
    -------
    str
        In hexadecimal; where the table was read from does not matter.
    """
    scale = "\n".join((ratings.scale.name, *ratings.scale.grades))
    return hashlib.sha256(f"{scale}\n\n{_body(ratings)}".encode()).hexdigest()


def _body(ratings: Ratings) -> str:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(RATING_COLUMNS)
    columns = [ratings.table[name].tolist() for name in RATING_COLUMNS]
    for row in zip(*columns, strict=True):
        writer.writerow([_as_text(value) for value in row])
    return text.getvalue()


def _as_text(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "NA"
    return repr(value) if isinstance(value, float) else str(value)
