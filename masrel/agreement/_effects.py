"""Components of variance of any crossed or nested design, and draws of them.

In: deviations of ratings, and which cell of every effect each rating lies in. Out: mean
squares where the design is balanced, components by Henderson's moments, and draws from
which intervals of components, and of whatever is made of them, are read.
"""

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from masrel.agreement._engine import Floats, Integers

# the columns of each effect, small ones first, to the cell of each rating
Cells = Mapping[frozenset[str], Integers]

N_DRAWS = 10_000

_BLOCKS = 20  # of levels of each column, of which the jackknife leaves out one

# Share of what is expected of a variance that is rounding
_NOTHING = 1e-9


def expected_squares(cells: Cells) -> Floats:
    """Return the mean squares expected of each variance alone, by mean counts."""
    # as many ratings as a level has, of the effects that lie within one
    per_level = [len(cell) / (cell.max() + 1) for cell in cells.values()]
    lies_within = np.array([[one <= other for other in cells] for one in cells])
    return np.asarray(lies_within * per_level, dtype=np.float64)


def mean_squares(values: Floats, cells: Cells) -> tuple[Floats, Floats] | None:
    """Return mean squares with degrees of freedom, if the design is balanced."""
    # values have mean 0
    counts = {effect: np.bincount(cell) for effect, cell in cells.items()}
    size = {effect: len(count) for effect, count in counts.items()}
    if any(count.min() < count.max() for count in counts.values()) or any(
        size[one | other] * size.get(one & other, 1) != size[one] * size[other]
        for one, other in combinations(cells, 2)  # some cells of both are empty
    ):
        return None
    squares, df = np.empty(len(cells)), np.empty(len(cells))
    for at, (effect, cell) in enumerate(cells.items()):
        parts = [k for k, other in enumerate(cells) if other < effect]
        sums = np.bincount(cell, values)
        squares[at] = (sums**2 / counts[effect]).sum() - squares[parts].sum()
        df[at] = size[effect] - 1 - df[parts].sum()
    return np.maximum(squares, 0.0) / df, df


def _expected_sums(cells: Cells) -> Floats:
    """Return the sums of squares expected of each variance alone, the mean's off."""
    expected = np.empty((len(cells), len(cells)))
    for i, cell in enumerate(cells.values()):
        size = np.maximum(np.bincount(cell), 1)
        for j, other in enumerate(cells):
            joint = cells[[*cells][i] | other]
            both = np.bincount(joint)
            inside = np.zeros(len(both), dtype=np.int64)
            inside[joint] = cell
            of_mean = (np.bincount(cells[other]) ** 2).sum() / len(cell)
            expected[i, j] = (both**2 / size[inside]).sum() - of_mean  # Σ n_st²/n_s
    return expected


def moments(values: Floats, cells: Cells) -> Floats:
    """Return components by Henderson's first method, of values with mean 0."""
    squares = [
        (np.bincount(cell, values) ** 2 / np.maximum(np.bincount(cell), 1)).sum()
        for cell in cells.values()
    ]
    # a block that is left out may leave effects of which only sums are told
    parts = np.linalg.lstsq(_expected_sums(cells), np.array(squares), rcond=None)[0]
    return np.asarray(parts, dtype=np.float64)


def told_together(cells: Cells) -> list[int]:
    """Return places of effects of whose variances only sums can be known, or none."""
    expected = _expected_sums(cells)
    for k, column in enumerate(expected.T):
        share = np.linalg.lstsq(expected[:, :k], column, rcond=None)[0]
        rest = column - expected[:, :k] @ share
        if np.abs(rest).max() <= _NOTHING * np.abs(column).max():
            return [*np.flatnonzero(np.abs(share) > 1e-6).tolist(), k]
    return []


def jackknife_draws(
    parts: Floats,
    values: Floats,
    cells: Cells,
    levels: Mapping[str, Integers],
    rng: np.random.Generator,
) -> Floats:
    """Return normal draws of `moments`, with covariances by leaving out blocks."""
    covariance = np.zeros((len(cells), len(cells)))
    for level in levels.values():
        n_levels = int(level.max()) + 1
        n_blocks = min(_BLOCKS, n_levels)
        block = rng.permutation(n_levels)[level] % n_blocks
        left = []
        for rest in (block != out for out in range(n_blocks)):
            some = {effect: cell[rest] for effect, cell in cells.items()}
            left.append(moments(values[rest] - values[rest].mean(), some))
        # that of persons and that of raters both hold what is of both, so that the sum
        # is rather too large than too small
        deviation = np.array(left) - np.mean(left, axis=0)
        covariance += (n_blocks - 1) / n_blocks * deviation.T @ deviation
    return rng.multivariate_normal(parts, covariance, N_DRAWS, method="eigh")


def pivotal_draws(
    squares: Floats, df: Floats, expected: Floats, rng: np.random.Generator
) -> Floats:
    """Return draws of components, (n_draws, n): what mean squares could be of."""
    # generalized confidence: MS df/χ²(df) has the place of the expected mean square
    drawn = squares * df / rng.chisquare(df, (N_DRAWS, len(df)))
    return np.asarray(np.linalg.solve(expected, drawn.T).T, dtype=np.float64)
