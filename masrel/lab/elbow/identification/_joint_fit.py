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

from masrel.lab.elbow.identification._clusters import (
    ClusteredFit,
    Rows,
    left_out_steps,
    partial_out,
    solve,
    triangle,
)
from masrel.lab.elbow.identification._equations import Equations
from masrel.lab.elbow.identification._lack_of_fit import LackOfFit, lack_of_fit

_Floats = NDArray[np.float64]

_EVALUATIONS = 60
# Relative fall of the sum of squares that ends the search; with derivatives that are
# differences, or of more rounds to come, less is enough.
_PRECISE, _TIMED = 1e-10, 1e-7
_KINK = 1e-6  # where a climb begins at a sample, nothing is more precise


@dataclass(frozen=True, slots=True, kw_only=True)
class JointFit:
    """Values of all parameters with their covariance, and what they leave over."""

    names: tuple[str, ...]
    fit: ClusteredFit
    fitted_torque: tuple[_Floats, ...] = field(repr=False)
    torque_sd: float
    lack_of_fit: LackOfFit
    cross_validation: _Floats = field(repr=False)
    n_evaluations: int


@dataclass(frozen=True, slots=True)
class Solution:
    """Where the sum of squares is smallest: shared parameters, and each trial's own."""

    shared: _Floats
    local: list[_Floats]
    typical: float  # median over catches of the mean square that is left, (N·m)²
    n_evaluations: int


def fit_together(
    equations: Sequence[Equations],
    start: Mapping[str, float],
    floors: Mapping[str, float],
) -> Solution:
    """Fit every parameter to every trial at once, by Gauss and Newton's method.

    Instants of catches stay where the change points are, unless the torque takes time:
    the law is not differentiable in them. Everything else is. No parameter falls
    below its floor.
    """
    names = equations[0].known.names
    shared = np.array([start[name] for name in names])
    local = [e.start(start) for e in equations]
    bound = np.array([floors.get(name, -math.inf) for name in names])
    tables = _tables(equations, shared, local)
    squares, n_evaluations = _squares(tables), 1
    precise = _TIMED if equations[0].known.arm.takes_time else _PRECISE
    while n_evaluations < _EVALUATIONS:
        steps = _step(equations, tables, len(names))
        share, best = 1.0, squares
        while n_evaluations < _EVALUATIONS:
            trial = (
                np.maximum(shared + share * steps[0], bound),
                [x + share * step for x, step in zip(local, steps[1], strict=True)],
            )
            tried = _tables(equations, *trial)
            best, n_evaluations = _squares(tried), n_evaluations + 1
            if best <= squares * (1.0 + _KINK) or share < 1e-3:
                break
            share *= 0.5
        if not best <= squares:
            break
        fall, squares = squares - best, best
        (shared, local), tables = trial, tried
        if fall <= precise * squares:
            break
    left = [
        float(((e.measured - e.law(shared, x)) ** 2).mean())
        for e, x in zip(equations, local, strict=True)
        if e.catch is not None
    ]
    typical = float(np.median(left)) if left else math.nan
    return Solution(shared, local, typical, n_evaluations)


def _tables(
    equations: Sequence[Equations], shared: _Floats, local: Sequence[_Floats]
) -> list[_Floats]:
    return [
        triangle(e.table(shared, mine))
        for e, mine in zip(equations, local, strict=True)
    ]


def _squares(tables: Sequence[_Floats]) -> float:
    return sum(float((table[:, -1] ** 2).sum()) for table in tables)


def _step(
    equations: Sequence[Equations], tables: Sequence[_Floats], n_shared: int
) -> tuple[_Floats, list[_Floats]]:
    # each trial's own parameters are eliminated first, and follow from the shared ones
    rest = np.concatenate(
        [partial_out(t, len(e.local)) for e, t in zip(equations, tables, strict=True)]
    )
    size = np.linalg.norm(rest[:, :-1], axis=0)
    size[size == 0.0] = 1.0
    reduced = triangle(np.column_stack([rest[:, :-1] / size, rest[:, -1]]))
    shared = np.linalg.lstsq(reduced[:, :-1], -reduced[:, -1], rcond=1e-12)[0] / size
    local = []
    for e, table in zip(equations, tables, strict=True):
        n = len(e.local)
        left = table[:, -1] + table[:, n : n + n_shared] @ shared
        local.append(np.linalg.lstsq(table[:, :n], -left, rcond=1e-12)[0])
    return shared, local


def joint_fit(
    equations: Sequence[Equations], solution: Solution, rest_sd: float
) -> JointFit:
    """Return what a solution says of the parameters, and leaves over."""
    shared, local = solution.shared, solution.local
    names = equations[0].known.names
    tables = [
        e.table(shared, mine, whole=True)
        for e, mine in zip(equations, local, strict=True)
    ]
    rows = [e.rows(shared, t) for e, t in zip(equations, tables, strict=True)]
    laws = tuple(e.law(shared, mine) for e, mine in zip(equations, local, strict=True))
    squares = sum(
        float(((e.measured - law) ** 2).sum())
        for e, law in zip(equations, laws, strict=True)
    )
    n_local = sum(mine.size for mine in local)
    count = sum(e.measured.size for e in equations)
    step = solve(rows)
    # what no trial determines is nan in the step and stays so
    values = np.where(np.isnan(step.values), np.nan, shared)
    return JointFit(
        names=names,
        fit=replace(step, values=values),
        fitted_torque=laws,
        torque_sd=math.sqrt(squares / max(count - n_local - len(names), 1)),
        lack_of_fit=lack_of_fit(equations, shared, local, tables, laws, rest_sd),
        cross_validation=_left_out(equations, solution, rows, tables, laws),
        n_evaluations=solution.n_evaluations,
    )


def _left_out(
    equations: Sequence[Equations],
    solution: Solution,
    rows: Sequence[Rows],
    tables: Sequence[_Floats],
    laws: Sequence[_Floats],
) -> _Floats:
    # Per trial the mean square of its torque less what the others' parameters give, as
    # linear as they are at the fit. Constant, peak, residual and travel are its own;
    # its drift is the others' mean, or a drift would better every fit.
    drifts = np.array(
        [
            local[e.local.index("drift")] if "drift" in e.local else 0.0
            for e, local in zip(equations, solution.local, strict=True)
        ]
    )
    made = []
    for i, (e, step) in enumerate(zip(equations, left_out_steps(rows), strict=True)):
        table, law, n = tables[i], laws[i], len(e.local)
        r = triangle(table)
        local = np.zeros(n)
        if "drift" in e.local and drifts.size > 1:
            others = (drifts.sum() - drifts[i]) / (drifts.size - 1)
            local[e.local.index("drift")] = others - drifts[i]
        left = r[:, -1] + r[:, n:-1] @ np.nan_to_num(step) + r[:, :n] @ local
        free = [j for j, name in enumerate(e.local) if name != "drift"]
        local[free] = np.linalg.lstsq(r[:, free], -left, rcond=1e-12)[0]
        columns = table[: law.size, :-1] * np.concatenate([local, step])
        error = e.measured - law - e.known.spreads.torque * columns.sum(axis=1)
        made.append(float((error**2).mean()) if error.size else math.nan)
    return np.array(made)
