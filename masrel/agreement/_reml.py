"""Components by restricted maximum likelihood, for designs with gaps.

Henderson's mixed-model equations: of random effects scaled by √ratio to the residual,
of the mean and of the ratings themselves. Effects that hold the largest column are
sparse and eliminated first; what is left is dense.
"""

from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import LinAlgError, cho_solve, cholesky
from scipy.optimize import minimize, root
from scipy.sparse.linalg import splu

from masrel.agreement._effects import Cells
from masrel.agreement._engine import Floats

_HIGHEST = 1e3  # √ratio of effects beside which there is as good as no residual
_STEP = 1e-4
_AT_ONCE = 2e7  # numbers in columns that are solved for together
_EXACT = 1000  # levels up to which traces are exact; of more, by random signs
_SIGNS = 256


def components(
    values: Floats, cells: Cells, largest: str, start: Floats
) -> tuple[Floats, Floats] | None:
    """Return the likeliest components and their covariances, the residual last."""
    # None where the ratings leave no residual
    equations = _Equations(values, cells, largest)

    def slopes(theta: Floats) -> Floats:
        steps = np.diag(_STEP * (np.abs(theta) + 0.01))
        rises = [
            equations.deviance(theta + h) - equations.deviance(theta - h) for h in steps
        ]
        return np.asarray(np.array(rises) / (2.0 * steps.sum(axis=1)))

    ratios = start[equations.order] / max(start[-1], 1e-3 * values.var())
    theta = np.sqrt(np.clip(ratios, 0.1, _HIGHEST))
    # either sign is the same, and at 0, where the slope is 0, no search may end
    bounds = [(-_HIGHEST, _HIGHEST)] * len(ratios)
    search = minimize(
        equations.deviance, theta, jac=slopes, method="L-BFGS-B", bounds=bounds
    )
    theta = np.abs(search.x)
    if (theta > 0.9 * _HIGHEST).any():
        return None
    # a search nears 0 and never meets it, where the slope is 0 whatever the others are
    for at in np.eye(len(theta), dtype=bool):
        without = np.where(at, 0.0, theta)
        if equations.deviance(without) <= equations.deviance(theta):
            theta = without
    free = theta > 0.0

    def slopes_of(some: Floats) -> Floats:
        theta[free] = some
        return slopes(theta)[free]

    if free.any():
        theta[free] = np.abs(root(slopes_of, theta[free], tol=1e-7).x)
    return equations.components(theta)


class _Equations:
    """The mixed-model equations of a design, and what follows at √ratios."""

    def __init__(self, values: Floats, cells: Cells, largest: str) -> None:
        is_dense = np.array([largest not in effect for effect in cells][:-1])
        self.order = np.argsort(is_dense, kind="stable")
        rows, ones = np.arange(len(values)), np.ones(len(values))
        blocks: list[Any] = [
            sparse.csc_array((ones, (rows, [*cells.values()][place])))
            for place in self.order
        ]
        last = sparse.csc_array(np.column_stack([ones, values]))
        design: Any = sparse.hstack([*blocks, last])
        self.products = (design.T @ design).tocsc()
        sizes = [block.shape[1] for block in blocks]
        self.owner = np.repeat(np.arange(len(sizes)), sizes)  # effect of each row
        k = self.n_sparse = int((~is_dense[self.order][self.owner]).sum())
        # of sparse effects, of both, and of the others with the mean and the ratings
        self.inner, self.outer = self.products[:k, :k], self.products[k:, k:].toarray()
        self.across = self.products[k:, :k].tocsr()
        self.df = len(values) - 1

    def factors(self, theta: Floats) -> tuple[Any, Floats]:
        """Return the factor of the sparse part, and the dense factor of the rest."""
        top, below = np.split(np.append(theta[self.owner], [1.0, 1.0]), [self.n_sparse])
        inner, rows = self.inner.copy(), self.inner.indices
        columns = np.repeat(np.arange(len(top)), np.diff(inner.indptr))
        inner.data = inner.data * top[rows] * top[columns] + (rows == columns)
        factor = splu(
            inner,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        ridge = np.diag(np.append(np.ones(len(below) - 2), [0.0, 0.0]))
        outer = self.outer * np.outer(below, below) + ridge
        step = int(_AT_ONCE / len(top)) + 1
        for start in range(0, len(below), step):
            some = slice(start, start + step)
            right = top[:, None] * self.across[some].toarray().T * below[some]
            left = self.across @ (top[:, None] * factor.solve(right))
            outer[:, some] -= below[:, None] * left
        return factor, cholesky(outer, lower=True)

    def deviance(self, theta: Floats) -> float:
        """Return -2 log of the restricted likelihood, whatever the residual is."""
        try:
            factor, lower = self.factors(theta)
        except LinAlgError:  # all is rounding so far from the likeliest
            return np.inf
        # the last pivot is what the effects leave of the squares of ratings
        *logs, rest = np.log(lower.diagonal())
        of_sparse = np.log(np.abs(factor.U.diagonal())).sum()
        return float(of_sparse + 2.0 * (np.sum(logs) + self.df * rest))

    def components(self, theta: Floats) -> tuple[Floats, Floats]:
        """Return the components at these √ratios, and their covariances."""
        ratios, n_effects = theta**2, len(theta)
        factor, lower = self.factors(theta)
        residual = lower[-1, -1] ** 2 / self.df
        # information/2: tr(P V_i P V_j), of which P V P = P gives the residual's
        traces, whole = np.zeros(n_effects), np.zeros((n_effects + 1, n_effects + 1))
        for effect in range(n_effects):
            rows = np.flatnonzero(self.owner == effect)
            probes = np.eye(len(rows))
            if len(rows) > _EXACT:
                rng = np.random.default_rng(0)
                probes = rng.choice([-1.0, 1.0], (len(rows), _SIGNS)) / np.sqrt(_SIGNS)
            right = self.products[:-1, rows] @ probes
            left = self._projected(right, theta, factor, lower)
            traces[effect] = (probes * left[rows]).sum()
            norms = (left[:-1] ** 2).sum(axis=1)
            whole[effect, :-1] = np.bincount(self.owner, norms, n_effects)
        whole[:-1, :-1] = 0.5 * (whole[:-1, :-1] + whole[:-1, :-1].T)
        whole[-1, :-1] = whole[:-1, -1] = traces - whole[:-1, :-1] @ ratios
        whole[-1, -1] = self.df - ratios @ traces - ratios @ whole[-1, :-1]
        order = np.argsort([*self.order, n_effects])
        # to a diagonal of 1, for ratios may be of any size; negative by rounding alone
        size = np.sqrt(np.abs(whole.diagonal()))
        inverse = np.linalg.pinv(whole / np.outer(size, size)) / np.outer(size, size)
        covariance = 2.0 * residual**2 * inverse[np.ix_(order, order)]
        return residual * np.append(ratios, 1.0)[order], covariance

    def _projected(
        self, right: Floats, theta: Floats, factor: Any, lower: Floats
    ) -> Floats:
        """Return Z' P of vectors whose products with the design are given."""
        scale = np.append(theta[self.owner], 1.0)[:, None]
        across = self.across[:-1].multiply(scale[self.n_sparse :]).tocsr()
        top, below = np.split(scale * right, [self.n_sparse])
        of_top = scale[: self.n_sparse]
        below = below - across @ (of_top * factor.solve(top))
        below = cho_solve((lower[:-1, :-1], True), below)
        top = factor.solve(top - of_top * (across.T @ below))
        solved = scale * np.concatenate([top, below])
        return np.asarray(right - self.products[:-1, :-1] @ solved)
