"""Rows of features as points of a lattice, so that equal sums are equal integers."""

from dataclasses import dataclass, field

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.intervals.resampling.numerators import Integers, numerators_of

__all__ = ["Lattice", "grid_of", "lattice_of"]

_MOST = 2.0**52  # integers that a float still holds
_DIMENSIONS, _ROWS = 12, 2_000  # a lattice of more helps nobody
_TURNS = 50


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
        """Return sums of features."""
        # steps (..., n_dimensions) -> (..., n_features)
        whole: Floats = steps.astype(np.float64) @ self.basis.astype(np.float64)
        whole += n * self.origin
        whole /= self.denominators
        return whole


def grid_of(rows: Floats, n: int) -> Lattice | None:
    """Take the numerators of the features themselves as steps."""
    # Takes rows (n_rows, n_features)
    found = numerators_of(rows, n)
    if found is None:
        return None
    whole, denominators = found
    least = whole.min(axis=0)
    moving = np.flatnonzero(whole.max(axis=0) - least)
    return Lattice(
        steps=whole[:, moving] - least[moving],
        origin=least,
        basis=np.eye(least.size, dtype=np.int64)[moving],
        denominators=denominators,
    )


def lattice_of(rows: Floats, shares: Floats, n: int) -> Lattice | None:
    """Find the lattice of distinct rows, with short steps."""
    # Takes rows (n_rows, n_features), shares (n_rows,)
    if len(rows) > _ROWS:
        return None
    found = numerators_of(rows, n)
    if found is None:
        return None
    whole, denominators = found
    basis = _echelon(whole - whole[0])
    if basis is None:
        return None
    steps = _shorten(_coordinates(whole - whole[0], basis), basis, shares)
    if np.abs(steps).max(initial=0) * max(n, 1) > _MOST:
        return None
    least = steps.min(axis=0)
    return Lattice(
        steps=steps - least,
        origin=whole[0] + least @ basis,
        basis=basis,
        denominators=denominators,
    )


def _echelon(rows: Integers) -> Integers | None:
    # (n_rows, n_features) -> a basis of all integer sums of rows, in echelon form, by
    # Euclid's algorithm, column by column
    left, top = rows.copy(), 0
    for column in range(rows.shape[1]):
        while (at := np.flatnonzero(left[top:, column]) + top).size:
            if top == _DIMENSIONS or np.abs(left).max() > _MOST:
                return None
            least = at[np.argmin(np.abs(left[at, column]))]
            left[[top, least]] = left[[least, top]]
            if at.size == 1:
                top += 1
                break
            times = left[top + 1 :, column] // left[top, column]
            left[top + 1 :] -= times[:, None] * left[top]
    return left[:top]


def _coordinates(rows: Integers, basis: Integers) -> Integers:
    # (n_rows, n_features) -> (n_rows, n_dimensions)
    rest = rows.copy()
    steps = np.zeros((len(rows), len(basis)), dtype=np.int64)
    for of, direction in enumerate(basis):
        first = np.flatnonzero(direction)[0]
        steps[:, of] = rest[:, first] // direction[first]
        rest -= steps[:, of, None] * direction
    return steps


def _shorten(steps: Integers, basis: Integers, shares: Floats) -> Integers:
    # Lagrange's reduction, pair by pair: a coordinate less a multiple of another while
    # that makes its variance smaller; the basis changes in place.
    centred = steps - shares @ steps
    covariance = ((centred * shares[:, None]).T @ centred).tolist()
    for _ in range(_TURNS):
        turn = _best_turn(covariance)
        if turn is None:
            break
        of, by, times = turn
        steps[:, of] -= times * steps[:, by]
        basis[by] += times * basis[of]
        for row in covariance:
            row[of] -= times * row[by]
        of_by = zip(covariance[of], covariance[by], strict=True)
        covariance[of] = [x - times * y for x, y in of_by]
    return steps


def _best_turn(covariance: list[list[float]]) -> tuple[int, int, int] | None:
    # which coordinate loses most variance less how often which other
    most, best = 0.0, None
    for by, row in enumerate(covariance):
        for of, shared in enumerate(row):
            times = round(shared / row[by])
            if times and of != by:
                gain = times * (2.0 * shared - times * row[by])
                if gain > most:
                    most, best = gain, (of, by, times)
    return best
