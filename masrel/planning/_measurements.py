"""How large a study of measurements must be: persons of a g study, items, documents.

In: what a pilot had, or is taken to be true. Out: numbers with which an interval is
expected to be as narrow as it should be, and what a design can show.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from masrel._input import check_option, refuse
from masrel.agreement import GStudy
from masrel.agreement._effects import pivotal_draws
from masrel.agreement._engine import Floats, check_level


def units_needed(
    standard_error: float, n_units: int, *, half_width: float, level: float = 0.95
) -> int:
    """Return how many items, documents or clusters make an interval narrow enough.

    Parameters
    ----------
    standard_error : float
        That of any estimate, in a study of `n_units` of them: of a pilot, or by a
        formula.
    n_units : int
        How many that study has.
    half_width : float
        What half of the interval may be, in the units of the estimate.
    level : float, optional
        Level of the interval.

    Returns
    -------
    int
        The least n for which t(n − 1) · `standard_error` · √(`n_units`/n) is no larger.

    Raises
    ------
    ParameterError
        If the error or the half is not above 0, there are fewer than two units, or the
        level is not within (0, 1).

    Examples
    --------
    A limit of agreement of n items has the error s √(1/n + 1.96²/(2 (n − 1))) [1]_;
    with s = 3, for limits ± 1:

    >>> import math
    >>> units_needed(3.0 * math.sqrt(1 / 20 + 1.96**2 / 38), 20, half_width=1.0)
    107

    References
    ----------
    .. [1] Bland, J. M., Altman, D. G. (1999). Measuring agreement in method comparison
       studies. Statistical Methods in Medical Research, 8(2), 135-160.
       https://doi.org/10.1177/096228029900800204
    """
    from scipy.special import ndtri, stdtrit  # loaded only here

    check_level(level)
    refuse(
        (
            not 0.0 < standard_error < math.inf or not half_width > 0.0,
            "standard_error, half_width: need numbers above 0, got "
            f"{standard_error!r} and {half_width!r}",
        ),
        (n_units < 2, f"n_units: needs two or more, got {n_units!r}"),
    )
    of_one, upper = standard_error**2 * n_units / half_width**2, 0.5 + 0.5 * level
    n = max(2, math.ceil(of_one * float(ndtri(upper)) ** 2))  # by the normal: too few
    while of_one * float(stdtrit(n - 1, upper)) ** 2 > n:
        n += 1
    return n


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedDesign:
    """What a generalizability study of a design is expected to show.

    Attributes
    ----------
    n_persons : int
        How many are measured.
    sizes : mapping of str to int
        Levels of each facet; of a nested one within each level of the facet above.
    low, high : float
        Mean ends of the interval of the coefficient.
    chance : float or None
        Of a low end that reaches the aim, where there is one.
    monte_carlo_error : float
        Standard error of the chance, or of the mean low end.
    """

    n_persons: int
    sizes: Mapping[str, int]
    low: float
    high: float
    chance: float | None
    monte_carlo_error: float


def design_precision(
    study: GStudy,
    sizes: Mapping[str, int],
    *,
    n_persons: int,
    aim: float | None = None,
    of: Literal["dependability", "generalizability"] = "dependability",
    n_studies: int = 200,
    rng: int = 0,
) -> PlannedDesign:
    """Simulate g studies of a design, with the components of one that is known.

    Parameters
    ----------
    study : GStudy
        Components that are taken to be true, such as those of a pilot.
    sizes : mapping of str to int
        Levels of each facet in the mean that is judged; of a nested one within each
        level of the facet above. The study to come has as many, but two at least.
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
    >>> from masrel.agreement import g_study
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
    parts[len(effects) - 1] = parts[len(effects) - 1 :].sum()
    expected, df = _balanced(effects, levels)
    generator = np.random.default_rng(rng)
    ends = np.empty((n_studies, 2))
    for k in range(n_studies):
        squares = expected @ parts * generator.chisquare(df) / df
        found = np.linalg.solve(expected, squares)
        one = replace(
            study,
            effects=effects,
            components=dict(zip(effects, found, strict=True)),
            draws=pivotal_draws(squares, df, expected, generator),
        )
        interval = getattr(one.d_study(**sizes), f"{of}_interval")
        ends[k] = interval.low, interval.high
    reached = ends[:, 0] if aim is None else ends[:, 0] >= aim
    return PlannedDesign(
        n_persons=n_persons,
        sizes=dict(sizes),
        low=float(ends[:, 0].mean()),
        high=float(ends[:, 1].mean()),
        chance=None if aim is None else float(reached.mean()),
        monte_carlo_error=float(reached.std() / math.sqrt(n_studies)),
    )


def _balanced(
    effects: Mapping[str, frozenset[str]], levels: Mapping[str, int]
) -> tuple[Floats, Floats]:
    """Return mean squares expected of each variance, and degrees of freedom."""
    columns = [*effects.values()]
    n_ratings = math.prod(levels.values())
    counts = [math.prod(levels[name] for name in of) for of in columns]
    df = np.empty(len(columns))
    for at, of in enumerate(columns):
        within = [k for k, other in enumerate(columns) if other < of]
        df[at] = counts[at] - 1 - df[within].sum()
    expected = [
        [
            (one <= other) * n_ratings / n
            for other, n in zip(columns, counts, strict=True)
        ]
        for one in columns
    ]
    return np.array(expected), df
