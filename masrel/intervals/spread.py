"""How much an estimate moves when items or raters are left out, one at a time."""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import Floats
from masrel.errors import ParameterError
from masrel.intervals.case import Case
from masrel.intervals.features import blocks, features_of
from masrel.intervals.samples import warn_small

__all__ = ["Spread", "excess_of_raters", "jackknife_variance", "spread", "without_item"]

Integers = NDArray[np.int64]

_UNITS = {"items": ("items",), "raters": ("raters",), "both": ("items", "raters")}


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """How much an estimate moves when units are left out."""

    variance: float  # the jackknife's; ``nan`` when undefined
    df: float  # its degrees of freedom, Satterthwaite's for "both"
    notes: tuple[str, ...] = ()  # what is small
    reason: str | None = None  # why it makes no interval, or None


def spread(case: Case) -> Spread:
    """Leave out items, raters, or both, as the target says."""
    if np.isnan(case.value):
        reason = "the estimate itself is undefined"
        return Spread(variance=np.nan, df=np.nan, reason=reason)
    parts: list[tuple[float, int]] = []
    notes: tuple[str, ...] = ()
    units = _UNITS[case.target]
    for unit in units:
        replicates, times = (without_item if unit == "items" else _without_rater)(case)
        if np.isnan(replicates).any():
            reason = f"with one of the {unit} left out the estimate is undefined"
            return Spread(variance=np.nan, df=np.nan, reason=reason)
        n = int(times.sum())
        parts.append((jackknife_variance(replicates, times), n - 1))
        notes += warn_small(n, 10 if unit == "items" else 5, unit)
    variance = sum(part for part, _ in parts)
    if not variance > 0.0:
        reason = (
            f"leaving out any of the {' or '.join(units)} leaves the estimate as it "
            "is, so the jackknife cannot say how uncertain it is"
        )
        return Spread(variance=0.0, df=np.nan, notes=notes, reason=reason)
    df = variance**2 / sum(part**2 / n for part, n in parts)  # Satterthwaite [2]
    return Spread(variance=variance, df=df, notes=notes)


def jackknife_variance(replicates: Floats, times: Integers) -> float:
    """Return the jackknife's variance of an estimate."""
    # Takes replicates (n_distinct,), times (n_distinct,)
    n = int(times.sum())
    moved = replicates - replicates[0]  # so that no change at all is exactly 0
    deviations = moved - times @ moved / n
    return float((n - 1) / n * (times @ deviations**2))


def without_item(case: Case) -> tuple[Floats, Integers]:
    """Return the estimate without an item of each pattern, and how many there are."""
    if case.n_items < 2:
        return np.full(1, np.nan), np.ones(1, dtype=np.int64)
    return _values_without(case, case.sums, case.rows), case.times


def _values_without(case: Case, sums: Floats, rows: Floats) -> Floats:
    # sums without an item are the total less its features; (n_patterns,)
    parts = [case.values(sums - rows[items]) for items in blocks(len(rows))]
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def excess_of_raters(case: Case) -> float:
    """Return what raters differ by beyond single ratings."""
    # max(0, V_R - V_C), with V_R the jackknife variance over raters and V_C that of
    # leaving out a rater on an item, (n - 1)(r - 1)/(n r) Σ_ij (κ_-i-j - κ_-i - κ_-j +
    # κ)². 0 where undefined.
    without, n = _values_without(case, case.sums, case.rows), case.n_items
    raters, cells = [], 0.0
    for rows in _rows_without_each_rater(case):
        sums = case.times @ rows
        raters.append(float(case.values(sums)))
        own = _values_without(case, sums, rows) - without - raters[-1] + case.value
        cells += float(case.times @ own**2)
    r = len(raters)
    of_raters = jackknife_variance(np.array(raters), np.ones(r, dtype=np.int64))
    excess = of_raters - (n - 1) * (r - 1) / (n * r) * cells
    return max(0.0, excess) if np.isfinite(excess) else 0.0


def _without_rater(case: Case) -> tuple[Floats, Integers]:
    values = [case.values(case.times @ row) for row in _rows_without_each_rater(case)]
    return np.array(values, dtype=np.float64), np.ones(len(values), dtype=np.int64)


def _rows_without_each_rater(case: Case) -> Iterator[Floats]:
    # features are made anew, because pairs of raters go; each (n_patterns, n_features)
    width = 2 if case.entry.shape == "pairs" else 1  # columns of a rater
    codes = case.patterns.codes
    n_raters = codes.shape[1] // width
    fewest = 2 if width == 2 else 3
    if n_raters < fewest:
        raise ParameterError(
            f'target: "{case.target}" needs at least {fewest} raters, because one is '
            f"left out; got {n_raters}"
        )
    for rater in range(n_raters):
        rest = np.delete(codes, np.s_[rater * width : (rater + 1) * width], axis=1)
        left = dataclasses.replace(case.patterns, codes=rest)
        yield features_of(case.kernel, left, case.v)
