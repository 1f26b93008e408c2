"""Table V of the source, and made studies of a known kappa."""

import numpy as np

SCALE = ("0", "1", "1+", "2", "3", "4")

TABLE_V = [
    ["1", "1", "1", "1+", "1", "1", "1", "1"],
    ["1+", "1+", "1+", "1+", "1+", "1", "1+", "1"],
    ["2", "2", "2", "2", "2", "2", "2", "2"],
    ["3", "2", "3", "3", "3", "2", "3", "3"],
]


def dirichlet_multinomial(
    rng: np.random.Generator, n_items: int, n_raters: int, kappa: float
) -> list[list[int]]:
    """Draw ratings in 3 categories whose population kappa is known, by Pólya's urn.

    The first rating of an item is uniform; each further one repeats an earlier one
    with probability j / (A + j), where kappa = 1 / (1 + A).
    """
    mass = (1.0 - kappa) / kappa
    table = np.empty((n_items, n_raters), dtype=int)
    for j in range(n_raters):
        fresh = rng.random(n_items) * (mass + j) < mass
        earlier = rng.integers(0, max(j, 1), n_items)
        copied = table[np.arange(n_items), earlier] if j else 0
        table[:, j] = np.where(fresh, rng.integers(0, 3, n_items), copied)
    rows: list[list[int]] = table.tolist()
    return rows
