"""Sums of rows of features as points of a lattice, where equal sums are one point.

In: the distinct rows of a table, the probability of each at a draw, and how many are
drawn. Out: every sum there is with its probability, by the transform of one draw.
"""

import bisect
import math
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import Floats

Integers = NDArray[np.int64]
Spectrum = NDArray[np.complex128]

_MAX_INTEGER = 2.0**52  # integers up to it are floats, too
_MAX_DIMENSIONS, _MAX_ROWS = 12, 2_000  # a larger lattice has too many points to use
_MAX_REDUCTIONS = 50
_MAX_DENOMINATOR = 10**5  # numbers with larger ones are taken for irrational
_ROUNDING = 1e-13  # relative: a number as near to an integer is that integer
_LOST = 1e-12  # probability that may be lost far from the mean, or in rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class Lattice:
    """Rows as integer steps: a sum of n rows is n · origin + steps @ basis, exactly."""

    # (n_rows, n_dimensions): where each row is; the least of every coordinate is 0
    steps: Integers = field(compare=False, repr=False)
    # (n_features,): numerators of the features at 0
    origin: Integers = field(compare=False, repr=False)
    # (n_dimensions, n_features): what a step adds to the numerators
    basis: Integers = field(compare=False, repr=False)
    # (n_features,): what the numerators are divided by
    denominators: Floats = field(compare=False, repr=False)

    def sums(self, steps: Integers | Floats, n: int) -> Floats:
        """Return sums of features, (..., n_features), of sums of steps."""
        numerators: Floats = steps.astype(np.float64) @ self.basis.astype(np.float64)
        numerators += n * self.origin
        numerators /= self.denominators
        return numerators

    def bits(self, n: int) -> Integers:
        """Return the bits that hold each coordinate of a sum of n, (n_dimensions,)."""
        largest = (n * self.steps.max(axis=0)).tolist()
        return np.array([number.bit_length() for number in largest], dtype=np.int64)


def grid_of(rows: Floats, n: int) -> Lattice | None:
    """Take the numerators of the features themselves as steps."""
    fractions = _fractions(rows, n)
    if fractions is None:
        return None
    numerators, denominators = fractions
    least = numerators.min(axis=0)
    varying = np.flatnonzero(numerators.max(axis=0) - least)
    return Lattice(
        steps=numerators[:, varying] - least[varying],
        origin=least,
        basis=np.eye(least.size, dtype=np.int64)[varying],
        denominators=denominators,
    )


def lattice_of(rows: Floats, shares: Floats, n: int) -> Lattice | None:
    """Find the lattice of distinct rows, with steps that vary as little as can be."""
    # Takes rows (n_rows, n_features), shares (n_rows,)
    if len(rows) > _MAX_ROWS:
        return None
    fractions = _fractions(rows, n)
    if fractions is None:
        return None
    numerators, denominators = fractions
    basis = _echelon(numerators - numerators[0])
    if basis is None:
        return None
    steps = _reduce(_coordinates(numerators - numerators[0], basis), basis, shares)
    if np.abs(steps).max(initial=0) * max(n, 1) > _MAX_INTEGER:
        return None
    least = steps.min(axis=0)
    return Lattice(
        steps=steps - least,
        origin=numerators[0] + least @ basis,
        basis=basis,
        denominators=denominators,
    )


def _echelon(rows: Integers) -> Integers | None:
    """Return a basis of all integer sums of rows, in echelon form."""
    # (n_rows, n_features) -> (n_dimensions, n_features), by Euclid's algorithm on each
    # column in turn
    rest, top = rows.copy(), 0
    for column in range(rows.shape[1]):
        while (at := np.flatnonzero(rest[top:, column]) + top).size:
            if top == _MAX_DIMENSIONS or np.abs(rest).max() > _MAX_INTEGER:
                return None
            pivot = at[np.argmin(np.abs(rest[at, column]))]
            rest[[top, pivot]] = rest[[pivot, top]]
            if at.size == 1:
                top += 1
                break
            quotients = rest[top + 1 :, column] // rest[top, column]
            rest[top + 1 :] -= quotients[:, None] * rest[top]
    return rest[:top]


def _coordinates(rows: Integers, basis: Integers) -> Integers:
    """Return rows in a basis in echelon form, (n_rows, n_dimensions)."""
    rest = rows.copy()
    steps = np.zeros((len(rows), len(basis)), dtype=np.int64)
    for dimension, direction in enumerate(basis):
        pivot = np.flatnonzero(direction)[0]
        steps[:, dimension] = rest[:, pivot] // direction[pivot]
        rest -= steps[:, dimension, None] * direction
    return steps


def _reduce(steps: Integers, basis: Integers, shares: Floats) -> Integers:
    """Return steps whose coordinates vary less; the basis changes in place."""
    # Lagrange's reduction, pair by pair: coordinate j becomes itself less a multiple of
    # coordinate i, while that makes its variance smaller.
    centred = steps - shares @ steps
    covariance = ((centred * shares[:, None]).T @ centred).tolist()
    for _ in range(_MAX_REDUCTIONS):
        best = _best_reduction(covariance)
        if best is None:
            break
        j, i, multiple = best
        steps[:, j] -= multiple * steps[:, i]
        basis[i] += multiple * basis[j]
        for row in covariance:
            row[j] -= multiple * row[i]
        both = zip(covariance[j], covariance[i], strict=True)
        covariance[j] = [x - multiple * y for x, y in both]
    return steps


