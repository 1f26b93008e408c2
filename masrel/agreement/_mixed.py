"""Variances of items, raters and residual from ratings with gaps.

A rating is μ + item + rater + residual, all three random and normal; the variances are
those of highest restricted likelihood. Items with as many ratings enter together as
sums: after one pass over the ratings only matrices of raters by raters are left.
"""

from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, root

from masrel.agreement._engine import Floats, deviations
from masrel.agreement._profile import EXACT, ends, profile_ends
from masrel.estimates import _LongNote

_Numbers = NDArray[Any]  # real, or complex for slopes

# Imaginary step of which the square is nothing: slopes then have no rounding
_TINY = 1e-30

# √ratio of a variance that no ratings tell from 0: to 1e-8 it makes no difference
_NONE = 5e-5


@dataclass(frozen=True, slots=True, kw_only=True)
class _Likelihood:
    """The restricted likelihood at ratios of variances to the residual's."""

    # Sums of products are of the raters, in k contrasts of which the first is their
    # mean, and of the ratings less the levels of raters: of what these are within
    # items, and of their sums over items of so many ratings. Nothing large cancels.
    sizes: Floats  # (g,): ratings of an item
    freq: Floats  # (g,): items of that size
    between: Floats  # (g, k + 1, k + 1)
    within: Floats  # (k + 1, k + 1)
    basis: Floats  # (k + 1, 2): μ and the ratings, made of these
    n_ratings: int
    has_raters: bool

    def parts(self, ratios: _Numbers) -> tuple[_Numbers, _Numbers]:
        """Return log |V| + log μ'V⁻¹μ, and y'Py, at ratios of items and raters."""
        # (m, 2) -> (m,), (m,)
        of_items, of_raters = ratios.T[:, :, None]  # (m, 1) each
        shrink = 1.0 + of_items * self.sizes
        weights = 1.0 / (self.sizes * shrink)
        gram = self.within + np.tensordot(weights, self.between, 1)  # (m, k + 1, k + 1)
        # by Woodbury's formula: gram (I + ratio gram)⁻¹ where raters are rows
        system = of_raters[..., None] * gram
        system[:, -1] = 0.0
        system += np.eye(len(self.basis))
        sums = self.basis.T @ gram @ np.linalg.solve(system, self.basis)
        sign, log_det = np.linalg.slogdet(system)
        of_mean = sums[:, 0, 0]
        squares = sums[:, 1, 1] - sums[:, 0, 1] * sums[:, 1, 0] / of_mean
        log_det = log_det + np.log(sign) + np.log(of_mean)
        determinants: _Numbers = np.log(shrink) @ self.freq + log_det
        return determinants, squares

    def deviance(self, ratios: _Numbers) -> _Numbers:
        """Return -2 log of the restricted likelihood, whatever the residual is."""
        determinants, squares = self.parts(ratios)
        # all is rounding where raters are so far from the likeliest
        squares = np.where(squares.real > 0.0, squares, np.inf)
        return np.asarray(determinants + (self.n_ratings - 1) * np.log(squares))

    def at(self, u: _Numbers) -> _Numbers:
        """Return the deviance at ratios sinh² u, which may be 0 and very large."""
        # (m, 1 or 2), the raters' being 0 where they are not told -> (m,)
        ratios = np.zeros((len(u), 2), dtype=u.dtype)
        ratios[:, : u.shape[1]] = np.sinh(u) ** 2
        return self.deviance(ratios)

    def _height(self, u: Floats) -> float:
        return float(self.at(u[None])[0])

    def slopes(self, u: Floats) -> Floats:
        """Return those of the deviance at one u, by the complex step."""
        return np.asarray(self.at(u + 1j * _TINY * np.eye(len(u))).imag / _TINY)

    def maximum(self, precision: float) -> Floats:
        """Return the ratios (2,) of highest likelihood."""
        # from the best of a grid, the first of those that differ by rounding; ratios
        # are about as large as 1 / residual at most
        axis = np.arcsinh(np.sqrt(np.geomspace(1e-4, 30.0 * max(1.0, precision), 8)))
        starts = np.array(list(product(axis, repeat=1 + self.has_raters)))
        start = starts[np.argmin(self.at(starts).round(9))]
        near = minimize(self._height, start, jac=self.slopes, method="BFGS").x
        u = root(self.slopes, near, tol=1e-13).x
        ratios = np.zeros(2)
        ratios[: len(u)] = np.where(np.abs(u) < _NONE, 0.0, np.sinh(u) ** 2)
        return ratios

    def information(self, ratios: Floats) -> Floats:
        """Return tr(P V_i P V_j) of items, raters and residual, times residual²."""

        def slopes(ratios: Floats) -> Floats:
            steps = ratios + 1j * _TINY * np.eye(2)
            return np.asarray(self.parts(steps)[0].imag / _TINY)

        # P V P = P gives those of the residual from slopes and curvatures of the
        # determinants, here by differences of fourth order: right to some 1e-12, which
        # a shorter step would lose to rounding
        least = 1.0 / self.sizes.max(), len(self.basis) / self.n_ratings
        steps = np.diag(1e-3 * (ratios + least))
        near, far = (
            np.array([slopes(ratios + n * h) - slopes(ratios - n * h) for h in steps])
            for n in (1.0, 2.0)
        )
        traces = np.empty((3, 3))
        traces[:2, :2] = (far - 8.0 * near) / (12.0 * steps.sum(axis=0)[:, None])
        slope = slopes(ratios)
        traces[2, :2] = traces[:2, 2] = slope - traces[:2, :2] @ ratios
        traces[2, 2] = self.n_ratings - 1 - ratios @ slope - ratios @ traces[:2, 2]
        return traces


