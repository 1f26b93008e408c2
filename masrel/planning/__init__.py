"""How large a study must be, and what a study of a given size can show.

In: a coefficient, the value taken to be true, a model of the ratings, and what was
sampled. Out: a `Plan`, exact where all studies can be summed over, else simulated with
its Monte Carlo error.
"""

from masrel.planning._grids import plan_grid
from masrel.planning._item_models import LatentModel
from masrel.planning._pilot import Pilot, pilot
from masrel.planning._precision import Plan
from masrel.planning._sizes import precision, sample_size

__all__ = [
    "LatentModel",
    "Pilot",
    "Plan",
    "pilot",
    "plan_grid",
    "precision",
    "sample_size",
]
