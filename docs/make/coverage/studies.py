"""Simulated studies, and what every model that draws them offers."""

from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Codes = NDArray[np.int8]
Truths = NDArray[np.bool_]
Target = Literal["items", "raters", "both"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """How many items and raters a study has."""

    n_items: int
    n_raters: int

    def __str__(self) -> str:
        return f"{self.n_items} × {self.n_raters}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Studies:
    """Many studies of one design.

    `codes` has shape (n_studies, n_items, n_raters); `truth`, shape (n_studies,), is
    the population kappa that the target asks for.
    """

    codes: Codes = field(repr=False)
    truth: Floats = field(repr=False)
    n_categories: int

    @property
    def counts(self) -> NDArray[np.int64]:
        """Raters per category, shape (n_studies, n_items, n_categories)."""
        grades = np.arange(self.n_categories)
        return np.asarray((self.codes[..., None] == grades).sum(axis=2))


class Model(Protocol):
    """A population of items and raters whose kappa is `kappa`."""

    @property
    def kappa(self) -> float:
        """Kappa of all items and all raters."""

    def draw(
        self, size: int, design: Design, target: Target, rng: np.random.Generator
    ) -> Studies:
        """Draw studies, in which what the target says varies does so."""


def drawn(shares: Floats, n_raters: int, rng: np.random.Generator) -> Codes:
    """Draw ratings (..., n_raters) independently from shares (..., n_categories)."""
    below = np.cumsum(shares, axis=-1)[..., None, :-1]
    uniform = rng.random((*shares.shape[:-1], n_raters, 1))
    return np.asarray((uniform >= below).sum(axis=-1), dtype=np.int8)


def kappa_of_items(shares: Floats) -> Floats:
    """Kappa of these items and infinitely many raters.

    `shares` (..., n_items, n_categories) are those of all raters on each item. Two
    raters drawn from all of them are independent, so they agree on an item with
    probability Σ_k p_k², and by chance with that of the mean shares.
    """
    observed = 1.0 - (shares**2).sum(axis=-1).mean(axis=-1)
    chance = 1.0 - (shares.mean(axis=-2) ** 2).sum(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(1.0 - observed / chance)