@dataclass(frozen=True, slots=True, kw_only=True)
class Components:
    """Variances of items, raters (0 without raters) and residual, in unit²."""

    items: float
    raters: float
    residual: float
    n_items: int
    n_raters: int
    n_ratings: int
    unit: float  # in those of the ratings
    has_raters: bool  # whether they are told from the residual
    ratios: Floats = field(default_factory=lambda: np.zeros(2))
    likelihood: _Likelihood | None = None  # None without residual

    @property
    def words(self) -> str:
        """How they were estimated, and what they are."""
        parts = {"items": self.items, "raters": self.raters, "residual": self.residual}
        if not self.has_raters:
            del parts["raters"]
        listed = [
            f"{name} {value * self.unit * self.unit:.4g}"
            + " (the least it can be)" * (value == 0.0)
            for name, value in parts.items()
        ]
        return _LongNote(f"ratings are missing; variances by REML: {', '.join(listed)}")

    def icc_ends(self, *, absolute: bool, level: float) -> tuple[float, float]:
        """Return the ends of the interval of a single rating's correlation."""
        # absolute: whether the variance of raters counts as error
        n, k, likelihood = self.n_items, self.n_raters, self.likelihood
        if likelihood is None:
            if not absolute or self.raters == 0.0:
                return 1.0, 1.0
            low, high = profile_ends(
                n, k, (k * self.items, n * self.raters, 0.0), level
            )
            return float(low), float(high)

        def deviance(a: Floats, x: Floats) -> Floats:
            ratios = np.stack([(a - 1.0) / k, self.has_raters * (x - 1.0) / n], axis=-1)
            return likelihood.deviance(ratios.reshape(-1, 2)).reshape(a.shape)

        a, x = 1.0 + self.ratios * (k, n)
        low, high = ends(deviance, a, x, n=n, k=k, level=level, absolute=absolute)
        return float(low), float(high)


