"""The last fit: every parameter from every trial together, nonlinear least squares.

Trials differ: each has a constant torque of its own, -k·θ_rest, and each catch a peak,
a residual and a travel of its own. What the joint has in common is what the torque of
all trials shares (b, k, m, k_post), and what their catches scatter about: the line of
catch angles (L, α), peaks in proportion to speed (H), residuals in proportion to peaks
(Q), and travels (D).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification._clusters import (
    ClusteredFit,
    Rows,
    left_out_errors,
    partial_out,
    solve,
    triangle,
)
from masrel.elbow.identification._equations import Equations
from masrel.elbow.identification._lack_of_fit import LackOfFit, lack_of_fit

_Floats = NDArray[np.float64]

_EVALUATIONS = 60
_PRECISE = 1e-12  # relative fall of the sum of squares that ends the search
_MIN_TIME = 2e-4  # a lag or a rise is no shorter, s


@dataclass(frozen=True, slots=True, kw_only=True)
class JointFit:
    """Values of all parameters with their covariance, and what they leave over."""

    names: tuple[str, ...]
    fit: ClusteredFit
    own: tuple[dict[str, float], ...]  # by trial
    fitted_torque: tuple[_Floats, ...] = field(repr=False)
    torque_sd: float
    lack_of_fit: LackOfFit
    cross_validation: _Floats = field(repr=False)
    n_evaluations: int


def fit_together(
    equations: Sequence[Equations], start: Mapping[str, float], rest_sd: float
) -> JointFit:
    """Fit every parameter to every trial at once, by Gauss and Newton's method.

    Instants of catches stay where the change points are, unless the torque takes time:
    the law is not differentiable in them. Everything else is.
    """
    names = equations[0].known.names
    shared = np.array([start[name] for name in names])
    own = [e.start(start) for e in equations]
    tables = _tables(equations, shared, own)
    squares, n_evaluations = _squares(tables), 1
    while n_evaluations < _EVALUATIONS:
        steps = _step(equations, tables, len(names))
        share, best = 1.0, squares
        while n_evaluations < _EVALUATIONS:
            trial = _moved(names, shared, own, steps, share)
            tried = _tables(equations, *trial)
            best, n_evaluations = _squares(tried), n_evaluations + 1
            if best <= squares or share < 1e-3:
                break
            share *= 0.5
        if not best <= squares:
            break
        fall, squares = squares - best, best
        (shared, own), tables = trial, tried
        if fall <= _PRECISE * squares:
            break
    return _finish(equations, shared, own, rest_sd, n_evaluations)


def _tables(
    equations: Sequence[Equations], shared: _Floats, own: Sequence[_Floats]
) -> list[_Floats]:
    return [
        triangle(e.table(shared, mine)) for e, mine in zip(equations, own, strict=True)
    ]


def _squares(tables: Sequence[_Floats]) -> float:
    return sum(float((table[:, -1] ** 2).sum()) for table in tables)


def _step(
    equations: Sequence[Equations], tables: Sequence[_Floats], n_shared: int
) -> tuple[_Floats, list[_Floats]]:
    # each trial's own parameters are eliminated first, and follow from the shared ones
    rest = np.concatenate(
        [partial_out(t, len(e.own)) for e, t in zip(equations, tables, strict=True)]
    )
    size = np.linalg.norm(rest[:, :-1], axis=0)
    size[size == 0.0] = 1.0
    reduced = triangle(np.column_stack([rest[:, :-1] / size, rest[:, -1]]))
    shared = np.linalg.lstsq(reduced[:, :-1], -reduced[:, -1], rcond=1e-12)[0] / size
    own = []
    for e, table in zip(equations, tables, strict=True):
        n = len(e.own)
        left = table[:, -1] + table[:, n : n + n_shared] @ shared
        own.append(np.linalg.lstsq(table[:, :n], -left, rcond=1e-12)[0])
    return shared, own


def _moved(
    names: Sequence[str],
    shared: _Floats,
    own: Sequence[_Floats],
    steps: tuple[_Floats, list[_Floats]],
    share: float,
) -> tuple[_Floats, list[_Floats]]:
    moved = shared + share * steps[0]
    for place, name in enumerate(names):
        if name in ("lag", "catch_rise"):
            moved[place] = max(moved[place], _MIN_TIME)
    return moved, [x + share * step for x, step in zip(own, steps[1], strict=True)]


def _finish(
    equations: Sequence[Equations],
    shared: _Floats,
    own: Sequence[_Floats],
    rest_sd: float,
    n_evaluations: int,
) -> JointFit:
    names = equations[0].known.names
    tables = [
        e.table(shared, mine, whole=True)
        for e, mine in zip(equations, own, strict=True)
    ]
    rows = [e.rows(shared, t) for e, t in zip(equations, tables, strict=True)]
    laws = tuple(e.law(shared, mine) for e, mine in zip(equations, own, strict=True))
    squares = sum(
        float(((e.measured - law) ** 2).sum())
        for e, law in zip(equations, laws, strict=True)
    )
    n_own = sum(mine.size for mine in own)
    count = sum(e.measured.size for e in equations)
    step = solve(rows)
    # what no trial determines is nan in the step and stays so
    values = np.where(np.isnan(step.values), np.nan, shared)
    return JointFit(
        names=names,
        fit=replace(step, values=values),
        own=tuple(
            dict(zip(e.own, mine.tolist(), strict=True))
            for e, mine in zip(equations, own, strict=True)
        ),
        fitted_torque=laws,
        torque_sd=math.sqrt(squares / max(count - n_own - len(names), 1)),
        lack_of_fit=lack_of_fit(equations, shared, own, tables, laws, rest_sd),
        cross_validation=_left_out(equations, rows),
        n_evaluations=n_evaluations,
    )


def _left_out(equations: Sequence[Equations], rows: Sequence[Rows]) -> _Floats:
    # (N·m)² a degree of freedom, of the equations as they are linear at the fit
    errors = left_out_errors([r.design for r in rows], [r.target for r in rows])
    return np.array(
        [
            float(error @ error)
            * e.known.spreads.torque**2
            / max(e.torque.size - len(e.own), 1)
            for e, error in zip(equations, errors, strict=True)
        ]
    )
