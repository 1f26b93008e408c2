"""A question whose default interval is sought, and what its rules look at."""

import dataclasses
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._counts import item_counts
from masrel.intervals.case import Case
from masrel.intervals.dirichlet.prior import Prior
from masrel.intervals.dirichlet.rho import ExactPosterior
from masrel.intervals.table.interval import speaks_of

__all__ = ["FEW", "PRIOR", "SEVERAL", "Choice"]

FEW = 10
"""Items, and raters, below which a posterior covers best."""
SEVERAL = 30
"""Items, below which a jackknife alone ends too low."""
PRIOR = Prior.of("uniform", 1.0)
"""The prior of the Dirichlet-multinomial model."""
_ACCIDENT = 0.003  # of (1 - κ) / ratings: a variance below it is no information


@dataclasses.dataclass(frozen=True)
class Choice:
    """A question whose interval is to be chosen."""

    case: Case  # the question
    modelled: bool  # whether the Dirichlet-multinomial model speaks of the coefficient

    @property
    def small(self) -> bool:
        """Whether items and raters are both few."""
        return self.case.n_items < FEW and self.n_raters < FEW

    @cached_property
    def tabular(self) -> bool:
        """Whether the table of two raters speaks of the coefficient instead."""
        return (
            not self.modelled and self.case.target == "items" and speaks_of(self.case)
        )

    @property
    def n_raters(self) -> int:
        """Raters, also without ratings."""
        return int(self.case.coded.codes.shape[1])

    @cached_property
    def per_item(self) -> float:
        """Ratings of an item, on average."""
        given = (self.case.patterns.codes >= 0).sum(axis=1)
        return float(self.case.times @ given) / self.case.n_items

    @property
    def least(self) -> float:
        """The lower end of the scale on which an interval is symmetric."""
        # That of an intraclass correlation of r raters is -1/(r - 1): its logit is
        # Fisher's transformation, ln[(1 + (r - 1) κ) / (1 - κ)].
        if self.modelled and self.per_item > 1.0:
            return -1.0 / (self.per_item - 1.0)
        return self.case.entry.lowest

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """Raters per item and category."""
        return item_counts(self.case.coded)

    @cached_property
    def posterior(self) -> ExactPosterior:
        """The posterior under the default prior."""
        return ExactPosterior.of(self.counts, PRIOR, self.case.level)

    def has_spread(self, variance: float) -> bool:
        """Whether a variance is more than an accident of few disagreements."""
        case = self.case
        least = 0.0
        if self.modelled:
            n_ratings = case.n_items * self.per_item
            least = _ACCIDENT * (1.0 - case.value) / n_ratings
        return variance > least