def components(values: Floats, *, has_raters: bool) -> Components | str:
    """Return the variances of a table with gaps, or why they are undefined."""
    # values (n_items, n_raters), nan where there is no rating; without raters these
    # are part of the residual
    rated = ~np.isnan(values)
    sizes, n_ratings = rated.sum(axis=1), int(rated.sum())
    if (sizes < 2).all():
        return "no item has two ratings"
    scaled, unit = deviations(values)
    centred = np.where(rated, scaled - np.nanmean(scaled), 0.0)
    # items, and raters where these are told, as fixed effects
    weight = rated / sizes[:, None]
    laplacian = np.diag(rated.sum(axis=0)) - rated.T @ weight
    rest = centred - rated * (weight * centred).sum(axis=1, keepdims=True)
    levels, rank = np.zeros(values.shape[1]), 0
    if has_raters:
        levels, _, rank, _ = np.linalg.lstsq(laplacian, rest.sum(axis=0), rcond=1e-10)
        rest -= rated * (levels - (weight @ levels)[:, None])
    df = n_ratings - len(values) - int(rank)
    if df < 1 and centred.any():
        what = "raters" if has_raters else "items"
        return f"too few ratings to separate {what} from the residual"
    fit = Components(
        items=0.0,
        raters=0.0,
        residual=0.0,
        n_items=len(values),
        n_raters=len(levels),
        n_ratings=n_ratings,
        unit=unit,
        has_raters=has_raters,
    )
    squares, none = float((rest**2).sum()), EXACT * float((centred**2).sum())
    if squares <= none:
        # items and raters are known but for a constant, and their variances simple
        if levels @ laplacian @ levels <= none:
            levels[:] = 0.0
        elif rank < len(levels) - 1:
            return "there is no residual, and some raters are not linked by any item"
        means = (rated * (centred - levels)).sum(axis=1) / sizes
        of_items, of_raters = float(means.var(ddof=1)), float(levels.var(ddof=1))
        of_items = of_items if of_items > none else 0.0
        return replace(fit, items=of_items, raters=of_raters)
    likelihood = _likelihood_of(rated, centred, rest, levels, laplacian, has_raters)
    ratios = likelihood.maximum(df * float((centred**2).max()) / squares)
    residual = float(likelihood.parts(ratios[None])[1][0]) / (n_ratings - 1)
    return replace(
        fit,
        items=float(ratios[0]) * residual,
        raters=float(ratios[1]) * residual,
        residual=residual,
        ratios=ratios,
        likelihood=likelihood,
    )


def _likelihood_of(
    rated: NDArray[np.bool_],
    centred: Floats,
    rest: Floats,
    levels: Floats,
    laplacian: Floats,
    has_raters: bool,
) -> _Likelihood:
    """Return the likelihood of ratings (n_items, n_raters), by sizes of items."""
    # levels: raters' fixed effects; rest: what these and those of items leave
    sizes = rated.sum(axis=1)
    axes, _ = np.linalg.qr(np.column_stack([np.ones(len(levels)), np.eye(len(levels))]))
    within = np.zeros((len(levels) + 1, len(levels) + 1))
    within[:-1, :-1] = axes.T @ laplacian @ axes
    within[-1, :-1] = within[:-1, -1] = axes.T @ rest.sum(axis=0)
    within[0] = within[:, 0] = 0.0  # items have no mean of raters within
    within[-1, -1] = float((rest**2).sum())
    sums = np.column_stack([rated @ axes, (rated * (centred - levels)).sum(axis=1)])
    basis = np.column_stack([axes.T @ np.ones(len(levels)), axes.T @ levels])
    distinct, freq = np.unique(sizes, return_counts=True)
    of_size = [sums[sizes == size] for size in distinct]
    return _Likelihood(
        sizes=distinct.astype(float),
        freq=freq.astype(float),
        between=np.array([items.T @ items for items in of_size]),
        within=within,
        basis=np.vstack([basis, [0.0, 1.0]]),
        n_ratings=int(sizes.sum()),
        has_raters=has_raters,
    )
