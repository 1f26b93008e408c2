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
    fleiss_null,
    gwet_ac,
    icc,
    icc_f_test,
    krippendorff_alpha,
    light_kappa,
    p_value,
    percent_agreement,
    scott_pi,
)
from masrel.estimates import Estimate
from masrel.intervals import analytic

# The four items of the page, and the same with gaps: one item of a single rating.
RATINGS = [[1, 1, 1], [1, 1, 2], [2, 2, 2], [2, 3, 3]]
GAPS = [[1, 1, 1], [1, 1, 2], [2, 2, 2], [2, 3, None], [3, None, None]]
RATERS = ["Kim", "Lee", "Ann"]
COUNTS = [[3, 0, 0], [2, 1, 0], [0, 3, 0], [0, 1, 2]]
KIM_LEE = [row[:2] for row in RATINGS]
TABLE = [[0, 2, 1], [2, 0, 1], [1, 2, 0]]

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


def test_interval_from_the_error_under_no_agreement() -> None:
    # what STATS FLEISS KAPPA (SPSS) and JASP take for an interval
    kappa = fleiss_kappa(RATINGS)
    null = kappa.value / fleiss_null(RATINGS).statistic
    assert kappa.value - 1.959964 * null == pytest.approx(0.045, abs=5e-4)
    assert kappa.value + 1.959964 * null == pytest.approx(0.888, abs=5e-4)
    assert kappa.standard_error > 1.2 * null


# irrCAC


def irrcac(rows: Any, name: str, **options: Any) -> dict[str, Any]:
    raw = package("irrCAC.raw")
    frame = pd.DataFrame(rows, columns=RATERS, dtype=float)
    return quiet(getattr(raw.CAC(frame, digits=12, **options), name))["est"]


@of_items
def test_irrcac_has_our_value_error_and_interval_of_complete_items(name: str) -> None:
    printed, ours = irrcac(RATINGS, name), CAC[name](RATINGS)
    assert printed["coefficient_value"] == pytest.approx(ours.value, abs=1e-11)
    assert printed["se"] == pytest.approx(ours.standard_error, abs=1e-11)
    interval = quiet(analytic, ours.coefficient, RATINGS, target="items")
    ends = (interval.low, interval.high)
    assert printed["confidence_interval"] == pytest.approx(ends, abs=1e-11)
    finite = CAC[name](RATINGS, population=10)
    assert irrcac(RATINGS, name, N=10)["se"] == pytest.approx(
        finite.standard_error, abs=1e-11
    )


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


def test_irrcac_error_of_alpha_is_that_of_fleiss_kappa() -> None:
    printed, ours = irrcac(RATINGS, "krippendorff"), krippendorff_alpha(RATINGS)
    assert printed["coefficient_value"] == pytest.approx(ours.value, abs=1e-11)
    assert printed["se"] == pytest.approx(fleiss_kappa(RATINGS).standard_error)
    assert ours.standard_error == pytest.approx(0.250, abs=5e-4)


def test_irrcac_one_sided_p_of_brennan_prediger() -> None:
    one_sided = irrcac(RATINGS, "bp")["p_value"]
    assert p_value(brennan_prediger(RATINGS)) == pytest.approx(2 * one_sided, abs=1e-9)


@pytest.mark.skipif(int(pd.__version__.split(".")[0]) < 3, reason="pandas below 3")
@pytest.mark.parametrize("name", ["gwet", "bp"])
def test_irrcac_takes_a_gap_for_a_grade(name: str) -> None:
    undeclared = irrcac(GAPS, name)["coefficient_value"]
    more = CAC[name](GAPS, categories=[1, 2, 3, 4]).value
    assert undeclared == pytest.approx(more, abs=1e-11)
    assert undeclared > CAC[name](GAPS).value + 0.05


def test_irrcac_of_one_category_fails() -> None:
    with pytest.raises(ZeroDivisionError):
        irrcac([[1, 1, 1]] * 3, "fleiss")


