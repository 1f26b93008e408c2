"""What is believed of a table of two raters before the data."""

import math
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from masrel.agreement._kernel import Floats

__all__ = ["TablePrior"]

_ITEMS = 1.5  # that the default prior is as strong as, by the study of coverage


@dataclass(frozen=True, slots=True, kw_only=True)
class TablePrior:
    """A Dirichlet over the pairs of categories."""

    cells: Floats = field(repr=False)  # (n_categories, n_categories): its parameters
    words: str  # the prior in words
    # the one parameter of all cells; None where agreeing pairs have others
    even: float | None

    @classmethod
    def by_default(cls, n_categories: int) -> Self:
        """Return a prior worth 1.5 items, half of it on pairs that agree."""
        # An even one would expect agreement to be the rarer, the more categories are
        # declared.
        q = n_categories
        cells = np.full((q, q), 0.5 * _ITEMS / (q * (q - 1)))
        np.fill_diagonal(cells, 0.5 * _ITEMS / q)
        words = f"a Dirichlet worth {_ITEMS:g} items, half of it on pairs that agree"
        return cls(cells=cells, words=words, even=None)

    @classmethod
    def of(cls, concentration: float, n_categories: int) -> Self:
        """Return a prior with one parameter for all cells."""
        cells = np.full((n_categories, n_categories), concentration)
        words = f"Dirichlet({concentration:.3g}, ...) over the cells of the table"
        return cls(cells=cells, words=words, even=concentration)

    def other(self) -> Self:
        """Return another that one could have had."""
        q = len(self.cells)
        if self.even is not None and math.isclose(self.even, 1.0 / q):
            return self.by_default(q)
        return self.of(1.0 / q, q)
