"""Variance components of ratings with gaps, by restricted maximum likelihood.

A rating is μ + item + rater + residual, all three random and normal. Items are
eliminated by formula, and those with as many ratings enter together as sums, so that
after one pass over the ratings a step costs what a few matrices of raters by raters do.
"""

import math
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]

_EXACT = 1e-24
"""Residual sum of squares, as a share of all, that is the rounding of a perfect fit."""

_STEPS = 100
"""Newton's steps; as a rule some eight."""

_CONVERGED = 1e-11
"""Relative step at which the components are what they are."""

_MANY = 100
"""Raters from which on the profile is taken to have one valley: looking costs much."""

_RATIOS = (0.0, *np.geomspace(1e-3, 1e3, 10))
"""Ratios of raters to the residual, among which the way down to a valley begins."""

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
    fit: "_Fit | None" = None  # None without residual
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
    # Sums over items with as many ratings; the last of each of the k + 1 rows and
    # columns is the ratings themselves.
    sizes: _Floats  # (g,): ratings of an item
    freq: _Floats  # (g,): items of that size
    # (g, (k + 1)²): Σ_i z_i z_i', where z_i are the sums over an item
    products: _Floats
    total: _Floats  # (k + 1, k + 1): the same of single ratings
    n_ratings: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Fit:
    # where the likelihood is highest: ratios (2,) of items and raters to the residual
    sums: _Sums
    ratios: _Floats
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
    squares, df = _residual(centred, rated, has_raters)
    if df < 1:
        what = "raters" if has_raters else "items"
        return replace(
            blank, reason=f"too few ratings to tell {what} from the residual"
        )
    if squares <= _EXACT * float((centred**2).sum()):
        return _without_residual(blank, centred, rated, has_raters)
    sums = _sums(centred, rated)
    ratios = _maximum(sums, 1.0 / (squares / df), has_raters)
    return _estimated(blank, sums, ratios, has_raters)


def rated_part(values: _Floats) -> _Floats:
    """Return the table without items and raters that have no rating."""
    rated = ~np.isnan(values)
    if rated.all():
        return values
    return np.asarray(values[np.ix_(rated.any(axis=1), rated.any(axis=0))])


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


def _residual(
    centred: _Floats, rated: NDArray[np.bool_], has_raters: bool
) -> tuple[float, int]:
    # sum of squares and its degrees of freedom with items, and raters, as fixed
    sizes = rated.sum(axis=1)
    means = centred.sum(axis=1) / sizes
    within = np.where(rated, centred - means[:, None], 0.0)
    squares, df = float((within**2).sum()), int(rated.sum()) - len(rated)
    if not has_raters:
        return squares, df
    weight = rated / sizes[:, None]
    # (k, k): the Laplacian of raters who are linked by items
    laplacian = np.diag(rated.sum(axis=0).astype(float)) - rated.T @ weight
    levels, *_ = np.linalg.lstsq(laplacian, within.sum(axis=0), rcond=1e-10)
    fitted = np.where(rated, levels - (weight @ levels)[:, None], 0.0)
    rank = np.linalg.matrix_rank(laplacian, tol=1e-10 * rated.sum(), hermitian=True)
    return float(((within - fitted) ** 2).sum()), df - int(rank)


def _without_residual(
    blank: Components, centred: _Floats, rated: NDArray[np.bool_], has_raters: bool
) -> Components:
    # items and raters are then known but for a constant, and their variances simple
    sizes = rated.sum(axis=1)
    items = centred.sum(axis=1) / sizes
    levels = np.zeros(rated.shape[1])
    within = np.where(rated, centred - items[:, None], 0.0)
    if has_raters and (within**2).sum() > _EXACT * (centred**2).sum():
        weight = rated / sizes[:, None]
        laplacian = np.diag(rated.sum(axis=0).astype(float)) - rated.T @ weight
        if np.linalg.matrix_rank(laplacian, hermitian=True) < len(levels) - 1:
            return replace(blank, reason="no residual, and raters whom no item links")
        levels, *_ = np.linalg.lstsq(laplacian, within.sum(axis=0), rcond=None)
        items = items - weight @ levels
    return replace(
        blank,
        items=float(items.var(ddof=1)),
        raters=float(levels.var(ddof=1)),
        residual=0.0,
    )


