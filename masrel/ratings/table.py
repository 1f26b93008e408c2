"""What makes a data frame a table of ratings."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from masrel.errors import RatingsError
from masrel.scales import Scale

__all__ = [
    "DEFAULT_SESSION",
    "RATING_COLUMNS",
    "SOURCES",
    "Ratings",
    "ratings_from_rows",
]

RATING_COLUMNS = (
    "session",  # text
    "rater",  # text
    "model",  # text: the haptic model, or the item of a foreign table
    "repeat",  # whole number from 1: which presentation of the model in the session
    "grade",  # text, a grade of the scale; None when missing
    "mean_speed_deg_s",  # mean speed before the catch, deg/s; nan when unknown
    "source",  # one of SOURCES
)

SOURCES = ("published", "recorded", "simulated", "foreign")
"""Where a rating comes from; "foreign" is a file that does not say."""

DEFAULT_SESSION = "test"
"""Session of ratings that do not name one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratings:
    """A checked table of ratings with its scale.

    Made by `read_ratings`, `ratings_from_logs` or `ratings_from_rows`, which check.

    Attributes
    ----------
    table : DataFrame, shape (n_ratings, 7)
        One row a rating, columns `RATING_COLUMNS`; session, rater, model and repeat
        together are unique; a missing grade is None.
    scale : Scale
        The grades a rater may give, in order.
    source_path : Path or None
        The file it was read from.
    simulated : bool
        Whether any rating is simulated.
    """

    table: pd.DataFrame = field(compare=False, repr=False)
    scale: Scale
    source_path: Path | None = None
    simulated: bool


def ratings_from_rows(
    rows: Iterable[Mapping[str, object]],
    scale: Scale,
    *,
    source_path: Path | None = None,
) -> Ratings:
    """Make a table of ratings from one mapping a rating.

    Parameters
    ----------
    rows : iterable of mapping
        Values by column name. `rater` and `model` are needed; `grade` None or
        absent is missing; `session` is "test", `repeat` 1, `mean_speed_deg_s`
        unknown and `source` "foreign" unless given.
    scale : Scale
        The grades a rater may give.
    source_path : Path, optional
        The file the rows are from.

    Returns
    -------
    Ratings
        The table, rows in their order.

    Raises
    ------
    RatingsError
        If a row lacks its rater or model, has an unknown column, a grade that is
        not of the scale, or is there twice. The message lists every problem.

    Examples
    --------
    >>> from masrel.scales import MODIFIED_ASHWORTH
    >>> ratings = ratings_from_rows(
    ...     [{"rater": "R1", "model": "HM2", "grade": "1+"}], MODIFIED_ASHWORTH
    ... )
    >>> ratings.table["grade"].tolist()
    ['1+']
    """
    complete = [{**_DEFAULTS, **row} for row in rows]
    problems = [
        f"row {number}: {problem}"
        for number, row in enumerate(complete, start=1)
        for problem in _problems(row, scale)
    ]
    seen: dict[tuple[object, ...], int] = {}
    for number, row in enumerate(complete, start=1):
        key = tuple(row.get(name) for name in RATING_COLUMNS[:4])
        if seen.setdefault(key, number) != number:
            problems.append(f"row {number}: {key} is in row {seen[key]} already")
    if problems:
        raise RatingsError("\n".join(problems))
    return assemble(complete, scale, source_path)


def assemble(
    rows: Sequence[Mapping[str, object]], scale: Scale, source_path: Path | None
) -> Ratings:
    """Put checked rows into a table."""
    types = dict.fromkeys(RATING_COLUMNS, "object")
    types.update({"repeat": "int64", "mean_speed_deg_s": "float64"})
    table = pd.DataFrame(
        {
            name: pd.Series([row[name] for row in rows], dtype=types[name])
            for name in RATING_COLUMNS
        }
    )
    return Ratings(
        table=table,
        scale=scale,
        source_path=source_path,
        simulated=any(row["source"] == "simulated" for row in rows),
    )


_DEFAULTS: dict[str, object] = {
    "session": DEFAULT_SESSION,
    "repeat": 1,
    "grade": None,
    "mean_speed_deg_s": math.nan,
    "source": "foreign",
}


def _problems(row: Mapping[str, object], scale: Scale) -> list[str]:
    problems = [
        f"{name}: needed text, got {row.get(name)!r}"
        for name in ("session", "rater", "model")
        if not isinstance(row.get(name), str) or not row[name]
    ]
    repeat, speed, grade = row["repeat"], row["mean_speed_deg_s"], row["grade"]
    if not isinstance(repeat, int) or isinstance(repeat, bool) or repeat < 1:
        problems.append(f"repeat: needed a whole number from 1, got {repeat!r}")
    if not isinstance(speed, int | float) or isinstance(speed, bool):
        problems.append(f"mean_speed_deg_s: needed a number, got {speed!r}")
    if grade is not None and grade not in scale.grades:
        problems.append(
            f"grade: needed one of {', '.join(scale.grades)} or None, got {grade!r}"
        )
    if row["source"] not in SOURCES:
        problems.append(
            f"source: needed one of {', '.join(SOURCES)}, got {row['source']!r}"
        )
    unknown = sorted(set(row) - set(RATING_COLUMNS))
    if unknown:
        problems.append(f"unknown columns {', '.join(unknown)}")
    return problems
