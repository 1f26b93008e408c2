"""What a table of ratings is, how statistics take its ratings, and its bytes."""

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from masrel._files import write_file
from masrel.errors import RatingsError
from masrel.lab._study_files import is_unknown, table_csv
from masrel.lab.run._state import FELT, FROM_PERSONS
from masrel.lab.schedule.presentation import _SEALED
from masrel.scales import Scale

if TYPE_CHECKING:
    import pandas as pd


class Rating(NamedTuple):
    """One rating: a row of a study's table, which has a column for each field.

    Attributes
    ----------
    session : str
        The session.
    rater : str
        Who rated.
    model : str
        The haptic model, or the item of a foreign table.
    repeat : int
        Which presentation of the model in the session, from 1.
    grade : str or None
        A grade of the scale; None when missing.
    mean_speed_deg_s : float
        Mean speed before the catch, deg/s; nan when unknown.
    source : {"published", "recorded", "simulated", "foreign"}
        Where it comes from.
    n_stretches : int or None
        How many stretches were made before the grade; None when unknown.
    min_speed_deg_s, max_speed_deg_s : float
        Slowest and fastest mean speed of a stretch, deg/s; nan when unknown.
    speeds_deg_s : tuple of (float or None), or None
        Mean speed of each stretch, in order, None where it has none.
    graded_stretch : int or None
        Number of the stretch that the grade rests on; None when not said.
    felt : str or None
        What could be felt, "felt", "below-threshold" or "no-catch"; None when unknown.
    grades_from : str or None
        Name of the source of the session's grades; None when unknown.
    device : str or None
        Name of the session's device, "simulated" with others before it; None when
        unknown.
    position : int or None
        Its place in the session, from 1; None when unknown.
    code : str or None
        The blinded code the rater knew the model by; None when unknown.
    n_attempts : int or None
        How often it was presented; None when unknown.
    first_grade : str or None
        What the rater gave; other than `grade` when corrected.
    graded_at : str or None
        Time in UTC, ISO 8601, when a person gave the first grade; None when unknown.
    grip_lost : bool or None
        Whether the arm came loose and the model let it go; None when unknown.
    """

    session: str
    rater: str
    model: str
    repeat: int = 1
    grade: str | None = None
    mean_speed_deg_s: float = math.nan
    source: str = "foreign"
    n_stretches: int | None = None
    min_speed_deg_s: float = math.nan
    max_speed_deg_s: float = math.nan
    speeds_deg_s: tuple[float | None, ...] | None = None
    graded_stretch: int | None = None
    felt: str | None = None
    grades_from: str | None = None
    device: str | None = None
    position: int | None = None
    code: str | None = None
    n_attempts: int | None = None
    first_grade: str | None = None
    graded_at: str | None = None
    grip_lost: bool | None = None


RATING_COLUMNS = Rating._fields
"""Columns of a table of ratings."""

_N_ALWAYS = 7  # columns that every table has

_FORMAT = 2  # version of the file of a study's ratings

# Columns of a table that does not know of any grip whether it was lost
_N_WITHOUT_GRIP = 20

_N_FORMERLY = 15  # columns of a table of format 1, which does not name its format

SOURCES = ("published", "recorded", "simulated", "foreign")
"""Where a rating comes from; "foreign" is a file that does not say."""

_FLOATS = ("mean_speed_deg_s", "min_speed_deg_s", "max_speed_deg_s")
# Columns of whole numbers, and the least that each may hold
_WHOLE = {
    "repeat": 1,
    "n_stretches": 0,
    "graded_stretch": 1,
    "position": 1,
    "n_attempts": 0,
}

# Of columns that are no objects
_TYPES = {"repeat": "int64", **dict.fromkeys(_FLOATS, "float64")}

