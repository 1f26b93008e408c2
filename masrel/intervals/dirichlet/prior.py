"""The prior of the Dirichlet-multinomial model, in parameters and in words."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

from masrel.errors import ParameterError

__all__ = ["Prior", "PriorName"]

PriorName = Literal["uniform", "jeffreys"]
"""Prior of ρ: U(0, 1), or Beta(1/2, 1/2), the prior of Jeffreys for a probability."""

_SHAPES: dict[str, float] = {"uniform": 1.0, "jeffreys": 0.5}
_WORDS = {"uniform": "ρ ~ U(0, 1)", "jeffreys": "ρ ~ Beta(1/2, 1/2)"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """What is believed before the data."""

    name: PriorName  # that of ρ
    # π ~ Dirichlet(concentration, ...) over the declared categories
    concentration: float

    @classmethod
    def of(cls, name: PriorName, concentration: float) -> "Prior":
        """Check a prior."""
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
    def words(self) -> str:
        """Both priors, such as "ρ ~ U(0, 1), π ~ Dirichlet(1, ...)"."""
        return f"{_WORDS[self.name]}, π ~ Dirichlet({self.concentration:.3g}, ...)"

    def others(self, n_categories: int) -> "tuple[Prior, Prior]":
        """Return what might as well have been believed: of ρ, and of π."""
        # With the other prior of ρ; and with a Dirichlet as strong as one rating,
        # Dirichlet(1/K, ...), or for that Dirichlet(1, ...).
        of_rho: PriorName = "jeffreys" if self.name == "uniform" else "uniform"
        as_one = 1.0 / n_categories
        of_pi = 1.0 if math.isclose(self.concentration, as_one) else as_one
        return (
            Prior(name=of_rho, concentration=self.concentration),
            Prior(name=self.name, concentration=of_pi),
        )
