"""Intervals for agreement coefficients, for the population that `target` names.

In: a coefficient's name, its ratings, and the `target` population. Out: an
`Interval`. scipy and emcee load only when a method needs them.
"""

from typing import TYPE_CHECKING

from masrel._interpreter import loaded_from
from masrel.intervals.analytic import analytic
from masrel.intervals.bootstrap import bootstrap
from masrel.intervals.choose import estimate
from masrel.intervals.contrasts import (
    Differences,
    difference,
    difference_test,
    differences,
    donner_test,
    equality_test,
)
from masrel.intervals.diagnosis import Diagnosis, diagnose
from masrel.intervals.jackknife import jackknife
from masrel.intervals.posterior import Quantity, posterior

if TYPE_CHECKING:
    from masrel.intervals.latent._implied import PredictiveCheck
    from masrel.intervals.latent._model import LatentPrior
    from masrel.intervals.latent._trait import LatentChains, LatentTrait, latent_trait
    from masrel.intervals.self_agreement import RetestModel, retest_model

__all__ = [
    "Diagnosis",
    "Differences",
    "LatentChains",
    "LatentPrior",
    "LatentTrait",
    "PredictiveCheck",
    "Quantity",
    "RetestModel",
    "analytic",
    "bootstrap",
    "diagnose",
    "difference",
    "difference_test",
    "differences",
    "donner_test",
    "equality_test",
    "estimate",
    "jackknife",
    "latent_trait",
    "posterior",
    "retest_model",
]

_HOMES = {
    "LatentChains": "latent._trait",
    "LatentPrior": "latent._model",
    "LatentTrait": "latent._trait",
    "PredictiveCheck": "latent._implied",
    "RetestModel": "self_agreement",
    "latent_trait": "latent._trait",
    "retest_model": "self_agreement",
}


# these load scipy, and the latent-trait model emcee
__getattr__ = loaded_from(__name__, _HOMES)