DEFAULT_SESSION = "test"
"""Session of ratings that do not name one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratings:
    """A checked table of ratings with its scale.

    Made by `read_ratings`, `ratings_from_logs` or `ratings_from_rows`, which check.

    Attributes
    ----------
    rows : tuple of Rating
        The ratings; session, rater, model and repeat together are unique.
    scale : Scale
        The grades a rater may give, in order.
    source_path : Path or None
        The file it was read from.
    simulated : bool
        Whether any rating is simulated: its grade, or the device, or both.
    """

    rows: tuple[Rating, ...] = field(compare=False, repr=False)
    scale: Scale
    source_path: Path | None = None
    simulated: bool

    @property
    def is_sealed(self) -> bool:
        """Whether nobody says yet which models some of them are of."""
        return any(row.model == _SEALED for row in self.rows)

    @property
    def n_by_programs(self) -> int:
        """How many ratings a program gave, for all that is known."""
        return sum(
            row.source == "simulated" and row.grades_from not in FROM_PERSONS
            for row in self.rows
        )

    @property
    def simulated_counts(self) -> str:
        """Of how many ratings grade or device is simulated, in words; "" of none."""
        n, n_programs = len(self.rows), self.n_by_programs
        n_device = sum(row.source == "simulated" for row in self.rows) - n_programs
        if not n_programs + n_device:
            return ""
        if n_programs == n:
            return "SIMULATED DATA: no person gave these grades."
        if not n_programs:
            return (
                f"SIMULATED DEVICE: persons gave these grades, {n_device} of {n} on "
                "the simulated device."
            )
        by_persons = f", {n_device} by persons on the simulated device" * bool(n_device)
        return (
            f"SIMULATED DATA: {n_programs} of {n} grades are a program's{by_persons}."
        )

    @property
    def n_missing(self) -> int:
        """How many ratings have no grade."""
        return sum(row.grade is None for row in self.rows)

    def without(self, raters: Collection[str]) -> "Ratings":
        """Return the ratings of all others, such as are left where some are excluded.

        Parameters
        ----------
        raters : collection of str
            Who is left out.

        Returns
        -------
        Ratings
            The others' ratings.
        """
        rows = tuple(row for row in self.rows if row.rater not in raters)
        return replace(self, rows=rows)

    @property
    def table(self) -> "pd.DataFrame":
        """The ratings as a new data frame: one row each, columns of `Rating`."""
        import pandas as pd  # which takes longer to load than a study to read

        columns = list(zip(*self.rows, strict=True)) or [()] * len(RATING_COLUMNS)
        return pd.DataFrame(
            {
                name: pd.Series(list(column), dtype=_TYPES.get(name, "object"))
                for name, column in zip(RATING_COLUMNS, columns, strict=True)
            }
        )


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
    >>> ratings.rows[0].grade
    '1+'
    """
    complete = [{**_DEFAULTS, **row} for row in rows]
    problems = [
        f"row {number}: {column}: {message}"
        for number, column, message in _problems(enumerate(complete, 1), scale, "row")
    ]
    if problems:
        raise RatingsError("\n".join(problems))
    return _assemble(complete, scale, source_path)


def _assemble(
    rows: Iterable[dict[str, Any]], scale: Scale, source_path: Path | None
) -> Ratings:
    """Return the table of rows that have been checked."""
    ratings = tuple(
        Rating(**{**row, **{name: float(row[name]) for name in _FLOATS}})
        for row in rows
    )
    return Ratings(
        rows=ratings,
        scale=scale,
        source_path=source_path,
        simulated=any(row.source == "simulated" for row in ratings),
    )


_DEFAULTS: dict[str, object] = {"session": DEFAULT_SESSION, **Rating._field_defaults}

_NEEDED_TIME = "needed a time in UTC such as 2026-05-04T09:30:00Z"
_NEEDED_SPEED = "needed a speed of 0 or more"
_NEVER_MISSING = ("session", "rater", "model", "repeat", "source", *_FLOATS)


def _is_utc(text: object) -> bool:
    """Return whether a value is a time in UTC as ISO 8601 writes it."""
    try:
        return datetime.fromisoformat(str(text)).utcoffset() == timedelta(0)
    except ValueError:
        return False


def _is_text(value: object) -> bool:
    return isinstance(value, str) and value != ""


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _rules(scale: Scale) -> dict[str, tuple[Callable[[Any], bool], str]]:
    # what the value of each column must be, and how that is said
    of_grades = (
        f"needed one of {', '.join(scale.grades)}, or None (in a file an empty cell or "
        "NA) when missing"
    )
    whole = {
        # true is no number
        name: (
            lambda value, least=least: type(value) is int and value >= least,
            f"needed a whole number from {least}",
        )
        for name, least in _WHOLE.items()
    }
    return {
        **dict.fromkeys(("session", "rater", "model"), (_is_text, "needed text")),
        **dict.fromkeys(
            ("grades_from", "device", "code"), (_is_text, "needed text or None")
        ),
        **whole,
        **dict.fromkeys(_FLOATS, (_is_number, _NEEDED_SPEED)),
        **dict.fromkeys(
            ("grade", "first_grade"), (scale.grades.__contains__, of_grades)
        ),
        "source": (SOURCES.__contains__, f"needed one of {', '.join(SOURCES)}"),
        "felt": (FELT.__contains__, f"needed one of {', '.join(FELT)}"),
        "grip_lost": (lambda value: isinstance(value, bool), "needed yes or no"),
        "graded_at": (_is_utc, _NEEDED_TIME),
    }


