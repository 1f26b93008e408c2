"""The agreement table of a file of ratings: its rows, and how they are shown."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from masrel.errors import MasrelError, ParameterError
from masrel.estimates import Estimate, Interval, Target

if TYPE_CHECKING:
    from masrel.agreement import Coefficient
    from masrel.agreement.weights import WeightName
    from masrel.ratings import RatingMatrix, Ratings
    from masrel.report.tables import Table, Value

__all__ = ["Row", "Wanted", "agreement_table", "estimate_session"]

_ANY_ORDER = ("all",)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """What the caller wants of every session.

    Attributes
    ----------
    coefficients : tuple of str
        Names of the register, or ``("all",)``.
    weights : str
        Name of the weights, for coefficients that take any.
    target : {"items", "raters", "both"} or None
        What a new study would draw anew; no interval when None.
    interval : str
        Kind of interval, or ``"default"``.
    level : float
        Its level.
    n_resamples, seed : int
        For intervals that draw.
    words : str or None
        Whose words for values.
    """

    coefficients: tuple[str, ...]
    weights: "WeightName"
    target: Target | None
    interval: str
    level: float
    n_resamples: int
    seed: int
    words: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One estimate, and what it lacks of what was asked for.

    Attributes
    ----------
    session, title : str
        Of what, and which coefficient.
    estimate : Estimate
        The estimate.
    without : str or None
        Why it has no interval where one was asked for.
    unweighted : bool
        Whether weights were asked for that the coefficient does not take.
    """

    session: str
    title: str
    estimate: Estimate
    without: str | None = None
    unweighted: bool = False


def estimate_session(ratings: "Ratings", session: str, wanted: Wanted) -> list[Row]:
    """Estimate the coefficients of one session.

    Parameters
    ----------
    ratings : Ratings
        The ratings.
    session : str
        One of its sessions.
    wanted : Wanted
        What of it.

    Returns
    -------
    list of Row
        One per coefficient, in the order asked for.

    Raises
    ------
    ParameterError
        If a coefficient, weights or an interval does not exist or does not fit. Under
        ``"all"`` what does not fit two raters, or has no such interval, is left out or
        said instead.
    RatingsError
        If the ratings do not fit a coefficient.
    """
    from masrel.agreement import count_ratings
    from masrel.ratings import rating_matrix

    matrix = rating_matrix(ratings, session=session)
    values = ratings.scale.values
    counted = count_ratings(ratings.scale.weigh(matrix.grades), values)
    rows = []
    for entry in _entries(wanted, matrix):
        weights: WeightName = wanted.weights if entry.weighted else "identity"
        estimate = entry(counted, categories=values, weights=weights)
        without = None
        if wanted.target is not None and estimate.interval is None:
            try:
                interval = _interval(entry, counted, values, weights, wanted)
                estimate = replace(estimate, interval=interval)
            except MasrelError as error:
                if wanted.coefficients != _ANY_ORDER:
                    raise
                without = str(error)
        title = entry.title
        if weights != "identity":
            title += f", {weights}"
        rows.append(
            Row(
                session=session,
                title=title,
                estimate=estimate,
                without=without,
                unweighted=weights != wanted.weights
                and wanted.coefficients != _ANY_ORDER,
            )
        )
    return rows


def _entries(wanted: Wanted, matrix: "RatingMatrix") -> list["Coefficient"]:
    from masrel.agreement import COEFFICIENTS, coefficient

    if wanted.coefficients == _ANY_ORDER:
        n_raters = len(matrix.raters)
        return [
            entry
            for entry in COEFFICIENTS.values()
            if entry.shape == "ratings" and n_raters <= (entry.n_raters[1] or n_raters)
        ]
    entries = [coefficient(name) for name in wanted.coefficients]
    for entry in entries:
        if entry.shape == "pairs":
            raise ParameterError(
                f"--coefficients: {entry.name} takes each rater's grades of two "
                "sessions; masrel analyze computes it from a study's plan"
            )
    return entries


def _interval(
    entry: "Coefficient",
    ratings: object,
    categories: tuple[float, ...],
    weights: "WeightName",
    wanted: Wanted,
) -> Interval | None:
    from masrel.analysis.interval import planned_interval

    if wanted.target is None:
        return None
    usual = "analytic" if wanted.target == "items" else "jackknife"
    return planned_interval(
        usual if wanted.interval == "default" else wanted.interval,
        entry.name,
        ratings,
        target=wanted.target,
        categories=categories,
        weights=weights,
        level=wanted.level,
        n_resamples=wanted.n_resamples,
        seed=wanted.seed,
    )


