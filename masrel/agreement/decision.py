"""Decision studies: how reliable means over given numbers of levels are.

In: a `GStudy`, and how many levels of each facet. Out: error variances and reliability,
with intervals, and the cheapest numbers of levels for an aim.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from masrel._input import check_option, listed, refuse, shown, warn_caller
from masrel.agreement._effects import pivotal_draws
from masrel.agreement._engine import Floats, check_level
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Interval

if TYPE_CHECKING:
    from masrel.agreement.generalizability import GStudy

_MOST_DESIGNS = 200_000  # that are looked at for an aim


@dataclass(frozen=True, slots=True, kw_only=True)
class DStudy:
    """Reliability of the mean over a design, from components of variance.

    Attributes
    ----------
    sizes : mapping of str to int
        Levels of each facet; of a nested one within each level of the facet above.
    universe : float
        Variance of what is measured.
    relative_error, absolute_error : float
        Variances of the errors of differences between persons, σ²(δ), and of the
        distance from the mean over the universe, σ²(Δ).
    generalizability, dependability : float
        Eρ² = universe/(universe + σ²(δ)) and Φ = universe/(universe + σ²(Δ)); ``nan``
        where they are 0/0.
    generalizability_interval, dependability_interval : Interval
        Theirs, for other persons and other levels of the facets that are samples.
    cut : float or None
        The grade at which persons are told apart.
    cut_dependability : float or None
        Φ(λ) at the cut: as Φ, with the squared distance of the mean from the cut added
        to the universe.
    cut_interval : Interval or None
        Interval of `cut_dependability`.
    cost : float or None
        What the ratings cost, of a design that was sought by its price.
    reason : str or None
        Why coefficients are undefined, or None.
    """

    sizes: Mapping[str, int]
    universe: float
    relative_error: float
    absolute_error: float
    generalizability: float
    dependability: float
    generalizability_interval: Interval
    dependability_interval: Interval
    cut: float | None = None
    cut_dependability: float | None = None
    cut_interval: Interval | None = None
    cost: float | None = None
    reason: str | None = None


def d_study(
    study: "GStudy",
    sizes: Mapping[str, int],
    *,
    fixed: Sequence[str] | None = None,
    cut: float | None = None,
) -> DStudy:
    """Return the reliability of means over given numbers of levels of each facet.

    Parameters
    ----------
    study : GStudy
        Components of variance.
    sizes : mapping of str to int
        Levels of each facet; of a nested one within each level of the facet above.
    fixed : sequence of str, optional
        Facets that keep their levels and are not generalized over; those of the study
        unless given.
    cut : float, optional
        A grade at which persons are told apart, for Φ(λ).

    Returns
    -------
    DStudy
        Error variances, and the coefficients Eρ² and Φ with their intervals.

    Raises
    ------
    ParameterError
        If a facet is missing or unknown, a number is below 1, the cut is not a number,
        or no component is left that could be an error.

    Warns
    -----
    UndefinedStatisticWarning
        If ratings do not vary; coefficients are then ``nan``.

    References
    ----------
    .. [1] Brennan, R. L. (2001). Generalizability theory. Springer, ch. 2, 4 and 5;
       Φ(λ): section 2.5. https://doi.org/10.1007/978-1-4757-3456-0

    Examples
    --------
    One rating each, and ratings of the same rater, which tell how well raters agree
    with themselves:

    >>> import pandas as pd
    >>> from masrel.agreement import d_study, g_study
    >>> rows = [(p, r, g) for p, gs in enumerate(["4455", "2132", "2243", "5566"])
    ...         for r, g in zip("AABB", map(int, gs))]
    >>> frame = pd.DataFrame(rows, columns=["person", "rater", "grade"])
    >>> study = g_study(frame, of="person", facets=["rater"])
    >>> round(d_study(study, {"rater": 1}).dependability, 3)
    0.758
    >>> round(d_study(study, {"rater": 1}, fixed=["rater"]).dependability, 3)
    0.931
    """
    fixed = study.fixed if fixed is None else tuple(fixed)
    _check(study, sizes, fixed, cut)
    parts = dict(zip(study.components, study.draws.T, strict=True))
    # negative components are estimates of 0
    estimated = {of: max(part, 0.0) for of, part in study.components.items()}
    universe, relative, absolute = _errors(study, estimated, sizes, fixed)
    # draws may be negative, too, and only what is made of them may not
    universes, *errors = np.maximum(_errors(study, parts, sizes, fixed), 0.0)
    reason = None if universe + absolute > 0.0 else "ratings do not vary"
    if reason is not None:
        warn_caller(f"reliability is undefined: {reason}", UndefinedStatisticWarning)
    result = DStudy(
        sizes=dict(sizes),
        universe=float(universe),
        relative_error=float(relative),
        absolute_error=float(absolute),
        generalizability=float(_share(universe, relative)),
        dependability=float(_share(universe, absolute)),
        generalizability_interval=study.interval(_share(universes, errors[0])),
        dependability_interval=study.interval(_share(universes, errors[1])),
        reason=reason,
    )
    if cut is None:
        return result
    # Brennan's unbiased (μ - λ)², and draws of μ by how the mean varies
    distance = (study.mean - cut) ** 2 - study.variance_of_mean(estimated, fixed)
    deviations = np.sqrt(np.maximum(study.variance_of_mean(parts, fixed), 0.0))
    # a stream of its own, since those of components may share their random bits
    normal = np.random.default_rng((study.seed or 0, 1)).normal(size=len(deviations))
    distances = (study.mean - cut - deviations * normal) ** 2
    return replace(
        result,
        cut=float(cut),
        cut_dependability=float(_share(universe + max(distance, 0.0), absolute)),
        cut_interval=study.interval(_share(universes + distances, errors[1])),
    )


def _errors(
    study: "GStudy", parts: Mapping[str, Any], sizes: Mapping[str, Any], fixed: Any
) -> tuple[Any, Any, Any]:
    """Return the variance of the universe, and of relative and absolute errors."""
    universe = relative = absolute = 0.0 * next(iter(parts.values()))
    for source, variance in parts.items():
        columns = study.effects[source]
        facets, is_of_persons = columns - {study.of}, study.of in columns
        part = variance / math.prod(sizes.get(name, 1) for name in facets)
        if facets <= {*fixed}:
            universe = universe + part * is_of_persons
        else:
            relative = relative + part * is_of_persons
            absolute = absolute + part
    return universe, relative, absolute


def _share(part: Any, rest: Any) -> Any:
    with np.errstate(invalid="ignore"):
        return part / np.asarray(part + rest)


def _check(
    study: "GStudy", sizes: Mapping[str, int], fixed: Sequence[str], cut: float | None
) -> None:
    known = ", ".join(study.facets)
    is_number = isinstance(cut, int | float | np.number) and math.isfinite(cut)
    refuse(
        ({*sizes} != {*study.facets}, f"sizes: need {known}, got {listed(sizes)}"),
        ({*fixed} - {*study.facets}, f"fixed: needs facets ({known}), got {fixed}"),
        *(
            (
                not isinstance(n, int | np.integer) or n < 1,
                f"{name}: needs a whole number above 0, got {shown(n)}",
            )
            for name, n in sizes.items()
        ),
        (
            not _may_err(study, fixed),
            "fixed: needs a random facet or several ratings of a cell, got "
            f"{', '.join(fixed)}: otherwise ratings have no error",
        ),
        (not (cut is None or is_number), f"cut: needs a number, got {shown(cut)}"),
    )


def cheapest_design(
    study: "GStudy",
    aim: float,
    *,
    prices: Sequence[float] | None = None,
    of: Literal["dependability", "generalizability"] = "dependability",
) -> DStudy:
    """Return the cheapest design that reaches an aim.

    Parameters
    ----------
    study : GStudy
        Components of variance.
    aim : float
        The coefficient to be reached, between 0 and 1.
    prices : sequence of float, optional
        Prices of a level of each facet, in order, and of a rating; a study has as
        many persons as this one. A rating costs 1 and nothing else does unless given.
    of : {"dependability", "generalizability"}, optional
        Which coefficient: Φ, or Eρ² where persons are only compared.

    Returns
    -------
    DStudy
        The design, with its `cost`; of several, that with the highest coefficient.

    Raises
    ------
    ParameterError
        If the aim or the prices are invalid, or no design that is tried reaches the
        aim.

    Examples
    --------
    >>> import pandas as pd
    >>> from masrel.agreement import cheapest_design, g_study
    >>> frame = pd.DataFrame({"person": [1, 1, 2, 2, 3, 3], "rater": list("ABABAB"),
    ...                       "grade": [4, 5, 2, 1, 2, 4]})
    >>> design = cheapest_design(g_study(frame, of="person", facets=["rater"]), 0.9)
    >>> design.sizes, design.cost
    ({'rater': 7}, 21.0)
    """
    check_option("of", of, ("dependability", "generalizability"))
    usual = (*(0.0 for _ in study.facets), 1.0)
    prices = usual if prices is None else tuple(prices)
    check_level(aim, "aim")
    refuse(
        (
            len(prices) != len(usual) or not all(0.0 <= x < math.inf for x in prices),
            f"prices: needs {len(usual)} numbers of at least 0 (for a level of "
            f"{', '.join(study.facets)}, and for a rating), got {shown(prices)}",
        ),
    )
    free = [name for name in study.facets if name not in study.fixed]
    most = int(_MOST_DESIGNS ** (1.0 / max(len(free), 1)))
    grid = np.meshgrid(
        *(
            range(1, most + 1) if name in free else [study.n_within(name)]
            for name in study.facets
        ),
        indexing="ij",
    )
    sizes = {name: n.ravel() for name, n in zip(study.facets, grid, strict=True)}
    estimated = {source: max(part, 0.0) for source, part in study.components.items()}
    universe, *errors = _errors(study, estimated, sizes, study.fixed)
    reached = _share(universe, errors[of == "dependability"]) + np.zeros(grid[0].size)
    refuse(
        (
            not (reached >= aim).any(),
            f"aim: cannot be reached with up to {most} levels of each facet: the "
            f"highest value is {reached.max():.3g}, got {shown(aim)}"
            + f"; {study.of} has no variance"
            * bool(reached.max() == 0.0),
        )
    )
    costs: Any = prices[-1] * study.n_levels[study.of] * math.prod(sizes.values())
    for name, price in zip(study.facets, prices[:-1], strict=True):
        levels = {name, *study.columns_above(name)} - {study.of}
        costs = costs + price * math.prod(sizes[facet] for facet in levels)
    enough = np.flatnonzero(reached >= aim)
    chosen = enough[np.lexsort((-reached[enough], costs[enough]))[0]]
    design = d_study(study, {name: int(n[chosen]) for name, n in sizes.items()})
    return replace(design, cost=float(costs[chosen]))


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedDesign:
    """What a generalizability study of a design is expected to show.

    Attributes
    ----------
    n_persons : int
        How many are measured.
    sizes : mapping of str to int
        Levels of each facet; of a nested one within each level of the facet above.
    of : {"dependability", "generalizability"}
        Which coefficient: Φ, or Eρ².
    low, high : float
        Mean ends of its interval.
    aim, chance : float or None
        What the low end should reach, and how often it does.
    monte_carlo_error : float
        Standard error of the chance, or of the mean low end.
    """

    n_persons: int
    sizes: Mapping[str, int]
    of: Literal["dependability", "generalizability"]
    low: float
    high: float
    aim: float | None
    chance: float | None
    monte_carlo_error: float


def design_precision(
    study: "GStudy",
    sizes: Mapping[str, int],
    *,
    n_persons: int,
    aim: float | None = None,
    of: Literal["dependability", "generalizability"] = "dependability",
    n_studies: int = 200,
    rng: int = 0,
) -> PlannedDesign:
    """Simulate g studies of a design, with the components of a given study.

    Parameters
    ----------
    study : GStudy
        Components that are taken to be true, such as those of a pilot.
    sizes : mapping of str to int
        Levels of each facet in the mean; for a nested facet, within each level of the
        facet above. The future study has as many, but at least two.
    n_persons : int
        How many are measured, each at every level.
    aim : float, optional
        What the interval's low end should reach.
    of : {"dependability", "generalizability"}, optional
        Which coefficient: Φ, or Eρ².
    n_studies : int, optional
        How many are simulated.
    rng : int, optional
        Seed.

    Returns
    -------
    PlannedDesign
        The interval that can be expected, and the chance to reach the aim.

    Raises
    ------
    ParameterError
        If a facet is missing or unknown, a number is too small, or the aim is not
        within (0, 1).

    Examples
    --------
    >>> import pandas as pd
    >>> from masrel.agreement import design_precision, g_study
    >>> frame = pd.DataFrame({"person": [1, 1, 2, 2, 3, 3], "rater": list("ABABAB"),
    ...                       "grade": [4, 5, 2, 1, 2, 4]})
    >>> pilot = g_study(frame, of="person", facets=["rater"])
    >>> for n in (20, 80):
    ...     plan = design_precision(pilot, {"rater": 4}, n_persons=n, aim=0.7)
    ...     print(n, round(plan.low, 2), plan.chance)
    20 0.65 0.42
    80 0.78 0.975
    """
    check_option("of", of, ("dependability", "generalizability"))
    check_level(0.5 if aim is None else aim, "aim")
    refuse((n_persons < 2, f"n_persons: needs two or more, got {n_persons!r}"))
    study.d_study(**sizes)  # which checks them
    # of one level alone nobody can tell the variance
    levels = {study.of: n_persons, **{of: max(n, 2) for of, n in sizes.items()}}
    effects = {of: at for of, at in study.effects.items() if at <= {*levels}}
    # with one rating a cell the residual is in the last effect
    parts = np.maximum([*study.components.values()], 0.0)
    parts = np.append(parts[: len(effects) - 1], parts[len(effects) - 1 :].sum())
    expected, df = _balanced(effects, levels)
    generator = np.random.default_rng(rng)
    ends = np.empty((n_studies, 2))
    for k in range(n_studies):
        squares = expected @ parts * generator.chisquare(df) / df
        solved = np.linalg.solve(expected, squares)
        one = replace(
            study,
            effects=effects,
            components=dict(zip(effects, solved, strict=True)),
            draws=pivotal_draws(squares, df, expected, generator),
        )
        interval = getattr(one.d_study(**sizes), f"{of}_interval")
        ends[k] = interval.low, interval.high
    reached = ends[:, 0] if aim is None else ends[:, 0] >= aim
    return PlannedDesign(
        n_persons=n_persons,
        sizes=dict(sizes),
        of=of,
        aim=aim,
        low=float(ends[:, 0].mean()),
        high=float(ends[:, 1].mean()),
        chance=None if aim is None else float(reached.mean()),
        monte_carlo_error=float(reached.std() / math.sqrt(n_studies)),
    )


def _balanced(
    effects: Mapping[str, frozenset[str]], levels: Mapping[str, int]
) -> tuple[Floats, Floats]:
    """Return mean squares expected of each variance, and degrees of freedom."""
    columns, n_ratings = [*effects.values()], math.prod(levels.values())
    n = np.array([math.prod(levels[name] for name in of) for of in columns])
    lies_within = np.array([[one <= other for other in columns] for one in columns])
    # an effect and those that it lies within have n - 1 degrees of freedom together
    return lies_within * n_ratings / n, np.linalg.solve(lies_within.T, n - 1.0)


def single_ratings(study: "GStudy") -> dict[str, DStudy]:
    """Return the reliability of one rating, by what two ratings of a person share.

    Parameters
    ----------
    study : GStudy
        Components of variance.

    Returns
    -------
    dict of str to DStudy
        "the same rater" and so on for each facet, where ratings then still differ, and
        "another of each"; `dependability` is the ICC of absolute agreement: within a
        rater, between raters on one occasion, and in total.

    References
    ----------
    .. [1] Eliasziw, M., Young, S. L., Woodbury, M. G., and Fryday-Field, K. (1994).
       Statistical methodology for the concurrent assessment of interrater and
       intrarater reliability. Physical Therapy, 74(8), 777-788.
       https://doi.org/10.1093/ptj/74.8.777

    Examples
    --------
    >>> import pandas as pd
    >>> from masrel.agreement import g_study, single_ratings
    >>> rows = [(p, r, g) for p, gs in enumerate(["4455", "2132", "2243", "5566"])
    ...         for r, g in zip("AABB", map(int, gs))]
    >>> frame = pd.DataFrame(rows, columns=["person", "rater", "grade"])
    >>> study = g_study(frame, of="person", facets=["rater"])
    >>> for shared, design in single_ratings(study).items():
    ...     print(shared, round(design.dependability, 3))
    the same rater 0.931
    another of each 0.758
    """
    cases = {
        f"the same {name}": {name, *study.columns_above(name)} for name in study.facets
    }
    return {
        shared: d_study(study, dict.fromkeys(study.facets, 1), fixed=fixed)
        for shared, names in {**cases, "another of each": set[str]()}.items()
        if _may_err(study, fixed := sorted(names - {study.of} | {*study.fixed}))
    }


def _may_err(study: "GStudy", fixed: Sequence[str]) -> bool:
    # whether anything but what is fixed makes ratings of a person differ
    return any(not of - {study.of} <= {*fixed} for of in study.effects.values())