def _sums(centred: _Floats, rated: NDArray[np.bool_]) -> _Sums:
    sizes = rated.sum(axis=1)
    z = np.column_stack([rated.astype(float), centred.sum(axis=1)])  # (n, k + 1)
    met = np.unique(sizes)
    total = np.diag([*rated.sum(axis=0).astype(float), float((centred**2).sum())])
    total[-1, :-1] = total[:-1, -1] = centred.sum(axis=0)
    return _Sums(
        sizes=met.astype(float),
        freq=np.array([float((sizes == size).sum()) for size in met]),
        products=np.stack(
            [(z[sizes == size].T @ z[sizes == size]).ravel() for size in met]
        ),
        total=total,
        n_ratings=int(sizes.sum()),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Point:
    # The deviance, -2 log of the restricted likelihood, at two ratios of variances: of
    # items and of raters to the residual. With slopes (2,) and curvatures (2, 2), also
    # of its part that is a logarithm of determinants.
    deviance: float
    slopes: _Floats
    curvatures: _Floats
    determinant_slopes: _Floats
    determinant_curvatures: _Floats
    squares: float  # y' P y, the residual variance times n_ratings - 1


def _point(sums: _Sums, of_items: float, of_raters: float) -> _Point:
    """Return the deviance and its slopes."""
    n, freq = sums.sizes, sums.freq
    k = len(sums.total) - 1
    shrink = 1.0 + n * of_items
    # (k + 1, k + 1): Z' W Z and its slopes in the ratio of items, where Z has the
    # raters and the ratings, and W is the inverse variance of items and residual
    shares = np.array([-of_items / shrink, -(shrink**-2), 2.0 * n * shrink**-3])
    z, z1, z2 = (shares @ sums.products).reshape(3, k + 1, k + 1)
    z += sums.total
    a, a1, a2 = z[:k, :k], z1[:k, :k], z2[:k, :k]
    between = np.eye(k) + of_raters * a
    inverse = np.linalg.inv(between)
    # B = Z' V⁻¹ Z, with V⁻¹ by Woodbury's formula, and its slopes
    t = np.eye(k + 1)
    t[:, :k] -= of_raters * z[:, :k] @ inverse
    b = t @ z
    b = 0.5 * (b + b.T)
    bj = b.copy()
    bj[:, k] = 0.0  # B J: J leaves the ratings out
    b_a, b_b = t @ z1 @ t.T, -bj @ b
    t_a = np.zeros_like(t)
    t_a[:, :k] = -of_raters * b_a[:, :k]
    half = t_a @ z1 @ t.T
    b_aa = t @ z2 @ t.T + half + half.T
    half = bj @ b_a
    b_ab, b_bb = -(half + half.T), 2.0 * bj @ bj @ b
    e = np.zeros((k + 1, 2))
    e[:k, 0] = e[k, 1] = 1.0  # the raters' columns add up to that of μ
    s, s_a, s_b, s_aa, s_ab, s_bb = e.T @ np.array([b, b_a, b_b, b_aa, b_ab, b_bb]) @ e
    m_a1 = inverse @ a1
    slopes = np.array(
        [
            (freq * n / shrink).sum() + of_raters * np.trace(m_a1),
            np.trace(inverse @ a),
        ]
    )
    curve_ab = np.trace(m_a1 @ inverse)
    curvatures = np.array(
        [
            [
                -(freq * (n / shrink) ** 2).sum()
                + of_raters * np.trace(inverse @ a2)
                - of_raters**2 * np.trace(m_a1 @ m_a1),
                curve_ab,
            ],
            [curve_ab, -np.trace(b[:k, :k] @ b[:k, :k])],
        ]
    )
    _, log_det = np.linalg.slogdet(between)
    value = float((freq * np.log(shrink)).sum()) + float(log_det)
    # the fixed mean, and what is left of the ratings around it
    xx, x1 = s[0, 0], np.array([s_a[0, 0], s_b[0, 0]])
    x2 = np.array([[s_aa[0, 0], s_ab[0, 0]], [s_ab[0, 0], s_bb[0, 0]]])
    log_x1, log_x2 = x1 / xx, x2 / xx - np.outer(x1, x1) / xx**2
    slopes, curvatures = slopes + log_x1, curvatures + log_x2
    value += math.log(xx)
    mean = s[0, 1] / xx
    lean = np.array([-mean, 1.0])  # ratings less their mean
    squares = float(lean @ s @ lean)
    first = [s_a @ lean, s_b @ lean]
    q1 = np.array([lean @ f for f in first])
    q2 = np.array(
        [
            [
                lean @ second @ lean - 2.0 * first[i][0] * first[j][0] / xx
                for j, second in enumerate(row)
            ]
            for i, row in enumerate([[s_aa, s_ab], [s_ab, s_bb]])
        ]
    )
    df = sums.n_ratings - 1
    return _Point(
        deviance=value + df * math.log(squares),
        slopes=slopes + df * q1 / squares,
        curvatures=curvatures + df * (q2 / squares - np.outer(q1, q1) / squares**2),
        determinant_slopes=slopes,
        determinant_curvatures=curvatures,
        squares=squares,
    )


def _maximum(sums: _Sums, precision: float, has_raters: bool) -> _Floats:
    """Return the ratios, of items and raters to the residual, of highest likelihood."""
    ratios = _start(sums, precision, has_raters)
    point = _point(sums, *ratios)
    for _ in range(_STEPS):
        at_zero = ratios == 0.0
        lifted = at_zero & (point.slopes < 0.0) & np.array([True, has_raters])
        if lifted.any():  # the likelihood rises away from 0
            ratios = np.where(lifted, 1e-6 / sums.sizes.max(), ratios)
            point = _point(sums, *ratios)
            at_zero &= ~lifted
        if at_zero.all():
            break
        step = _newton(point, ratios, ~at_zero)
        following, ahead = _along(sums, ratios, point, step)
        if ahead is None or np.abs(step).max() < _CONVERGED:
            break
        ratios, point = following, ahead
    return ratios


def _newton(point: _Point, ratios: _Floats, free: NDArray[np.bool_]) -> _Floats:
    # Newton's step of the logarithms, downhill whatever the curvature
    slopes = point.slopes * ratios
    curvatures = point.curvatures * np.outer(ratios, ratios) + np.diag(slopes)
    step = np.zeros(2)
    bends, axes = np.linalg.eigh(curvatures[np.ix_(free, free)])
    floor = 1e-12 * max(1.0, float(np.abs(bends).max()))
    step[free] = -axes @ ((axes.T @ slopes[free]) / np.maximum(np.abs(bends), floor))
    return np.asarray(step / max(1.0, float(np.abs(step).max()) / 3.0))


def _along(
    sums: _Sums, ratios: _Floats, point: _Point, step: _Floats
) -> tuple[_Floats, _Point | None]:
    # the first of ever shorter steps that does not lower the likelihood, or None
    if (step < _TO_ZERO).any():
        following = np.where(step < _TO_ZERO, 0.0, ratios)  # as far as it goes
        ahead = _point(sums, *following)
        if ahead.deviance <= point.deviance:
            return following, ahead
    for halvings in range(40):
        following = ratios * np.exp(step * 0.5**halvings)
        ahead = _point(sums, *following)
        if ahead.deviance <= point.deviance + 1e-13 * abs(point.deviance):
            return following, ahead
    return ratios, None


def _start(sums: _Sums, precision: float, has_raters: bool) -> _Floats:
    # the best of a grid
    grid = np.concatenate([[0.0], np.geomspace(1e-3, 30.0 * max(1.0, precision), 12)])
    others = grid if has_raters else np.zeros(1)
    at = _deviances(sums, grid, others)
    of_items, of_raters = np.unravel_index(np.argmin(at), at.shape)
    return np.array([grid[of_items], others[of_raters]])


def _deviances(sums: _Sums, of_items: _Floats, of_raters: _Floats) -> _Floats:
    # (m, l): the deviance at m ratios of items and l of raters
    shrink = 1.0 + np.outer(of_items, sums.sizes)
    z = sums.total - (of_items[:, None] / shrink @ sums.products).reshape(
        -1, *sums.total.shape
    )
    levels, axes = np.linalg.eigh(z[:, :-1, :-1])
    levels = np.maximum(levels, 0.0)[:, None]  # (m, 1, k)
    ones = axes.sum(axis=1)[:, None]
    ratings = z[:, None, -1, :-1] @ axes  # (m, 1, k)
    stretch = 1.0 + of_raters[:, None] * levels  # (m, l, k)
    xx = (ones**2 * levels / stretch).sum(axis=-1)
    xy = (ones * ratings / stretch).sum(axis=-1)
    yy = z[:, -1, -1, None] - of_raters * (ratings**2 / stretch).sum(axis=-1)
    squares = np.maximum(yy - xy**2 / xx, np.finfo(float).tiny)
    return np.asarray(
        (np.log(shrink) @ sums.freq)[:, None]
        + np.log(stretch).sum(axis=-1)
        + np.log(xx)
        + (sums.n_ratings - 1) * np.log(squares)
    )


def _estimated(
    blank: Components, sums: _Sums, ratios: _Floats, has_raters: bool
) -> Components:
    """Return the components with their covariance."""
    point = _point(sums, *ratios)
    residual = point.squares / (sums.n_ratings - 1)
    # tr(P V_i P V_j) of items, raters and residual: P V P = P gives those of the last
    # from slopes and curvatures of the determinants
    traces = np.empty((3, 3))
    traces[:2, :2] = -point.determinant_curvatures
    traces[2, :2] = traces[:2, 2] = point.determinant_slopes - traces[:2, :2] @ ratios
    trace = sums.n_ratings - 1 - ratios @ point.determinant_slopes
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
        fit=_Fit(sums=sums, ratios=ratios, deviance=point.deviance),
    )


