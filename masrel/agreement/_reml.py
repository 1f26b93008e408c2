"""Variance components of ratings with gaps, by restricted maximum likelihood.

A rating is μ + item + rater + residual, all three random and normal. Items are
eliminated by formula, and those with as many ratings enter together as sums, so that
after one pass over the ratings a step costs what a few matrices of raters by raters do.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._data import rated_part

_Floats = NDArray[np.float64]

_EXACT = 1e-24
"""Residual sum of squares, as a share of all, that is the rounding of a perfect fit."""

_STEPS = 100
"""Newton's steps; as a rule some eight."""

_LAST = 1e-10
"""Fall of the deviance that a step promises, at which it is the last."""

_TINY = 1e-30
"""Imaginary step of which the square is nothing: slopes then have no rounding."""

_TO_ZERO = -0.3
"""Step of a logarithm from which on 0 is tried: towards 0 they tend to -1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Components:
    """Variances of items, raters (0 where there are none) and residual, in unit²."""

    items: float
    raters: float
    residual: float
    # (3, 3): of the three estimates, from the expected information; nan where there is
    # none, as without residual
    covariance: _Floats
    n_items: int
    n_raters: int
    n_ratings: int
    unit: float = 1.0  # in those of the ratings
    has_raters: bool  # whether they are told from the residual
    fit: "Fit | None" = None  # None without residual
    reason: str | None = None  # why they are undefined, or None

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
        return f"ratings are missing; variances by REML: {', '.join(listed)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sums:
    # Sums over items with as many ratings, (k + 1) by (k + 3): of raters, and of the
    # ratings less the levels of raters, with these, with μ and with the ratings. Raters
    # are the k contrasts of `axes`, the first of which is their mean, so that nothing
    # large cancels.
    sizes: _Floats  # (g,): ratings of an item
    freq: _Floats  # (g,): items of that size
    # (g, (k + 1) (k + 3)): Σ_i z_i z_i', where z_i are the sums over an item
    products: _Floats
    within: _Floats  # (k + 1, k + 3): the same of ratings less the mean of their item
    levels: _Floats  # (k, 2): of μ, and of the raters as they were taken off
    n_ratings: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """Where the likelihood is highest."""

    sums: _Sums
    ratios: _Floats  # (2,): of items and raters to the residual
    deviance: float


def crossed_components(values: _Floats) -> Components:
    """Return the components of items, raters and residual."""
    # values (n_items, n_raters), nan where there is no rating
    return _components(values, has_raters=True)


def nested_components(values: _Floats) -> Components:
    """Return the components of items and residual, raters being part of the latter."""
    return _components(values, has_raters=False)


def _components(values: _Floats, *, has_raters: bool) -> Components:
    values = _in_order(values)
    rated = ~np.isnan(values)
    blank = Components(
        items=math.nan,
        raters=math.nan,
        residual=math.nan,
        covariance=np.full((3, 3), math.nan),
        n_items=values.shape[0],
        n_raters=values.shape[1],
        n_ratings=int(rated.sum()),
        has_raters=has_raters,
    )
    if reason := _too_few(rated):
        return replace(blank, reason=reason)
    middle = 0.5 * np.nanmin(values) + 0.5 * np.nanmax(values)
    centred = np.where(rated, values - middle, 0.0)
    if not centred.any():
        return replace(blank, items=0.0, raters=0.0, residual=0.0)
    # by a power of two, so that squares are floats
    unit = math.ldexp(1.0, int(np.frexp(np.abs(centred).max())[1]))
    centred = centred / unit
    blank = replace(blank, unit=unit)
    fixed = _fixed(centred, rated, has_raters)
    if fixed.df < 1:
        what = "raters" if has_raters else "items"
        return replace(
            blank, reason=f"too few ratings to tell {what} from the residual"
        )
    if fixed.squares <= _EXACT * float((centred**2).sum()):
        return _without_residual(blank, centred, rated, fixed)
    sums = _sums(centred, rated, fixed)
    ratios = _maximum(sums, fixed.df / fixed.squares, has_raters)
    return _estimated(blank, sums, ratios, has_raters)


def _in_order(values: _Floats) -> _Floats:
    # Rated raters by what they gave, so that the order in which they came makes no
    # difference to the last digit.
    values = rated_part(values)
    if not values.size:
        return values
    rated = ~np.isnan(values)
    known = np.where(rated, values - np.nanmin(values), 0.0)
    known = np.ldexp(known, -int(np.frexp(known.max())[1]))  # squares are then floats
    keys = [(known**2).sum(axis=0), known.sum(axis=0), rated.sum(axis=0)]
    return np.asarray(values[:, np.lexsort(keys)])


def _too_few(rated: NDArray[np.bool_]) -> str | None:
    if rated.shape[0] < 2:
        return "fewer than two items are rated"
    if rated.shape[1] < 2:
        return "fewer than two raters"
    if not (rated.sum(axis=1) > 1).any():
        return "no item has two ratings"
    return None


class _Fixed(NamedTuple):
    # ratings with items, and with raters where these are told, as fixed effects
    laplacian: _Floats  # (k, k): of raters who are linked by items
    levels: _Floats  # (k,): of raters, 0 where they are not told
    within: _Floats  # (k,): what is left of their ratings
    squares: float  # residual sum of squares
    df: int
    is_linked: bool


def _fixed(centred: _Floats, rated: NDArray[np.bool_], has_raters: bool) -> _Fixed:
    weight = rated / rated.sum(axis=1)[:, None]
    laplacian = np.diag(rated.sum(axis=0).astype(float)) - rated.T @ weight
    means = (weight * centred).sum(axis=1)
    rest = np.where(rated, centred - means[:, None], 0.0)
    within, levels = rest.sum(axis=0), np.zeros(rated.shape[1])
    rank = 0
    if has_raters:
        levels, *_ = np.linalg.lstsq(laplacian, within, rcond=1e-10)
        within = np.zeros(len(levels))
        tol = 1e-10 * rated.sum()
        rank = int(np.linalg.matrix_rank(laplacian, tol=tol, hermitian=True))
        rest -= np.where(rated, levels - (weight @ levels)[:, None], 0.0)
    return _Fixed(
        laplacian=laplacian,
        levels=levels,
        within=within,
        squares=float((rest**2).sum()),
        df=int(rated.sum()) - len(rated) - rank,
        is_linked=rank == len(levels) - 1,
    )


def _without_residual(
    blank: Components, centred: _Floats, rated: NDArray[np.bool_], fixed: _Fixed
) -> Components:
    # items and raters are then known but for a constant, and their variances simple
    levels, none = fixed.levels, _EXACT * float((centred**2).sum())
    if float(levels @ fixed.laplacian @ levels) <= none:
        levels = np.zeros(len(levels))
    elif not fixed.is_linked:
        return replace(blank, reason="no residual, and raters whom no item links")
    rest = np.where(rated, centred - levels, 0.0).sum(axis=1) / rated.sum(axis=1)
    of_items, of_raters = float(rest.var(ddof=1)), float(levels.var(ddof=1))
    if of_items <= none:
        of_items = 0.0
    return replace(blank, items=of_items, raters=of_raters, residual=0.0)


def _sums(centred: _Floats, rated: NDArray[np.bool_], fixed: _Fixed) -> _Sums:
    sizes, k = rated.sum(axis=1), rated.shape[1]
    axes, _ = np.linalg.qr(np.column_stack([np.ones(k), np.eye(k)[:, 1:]]))
    rest = np.where(rated, centred - fixed.levels, 0.0).sum(axis=1)
    z = np.column_stack([rated @ axes, rest, sizes, centred.sum(axis=1)])
    met = np.unique(sizes)
    of_size = [z[sizes == size] for size in met]
    laplacian = axes.T @ fixed.laplacian @ axes
    laplacian[0] = laplacian[:, 0] = 0.0  # items have no mean of raters within
    levels = axes.T @ np.column_stack([np.ones(k), fixed.levels])
    within = np.zeros((k + 1, k + 3))
    within[:k, :k] = laplacian
    within[:k, k] = within[k, :k] = axes.T @ fixed.within
    within[:, k + 2] = within[:, k]
    within[:k, k + 2] += laplacian @ levels[:, 1]
    within[k, [k, k + 2]] = fixed.squares + np.array([0.0, fixed.within @ fixed.levels])
    return _Sums(
        sizes=met.astype(float),
        freq=np.array([float(len(items)) for items in of_size]),
        products=np.stack([(items[:, :-2].T @ items).ravel() for items in of_size]),
        within=within,
        levels=levels,
        n_ratings=int(sizes.sum()),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Point:
    # The deviance, -2 log of the restricted likelihood, at two ratios of variances: of
    # items and of raters to the residual.
    deviance: float
    squares: float  # y' P y, the residual variance times n_ratings - 1
    # of its two parts, the logarithms of determinants and of squares
    slopes: _Floats  # (2, 2): part, ratio
    curvatures: _Floats  # (2, 2, m): part, ratio, way


def _point(sums: _Sums, ratios: _Floats, ways: _Floats) -> _Point:
    """Return the deviance, its slopes, and how these change in some ways."""
    # the ratios (2,), and m ways from there, (2, m)
    bent = ratios + 1j * _TINY * ways.T if ways.size else ratios[None]
    there = solved(sums, bent)
    slopes = there.slopes()
    return _Point(
        deviance=float(there.deviances[0]),
        squares=float(there.squares[0].real),
        slopes=slopes[0].real,
        curvatures=np.moveaxis(slopes.imag, 0, -1) / _TINY,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Solved:
    """The deviance at m ratios, real or complex, and what its slopes are made from."""

    sums: _Sums
    ratios: NDArray[Any]  # (m, 2)
    deviances: _Floats  # (m,)
    squares: NDArray[Any]  # (m,): y' P y
    of_mean: NDArray[Any]  # (m,): μ' V⁻¹ μ
    mean: NDArray[Any]  # (m,)
    # (m, k + 1, k + 3): Z' W Z, where W is the inverse variance of items and residual
    z: NDArray[Any]
    between: NDArray[Any]  # (m, k, k): I + ratio of raters times Z' W Z
    inverse: NDArray[Any] | None  # of that, if there are slopes for sure
    left: NDArray[Any]  # (m, k + 1, 2): V⁻¹ (μ, y), by raters

    def slopes(self) -> NDArray[Any]:
        """Return those of the logarithms of determinants and of squares."""
        # (m, 2, 2): part, ratio
        sums, k = self.sums, len(self.sums.levels)
        of_items, of_raters = self.ratios.T[:, :, None]
        shrink = 1.0 + of_items * sums.sizes
        inverse = _inverse(self.between) if self.inverse is None else self.inverse
        # of Z' W Z in the ratio of items
        z_a = _weighted(-(shrink**-2), sums.products)
        z_a = z_a.reshape(self.z.shape)[..., : k + 1]
        right = inverse @ self.z[:, :k, k + 1 :]
        # of μ' V⁻¹ μ, and of y' P y, which is that of y less its mean
        left = self.left.copy()
        left[..., 1] -= self.mean[:, None] * left[..., 0]
        right[..., 1] -= self.mean[:, None] * right[..., 0]
        slopes = np.empty((len(self.ratios), 2, 2), dtype=self.z.dtype)
        slopes[..., 0] = (z_a @ left * left).sum(axis=1)
        slopes[..., 1] = -(right**2).sum(axis=1)
        slopes[:, 0] /= self.of_mean[:, None]
        slopes[:, 1] *= (sums.n_ratings - 1) / self.squares[:, None]
        slopes[:, 0, 0] += (sums.freq * sums.sizes / shrink).sum(axis=1)
        transposed = inverse.mT
        traces = (transposed * z_a[:, :k, :k]).sum(axis=(1, 2))
        slopes[:, 0, 0] += of_raters[:, 0] * traces
        slopes[:, 0, 1] += (transposed * self.z[:, :k, :k]).sum(axis=(1, 2))
        return slopes


def solved(sums: _Sums, ratios: NDArray[Any]) -> _Solved:
    """Return the deviance at ratios (m, 2), without its slopes as yet."""
    m, k = len(ratios), len(sums.levels)
    of_items, of_raters = ratios.T[:, :, None]  # (m, 1) each
    shrink = 1.0 + of_items * sums.sizes
    weights = 1.0 / (sums.sizes * shrink)
    z = _weighted(weights, sums.products).reshape(m, k + 1, k + 3)
    z = z + sums.within
    between = np.eye(k) + of_raters[..., None] * z[:, :k, :k]
    # by Woodbury's formula: s = (μ, y)' V⁻¹ (μ, y)
    left = np.empty((m, k + 1, 2), dtype=z.dtype)
    left[:, :k] = sums.levels
    left[:, :k, 1] -= of_raters * z[:, :k, k]
    one, inverse = between, None
    if np.iscomplexobj(between):
        one, inverse = between[:1].real, _inverse(between)  # ways from one point
        left[:, :k] = inverse @ left[:, :k]
    else:
        left[:, :k] = np.linalg.solve(between, left[:, :k])
    left[:, k] = 0.0, 1.0
    s = left.mT @ z[..., k + 1 :]
    of_mean, mean = s[:, 0, 0], s[:, 0, 1] / s[:, 0, 0]
    squares = s[:, 1, 1] - mean * s[:, 0, 1]
    df = sums.n_ratings - 1
    deviances = (
        np.log(shrink.real) @ sums.freq
        + np.linalg.slogdet(one)[1]
        + np.log(of_mean.real)
        # not above 0 where raters are so far from the likeliest that all is rounding
        + df * np.log(np.where(squares.real > 0.0, squares.real, np.inf))
    )
    return _Solved(
        sums=sums,
        ratios=ratios,
        deviances=deviances,
        squares=squares,
        of_mean=of_mean,
        mean=mean,
        z=z,
        between=between,
        inverse=inverse,
        left=left,
    )


def _inverse(between: NDArray[Any]) -> NDArray[Any]:
    # (m, k, k); imaginary parts are steps from one point, of which squares are nothing
    if not np.iscomplexobj(between):
        return np.linalg.inv(between)
    real = np.linalg.inv(between[0].real)
    return np.asarray(real - 1j * (real @ between.imag @ real))


def _weighted(weights: NDArray[Any], products: _Floats) -> NDArray[Any]:
    # weights @ products, of which no complex copy is made
    if not np.iscomplexobj(weights):
        return weights @ products
    return weights.real @ products + 1j * (weights.imag @ products)


def lowest(
    sums: _Sums, base: _Floats, way: _Floats, x: _Floats
) -> tuple[_Floats, _Point]:
    """Return x, 0 or more, where the deviance of `base + way @ x` is lowest."""

    # base (2,), way (2, m), x (m,): the ratios are base + way @ x
    def at(x: _Floats) -> _Point:
        return _point(sums, base + way @ x, way)

    point = at(x)
    for _ in range(_STEPS):
        slopes = way.T @ point.slopes.sum(axis=0)
        lifted = (x == 0.0) & (slopes < 0.0)
        if lifted.any():  # the likelihood rises away from 0
            x = np.where(lifted, 1e-6 / sums.sizes.max(), x)
            point = at(x)
            slopes = way.T @ point.slopes.sum(axis=0)
        if not x.any():
            break
        step = _newton(slopes, way.T @ point.curvatures.sum(axis=0), x)
        if -(slopes * x) @ step < _LAST and (step >= _TO_ZERO).all():
            x = x * np.exp(step)
            break
        limit = point.deviance + 1e-13 * abs(point.deviance)
        for ahead in _ahead(x, step):
            there = at(ahead)
            if there.deviance <= limit:
                break
        else:  # no way down
            break
        x, point = ahead, there
    return x, point


def _newton(slopes: _Floats, curvatures: _Floats, x: _Floats) -> _Floats:
    # Newton's step of the logarithms, downhill whatever the curvature, 3 at most
    slopes = slopes * x
    curvatures = curvatures * np.outer(x, x) + np.diag(slopes)
    step, free = np.zeros(len(x)), x > 0.0
    bends, axes = np.linalg.eigh(curvatures[np.ix_(free, free)])
    floor = 1e-12 * max(1.0, float(np.abs(bends).max()))
    step[free] = -axes @ ((axes.T @ slopes[free]) / np.maximum(np.abs(bends), floor))
    return np.asarray(step / max(1.0, float(np.abs(step).max()) / 3.0))


def _ahead(x: _Floats, step: _Floats) -> Iterator[_Floats]:
    # where the step leads, as far as it goes and ever less far
    if (step < _TO_ZERO).any():
        yield np.where(step < _TO_ZERO, 0.0, x)
    for halvings in range(40):
        yield x * np.exp(step * 0.5**halvings)


def _maximum(sums: _Sums, precision: float, has_raters: bool) -> _Floats:
    """Return the ratios, of items and raters to the residual, of highest likelihood."""
    # from the best of a grid
    grid = np.concatenate([[0.0], np.geomspace(1e-3, 30.0 * max(1.0, precision), 6)])
    others = grid if has_raters else np.zeros(1)
    starts = np.array([(a, b) for a in grid for b in others])
    start = starts[np.argmin(solved(sums, starts).deviances)]
    way = np.eye(2)[:, : 1 + has_raters]
    x, _ = lowest(sums, np.zeros(2), way, start @ way)
    return way @ x


def _estimated(
    blank: Components, sums: _Sums, ratios: _Floats, has_raters: bool
) -> Components:
    """Return the components with their covariance."""
    point = _point(sums, ratios, np.eye(2))
    residual = point.squares / (sums.n_ratings - 1)
    # tr(P V_i P V_j) of items, raters and residual: P V P = P gives those of the last
    # from slopes and curvatures of the determinants
    traces = np.empty((3, 3))
    slopes = point.slopes[0]
    traces[:2, :2] = -point.curvatures[0]
    traces[2, :2] = traces[:2, 2] = slopes - traces[:2, :2] @ ratios
    trace = sums.n_ratings - 1 - ratios @ slopes
    traces[2, 2] = trace - ratios @ traces[:2, 2]
    rows = [0, 1, 2] if has_raters else [0, 2]
    covariance = np.zeros((3, 3))
    covariance[np.ix_(rows, rows)] = np.linalg.inv(0.5 * traces[np.ix_(rows, rows)])
    return replace(
        blank,
        items=float(ratios[0]) * residual,
        raters=float(ratios[1]) * residual,
        residual=residual,
        covariance=covariance * residual**2,
        fit=Fit(sums=sums, ratios=ratios, deviance=point.deviance),
    )
