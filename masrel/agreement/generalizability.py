"""Generalizability studies: variances of persons and facets.

In: one row per rating, with columns for what is measured and for each facet. Out: a
variance component for every effect, from which `decision` has the reliability of other
numbers of levels.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any, Literal

import numpy as np

from masrel._input import listed, refuse, shown
from masrel.agreement._codes import check_frame, levels, numbers
from masrel.agreement._effects import (
    Cells,
    expected_squares,
    jackknife_draws,
    mean_squares,
    moments,
    pivotal_draws,
    told_together,
)
from masrel.agreement._engine import (
    Floats,
    Integers,
    check_level,
    deviations,
    recorded_generator,
)
from masrel.agreement.decision import DStudy, d_study
from masrel.errors import RatingsError
from masrel.estimates import Interval

_Method = Literal["ANOVA", "REML", "moments"]

_RESIDUAL = "residual"  # what no effect explains, where cells have several ratings

# Degrees of freedom of the residual below which
# docs/reference/coefficients/generalizability.md has intervals that hold the truth less
# often than they say
_FEW, _FEW_RATINGS = (
    10,
    (
        "there are few ratings: the true coverage of the intervals may be below their "
        "level"
    ),
)
_MOST_DENSE = 5000  # levels of the effects that are not of the largest column

_METHODS = {
    "ANOVA": "generalized confidence interval, from mean squares",
    "REML": "generalized confidence interval, from mean squares that have the "
    "variances of REML's components",
    "moments": "normal, by a jackknife of blocks of levels of every column",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class GStudy:
    """Components of variance of ratings in a design of facets.

    Attributes
    ----------
    of : str
        The column of what is measured, such as persons.
    facets : tuple of str
        Columns of the conditions of measurement.
    nested : mapping of str to str
        Facets whose levels belong to one level of another each.
    fixed : tuple of str
        Facets whose levels are all there are.
    components : mapping of str to float
        Effect to its variance; by mean squares it can come out negative. The last is
        confounded with what no effect explains.
    intervals : mapping of str to Interval
        Effect to the interval of its variance, for other persons and levels.
    mean_squares, df : mapping of str to float
        Effect to its mean square and degrees of freedom; empty unless the design is
        balanced.
    n_levels : mapping of str to int
        Levels of each column.
    mean : float
        Mean of all ratings.
    n_ratings : int
        Number of ratings.
    method : {"ANOVA", "REML", "moments"}
        Mean squares of a balanced design; restricted likelihood of one with gaps; or
        Henderson's first method, of one that is too large for that.
    level : float
        Level of intervals.
    seed : int or None
        Seed of the draws from which intervals are read; None if a generator was given.
    notes : tuple of str
        What the reader must know of the components.
    draws : ndarray, shape (n_draws, n_effects)
        Draws of components from which intervals are read.
    effects : mapping of str to frozenset
        Effect to the columns that have a hand in it.
    in_mean : mapping of str to float
        Effect to the share of its variance that the mean of all ratings has.
    """

    of: str
    facets: tuple[str, ...]
    nested: Mapping[str, str]
    fixed: tuple[str, ...]
    components: Mapping[str, float]
    intervals: Mapping[str, Interval]
    mean_squares: Mapping[str, float]
    df: Mapping[str, float]
    n_levels: Mapping[str, int]
    mean: float
    n_ratings: int
    method: _Method
    level: float
    seed: int | None
    notes: tuple[str, ...] = ()
    draws: Floats = field(compare=False, repr=False)
    effects: Mapping[str, frozenset[str]] = field(compare=False, repr=False)
    in_mean: Mapping[str, float] = field(compare=False, repr=False)  # Σ n²/N²

    def d_study(self, **sizes: int) -> DStudy:
        """Return `decision.d_study` with these numbers of levels of each facet.

        Parameters
        ----------
        **sizes : int
            Levels of each facet; of a nested one within each level of the facet above.

        Returns
        -------
        DStudy
            Error variances, and the coefficients Eρ² and Φ with their intervals.

        Raises
        ------
        ParameterError
            If a facet is missing or unknown, or a number is below 1.
        """
        return d_study(self, sizes)

    def interval(self, values: Floats) -> Interval:
        """Return the interval of what has these values at the draws."""
        ends = 0.5 - 0.5 * self.level, 0.5 + 0.5 * self.level
        known = values[~np.isnan(values)]  # without those that are 0/0
        low, high = np.quantile(known, ends).tolist() if len(known) else (math.nan,) * 2
        return Interval(
            low=low,
            high=high,
            level=self.level,
            method=_METHODS[self.method],
            target="both",
            kind="confidence",
            n_resamples=len(self.draws),
            seed=self.seed,
            reason="ratings do not vary" if math.isnan(low) else None,
        )

    def variance_of_mean(self, parts: Mapping[str, Any], fixed: Sequence[str]) -> Any:
        """Return how the mean of all ratings varies, by components."""
        random = (of for of, names in self.effects.items() if not names <= {*fixed})
        return sum(self.in_mean[of] * parts[of] for of in random)

    def columns_above(self, name: str) -> set[str]:
        """Return the columns within which a facet's levels lie."""
        above = self.nested.get(name)
        return set() if above is None else {above} | self.columns_above(above)

    def n_within(self, name: str) -> int:
        """Return how many levels a facet has within each one above, rounded."""
        n_above = self.n_levels.get(self.nested.get(name, ""), 1)
        return round(self.n_levels[name] / n_above)


