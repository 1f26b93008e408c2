"""Number of items needed to show that a judge can replace a human.

In: how often humans and judge are right. Out: how often the judge passes the
alternative annotator test, and how many items make that often enough.
"""

import math
from dataclasses import dataclass

import numpy as np

from masrel._input import refuse
from masrel.agreement._engine import Floats, Integers, check_level, recorded_generator
from masrel.agreement.benchmarks import _yekutieli_bounds
from masrel.judges._paired import check_count, check_share, rejected
from masrel.judges.annotators import _EXACT_UP_TO, _Graded

_LEVEL = 0.05
_N_STUDIES = 1000
_FEWEST, _MOST = 30, 10_000  # items that are looked at
_GROWTH, _CLOSE = 1.5, 1.03  # of numbers of items, and where a search ends
_AT_ONCE = 1 << 20  # grades


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgePlan:
    """How often a judge passes the alternative annotator test, by simulation.

    Attributes
    ----------
    n_items : int
        Items that all humans and the judge grade.
    power : float
        Share of 1000 studies in which the winning rate is at least one half.
    monte_carlo_error : float
        Standard error of the power.
    advantage : float
        Advantage of the judge, on average.
    difference : float
        By how much a human's share exceeds the judge's on average; the judge can pass
        if it is less than epsilon.
    tied : float
        Share of items where human and judge are as near to the others.
    seed : int
        Seed that repeats it.
    """

    n_items: int
    power: float
    monte_carlo_error: float
    advantage: float
    difference: float
    tied: float
    seed: int


def judge_plan(
    *,
    epsilon: float,
    n_humans: int,
    human_accuracy: float,
    judge_accuracy: float | None = None,
    n_categories: int = 2,
    n_items: int | None = None,
    power: float = 0.8,
    rng: np.random.Generator | int | None = None,
) -> JudgePlan:
    """Return the number of items a judge needs to pass, or how often it passes.

    Parameters
    ----------
    epsilon : float
        By how much a human may be better; see `alternative_annotator_test`.
    n_humans : int
        Humans, at least 2.
    human_accuracy : float
        How often a human has the grade that is right; every wrong one is as frequent.
        Two humans agree on a² + (1 - a)²/(k - 1) of the items, with k grades.
    judge_accuracy : float, optional
        How often the judge has; as often as the humans when not given.
    n_categories : int, optional
        Number of different grades.
    n_items : int, optional
        Number of items, to find how often the judge passes with them.
    power : float, optional
        How often it should pass, where items are asked for.
    rng : numpy.random.Generator or int, optional
        Generator or seed; a new one is drawn and recorded when not given.

    Returns
    -------
    JudgePlan
        The number of items, to within 3 %, and the power with it.

    Raises
    ------
    ParameterError
        If a value is outside its range, or the judge differs by so much that 10 000
        items do not suffice.

    Notes
    -----
    Every human grades every item, the errors of all are independent, and the test is
    that of `alternative_annotator_test` by default at the level .05. If graders err
    on the same items they tie more often than here, and fewer items suffice.

    References
    ----------
    .. [1] Calderon, N., Reichart, R., Dror, R. (2025); see
       `alternative_annotator_test`.

    Examples
    --------
    Three experts and a judge are each right on 90 % of the items:

    >>> plan = judge_plan(epsilon=0.2, n_humans=3, human_accuracy=0.9, rng=1)
    >>> plan.n_items, round(plan.power, 1)
    (43, 0.8)
    """
    judge = human_accuracy if judge_accuracy is None else judge_accuracy
    check_share("epsilon", epsilon)
    check_share("human_accuracy", human_accuracy)
    check_share("judge_accuracy", judge)
    check_count("n_humans", n_humans, 2)
    check_count("n_categories", n_categories, 2)
    check_count("n_items", _FEWEST if n_items is None else n_items)
    check_level(power, "power")
    generator, seed = recorded_generator(rng)
    seed = int(generator.integers(2**62)) if seed is None else seed
    accuracies = np.array([human_accuracy] * n_humans + [judge])

    def at(n: int) -> JudgePlan:
        return _plan(n, epsilon, accuracies, n_categories, seed)

    if n_items is not None:
        return at(n_items)
    low, plan = 0, at(_FEWEST)
    while plan.power < power:
        low = plan.n_items
        refuse(
            (
                plan.difference >= epsilon or low * _GROWTH > _MOST,
                f"epsilon: needs to be more than {plan.difference:.3f}, the "
                f"difference between a human's share and the judge's; with {low} "
                f"items the judge passes in {plan.power:.0%} of studies, got "
                f"{epsilon:g}",
            )
        )
        plan = at(math.ceil(low * _GROWTH))
    while low and plan.n_items > max(low * _CLOSE, low + 1):
        between = at((low + plan.n_items) // 2)
        if between.power >= power:
            plan = between
        else:
            low = between.n_items
    return plan


def _plan(
    n: int, epsilon: float, accuracies: Floats, n_categories: int, seed: int
) -> JudgePlan:
    """Simulate studies of n items."""
    m, rng = len(accuracies) - 1, np.random.default_rng([seed, n])
    b, c = _drawn(n, accuracies, n_categories, rng)
    # it passes where k ≥ m/2 p-values are at most the k-th threshold, for some k
    is_passed, bounds = np.zeros(len(b), dtype=bool), _LEVEL * _yekutieli_bounds(m)
    for k, bound in enumerate(bounds, 1):
        if 2 * k < m:
            continue
        largest = rejected(n, epsilon, bound, "exact" if n <= _EXACT_UP_TO else "score")
        is_passed |= (b <= largest[c]).sum(axis=1) >= k
    share = float(is_passed.mean())
    return JudgePlan(
        n_items=int(n),
        power=share,
        monte_carlo_error=math.sqrt(share * (1.0 - share) / len(b)),
        advantage=1.0 - float(b.mean()) / n,
        difference=float((b - c).mean()) / n,
        tied=1.0 - float((b + c).mean()) / n,
        seed=seed,
    )


def _drawn(
    n: int, accuracies: Floats, n_categories: int, rng: np.random.Generator
) -> tuple[Integers, Integers]:
    """Return b and c of every human in studies that are drawn."""
    # -> (n_studies, n_humans) each; the right grade is 0
    n_at_once = max(1, min(_N_STUDIES, _AT_ONCE // (n * len(accuracies))))
    counts = []
    for start in range(0, _N_STUDIES, n_at_once):
        shape = (min(n_at_once, _N_STUDIES - start) * n, len(accuracies))
        wrong = rng.integers(1, n_categories, shape)
        grades = np.where(rng.random(shape) < accuracies, 0, wrong)
        graded = _Graded(
            names=["human"] * (shape[1] - 1),
            items=[],
            humans=grades[:, :-1],
            rated=np.ones((shape[0], shape[1] - 1), dtype=bool),
            judges=grades[:, -1:],
            nearness=lambda a, b: np.equal(a, b).astype(np.int64),
            is_tested=np.ones(shape[1] - 1, dtype=bool),
            n_categories=n_categories,
            score="accuracy",
        )
        nearer = graded.nearer().reshape(-1, n, shape[1] - 1)
        counts.append(((nearer == 1).sum(axis=1), (nearer == -1).sum(axis=1)))
    b, c = (np.concatenate(of) for of in zip(*counts, strict=True))
    return b, c
