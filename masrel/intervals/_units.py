"""What a bootstrap draws: items, clusters of items, or raters, and how each matters."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import cast

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.intervals._clusters import ClusterSums, clusters_of
from masrel.intervals._lattice import Lattice, lattice_of
from masrel.intervals._problem import Integers, IntervalProblem, blocks, warn_small

_MAX_SORTED = 2_000  # rows that are sorted column by column
_STEP = 1e-30  # of the imaginary part: its square is nothing beside 1
_JUMP = 1e-9  # further than a value moves with so small a step, unless it jumps
_NO_SPREAD = 1e-9  # of the standard error of the estimate: rounding, not spread


@dataclass(frozen=True, kw_only=True)
class SamplingUnits:
    """Distinct units, of which as many are drawn as there are."""

    n: int  # how many there are, and are drawn
    # (n_units,): how often each is there, and its probability at a draw
    freq: Integers = field(compare=False, repr=False)
    shares: Floats = field(compare=False, repr=False)
    # (n_units, n_features): features of each; None for raters, who have no sum
    rows: Floats | None = field(compare=False, repr=False)
    # how often each is drawn, (..., n_units), to sums (..., n_features)
    sums: Callable[[Floats], Floats]
    # sums (..., n_features) to the coefficient (...), ``nan`` where undefined
    values: Callable[[Floats], Floats]
    notes: tuple[str, ...] = ()  # that they are few
    words: str = ""  # what they are, where a method does not say

    @cached_property
    def lattice(self) -> Lattice | None:
        """The rows as points of a lattice; None where they are none."""
        if self.rows is None:
            return None
        return lattice_of(self.rows, self.shares, self.n)

    def of_counts(self, counts: Floats) -> Floats:
        """Return the coefficient of resamples."""
        # counts (n_resamples, n_units) -> (n_resamples,)
        return self.values(self.sums(counts))

    def influence(self, counts: Floats) -> Floats:
        """Return how fast the coefficient moves with one more of each unit."""
        # counts (n_resamples, n_units) -> (n_resamples, n_units)
        # Items are moved along an orthogonal basis of their features, which has few
        # directions; raters one by one. Of a unit that is not drawn it may be ``nan``,
        # or no derivative at all.
        if self.rows is None:
            return _derivatives(self.of_counts, counts, np.eye(self.n))
        directions, along = self._directions
        sums = self.sums(counts)
        slopes = _derivatives(self.values, sums, directions) @ along
        # Where nobody has a feature, as a rater without a pair, a value may jump if the
        # least part of one is added: there, only along the rows that are drawn.
        bare = ((sums == 0.0) & self.rows.any(axis=0)).any(axis=-1)
        if bare.any():
            slopes[bare] = _derivatives(self.values, sums[bare], self.rows)
        return slopes

    @cached_property
    def _directions(self) -> tuple[Floats, Floats]:
        # an orthogonal basis of the rows less their mean, (n_directions, n_features),
        # and the rows in it, (n_directions, n_units)
        rows = cast("Floats", self.rows)
        centred = rows - self.shares @ rows
        is_tall = centred.shape[0] > centred.shape[1]
        root = np.linalg.qr(centred, mode="r") if is_tall else centred
        _, sizes, basis = np.linalg.svd(root, full_matrices=False)
        basis = basis[sizes > 1e-10 * max(float(sizes[0]), 1.0)]
        return basis, np.asarray(basis @ centred.T)

    def standard_errors(self, counts: Floats) -> Floats:
        """Return the delta-method standard error of each resample, (n_resamples,)."""
        slopes = self.influence(counts)
        slopes = np.where(counts > 0.0, slopes, 0.0)  # those not drawn have no part
        mean = (counts * slopes).sum(axis=-1, keepdims=True) / self.n
        return np.asarray(np.sqrt((counts * (slopes - mean) ** 2).sum(axis=-1)))

    def studentized(self, counts: Floats, value: float, error: float) -> Floats:
        """Return how many of its own standard errors each resample is off."""
        # of an estimate and its standard error; -> (n_resamples,)
        off = self.of_counts(counts) - value
        errors = self.standard_errors(counts)
        has_none = errors <= _NO_SPREAD * error
        ratio = off / np.where(has_none, 1.0, errors)
        is_same = np.abs(off) <= _NO_SPREAD * error
        infinite = np.where(is_same, 0.0, np.copysign(np.inf, off))
        return np.where(has_none & ~np.isnan(off), infinite, ratio)

    def acceleration(self) -> float:
        """Return a sixth of the skewness of the estimate with one unit left out."""
        if self.rows is not None:
            values = self.values(self.freq @ self.rows - self.rows)
        else:
            values = self.of_counts(self.freq - np.eye(self.freq.size))
        is_defined = ~np.isnan(values)
        values, freq = values[is_defined], self.freq[is_defined]
        if values.size == 0:
            return 0.0
        deviations = freq @ values / freq.sum() - values
        squares = float(freq @ deviations**2)
        if squares <= 0.0:
            return 0.0
        return float(freq @ deviations**3 / (6.0 * squares**1.5))


def _derivatives(
    values: Callable[[Floats], Floats], at: Floats, directions: Floats
) -> Floats:
    """Return derivatives of values along directions, (..., n_directions)."""
    # The derivative of an analytic f at x is the imaginary part of f(x + ih) / h, to
    # the last digits, because nothing is subtracted [1]_. What takes floats here takes
    # complex numbers, too.
    # [1] Squire, W., Trapp, G. (1998). Using complex variables to estimate derivatives
    # of real functions. SIAM Review, 40(1), 110-112.
    # https://doi.org/10.1137/S003614459631241X
    slopes = np.empty((*at.shape[:-1], len(directions)))
    plain = values(at)
    with np.errstate(invalid="ignore", divide="ignore"):  # undefined ones
        for k, along in enumerate(directions):
            moved = values(cast("Floats", at + 1j * _STEP * along))
            jumps = np.abs(moved.real - plain) > _JUMP
            slopes[..., k] = np.where(jumps, np.nan, moved.imag / _STEP)
    return slopes


@dataclass(frozen=True, slots=True, kw_only=True)
class CrossedUnits:
    """Items and raters, of which as many are drawn as there are, by themselves."""

    # Owen (2007): a rating is there as often as its item and its rater together.
    items: SamplingUnits
    raters: SamplingUnits
    # how often each is drawn, (n, n_patterns) and (n, n_raters), to values (n,)
    of_both: Callable[[Floats, Floats], Floats]
    width: int  # numbers that one resample takes
    notes: tuple[str, ...]  # that items or raters are few
    words: str = " of items and raters"

    def acceleration(self) -> float:
        """Return a sixth of the skewness of a sum of what items and raters move."""
        # of independent samples, with l/n ≈ (n - 1)/n (mean - value without one)
        # [Efron and Tibshirani (1993), (14.15), for one]
        cubes = squares = 0.0
        items, raters = self.items.freq.astype(float), np.ones(self.raters.n)
        without = (
            (items - np.eye(items.size), np.tile(raters, (items.size, 1)), items),
            (np.tile(items, (raters.size, 1)), raters - np.eye(raters.size), raters),
        )
        for of_items, of_raters, freq in without:
            values = self.of_both(of_items, of_raters)
            known = ~np.isnan(values)
            values, freq = values[known], freq[known]
            n = freq.sum()
            if n > 0:
                moves = (n - 1.0) / n * (freq @ values / n - values)
                cubes += float(freq @ moves**3)
                squares += float(freq @ moves**2)
        return cubes / (6.0 * squares**1.5) if squares > 0.0 else 0.0


def sampling_units(
    problem: IntervalProblem, clusters: object
) -> SamplingUnits | CrossedUnits:
    """Return what is resampled, with a warning where there is little of it."""
    if clusters is not None:
        units, n_clusters = cluster_units(problem, clusters)
        return replace(units, notes=warn_small(n_clusters, 16, "clusters", units.n))
    drawn: SamplingUnits | CrossedUnits
    if problem.target == "items":
        drawn = row_units(problem, problem.rows, problem.freq)
    else:
        drawn = (rater_units if problem.target == "raters" else crossed_units)(problem)
    few: tuple[str, ...] = ()
    if problem.target != "raters":
        few += warn_small(problem.n_paired_items, 16, "items", problem.n_items)
    if problem.target != "items":
        few += warn_small(problem.n_paired_raters, 5, "raters", problem.n_raters)
    return replace(drawn, notes=few)


def crossed_units(problem: IntervalProblem) -> CrossedUnits:
    """Return items and raters, to be drawn both."""
    raters = rater_units(problem)  # or an error
    items = SamplingUnits(
        n=problem.n_items,
        freq=problem.freq,
        shares=np.asarray(problem.freq / max(problem.n_items, 1)),
        rows=None,
        sums=lambda counts: counts @ problem.rows,
        values=problem.values,
    )
    return CrossedUnits(
        items=items,
        raters=raters,
        of_both=problem.crossed_values(),
        width=problem.freq.size * (3 * len(problem.v) + 6) + raters.n,
        notes=(),
    )


def cluster_units(
    problem: IntervalProblem, clusters: object
) -> tuple[SamplingUnits, int]:
    """Return clusters of items, those alike together, and how many have a pair."""
    # Takes clusters (n_items,)
    sums = ClusterSums.of(problem, clusters_of(problem, clusters))
    rows = sums.sums[sums.known]
    units = row_units(problem, rows, np.ones(len(rows), dtype=np.int64))
    return replace(units, words=f" of {units.n} clusters"), sums.n_paired


def rater_units(problem: IntervalProblem) -> SamplingUnits:
    """Return the raters, of whom none is paired with a copy of itself."""
    sums = problem.rater_sums()
    n = problem.patterns.codes.shape[1]
    return SamplingUnits(
        n=n,
        freq=np.ones(n, dtype=np.int64),
        shares=np.full(n, 1.0 / n),
        rows=None,
        sums=sums,
        values=problem.values,
    )


def row_units(problem: IntervalProblem, rows: Floats, freq: Integers) -> SamplingUnits:
    """Return items or clusters with their features, those with equal ones together."""
    if len(rows) <= _MAX_SORTED:
        rows, kind = np.unique(rows, axis=0, return_inverse=True)
    else:
        rows, kind = _distinct_of_many(rows)
    freq = np.bincount(kind.ravel(), weights=freq).astype(np.int64)
    n = int(freq.sum())
    return SamplingUnits(
        n=n,
        freq=freq,
        shares=np.asarray(freq / n),
        rows=rows,
        sums=lambda counts: counts @ rows,
        values=problem.values,
    )


def _distinct_of_many(rows: Floats) -> tuple[Floats, Integers]:
    """Return the distinct rows, and which of them each row is."""
    # Equal rows have equal polynomials at any place; should different rows too, all
    # are compared column by column.
    key = np.zeros(len(rows))
    for column in rows.T:
        key = key * 0.7390851332151607 + column
    _, first, kind = np.unique(key, return_index=True, return_inverse=True)
    distinct = rows[first]
    if not all(
        np.array_equal(distinct[kind[block]], rows[block])
        for block in blocks(len(rows))
    ):
        distinct, kind = np.unique(rows, axis=0, return_inverse=True)
    return distinct, kind.ravel()