def agreement_table(
    rows: list[Row], file: Path, by: str | None, wanted: Wanted
) -> "Table":
    """Lay the estimates out as a table.

    Parameters
    ----------
    rows : list of Row
        The estimates.
    file : Path
        Where the ratings came from.
    by : str or None
        The column that tells sessions apart, if there is more than one.
    wanted : Wanted
        What was asked for.

    Returns
    -------
    Table
        One row an estimate, with what to know of it in the notes.
    """
    from masrel.report.tables import Column, Table

    columns = [
        Column(key="coefficient", heading="Coefficient", align="left"),
        Column(key="value", heading="Value", digits=3),
        Column(key="standard_error", heading="SE", digits=3),
        Column(key="low", heading="Low", digits=3),
        Column(key="high", heading="High", digits=3),
        Column(key="n_items", heading="Items"),
        Column(key="n_raters", heading="Raters"),
    ]
    if by is not None:
        columns.insert(0, Column(key=by, heading=by.title(), align="left"))
    if wanted.words is not None:
        columns.append(Column(key="words", heading="At least", align="left"))
    return Table(
        name="agreement",
        caption=f"Agreement of the raters in {file}",
        columns=tuple(columns),
        rows=tuple(_cells(row, by, wanted) for row in rows),
        notes=_notes(rows, wanted),
        data="foreign",
    )


def _cells(row: Row, by: str | None, wanted: Wanted) -> tuple["Value", ...]:
    estimate, interval = row.estimate, row.estimate.interval
    has_error = estimate.observed == estimate.observed or estimate.reason is not None
    cells: list[Value] = [] if by is None else [row.session]
    cells += [
        row.title,
        estimate.value,
        estimate.standard_error if has_error else None,
        None if interval is None else interval.low,
        None if interval is None else interval.high,
        estimate.n_items,
        estimate.n_raters,
    ]
    if wanted.words is not None:
        from masrel.agreement import COEFFICIENTS, benchmark

        entry = COEFFICIENTS.get(estimate.coefficient)
        kappa_like = entry is not None and entry.chance_corrected
        word = benchmark(estimate, scale=wanted.words)  # type: ignore[arg-type]
        cells.append(word if kappa_like and not math.isnan(estimate.value) else None)
    return tuple(cells)


def _notes(rows: list[Row], wanted: Wanted) -> tuple[str, ...]:
    # How each interval was made, what to know of it, and why a value is undefined;
    # what holds for every interval is said without their names.
    said: dict[str, list[str]] = {}
    for row in rows:
        for text in _of_row(row):
            titles = said.setdefault(text, [])
            if row.title not in titles:  # of several sessions
                titles.append(row.title)
    with_interval = {row.title for row in rows if row.estimate.interval is not None}
    notes = ["SE: delta method, items as the sample."]
    for text, titles in said.items():
        every = len(titles) > 1 and set(titles) == with_interval
        names = "" if every else f"{'; '.join(titles)}: "
        notes.append(f"{names}{text}.")
    if wanted.words is not None:
        notes.append(
            "At least: the best word of "
            f"{_WORDS[wanted.words]} that the true value earns with a probability of "
            "95 %, normal law around the estimate; the words are conventions."
        )
    return tuple(notes)


def _of_row(row: Row) -> list[str]:
    estimate, interval = row.estimate, row.estimate.interval
    said = [] if estimate.reason is None else [f"undefined: {estimate.reason}"]
    if row.unweighted:
        said.append("unweighted, there are no weights for it")
    if row.without is not None:
        said.append(f"no interval: {row.without}")
    if interval is not None:
        said.append(
            f"{100 * interval.level:g} % {interval.kind} interval, {interval.method}; "
            f"it speaks of other {_OTHERS[interval.target]}"
        )
        said += interval.notes
        if interval.reason not in (None, estimate.reason):
            said.append(f"no interval: {interval.reason}")
    return said


_OTHERS = {"items": "items", "raters": "raters", "both": "items and raters"}
_WORDS = {
    "landis_koch": "Landis and Koch (1977)",
    "altman": "Altman (1991)",
    "fleiss": "Fleiss (1981)",
    "cicchetti": "Cicchetti and Sparrow (1981)",
}
