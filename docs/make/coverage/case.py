"""Many studies with all that the intervals are made of, computed once."""

from dataclasses import dataclass

import numpy as np

from docs.make.coverage.bounds import Posterior, has_spread, student
from docs.make.coverage.exact import posterior_ends
from docs.make.coverage.spread import Spread, spread_of
from docs.make.coverage.studies import Floats, Studies, Truths


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """Studies of one design.

    Attributes
    ----------
    spread : Spread
        Kappa and what it is when something is left out.
    posterior : Posterior
        Of the Dirichlet-multinomial model.
    studies : Studies
        The ratings themselves.
    """

    spread: Spread
    posterior: Posterior
    studies: Studies

    @classmethod
    def of(cls, studies: Studies) -> "Case":
        """Compute all of it."""
        ends = posterior_ends(studies.counts, (0.025, 0.05, 0.5, 0.975)).T
        p025, p05, p50, p975 = ends
        return cls(
            spread=spread_of(studies),
            posterior=Posterior(p025=p025, p05=p05, p50=p50, p975=p975),
            studies=studies,
        )

    @property
    def value(self) -> Floats:
        """The estimates."""
        return self.spread.value

    @property
    def n(self) -> int:
        """Items."""
        return self.spread.n_items

    @property
    def r(self) -> int:
        """Raters."""
        return self.spread.n_raters

    @property
    def excess(self) -> Floats:
        """Variance of raters beyond that of single ratings; 0 where undefined."""
        beyond = self.spread.of_raters - self.spread.of_cells
        return np.nan_to_num(np.maximum(beyond, 0.0))

    @property
    def t_items(self) -> float:
        """Student's quantile with n - 1 degrees of freedom."""
        return float(student(self.n - 1))

    @property
    def t_raters(self) -> float:
        """Student's quantile with r - 1 degrees of freedom."""
        return float(student(self.r - 1))

    @property
    def t_fewest(self) -> float:
        """Student's quantile with the fewer degrees of freedom of the two."""
        return max(self.t_items, self.t_raters)

    def spreads(self, variance: Floats) -> Truths:
        """Whether a variance is more than an accident."""
        return has_spread(variance, self.value, self.n * self.r)
