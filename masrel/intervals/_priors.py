"""What is believed before the data: of ρ and π, or of a table of two raters."""

import math
from dataclasses import dataclass, field
from typing import Literal, Self, get_args

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.errors import ParameterError

RHO_COEFFICIENTS = ("fleiss_kappa", "scott_pi", "krippendorff_alpha")
"""Coefficients whose value in the population is ρ of the Dirichlet-multinomial."""

PriorName = Literal["uniform", "jeffreys"]
"""Prior of ρ: U(0, 1), or Beta(1/2, 1/2), the prior of Jeffreys for a probability."""

_SHAPES: dict[str, float] = {"uniform": 1.0, "jeffreys": 0.5}
_OF_RHO = {"uniform": "ρ ~ U(0, 1)", "jeffreys": "ρ ~ Beta(1/2, 1/2)"}
_ITEMS = 1.5  # that the default prior of a table is worth, by the study of coverage


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """The prior of the Dirichlet-multinomial model."""

    name: PriorName  # that of ρ
    # π ~ Dirichlet(concentration, ...) over the declared categories
    concentration: float

    @classmethod
    def of(cls, name: PriorName, concentration: float) -> "Prior":
        """Return a prior, checked."""
        if name not in _SHAPES:
            raise ParameterError(
                f"prior: needs one of {', '.join(get_args(PriorName))}, got {name!r}"
            )
        if not 0.0 < concentration < math.inf:
            raise ParameterError(
                f"concentration: needs a positive number, got {concentration!r}"
            )
        return cls(name=name, concentration=float(concentration))

    @property
    def shape(self) -> float:
        """The prior of ρ is Beta(shape, shape)."""
        return _SHAPES[self.name]

    @property
    def description(self) -> str:
        """Both priors, such as "ρ ~ U(0, 1), π ~ Dirichlet(1, ...)"."""
        return f"{_OF_RHO[self.name]}, π ~ Dirichlet({self.concentration:.3g}, ...)"

    def others(self, n_categories: int) -> "tuple[Prior, Prior]":
        """Return two that are as reasonable: another of ρ, and another of π."""
        # of π a Dirichlet as strong as one rating, Dirichlet(1/K, ...), or instead of
        # that Dirichlet(1, ...)
        of_rho: PriorName = "jeffreys" if self.name == "uniform" else "uniform"
        as_one = 1.0 / n_categories
        of_pi = 1.0 if math.isclose(self.concentration, as_one) else as_one
        return (
            Prior(name=of_rho, concentration=self.concentration),
            Prior(name=self.name, concentration=of_pi),
        )


DEFAULT_PRIOR = Prior(name="uniform", concentration=1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class TablePrior:
    """A Dirichlet over the pairs of categories."""

    cells: Floats = field(repr=False)  # (n_categories, n_categories): its parameters
    description: str  # the prior in words
    # the one parameter of all cells; None where pairs that agree have others
    concentration: float | None

    @classmethod
    def by_default(cls, n_categories: int) -> Self:
        """Return a prior worth 1.5 items, half of it on pairs that agree."""
        # With the same parameter in every cell agreement would be expected to be the
        # rarer, the more categories are declared.
        q = n_categories
        cells = np.full((q, q), 0.5 * _ITEMS / (q * (q - 1)))
        np.fill_diagonal(cells, 0.5 * _ITEMS / q)
        description = (
            f"a Dirichlet worth {_ITEMS:g} items, half of it on pairs that agree"
        )
        return cls(cells=cells, description=description, concentration=None)

    @classmethod
    def of(cls, concentration: float, n_categories: int) -> Self:
        """Return a prior with one parameter for all cells."""
        cells = np.full((n_categories, n_categories), concentration)
        description = f"Dirichlet({concentration:.3g}, ...) over the cells of the table"
        return cls(cells=cells, description=description, concentration=concentration)

    def other(self) -> Self:
        """Return another that is as reasonable."""
        q = len(self.cells)
        if self.concentration is not None and math.isclose(self.concentration, 1.0 / q):
            return self.by_default(q)
        return self.of(1.0 / q, q)
