"""How the posterior of a coefficient of two raters is integrated.

By one formula where only the share of agreeing pairs matters, by quadrature for two
categories, else over draws.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.errors import ConvergenceError
from masrel.intervals.table.chances import Chance, Nodes, drawn, grid, single
from masrel.intervals.table.posterior import TablePosterior

__all__ = ["table_quantiles"]

_STEPS = (0.5, 0.25, 0.125, 0.0625)  # of the quadrature, until the ends settle
_SETTLED = 1e-7  # halving moves an end less: its own error is about the square
_NEARLY = 1e-5  # as far as a few tables get, of zeros and small priors
_FIRST_DRAWS = 500  # which show where the ends are about
_SHOWN_DRAWS = 2000  # of which a density that is looked at is made


def table_quantiles(
    chance: Chance,
    v: Floats,
    prior: Floats,
    shares: tuple[float, float],
    *,
    start: float,
    generator: Callable[[], np.random.Generator],
    n_draws: int,
) -> tuple[TablePosterior, tuple[float, float]]:
    """Integrate, or draw, the posterior of a coefficient of two raters."""
    # Takes v (n_categories, n_categories), prior (n_categories, n_categories)
    q = len(v)
    agreed = float(prior.trace())
    of_nodes = partial(TablePosterior, apart=float(prior.sum()) - agreed, agreed=agreed)
    if chance in ("none", "uniform") and np.ptp(v[~np.eye(q, dtype=bool)]) == 0.0:
        one = _always(single(chance, v))
        return _solved(of_nodes(nodes=one, shown=one), shares, (start, start))
    if q > 2:
        drawn_nodes = drawn(chance, v, prior, generator(), n_draws)
        few, some = (
            _always(drawn_nodes.first(min(n, n_draws)))
            for n in (_FIRST_DRAWS, _SHOWN_DRAWS)
        )
        _, ends = _solved(of_nodes(nodes=few, shown=few), shares, (start, start))
        found = of_nodes(nodes=_always(drawn_nodes), shown=some, n_draws=n_draws)
        return _solved(found, shares, ends)
    ends, coarse = (start, start), _on_grid(chance, v, prior, _STEPS[0])
    for step in _STEPS:
        found = of_nodes(nodes=_on_grid(chance, v, prior, step), shown=coarse)
        before = ends
        _, ends = _solved(found, shares, before)
        moved = max(abs(ends[0] - before[0]), abs(ends[1] - before[1]))
        if moved < _SETTLED:
            break
    if moved > _NEARLY:
        raise ConvergenceError("the quadrature of the posterior has not settled")
    return found, ends


def _always(nodes: Nodes) -> Callable[[float], Nodes]:
    return lambda _: nodes


def _solved(
    found: TablePosterior, shares: tuple[float, float], starts: tuple[float, float]
) -> tuple[TablePosterior, tuple[float, float]]:
    low, high = map(found.quantile, shares, starts)
    return found, (low, high)


def _on_grid(
    chance: Chance, v: Floats, prior: Floats, step: float
) -> Callable[[float], Nodes]:
    # From 0 on all values have the same nodes.
    whole = grid(chance, v, prior, step, 0.0)
    if chance != "margins":
        return _always(whole)
    return lambda at: whole if at >= 0.0 else grid(chance, v, prior, step, at)
