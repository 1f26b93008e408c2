"""The distribution of sums of features over all resamples, equal sums together.

Three ways to the same probabilities: the n-th power of the transform of one draw;
adding one draw at a time; and, in `compositions`, every resample by itself.
"""

import bisect
import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import Floats
from masrel.intervals.resampling.lattice import Lattice
from masrel.intervals.resampling.numerators import Integers

__all__ = ["box", "line_of_sums", "merged_states", "transformed_states"]

Spectrum = NDArray[np.complex128]

_LEFT_OUT = 1e-12  # probability that may be lost at the far ends, or in rounding


def box(steps: Integers, shares: Floats, n: int) -> Integers:
    """Return the sides of a box that holds the sums but for a probability of 1e-12."""
    # steps (n_rows, n_dimensions), shares (n_rows,) -> (n_dimensions,)
    # By Bernstein's inequality a sum of n steps, each at most b from its mean and of
    # variance s², is t away from its own with probability at most 2 exp(-t² / (2 (n s²
    # + b t / 3))). Sums that far away are few where n is large.
    apart = steps - shares @ steps
    variance = n * (shares @ apart**2)
    most = np.abs(apart).max(axis=0)
    tail = math.log(4.0 * max(steps.shape[1], 1) / _LEFT_OUT)
    reach = most * tail / 3.0 + np.sqrt((most * tail / 3.0) ** 2 + 2 * variance * tail)
    whole = n * steps.max(axis=0) + 1
    return np.asarray(np.minimum(whole, 2 * np.ceil(reach).astype(np.int64) + 3))


def transformed_states(
    lattice: Lattice, shares: Floats, n: int
) -> tuple[Integers, Floats]:
    """Return all sums by Fourier's transform, whatever n."""
    # -> (n_states, n_dimensions), (n_states,)
    # Sums beyond the box come round to its other side; the box is so large that they do
    # not matter, and a residue stands for the sum that is nearest to the mean.
    if not lattice.steps.shape[1]:  # all rows are alike
        return np.zeros((1, 0), dtype=np.int64), np.ones(1)
    sides = [_smooth(int(side)) for side in box(lattice.steps, shares, n)]
    one = np.zeros(lattice.steps.max(axis=0) + 1)
    np.add.at(one, tuple(lattice.steps.T), shares)
    axes = tuple(range(len(sides)))
    spectrum = _power(np.fft.rfftn(one, s=sides, axes=axes), n)
    found = np.fft.irfftn(spectrum, s=sides, axes=axes).ravel()
    # What is below 0 is rounding, and so is what is above by as little.
    at = np.flatnonzero(found > max(_LEFT_OUT / found.size, -4.0 * float(found.min())))
    residues = np.column_stack(np.unravel_index(at, sides))
    least = _least(lattice.steps, shares, n, np.array(sides))
    return least + (residues - least) % sides, found[at]


def line_of_sums(scores: Integers, shares: Floats, n: int) -> tuple[int, Floats]:
    """Return the probabilities of sums of integers, one after the other."""
    # scores (n_rows,) -> (n_sums,)
    side = _smooth(int(box(scores[:, None], shares, n)[0]))
    spectrum = _power(np.fft.rfft(np.bincount(scores, weights=shares), side), n)
    found = np.fft.irfft(spectrum, side)
    least = int(_least(scores[:, None], shares, n, np.array([side]))[0])
    return least, np.roll(found, -(least % side))


def _least(steps: Integers, shares: Floats, n: int, sides: Integers) -> Integers:
    # (n_dimensions,): where a box around the mean begins, within what there is
    centre = np.rint(n * (shares @ steps)).astype(np.int64)
    last = np.maximum(n * steps.max(axis=0) + 1 - sides, 0)
    return np.asarray(np.clip(centre - sides // 2, 0, last), dtype=np.int64)


def merged_states(
    lattice: Lattice, shares: Floats, n: int, most: int
) -> tuple[Integers, Floats] | None:
    """Return all sums by adding one draw at a time, equal sums together."""
    # The number of sums of k rows in d dimensions is Σ_i h_i C(k + d - i, d), with h at
    # least 0 as a rule. So the number for n is no less than that for k times C(n + d,
    # d) / C(k + d, d), which tells early that there will be too many.
    sides = n * lattice.steps.max(axis=0) + 1
    if math.prod(map(int, sides)) >= 2**62:
        return None
    places = np.cumprod([1, *sides[:-1]])
    moves = lattice.steps @ places
    keys: Integers = np.zeros(1, dtype=np.int64)
    found: Floats = np.ones(1)
    d = len(sides)
    for k in range(1, n + 1):
        every, parts = (keys[:, None] + moves).ravel(), np.outer(found, shares).ravel()
        keys, kind = np.unique(every, return_inverse=True)
        if keys.size * math.comb(n + d, d) > most * math.comb(k + d, d):
            return None
        found = np.asarray(np.bincount(kind, weights=parts), dtype=np.float64)
    return keys[:, None] // places % sides, found


def _power(base: Spectrum, n: int) -> Spectrum:
    # by squaring: rounding grows with n, not with a logarithm and an exponential
    found = None
    while n:
        if n % 2:
            found = base.copy() if found is None else found * base
        n //= 2
        if n:
            base = base * base
    return np.ones_like(base) if found is None else found


def _smooth(least: int) -> int:
    # the next number with no prime factor above 5, which transforms fast
    known = _smooth_numbers()
    return known[bisect.bisect_left(known, least)]


@cache
def _smooth_numbers() -> list[int]:
    twos = [1 << power for power in range(32)]
    return sorted(
        two * 3**a * 5**b for two in twos for a in range(14) for b in range(9)
    )
