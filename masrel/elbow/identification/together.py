"""The last fit: every parameter from every trial together, nonlinear least squares.

Trials differ: each has a constant torque of its own, -k·θ_rest, and each catch a
peak, a residual and a travel of its own. What the joint has in common is what the
torque of all trials shares (b, k, m, k_post), and what their catches scatter about:
the line of catch angles (L, α), peaks in proportion to speed (H), residuals in
proportion to peaks (Q), and travels (D).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from masrel.elbow.identification.clusters import ClusteredFit, solve
from masrel.elbow.identification.equations import Equations
from masrel.elbow.identification.horizon import Horizon
from masrel.elbow.identification.scatter import Known, Spreads
from masrel.elbow.identification.trials import Trial
from masrel.elbow.parameters import ElbowParameters

__all__ = ["Together", "refine"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Together:
    """The last fit.

    Attributes
    ----------
    names : tuple of str
        The parameters that were fitted.
    fit : ClusteredFit
        Their values and covariance.
    fitted_torque : tuple of ndarray
        Per trial, the law at its samples, N·m.
    torque_sd : float
        Standard deviation of measured torque about it, N·m.
    n_evaluations : int
        Evaluations of the residuals of all trials.
    """

    names: tuple[str, ...]
    fit: ClusteredFit
    fitted_torque: tuple[Floats, ...] = field(repr=False)
    torque_sd: float
    n_evaluations: int


def refine(
    trials: Sequence[Trial],
    start: Mapping[str, float],
    constants: ElbowParameters,
    spreads: Spreads,
    on_line: Sequence[bool],
    horizons: Sequence[Horizon | None],
) -> Together:
    """Fit every parameter to every trial at once.

    Parameters
    ----------
    trials : sequence of Trial
        Trials with samples.
    start : mapping of str to float
        Where the steps left each parameter; what is ``nan`` is not fitted.
    constants : ElbowParameters
        ΔT_peak, ν_L and the reading of (5).
    spreads : Spreads
        What residuals are divided by.
    on_line : sequence of bool
        Of which trials the catch lies on the line of (2).
    horizons : sequence of Horizon or None
        Behind which of them catches end that do not end before.

    Returns
    -------
    Together
        Values and clustered covariance.

    Notes
    -----
    Instants of catches stay where the change points are: the law is not
    differentiable in them. Everything else is, and has its analytic Jacobian.
    """
    names = tuple(name for name, value in start.items() if not math.isnan(value))
    equations = [
        Equations(
            trial,
            Known(
                names=names,
                constants=constants,
                spreads=spreads,
                on_line=on,
                horizon=horizon,
            ),
        )
        for trial, on, horizon in zip(trials, on_line, horizons, strict=True)
    ]
    system = _System(equations, len(names))
    shared = np.array([start[name] for name in names])
    vector = np.concatenate([shared, *(e.start(dict(start)) for e in equations)])
    found = least_squares(
        system.residuals,
        vector,
        jac=system.jacobian,
        x_scale="jac",
        method="trf",
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-12,
        max_nfev=100,
    )
    return _finish(trials, system, names, found.x)


class _System:
    # All trials' equations behind each other; the vector holds the shared parameters
    # and then each trial's own.

    def __init__(self, equations: Sequence[Equations], n_shared: int) -> None:
        self.equations, self.n_shared = equations, n_shared
        ends = n_shared + np.cumsum([0, *(e.n_own for e in equations)])
        self.own = [slice(a, b) for a, b in pairwise(ends)]
        self.n_evaluations = 0

    def of_trial(self, vector: Floats, place: int) -> tuple[Floats, Floats, Floats]:
        equations = self.equations[place]
        return equations.at(vector[: self.n_shared], vector[self.own[place]])

    def residuals(self, vector: Floats) -> Floats:
        self.n_evaluations += 1
        places = range(len(self.equations))
        return np.concatenate([self.of_trial(vector, i)[0] for i in places])

    def jacobian(self, vector: Floats) -> Floats:
        blocks = []
        for place, own in enumerate(self.own):
            _, by_shared, by_own = self.of_trial(vector, place)
            block = np.zeros((by_shared.shape[0], vector.size))
            block[:, : self.n_shared] = by_shared
            block[:, own] = by_own
            blocks.append(block)
        return np.concatenate(blocks)


def _finish(
    trials: Sequence[Trial], system: _System, names: tuple[str, ...], vector: Floats
) -> Together:
    rows, torques, squares, count = [], [], 0.0, 0
    shared = vector[: len(names)]
    for place, trial in enumerate(trials):
        equations, own = system.equations[place], vector[system.own[place]]
        rows.append(equations.rows(shared, own))
        law = equations.torque(shared, own)
        measured = trial.pre_catch.measured
        if trial.after is not None:
            measured = np.concatenate([measured, trial.after.measured])
        torques.append(law)
        squares += float(((measured - law) ** 2).sum())
        count += measured.size
    n_own = vector.size - len(names) + len(trials)
    step = solve(rows, n_own=n_own)
    fit = ClusteredFit(
        # what no trial determines is nan in the step and stays so
        values=np.where(np.isnan(step.values), np.nan, shared),
        covariance=step.covariance,
        freedom=step.freedom,
        residual_sd=step.residual_sd,
        n_trials=step.n_trials,
    )
    return Together(
        names=names,
        fit=fit,
        fitted_torque=tuple(torques),
        torque_sd=math.sqrt(squares / max(count - n_own - len(names), 1)),
        n_evaluations=system.n_evaluations,
    )
