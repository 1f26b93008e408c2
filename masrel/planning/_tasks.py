"""Studies of a design in tasks, no more of them than the Monte Carlo error needs.

Each task has its own seed, so that any number of processes gives the same numbers.
"""

import math

import numpy as np

from masrel.errors import ParameterError
from masrel.planning._icc_studies import AGREEMENT, FORMS, exact_icc, simulate_icc
from masrel.planning._studies import StudyDesign, StudyMaker, StudySums

Errors = dict[str, float]

TASK = 10_000  # studies
_CHOSEN_TASK = 250  # where the interval is chosen study by study
_MAX_TABLES = 1_000_000  # that are summed over
_MAX_CHOSEN = 4_000  # where an interval is chosen for each
_MAX_TASKS = 100
# Monte Carlo errors that are small enough, of a half-width and of a chance; twice as
# much where intervals are chosen study by study
_RELATIVE = 0.003
_SHARE = 0.004


def is_enumerable(design: StudyDesign) -> bool:
    """Whether all studies can be summed over."""
    if design.coefficient in FORMS:
        return design.coefficient != AGREEMENT
    most = _MAX_CHOSEN if design.interval == "auto" else _MAX_TABLES
    return design.n_tables <= most


def exact_sums(design: StudyDesign) -> StudySums:
    """Return sums over all studies, each by its probability."""
    if design.coefficient in FORMS and is_enumerable(design):
        return exact_icc(design)
    if design.n_tables > 20 * _MAX_TABLES:
        many = design.n_tables
        what = f"{many:g} of them" if math.isfinite(many) else "no list of them"
        raise ParameterError(
            f'method: "exact" sums over all studies that differ, and there is {what}; '
            '"simulation" needs no list'
        )
    return StudyMaker(design).exact()


def task_size(design: StudyDesign) -> int:
    """Return how many studies a task draws."""
    is_chosen = design.interval == "auto" and design.coefficient not in FORMS
    return _CHOSEN_TASK if is_chosen and not design.is_jackknife else TASK


def run_task(
    maker: StudyMaker | StudyDesign,
    seed: int,
    task: int,
    n_studies: int,
    rater_share: float = 0.0,
) -> StudySums:
    """Draw the studies of one task: the same wherever it runs."""
    if isinstance(maker, StudyDesign):
        maker = StudyMaker(maker)
    rng = np.random.default_rng([seed, task])
    if maker.design.coefficient in FORMS:
        return simulate_icc(maker.design, rng, n_studies, rater_share)
    return maker.simulate(rng, n_studies)


def simulated_sums(
    design: StudyDesign, seed: int, rater_share: float = 0.0
) -> StudySums:
    """Draw studies until the Monte Carlo errors are small."""
    maker, size = StudyMaker(design), task_size(design)
    total = StudySums(np.zeros(14))
    for task in range(_MAX_TASKS):
        total += run_task(maker, seed, task, size, rater_share)
        if is_enough(design, total):
            break
    return total


def is_enough(design: StudyDesign, sums: StudySums) -> bool:
    """Whether the Monte Carlo errors are small."""
    half, error = sums.mean(0)
    if math.isnan(half):
        return True
    chances_of = []
    if design.half_width is not None:
        chances_of.append(sums.share(0))
    if design.null is not None:
        chances_of.append(sums.share(1))
    if design.lower is not None or design.upper is not None:
        chances_of.append(sums.share(2))
    of_shares = [math.sqrt(p * (1 - p) / sums.weight) for p in chances_of]
    factor = 2.0 if task_size(design) < TASK else 1.0
    worst = max(of_shares, default=0.0)
    return error <= factor * _RELATIVE * half and worst <= factor * _SHARE
