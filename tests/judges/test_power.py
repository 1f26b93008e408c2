"""Plans of studies of a judge: by the test itself, and what must follow."""

from functools import cache

import numpy as np
import pytest

from masrel.agreement import benjamini_yekutieli
from masrel.judges import judge_plan
from masrel.judges._paired import p_less
from masrel.judges.power import _drawn

ACCURACIES = np.array([0.9, 0.9, 0.9, 0.85])


def test_a_judge_passes_as_often_as_the_test_lets_it() -> None:
    plan = judge_plan(
        epsilon=0.2,
        n_humans=3,
        human_accuracy=0.9,
        judge_accuracy=0.85,
        n_categories=3,
        n_items=40,
        rng=5,
    )
    b, c = _drawn(40, ACCURACIES, 3, np.random.default_rng([5, 40]))
    p_of = cache(lambda b, c: p_less(b, c, 40, 0.2, "exact"))
    adjusted = [
        benjamini_yekutieli([p_of(*pair) for pair in zip(*pairs, strict=True)])
        for pairs in zip(b.tolist(), c.tolist(), strict=True)
    ]
    n_rejected = (np.array(adjusted) <= 0.05).sum(axis=1)
    assert plan.power == (n_rejected >= 1.5).mean()
    assert plan.difference == pytest.approx((b - c).mean() / 40)
    assert plan.tied == pytest.approx(1 - (b + c).mean() / 40)


def test_what_graders_are_right_on_says_how_often_they_tie() -> None:
    # of two humans and two grades: a human and the judge are as near to the other human
    # where both are right or both are wrong: .81 + .01
    plan = judge_plan(epsilon=0.2, n_humans=2, human_accuracy=0.9, n_items=100, rng=1)
    # 1000 studies of 100 items and two humans that share them: five errors of .0012
    assert plan.tied == pytest.approx(0.82, abs=0.006)


def test_as_many_items_as_it_takes_and_no_more() -> None:
    plan = judge_plan(epsilon=0.2, n_humans=3, human_accuracy=0.95, rng=3)
    assert plan.power >= 0.8
    fewer = judge_plan(
        epsilon=0.2, n_humans=3, human_accuracy=0.95, n_items=20, rng=plan.seed
    )
    assert fewer.power < 0.8 or plan.n_items == 30
    again = judge_plan(
        epsilon=0.2,
        n_humans=3,
        human_accuracy=0.95,
        n_items=plan.n_items,
        rng=plan.seed,
    )
    assert again == plan