@pytest.mark.parametrize(
    ("name", "ours"),
    [("cohen", cohen_kappa), ("scott", scott_pi)],
)
def test_irrcac_error_of_a_table_is_over_n(
    name: str, ours: Callable[..., Estimate]
) -> None:
    table = package("irrCAC.table").CAC(pd.DataFrame(TABLE), digits=12)
    printed, estimate = quiet(getattr(table, name))["est"], ours(count_table(TABLE))
    assert printed["coefficient_value"] == pytest.approx(estimate.value, abs=1e-11)
    over_n = estimate.standard_error * math.sqrt(8 / 9)
    assert printed["se"] == pytest.approx(over_n, abs=1e-11)


# scikit-learn, statsmodels, krippendorff


@pytest.mark.parametrize("weights", [None, "linear", "quadratic"])
def test_sklearn_has_our_value_of_neighbouring_grades(weights: Any) -> None:
    kappa = package("sklearn.metrics").cohen_kappa_score
    kim, lee = zip(*KIM_LEE, strict=True)
    ours = cohen_kappa(
        list(zip(kim, lee, strict=True)), weights=weights or "identity"
    ).value
    assert kappa(kim, lee, weights=weights) == pytest.approx(ours, rel=1e-12)


def test_sklearn_weighs_grades_by_place() -> None:
    kappa = package("sklearn.metrics").cohen_kappa_score
    pairs = [[1, 2], [2, 2], [5, 5], [1, 5]]
    printed = kappa(*zip(*pairs, strict=True), weights="linear")
    text = [[str(grade) for grade in row] for row in pairs]
    places = cohen_kappa(text, categories=["1", "2", "5"], weights="linear")
    assert printed == pytest.approx(0.25)
    assert places.value == pytest.approx(printed)
    assert cohen_kappa(pairs, weights="linear").value == 0.375


def test_sklearn_puts_text_into_the_order_of_its_letters() -> None:
    kappa = package("sklearn.metrics").cohen_kappa_score
    first, second = ["1", "1+", "10", "2"], ["1", "1+", "2", "2"]
    scale = ["1", "1+", "2", "10"]
    ours = cohen_kappa(
        list(zip(first, second, strict=True)), categories=scale, weights="linear"
    ).value
    declared = kappa(first, second, labels=scale, weights="linear")
    assert declared == pytest.approx(ours)
    assert kappa(first, second, weights="linear") != pytest.approx(ours, abs=0.01)


@pytest.mark.parametrize("gap", [None, math.nan])
def test_sklearn_refuses_a_gap(gap: float | None) -> None:
    kappa = package("sklearn.metrics").cohen_kappa_score
    with pytest.raises(ValueError, match=r"mix of|NaN"):
        quiet(kappa, [1, 2, gap], [1, 2, 2])


@pytest.mark.parametrize("weights", [None, "linear", "quadratic"])
def test_statsmodels_error_of_cohens_kappa_is_over_n(weights: Any) -> None:
    table = [[2, 1, 0], [0, 3, 1], [1, 0, 1]]
    printed = inter_rater.cohens_kappa(table, wt=weights)
    ours = cohen_kappa(count_table(table), weights=weights or "identity")
    assert printed.kappa == pytest.approx(ours.value, rel=1e-12)
    over_n = ours.standard_error * math.sqrt(8 / 9)
    assert printed.std_kappa == pytest.approx(over_n, rel=1e-12)


def test_statsmodels_has_our_fleiss_kappa_and_brennan_prediger() -> None:
    counts, _ = inter_rater.aggregate_raters(np.array(RATINGS))
    assert counts.tolist() == COUNTS
    fleiss = inter_rater.fleiss_kappa(counts)
    assert fleiss == pytest.approx(fleiss_kappa(RATINGS).value, rel=1e-12)
    randolph = inter_rater.fleiss_kappa(counts, method="randolph")
    assert randolph == pytest.approx(brennan_prediger(RATINGS).value, rel=1e-12)


def test_statsmodels_makes_a_gap_a_category_and_needs_equal_numbers() -> None:
    counts, _ = inter_rater.aggregate_raters(np.array(GAPS, dtype=float))
    assert counts.shape == (5, 4)
    with pytest.raises(AssertionError):
        inter_rater.fleiss_kappa(np.array([[2, 0], [1, 2]]))


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
    ours, test = icc(RATINGS, form=form), icc_f_test(RATINGS, form=form)
    assert printed["ICC"] == pytest.approx(ours.value, rel=1e-9)
    assert printed["F"] == pytest.approx(test.statistic, rel=1e-9)
    assert printed["pval"] == pytest.approx(test.p_value, rel=1e-9)
    assert ours.interval is not None
    ends = [round(end, 2) for end in (ours.interval.low, ours.interval.high)]
    assert list(printed["CI95"]) == ends


