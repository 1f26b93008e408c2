"""Studies of a design in tasks, no more of them than the Monte Carlo error needs.

Each task has its own seed, so that any number of processes gives the same numbers.
"""

import math
from collections.abc import Callable

import numpy as np

from masrel.errors import ParameterError
from masrel.planning._icc_studies import AGREEMENT, FORMS, exact_icc, simulate_icc
from masrel.planning._studies import StudyDesign, StudyMaker, StudySums

Errors = dict[str, float]
Progress = Callable[[int, int], None]  # studies that are drawn, and that will be

TASK = 10_000  # studies
_CHOSEN_TASK = 250  # where an interval is computed study by study
_RESAMPLED_TASK = 50  # where that takes resamples
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
    if design.interval == "bootstrap":
        return False
    return design.n_tables <= (_MAX_CHOSEN if design.is_chosen else _MAX_TABLES)


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
    if design.coefficient in FORMS or not design.is_chosen:
        return TASK
    return _RESAMPLED_TASK if design.interval == "bootstrap" else _CHOSEN_TASK


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
    design: StudyDesign,
    seed: int,
    rater_share: float = 0.0,
    progress: Progress | None = None,
) -> StudySums:
    """Draw studies until the Monte Carlo errors are small."""
    maker, size = StudyMaker(design), task_size(design)
    total = StudySums(np.zeros(14))
    for task in range(_MAX_TASKS):
        total += run_task(maker, seed, task, size, rater_share)
        n_more = math.ceil(task_ratio(design, total) * (task + 1)) - task - 1
        n_tasks = task + 1 + min(max(n_more, 0), _MAX_TASKS - task - 1)
        if progress is not None:
            progress((task + 1) * size, n_tasks * size)
        if n_tasks == task + 1:
            break
    return total


def task_ratio(design: StudyDesign, sums: StudySums) -> float:
    """Return how many times the studies are needed for errors that are small."""
    half, error = sums.mean(0)
    if math.isnan(half):
        return 0.0
    chances_of = []
    if design.half_width is not None:
        chances_of.append(sums.share(0))
    if design.null is not None:
        chances_of.append(sums.share(1))
    if design.lower is not None or design.upper is not None:
        chances_of.append(sums.share(2))
    variances = [p * (1 - p) / sums.weight for p in chances_of]
    factor = 2.0 if task_size(design) < TASK else 1.0
    of_half = (error / (factor * _RELATIVE * half)) ** 2 if half > 0.0 else 0.0
    return max(of_half, max(variances, default=0.0) / (factor * _SHARE) ** 2)