def _effects_of(
    of: str, facets: Sequence[str], nested: Mapping[str, str]
) -> dict[str, frozenset[str]]:
    """Return every effect of a design by its name: its columns, small ones first."""
    columns = (of, *facets)
    sets = [
        frozenset(subset)
        for size in range(1, len(columns) + 1)
        for subset in combinations(columns, size)
        if all(nested.get(name, name) in subset for name in subset)
    ]
    return {_source(subset, columns, nested): subset for subset in sets}


def _source(
    subset: frozenset[str], columns: Sequence[str], nested: Mapping[str, str]
) -> str:
    # rater:task is a rater in a task; person × rater:task its interaction with persons
    inner = [name for name in columns if name in subset]
    above = {nested[name] for name in inner if name in nested}
    return " × ".join(
        f"{name}:{nested[name]}" if name in nested else name
        for name in inner
        if name not in above
    )


def g_study(
    data: Any,
    *,
    of: str,
    facets: Sequence[str],
    nested: Mapping[str, str] | None = None,
    fixed: Sequence[str] = (),
    grade: str = "grade",
    level: float = 0.95,
    rng: np.random.Generator | int = 0,
) -> GStudy:
    """Estimate how much persons and each facet of measurement add to the variance.

    Parameters
    ----------
    data : DataFrame
        One row a rating; rows without a grade are left out.
    of : str
        Name of the column of what is measured, such as persons.
    facets : sequence of str
        Names of one to three columns of conditions, such as raters and occasions.
    nested : mapping of str to str, optional
        Facet to the column within which its levels lie, as ``{"rater": "task"}`` where
        each task has raters of its own. Others are crossed.
    fixed : sequence of str, optional
        Facets whose levels are all there are; others are samples.
    grade : str, optional
        Name of the column of grades, which are numbers.
    level : float, optional
        Level of intervals.
    rng : Generator or int, optional
        What intervals are drawn with, or its seed.

    Returns
    -------
    GStudy
        Components of variance, and `GStudy.d_study` for other numbers of levels.

    Raises
    ------
    ParameterError
        If there are no facets or more than three, `nested` or `fixed` names another
        facet, or `level` or `rng` is invalid.
    RatingsError
        If a column is missing, grades are not numbers, a column never varies, or
        effects cannot be separated.

    Notes
    -----
    Of a balanced design components solve the equations of expected mean squares. They
    may be negative, which says that they are small against their error; reliability
    takes them as 0. For a design with gaps they maximise the restricted
    likelihood and are at least 0. Henderson's first method is used instead if there are
    more than 5 000 levels besides those of the largest column, or no residual.

    Intervals are read from draws of components: generalized confidence intervals, for
    which χ² takes the place of each mean square's error; of moments, normal draws with
    the covariances of a jackknife over blocks of persons and of each facet.

    References
    ----------
    .. [1] Brennan, R. L. (2001). Generalizability theory. Springer, ch. 3 to 7.
       https://doi.org/10.1007/978-1-4757-3456-0
    .. [2] Henderson, C. R. (1953). Estimation of variance and covariance components.
       Biometrics, 9(2), 226-252. https://doi.org/10.2307/3001853
    .. [3] Weerahandi, S. (1993). Generalized confidence intervals. Journal of the
       American Statistical Association, 88(423), 899-905.
       https://doi.org/10.1080/01621459.1993.10476355

    Examples
    --------
    >>> import pandas as pd
    >>> frame = pd.DataFrame({"person": [1, 1, 2, 2, 3, 3], "rater": list("ABABAB"),
    ...                       "grade": [4, 5, 2, 1, 2, 4]})
    >>> study = g_study(frame, of="person", facets=["rater"])
    >>> {source: round(part, 3) for source, part in study.components.items()}
    {'person': 1.667, 'rater': -0.167, 'person × rater': 1.167}
    >>> study.notes
    ('rater is negative (-0.167) and treated as 0 in reliability',)
    >>> round(study.d_study(rater=4).dependability, 3)
    0.851
    """
    nested = dict(nested or {})
    _check_design(of, facets, nested, fixed)
    check_level(level)
    generator, seed = recorded_generator(rng)
    values, codes = _read(data, (of, *facets), grade)
    effects = _effects_of(of, facets, nested)
    cells = _cells(codes, effects, len(values))
    scaled, unit = deviations(values)
    refuse(
        (unit > 1e150, "ratings: grades are too large, because their squares overflow")
    )
    scaled -= scaled.mean()
    balanced = mean_squares(scaled, cells)
    parts, draws, method, notes = _fit(scaled, cells, codes, balanced, generator)
    squares, df = balanced or (np.empty(0), np.empty(0))
    components = dict(zip(effects, (unit**2 * parts).tolist(), strict=True))
    notes += [
        f"{source} is negative ({part:.3g}) and treated as 0 in reliability"
        if part < 0.0
        else f"{source} is 0, the lowest value that REML gives"
        for source, part in components.items()
        if part < 0.0 or (part == 0.0 and method == "REML")
    ]
    study = GStudy(
        of=of,
        facets=tuple(facets),
        nested=nested,
        fixed=tuple(fixed),
        components=components,
        intervals={},
        mean_squares=dict(zip(effects, (unit**2 * squares).tolist(), strict=False)),
        df=dict(zip(effects, df.tolist(), strict=False)),
        n_levels={name: int(code.max()) + 1 for name, code in codes.items()},
        mean=float(values.mean()),
        n_ratings=len(values),
        method=method,
        level=level,
        seed=seed,
        notes=tuple(notes),
        draws=unit**2 * draws,
        effects=effects,
        in_mean={
            source: float(((np.bincount(cells[effect]) / len(values)) ** 2).sum())
            for source, effect in effects.items()
        },
    )
    bounded = np.maximum(study.draws, 0.0).T  # no variance is below
    intervals = dict(zip(components, map(study.interval, bounded), strict=True))
    return replace(study, intervals=intervals)