def _problems(
    rows: Iterable[tuple[int, Mapping[str, Any]]], scale: Scale, place: str
) -> Iterator[tuple[int, str, str]]:
    """Yield place, column and message of all that is wrong with rows by their place."""
    first: dict[tuple[object, ...], int] = {}
    rules = _rules(scale)
    for number, row in rows:
        for column, (holds, needed) in rules.items():
            value = row.get(column)
            if value is None and column not in _NEVER_MISSING:
                continue
            if not holds(value):
                yield number, column, f"{needed}, got {value!r}"
        for column, message in _stretch_problems(row):
            yield number, column, message
        for column in sorted(row.keys() - {*RATING_COLUMNS}):
            yield number, column, "unknown column"
        session, rater, model, repeat = (row.get(name) for name in RATING_COLUMNS[:4])
        earlier = first.setdefault((session, rater, model, repeat), number)
        if earlier != number:
            message = (
                f"needed one rating of {model!r} by {rater!r} in session {session!r}, "
                f"{place} {earlier} has one already"
            )
            yield number, "grade", message


def _stretch_problems(row: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with what a row says of each of its stretches."""
    speeds, graded, n_stretches = (
        row[name] for name in ("speeds_deg_s", "graded_stretch", "n_stretches")
    )
    n_known = n_stretches if type(n_stretches) is int and n_stretches >= 0 else 0
    if speeds is not None and (not isinstance(speeds, tuple) or len(speeds) != n_known):
        message = f"needed one for each of {n_known} stretches, got {speeds!r}"
        yield "speeds_deg_s", message
    else:
        for speed in speeds or ():
            if speed is not None and not _is_number(speed):
                yield "speeds_deg_s", f"{_NEEDED_SPEED}, got {speed!r}"
    if type(graded) is int and graded > n_known:
        yield "graded_stretch", f"needed one of {n_known} stretches, got {graded}"


@dataclass(frozen=True, slots=True, kw_only=True)
class RatingMatrix:
    """Grades of one session, item by rater.

    Attributes
    ----------
    items : tuple of str
        The haptic models; a second presentation of one is an item ``"HM1#2"``.
    raters : tuple of str
        The raters.
    grades : list of list of (str or None), shape (n_items, n_raters)
        None is missing.
    n_missing : int
        How many are None.
    """

    items: tuple[str, ...]
    raters: tuple[str, ...]
    grades: list[list[str | None]] = field(hash=False)
    n_missing: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RetestPairs:
    """Grades the same raters gave the same items in two sessions.

    Attributes
    ----------
    raters : tuple of str
        Raters with rows in both sessions.
    items : tuple of str
        The haptic models; a second presentation of one is an item ``"HM1#2"``.
    pairs : list, shape (n_raters, n_items, 2)
        First and second grade; None is missing.
    n_missing : int
        Number of pairs with a side missing.
    """

    raters: tuple[str, ...]
    items: tuple[str, ...]
    pairs: list[list[list[str | None]]] = field(hash=False)
    n_missing: int


_Key = tuple[str, str, int]  # rater, model, repeat


def rating_matrix(
    ratings: Ratings, *, session: str, models: Sequence[str] | None = None
) -> RatingMatrix:
    """Arrange the grades of one session item by rater.

    Parameters
    ----------
    ratings : Ratings
        The table.
    session : str
        The session.
    models : sequence of str, optional
        The models, in this order; one that nobody rated is a row of None. Every
        model of the session, as they come, unless given.

    Returns
    -------
    RatingMatrix
        Raters as they come in the session, all of them.

    Raises
    ------
    RatingsError
        If the session has no ratings.

    Examples
    --------
    >>> from masrel.lab.ratings import ratings_from_rows
    >>> from masrel.scales import MODIFIED_ASHWORTH
    >>> rows = [
    ...     {"rater": "R1", "model": "HM1", "grade": "1"},
    ...     {"rater": "R2", "model": "HM1", "grade": "1+"},
    ... ]
    >>> ratings = ratings_from_rows(rows, MODIFIED_ASHWORTH)
    >>> rating_matrix(ratings, session="test").grades
    [['1', '1+']]
    """
    grades = _of_session(ratings, session)
    raters = tuple(dict.fromkeys(rater for rater, _, _ in grades))
    keys, items = _items([grades], models)
    matrix = [
        [grades.get((rater, model, repeat)) for rater in raters]
        for model, repeat in keys
    ]
    return RatingMatrix(
        items=items,
        raters=raters,
        grades=matrix,
        n_missing=sum(row.count(None) for row in matrix),
    )


def retest_pairs(
    ratings: Ratings,
    *,
    first: str,
    second: str,
    models: Sequence[str] | None = None,
) -> RetestPairs:
    """Pair the grades raters gave in two sessions.

    Parameters
    ----------
    ratings : Ratings
        The table.
    first, second : str
        The sessions.
    models : sequence of str, optional
        The models, in this order. Every model of either session unless given.

    Returns
    -------
    RetestPairs
        Raters of both sessions, in the order of the first; there may be none.

    Raises
    ------
    RatingsError
        If a session has no ratings, or both are the same.
    """
    if first == second:
        raise RatingsError(f"needed two different sessions, got {first!r} twice")
    before, after = _of_session(ratings, first), _of_session(ratings, second)
    again = {rater for rater, _, _ in after}
    raters = tuple(dict.fromkeys(r for r, _, _ in before if r in again))
    keys, items = _items([before, after], models)
    pairs = [
        [[before.get((r, *key)), after.get((r, *key))] for key in keys] for r in raters
    ]
    return RetestPairs(
        raters=raters,
        items=items,
        pairs=pairs,
        n_missing=sum(None in pair for of_rater in pairs for pair in of_rater),
    )


def _of_session(ratings: Ratings, session: str) -> dict[_Key, str | None]:
    grades = {
        (row.rater, row.model, row.repeat): row.grade
        for row in ratings.rows
        if row.session == session
    }
    if not grades:
        known = ", ".join(dict.fromkeys(row.session for row in ratings.rows)) or "none"
        raise RatingsError(f"needed ratings of session {session!r}, there are {known}")
    return grades


def _items(
    sessions: Sequence[Mapping[_Key, str | None]], models: Sequence[str] | None
) -> tuple[list[tuple[str, int]], tuple[str, ...]]:
    # -> (model, repeat) in the order of models, a model without ratings once; names
    n_repeats: dict[str, int] = {}
    for grades in sessions:
        for _, model, repeat in grades:
            n_repeats[model] = max(n_repeats.get(model, 1), repeat)
    keys = [
        (model, repeat)
        for model in (n_repeats if models is None else models)
        for repeat in range(1, n_repeats.get(model, 1) + 1)
    ]
    return keys, tuple(
        model if repeat == 1 else f"{model}#{repeat}" for model, repeat in keys
    )


def write_ratings(ratings: Ratings, path: Path, *, within: Path | None = None) -> None:
    """Write a table of ratings; the same table gives the same bytes.

    A table with codes shows which models they mean, so only its owner may read it.

    Parameters
    ----------
    ratings : Ratings
        The table.
    path : Path
        The CSV file; its folder is made when missing.
    within : Path, optional
        A folder that the file may not leave by a link, such as the study's.

    Raises
    ------
    ParameterError
        If `path` is the place of a study's primary record, or not within `within`.
    OSError
        If the file cannot be written; what was there is then there still.
    """
    names_models = any(row.code is not None for row in ratings.rows)
    mode = 0o600 if names_models else None
    write_file(path, ratings_csv(ratings), within=within, mode=mode)


def ratings_csv(ratings: Ratings) -> str:
    """Return a table of ratings as the text of its file.

    Parameters
    ----------
    ratings : Ratings
        The table.

    Returns
    -------
    str
        What `write_ratings` writes.
    """
    has_more = any(
        not is_unknown(value) for row in ratings.rows for value in row[_N_ALWAYS:]
    )
    names = RATING_COLUMNS if has_more else RATING_COLUMNS[:_N_ALWAYS]
    if all(row.grip_lost is None for row in ratings.rows):
        names = names[:_N_WITHOUT_GRIP]
    return _text(ratings, names, f"format: {_FORMAT}")


def _texts(ratings: Ratings) -> Iterator[str]:
    """Yield every text that a table of these ratings of logs has ever been."""
    yield ratings_csv(ratings)
    yield _text(ratings, RATING_COLUMNS[:_N_FORMERLY])
    says_felt = any(row.felt is not None for row in ratings.rows)
    if not says_felt:  # of logs that say nothing of stretches
        yield _text(ratings, RATING_COLUMNS[:_N_ALWAYS])


def _text(ratings: Ratings, names: Sequence[str], *more: str) -> str:
    head = ["SIMULATED: not grades of persons on hardware."] * ratings.simulated
    head += ["Ratings, one row a rating; grades are text; NA is missing.", *more]
    rows = (row[: len(names)] for row in ratings.rows)
    return table_csv(names, rows, head=head)
