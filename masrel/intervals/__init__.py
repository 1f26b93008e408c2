"""Intervals for agreement coefficients: what was sampled is asked, never guessed.

In: a coefficient's name, its ratings, and the `target` population. Out: an
`Interval`. scipy and emcee load only when a method needs them.
"""

from masrel.intervals.analytic import analytic
from masrel.intervals.auto import estimate
from masrel.intervals.bootstrap import bootstrap
from masrel.intervals.difference import difference
from masrel.intervals.jackknife import jackknife
from masrel.intervals.latent.prior import LatentPrior
from masrel.intervals.latent.trait import latent_trait
from masrel.intervals.posterior import posterior
from masrel.intervals.retest.model import retest_model

__all__ = [
    "LatentPrior",
    "analytic",
    "bootstrap",
    "difference",
    "estimate",
    "jackknife",
    "latent_trait",
    "posterior",
    "retest_model",
]