def _fit(
    values: Floats,
    cells: Cells,
    codes: Mapping[str, Integers],
    balanced: tuple[Floats, Floats] | None,
    rng: np.random.Generator,
) -> tuple[Floats, Floats, _Method, list[str]]:
    """Return components with draws of them, how they were had, and notes."""
    expected = expected_squares(cells)
    if balanced is not None:
        parts = np.asarray(np.linalg.solve(expected, balanced[0]), dtype=np.float64)
        return parts, pivotal_draws(*balanced, expected, rng), "ANOVA", []
    start = moments(values, cells)
    largest = max(codes, key=lambda name: int(codes[name].max()))
    others = [cell.max() + 1 for effect, cell in cells.items() if largest not in effect]
    why = f"{sum(others)} levels besides those of {largest} are too many for REML"
    if sum(others) <= _MOST_DENSE:
        why = "the effects leave no residual, so REML has no maximum"
    if sum(others) <= _MOST_DENSE and values.any():
        from masrel.agreement._reml import components  # with scipy

        if (fit := components(values, cells, largest, start)) is not None:
            squares = expected @ fit[0]
            # as many degrees of freedom as give these squares their variance
            df = 2.0 * squares**2 / np.einsum("ij,jk,ik->i", expected, fit[1], expected)
            if (df > 0.0).all():
                few = [_FEW_RATINGS] if df[-1] < _FEW else []
                return fit[0], pivotal_draws(squares, df, expected, rng), "REML", few
    draws = jackknife_draws(start, values, cells, codes, rng)
    return start, draws, "moments", [f"{why}: by Henderson's moments"]