def _best_reduction(covariance: list[list[float]]) -> tuple[int, int, int] | None:
    """Return which coordinate loses most variance, less which multiple of which."""
    largest, best = 0.0, None
    for i, row in enumerate(covariance):
        for j, shared in enumerate(row):
            multiple = round(shared / row[i])
            if multiple and j != i:
                gain = multiple * (2.0 * shared - multiple * row[i])
                if gain > largest:
                    largest, best = gain, (j, i, multiple)
    return best


def _fractions(rows: Floats, n: int) -> tuple[Integers, Floats] | None:
    """Return rational numbers as integers over one denominator a column."""
    # (n_rows, n_features) -> (n_rows, n_features), (n_features,); None if some number
    # is irrational, or a sum of n numerators is no float
    denominators = np.ones(rows.shape[1])
    scaled = rows
    while True:
        nearest = np.rint(scaled)
        off = np.abs(scaled - nearest) > _ROUNDING * np.maximum(np.abs(scaled), 1)
        at = np.argmax(off, axis=0)
        columns = np.flatnonzero(off[at, np.arange(at.size)])
        if columns.size == 0:
            break
        for column in columns.tolist():
            denominators[column] *= _denominator(float(scaled[at[column], column]))
        if denominators.max() > _MAX_INTEGER:
            return None
        scaled = rows * denominators
    if np.abs(nearest).max() * max(n, 1) > _MAX_INTEGER:
        return None
    return nearest.astype(np.int64), denominators


def _denominator(number: float) -> float:
    """Return that of the first convergent of a continued fraction that is the number.

    Infinity if there is none up to the largest denominator.
    """
    rest, before, denominator = number - math.floor(number), 0, 1
    while denominator <= _MAX_DENOMINATOR:
        scaled = number * denominator
        if abs(scaled - round(scaled)) <= _ROUNDING * max(abs(scaled), 1.0):
            return float(denominator)
        rest = 1.0 / rest
        quotient = math.floor(rest)
        rest -= quotient
        before, denominator = denominator, quotient * denominator + before
    return math.inf


def box(steps: Integers, shares: Floats, n: int) -> Integers:
    """Return the sides of a box that holds sums of n steps but for 1e-12."""
    # steps (n_rows, n_dimensions), shares (n_rows,) -> (n_dimensions,)
    # Bernstein's inequality: a sum of n steps, each at most b from its mean and of
    # variance s², is t away from its mean with a probability of at most
    # 2 exp(-t² / (2 (n s² + b t / 3))). Where n is large most sums lie further away.
    deviations = steps - shares @ steps
    variance = n * (shares @ deviations**2)
    largest = np.abs(deviations).max(axis=0)
    tail = math.log(4.0 * max(steps.shape[1], 1) / _LOST)
    linear = largest * tail / 3.0
    reach = linear + np.sqrt(linear**2 + 2 * variance * tail)
    full = n * steps.max(axis=0) + 1
    return np.asarray(np.minimum(full, 2 * np.ceil(reach).astype(np.int64) + 3))


def sums_of_steps(steps: Integers, shares: Floats, n: int) -> tuple[Integers, Floats]:
    """Return all sums of n steps, (n_sums, n_dimensions), and their probabilities."""
    if not steps.shape[1]:  # all rows are alike
        return np.zeros((1, 0), dtype=np.int64), np.ones(1)
    table, corner = _transform(steps, shares, n)
    weights = table.ravel()
    # What is below 0 is rounding, and so is what is above by as little.
    rounding = max(_LOST / weights.size, -4.0 * float(weights.min()))
    at = np.flatnonzero(weights > rounding)
    residues = np.column_stack(np.unravel_index(at, table.shape))
    return corner + (residues - corner) % table.shape, weights[at]


def sums_of_scores(scores: Integers, shares: Floats, n: int) -> tuple[int, Floats]:
    """Return the least sum of n scores, and the probabilities of it and all above."""
    # Takes scores (n_rows,)
    weights, corner = _transform(scores[:, None], shares, n)
    least = int(corner[0])
    return least, np.roll(weights, -(least % weights.size))


def _transform(steps: Integers, shares: Floats, n: int) -> tuple[Floats, Integers]:
    """Return the probabilities of sums in a box, and the corner where it begins."""
    # The transform of a sum of n draws is the n-th power of that of one. Sums outside
    # the box come round to its other side; it is so large that they do not matter, and
    # a residue stands for the sum that is nearest to the mean.
    sides = [_smooth(int(side)) for side in box(steps, shares, n)]
    one = np.zeros(steps.max(axis=0) + 1)
    np.add.at(one, tuple(steps.T), shares)
    axes = tuple(range(len(sides)))
    spectrum = _power(np.fft.rfftn(one, s=sides, axes=axes), n)
    table = np.fft.irfftn(spectrum, s=sides, axes=axes)
    centre = np.rint(n * (shares @ steps)).astype(np.int64)
    last = np.maximum(n * steps.max(axis=0) + 1 - np.array(sides), 0)
    corner = np.clip(centre - np.array(sides) // 2, 0, last)
    return table, np.asarray(corner, dtype=np.int64)


def _power(base: Spectrum, n: int) -> Spectrum:
    """Return base^n by squaring: a logarithm and an exponential would round more."""
    power = None
    while n:
        if n % 2:
            power = base.copy() if power is None else power * base
        n //= 2
        if n:
            base = base * base
    return np.ones_like(base) if power is None else power


def _smooth(number: int) -> int:
    """Return the next number without a prime factor above 5: it transforms fast."""
    smooth = _smooth_numbers()
    return smooth[bisect.bisect_left(smooth, number)]


@cache
def _smooth_numbers() -> list[int]:
    return sorted(
        2**a * 3**b * 5**c for a in range(32) for b in range(14) for c in range(9)
    )