def test_pingouin_averages_repeated_ratings() -> None:
    rows = long(RATINGS)
    rater, item, grade = rows[0]
    twice = [(rater, item, grade - 1), (rater, item, grade + 1), *rows[1:]]
    assert pingouin_icc(twice).equals(pingouin_icc(rows))


def test_pingouin_leaves_an_item_with_a_gap_out_when_told_so() -> None:
    rows = long(RATINGS)[1:]
    with pytest.raises(ValueError, match="unbalanced"):
        pingouin_icc(rows)
    printed = pingouin_icc(rows, nan_policy="omit").loc["ICC(A,1)", "ICC"]
    assert printed == pytest.approx(icc(RATINGS[1:]).value, rel=1e-9)
    gap: Any = [[None, 1, 1], *RATINGS[1:]]  # which we take as it is
    assert printed != pytest.approx(icc(gap).value, rel=1e-3)


def test_pingouin_cronbachs_alpha_is_consistency_of_the_mean() -> None:
    alpha, ends = package("pingouin").cronbach_alpha(pd.DataFrame(RATINGS))
    ours = icc(RATINGS, form="ICC(C,k)")
    assert alpha == pytest.approx(ours.value, rel=1e-12)
    assert ours.interval is not None
    printed = [round(end, 3) for end in (ours.interval.low, ours.interval.high)]
    assert list(ends) == printed


# NLTK


def annotation_task(rows: list[tuple[str, str, int]], **options: Any) -> Any:
    return package("nltk.metrics.agreement").AnnotationTask(data=rows, **options)


@pytest.mark.parametrize(
    ("name", "ours"),
    [
        ("avg_Ao", percent_agreement),
        ("kappa", light_kappa),
        ("multi_kappa", conger_kappa),
        ("pi", fleiss_kappa),
        ("S", brennan_prediger),
        ("alpha", krippendorff_alpha),
    ],
)
def test_nltk_has_our_value(name: str, ours: Callable[..., Estimate]) -> None:
    printed = getattr(annotation_task(long(RATINGS)), name)()
    assert printed == pytest.approx(ours(RATINGS).value, rel=1e-12)


def test_nltk_interval_distance() -> None:
    distance = package("nltk.metrics.distance").interval_distance
    task = annotation_task(long(RATINGS), distance=distance)
    alpha = krippendorff_alpha(RATINGS, metric="interval").value
    assert task.alpha() == pytest.approx(alpha, rel=1e-12)
    light = light_kappa(RATINGS, weights="quadratic").value
    assert task.weighted_kappa() == pytest.approx(light, rel=1e-12)


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


def test_nltk_distance_is_left_out_of_chance() -> None:
    task = annotation_task(long(RATINGS), distance=lambda x, y: abs(x - y) / 2)
    observed = percent_agreement(RATINGS, weights="linear").value
    chance = fleiss_kappa(RATINGS).chance
    assert task.pi() == pytest.approx((observed - chance) / (1 - chance), rel=1e-12)
    assert task.pi() == pytest.approx(0.733, abs=5e-4)
    weighted = fleiss_kappa(RATINGS, weights="linear").value
    assert weighted == pytest.approx(0.564, abs=5e-4)


def test_nltk_with_a_gap_has_alpha_alone() -> None:
    task = annotation_task(long(RATINGS)[:-1])
    gap: Any = [*RATINGS[:3], [2, 3, None]]
    alpha = krippendorff_alpha(gap).value
    assert task.alpha() == pytest.approx(alpha, rel=1e-12)
    for name in ("avg_Ao", "kappa", "multi_kappa", "pi", "S"):
        with pytest.raises((RuntimeError, StopIteration)):
            getattr(task, name)()


def test_nltk_of_one_label_is_perfect() -> None:
    task = annotation_task(long([[1, 1, 1]] * 2))
    assert task.alpha() == 1
    assert task.pi() == 1.0