def _check_design(
    of: str, facets: Sequence[str], nested: Mapping[str, str], fixed: Sequence[str]
) -> None:
    columns = (of, *facets)
    is_few = not isinstance(facets, str) and 0 < len(facets) <= 3
    strange = {*nested, *fixed} - {*facets} or {*nested.values()} - {*columns}
    above: list[str | None] = [*nested]
    for _ in facets:
        above = [nested.get(name or "") for name in above]
    refuse(
        (
            not is_few or len({*columns}) < len(columns),
            f"facets: need one to three columns besides {of!r}, got {shown(facets)}",
        ),
        (
            strange,
            f"nested, fixed: need facets ({', '.join(facets)}), got "
            f"{listed(map(repr, strange))}",
        ),
        (
            any(name in nested for name in above),
            f"nested: needs facets within others, got a circle, {shown(nested)}",
        ),
    )


def _read(
    data: Any, columns: Sequence[str], grade: str
) -> tuple[Floats, dict[str, Integers]]:
    """Return the grades, and the level of each column that they have."""
    check_frame(data, (*columns, grade), "data")
    rated = data[data[grade].notna()]
    check_frame(rated, ())
    codes = {}
    for name in columns:
        codes[name], names = levels(rated[name], name)
        refuse(
            (
                len(names) < 2,
                f"ratings: column {name!r} needs two levels or more, got {names[0]} "
                "only, which has no variance",
            ),
            error=RatingsError,
        )
    return numbers(rated[grade], grade), codes


def _cells(
    codes: Mapping[str, Integers], effects: dict[str, frozenset[str]], n_ratings: int
) -> dict[frozenset[str], Integers]:
    """Return the cell of each rating by effects; add the residual if there is one."""
    cells = {}
    for columns in effects.values():
        cell = np.zeros(n_ratings, dtype=np.int64)
        # a set's order is another in each run, and so would rounding be
        for name in filter(columns.__contains__, codes):
            cell = cell * (codes[name].max() + 1) + codes[name]
            cell = np.unique(cell, return_inverse=True)[1]
        cells[columns] = cell
    if cell.max() + 1 < n_ratings:
        effects[_RESIDUAL] = columns | {_RESIDUAL}
        cells[effects[_RESIDUAL]] = np.arange(n_ratings)
    together = [[*effects][place] for place in told_together(cells)]
    refuse(
        (
            together,
            f"ratings: {' and '.join(together)} cannot be separated, because the same "
            "ratings share a level of each; name a facet as nested if each level of "
            "another has its own levels of it",
        ),
        error=RatingsError,
    )
    return cells