def icc_ends(
    components: Components, *, absolute: bool, level: float
) -> tuple[float, float]:
    """Return the ends of the interval of a single rating's intraclass correlation."""
    # absolute: whether the variance of raters counts as error
    fit = components.fit
    if fit is None:
        return _ends_without_residual(components, absolute, level)
    profile = _Profile(
        fit=fit,
        absolute=absolute,
        has_raters=components.has_raters,
        last=float(fit.ratios[1]),
    )
    height = NormalDist().inv_cdf(0.5 + 0.5 * level)
    low, high = profile.end(height, -1.0), profile.end(height, 1.0)
    return low, high


def _ends_without_residual(
    components: Components, absolute: bool, level: float
) -> tuple[float, float]:
    # of two variances that are known but for their degrees of freedom
    if not absolute or components.raters == 0.0:
        return 1.0, 1.0
    from scipy.special import fdtri

    of_items, of_raters = components.n_items - 1, components.n_raters - 1
    upper = 0.5 + 0.5 * level
    ratio = components.items / components.raters
    low = ratio / float(fdtri(of_items, of_raters, upper))
    high = ratio * float(fdtri(of_raters, of_items, upper))
    return low / (1.0 + low), high / (1.0 + high)


@dataclass(slots=True, kw_only=True)
class _Profile:
    # The highest likelihood of each intraclass correlation ρ, by its logit: the log
    # ratio of items to error.
    fit: _Fit
    absolute: bool
    has_raters: bool
    last: float  # ratio of raters that was likeliest last

    def end(self, height: float, side: float) -> float:
        """Return ρ where the root of the deviance above the least is so high."""
        of_items, raters = self.fit.ratios
        best = of_items / (1.0 + raters * self.absolute)
        if side < 0.0 and self._root(-math.inf)[0] <= height:
            return 0.0
        # from where the likelihood is highest, outwards until it is low enough
        inner = math.log(best) if best > 0.0 else -math.inf
        step = 1.0
        outer = (inner if best > 0.0 else math.log(1e-3)) + side * step
        root, slope = self._root(outer)
        while root < height:
            inner, step = outer, 2.0 * step
            outer += side * step
            root, slope = self._root(outer)
        return self._between(inner, outer, root, slope, height, side)

    def _between(
        self,
        inner: float,
        outer: float,
        root: float,
        slope: float,
        height: float,
        side: float,
    ) -> float:
        # Newton's steps, and halves where they leave the bracket
        at = outer
        for _ in range(60):
            following = at - (root - height) / slope if slope else math.nan
            if not min(inner, outer) < following < max(inner, outer):
                following = (
                    0.5 * (inner + outer) if math.isfinite(inner) else outer - side
                )
            if abs(following - at) < 1e-7:  # the next would be some 1e-14
                at = following
                break
            at = following
            root, slope = self._root(at)
            inner, outer = (inner, at) if root >= height else (at, outer)
        return 1.0 / (1.0 + math.exp(-at))

    def _root(self, logit: float) -> tuple[float, float]:
        # √(deviance - least) and its slope, whatever raters are likeliest
        odds = math.exp(logit)
        ratio = self._start(odds)
        point = self._at(odds, ratio)
        for _ in range(_STEPS if self.has_raters else 0):
            lean, bend = self._along_raters(point, odds)
            if ratio == 0.0:
                if lean >= 0.0:
                    break
                ratio = 1e-6 / self.fit.sums.sizes.max()
                point = self._at(odds, ratio)
                continue
            step = -lean * ratio / max(abs(bend * ratio**2 + lean * ratio), 1e-12)
            if abs(step) < 1e-6:  # which moves the deviance by its square
                break
            ahead, point = self._shorter(odds, ratio, point, step)
            if ahead == ratio:
                break
            ratio = ahead
        self.last = ratio
        above = math.sqrt(max(point.deviance - self.fit.deviance, 0.0))
        slope = point.slopes[0] * self._of_items(odds, ratio)
        return above, slope / (2.0 * above) if above else 0.0

    def _start(self, odds: float) -> float:
        # the best of some ratios of raters: there may be more than one valley
        if not self.has_raters or len(self.fit.sums.total) > _MANY:
            return self.last
        grid = np.array([*_RATIOS, self.last])
        if self.absolute:
            heights = np.diag(_deviances(self.fit.sums, odds * (1.0 + grid), grid))
        else:
            heights = _deviances(self.fit.sums, np.array([odds]), grid)[0]
        return float(grid[np.argmin(heights)])

    def _of_items(self, odds: float, ratio: float) -> float:
        return odds * (1.0 + ratio * self.absolute)

    def _at(self, odds: float, ratio: float) -> _Point:
        return _point(self.fit.sums, self._of_items(odds, ratio), ratio)

    def _along_raters(self, point: _Point, odds: float) -> tuple[float, float]:
        way = np.array([odds * self.absolute, 1.0])
        return float(way @ point.slopes), float(way @ point.curvatures @ way)

    def _shorter(
        self, odds: float, ratio: float, point: _Point, step: float
    ) -> tuple[float, _Point]:
        # the first of ever shorter steps that does not lower the likelihood
        steps = [max(-3.0, min(3.0, step)) * 0.5**i for i in range(30)]
        for factor in [0.0] * int(step < _TO_ZERO) + [math.exp(x) for x in steps]:
            ahead = self._at(odds, ratio * factor)
            if ahead.deviance <= point.deviance + 1e-13 * abs(point.deviance):
                return ratio * factor, ahead
        return ratio, point
