"""How large a study must be, and what a study of a given size can show.

In: a `Study`: a coefficient, the value taken to be true, a model of the ratings, what
was sampled, and an aim. Out: a `Plan`, exact where all studies can be summed over, else
simulated with its Monte Carlo error.
"""

from masrel.planning._formulas import units_needed
from masrel.planning._sizes import plan_grid, precision, sample_size
from masrel.planning._study_plan import LatentModel, Pilot, Plan, Study, pilot

__all__ = [
    "LatentModel",
    "Pilot",
    "Plan",
    "Study",
    "pilot",
    "plan_grid",
    "precision",
    "sample_size",
    "units_needed",
]
