"""What docs/coming_from.md says of other programs, for those that can be run here.

Each package is needed by its own tests alone, which are skipped without it.
"""

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest
from statsmodels.stats import inter_rater

from masrel.agreement import (
    brennan_prediger,
    cohen_kappa,
    conger_kappa,
    count_table,
    fleiss_kappa,
    gwet_ac,
    icc,
    icc_f_test,
    krippendorff_alpha,
)
from masrel.intervals import analytic

# The four items of the page, and the same with gaps: one item of a single rating.
RATINGS = [[1, 1, 1], [1, 1, 2], [2, 2, 2], [2, 3, 3]]
GAPS = [[1, 1, 1], [1, 1, 2], [2, 2, 2], [2, 3, None], [3, None, None]]
RATERS = ["Kim", "Lee", "Ann"]

CAC = {
    "fleiss": fleiss_kappa,
    "conger": conger_kappa,
    "gwet": gwet_ac,
    "bp": brennan_prediger,
    "krippendorff": krippendorff_alpha,
}
of_items = pytest.mark.parametrize("name", [n for n in CAC if n != "krippendorff"])
FORMS = {
    "ICC(1,1)": "ICC(1)",
    "ICC(A,1)": "ICC(A,1)",
    "ICC(C,1)": "ICC(C,1)",
    "ICC(1,k)": "ICC(1,k)",
    "ICC(A,k)": "ICC(A,k)",
    "ICC(C,k)": "ICC(C,k)",
}
METRICS = ("nominal", "ordinal", "interval", "ratio")


def package(name: str) -> Any:
    """Return a package, whose own warnings are not ours, or skip the test."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(name)


def long(rows: list[list[int]]) -> list[tuple[str, str, int]]:
    """Return rater, item and grade of every rating."""
    return [
        (rater, f"item {i}", grade)
        for i, row in enumerate(rows)
        for rater, grade in zip(RATERS, row, strict=True)
    ]


def quiet(function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """Return what a function does, without what it warns of."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return function(*args, **kwargs)


# SPSS and JASP cannot be run: their formulas, and an output that was published.


def test_spss_crosstabs_prints_an_error_over_n_and_t_under_no_agreement() -> None:
    # https://stats.oarc.ucla.edu/spss/faq/ on unequal ranges of scores: 12 films
    # prints Kappa .500, Asymp. Std. Error .156, Approx. T 3.000
    films = [[4, 0, 0], [0, 4, 0], [0, 4, 0]]
    kappa = cohen_kappa(count_table(films))
    assert kappa.value == 0.5
    assert kappa.standard_error == pytest.approx(0.163, abs=5e-4)
    assert kappa.standard_error * math.sqrt(11 / 12) == pytest.approx(0.156, abs=5e-4)
    null = inter_rater.cohens_kappa(films).std_kappa0
    assert kappa.value / null == pytest.approx(3.0, abs=5e-4)


# irrCAC


def irrcac(rows: Any, name: str, **options: Any) -> dict[str, Any]:
    raw = package("irrCAC.raw")
    frame = pd.DataFrame(rows, columns=RATERS, dtype=float)
    return quiet(getattr(raw.CAC(frame, digits=12, **options), name))["est"]


@of_items
def test_irrcac_error_with_a_single_rating_is_offered_by_name(name: str) -> None:
    printed = irrcac(GAPS, name, categories=[1.0, 2.0, 3.0])
    ours = CAC[name](GAPS)
    assert printed["coefficient_value"] == pytest.approx(ours.value, abs=1e-11)
    assert printed["se"] > ours.standard_error
    interval = quiet(
        *(analytic, ours.coefficient, GAPS),
        target="items",
        convention="irrcac",
        distribution="normal",
        level=0.2,  # whose quantile is 0.2533471, so that no end is cut
    )
    half = 0.5 * (interval.high - interval.low)
    assert printed["se"] == pytest.approx(half / 0.2533471031357997, abs=1e-9)
    options = {"target": "items", "convention": "irrcac"}
    interval = quiet(analytic, ours.coefficient, GAPS, **options)
    low, high = printed["confidence_interval"]
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=1e-9)


# scikit-learn, statsmodels, krippendorff


@pytest.mark.parametrize("rows", [RATINGS, GAPS], ids=["complete", "gaps"])
@pytest.mark.parametrize("metric", METRICS)
def test_krippendorff_has_our_alpha(metric: Any, rows: Any) -> None:
    data = np.array(rows, dtype=float).T  # raters by items
    alpha = package("krippendorff").alpha
    ours = krippendorff_alpha(rows, metric=metric).value
    printed = alpha(reliability_data=data, level_of_measurement=metric)
    assert printed == pytest.approx(ours, rel=1e-12)
    if metric == "interval":  # its default
        assert alpha(reliability_data=data) == printed


# pingouin


def pingouin_icc(rows: list[tuple[str, str, int]], **options: Any) -> Any:
    frame = pd.DataFrame(rows, columns=["rater", "item", "grade"])
    result = quiet(
        package("pingouin").intraclass_corr,
        frame,
        targets="item",
        raters="rater",
        ratings="grade",
        **options,
    )
    return result.set_index("Type")


@pytest.mark.parametrize("name", FORMS)
def test_pingouin_has_our_icc_and_rounds_its_interval(name: str) -> None:
    printed = pingouin_icc(long(RATINGS)).loc[name]
    form: Any = FORMS[name]
    ours = icc(RATINGS, form=form, interval="F")
    test = icc_f_test(RATINGS, form=form)
    assert printed["ICC"] == pytest.approx(ours.value, rel=1e-9)
    assert printed["F"] == pytest.approx(test.statistic, rel=1e-9)
    assert printed["pval"] == pytest.approx(test.p_value, rel=1e-9)
    assert ours.interval is not None
    ends = [round(end, 2) for end in (ours.interval.low, ours.interval.high)]
    assert list(printed["CI95"]) == ends


# NLTK


def annotation_task(rows: list[tuple[str, str, int]], **options: Any) -> Any:
    return package("nltk.metrics.agreement").AnnotationTask(data=rows, **options)


SETS = [[{"a"}, {"a", "b"}], [{"a", "b"}, {"b", "c"}], [{"c"}, {"c"}], [{"a"}, {"c"}]]


@pytest.mark.parametrize(
    ("metric", "abs_"),
    # nltk rounds Passonneau's 2/3 and 1/3 to .67 and .33
    [("jaccard", 1e-12), ("masi", 5e-3)],
)
def test_nltk_distances_of_sets(metric: Any, abs_: float) -> None:
    distance = getattr(package("nltk.metrics.distance"), f"{metric}_distance")
    rows: Any = [
        (f"rater {j}", f"item {i}", frozenset(labels))
        for i, row in enumerate(SETS)
        for j, labels in enumerate(row)
    ]
    alpha = annotation_task(rows, distance=distance).alpha()
    ours = krippendorff_alpha(SETS, metric=metric).value
    assert ours == pytest.approx(alpha, abs=abs_)
