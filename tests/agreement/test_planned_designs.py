"""Designs of g studies to come: intervals that they can expect."""

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from masrel.agreement import GStudy, d_study, design_precision, g_study
from masrel.errors import ParameterError


def pilot(rng: np.random.Generator, n: int = 40, n_raters: int = 3) -> GStudy:
    """Variances of 1 of persons, .3 of raters, and .5 of the rest."""
    grade = rng.normal(size=(n, 1)) + math.sqrt(0.3) * rng.normal(size=n_raters)
    grade = grade + math.sqrt(0.5) * rng.normal(size=(n, n_raters))
    person, rater = np.indices(grade.shape).reshape(2, -1)
    frame = pd.DataFrame({"person": person, "rater": rater, "grade": grade.ravel()})
    return g_study(frame, of="person", facets=["rater"])


@pytest.mark.parametrize(
    ("n", "k", "of"), [(25, 4, "dependability"), (100, 2, "generalizability")]
)
def test_intervals_are_those_of_studies_that_are_drawn(n: int, k: int, of: Any) -> None:
    # 200 studies each: five standard errors of the difference, fails once in 10⁶
    rng, known = np.random.default_rng(4), pilot(np.random.default_rng(1))
    true = np.sqrt([max(part, 0.0) for part in known.components.values()])
    drawn = []
    for _ in range(200):
        person, rater, rest = (rng.normal(size=size) for size in ((n, 1), k, (n, k)))
        grade = true[0] * person + true[1] * rater + true[2] * rest
        codes = np.indices(grade.shape).reshape(2, -1)
        frame = pd.DataFrame(dict(zip(("person", "rater"), codes, strict=True)))
        frame["grade"] = grade.ravel()
        study = g_study(frame, of="person", facets=["rater"])
        drawn.append(getattr(study.d_study(rater=k), f"{of}_interval"))
    plan = design_precision(known, {"rater": k}, n_persons=n, aim=0.6, of=of)
    low, high = np.array([(interval.low, interval.high) for interval in drawn]).T
    planned = plan.low, plan.high, plan.high - plan.low
    for expected, ends in zip(planned, (low, high, high - low), strict=True):
        error = math.sqrt(2.0) * ends.std() / math.sqrt(200)
        assert expected == pytest.approx(ends.mean(), abs=5.0 * error)
    chance = np.mean(low >= 0.6)
    assert plan.chance == pytest.approx(chance, abs=5.0 * math.sqrt(0.5 / 200))


def test_more_persons_and_raters_tell_more() -> None:
    known = pilot(np.random.default_rng(1))
    options: Any = {"of": "generalizability", "n_studies": 30}
    plans = [
        design_precision(known, {"rater": k}, n_persons=n, **options)
        for k, n in ((3, 20), (3, 200), (12, 200))
    ]
    widths = [plan.high - plan.low for plan in plans]
    assert widths == sorted(widths, reverse=True)
    true = d_study(known, {"rater": 12}).generalizability
    assert plans[-1].low < true < plans[-1].high
    assert design_precision(known, {"rater": 3}, n_persons=20, **options) == plans[0]


def test_several_ratings_of_a_cell_are_planned_as_one() -> None:
    rng = np.random.default_rng(2)
    rows = [
        (p, r, level + rng.normal() * 0.3 + rng.normal())
        for p, level in enumerate(rng.normal(size=30))
        for r in range(3)
        for _ in range(2)
    ]
    frame = pd.DataFrame(rows, columns=["person", "rater", "grade"])
    known = g_study(frame, of="person", facets=["rater"])
    assert "residual" in known.components
    plan = design_precision(known, {"rater": 1}, n_persons=200, n_studies=30)
    assert plan.low < known.d_study(rater=1).dependability < plan.high


@pytest.mark.parametrize(
    ("sizes", "options", "name"),
    [
        ({"rater": 2}, {"n_persons": 1}, "n_persons"),
        ({"rater": 0}, {"n_persons": 9}, "rater"),
        ({"task": 2}, {"n_persons": 9}, "sizes"),
        ({"rater": 2}, {"n_persons": 9, "aim": 1.5}, "aim"),
        ({"rater": 2}, {"n_persons": 9, "of": "kappa"}, "of"),
    ],
)
def test_bad_designs_are_refused(
    sizes: dict[str, int], options: Any, name: str
) -> None:
    with pytest.raises(ParameterError, match=name):
        design_precision(pilot(np.random.default_rng(1)), sizes, **options)
