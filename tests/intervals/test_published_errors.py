"""Errors that others publish: as packages print them, and by their formulas."""

import json
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from masrel.agreement import (
    COEFFICIENTS,
    cohen_kappa,
    cohen_kappa_from_table,
)
from masrel.errors import MasrelWarning, ParameterError, SmallSampleWarning
from masrel.estimates import Interval
from masrel.intervals import analytic
from tests.agreement.oracles import datasets

FILE = Path(__file__).parents[1] / "oracles" / "published_errors.json"
PUBLISHED: dict[str, dict[str, Any]] = json.loads(FILE.read_text("utf-8"))["errors"]
DATA = {dataset["name"]: dataset for dataset in datasets()}
TABLE = [[20, 5], [10, 15]]
PAIRS = [["a", "a"]] * 20 + [["a", "b"]] * 5 + [["b", "a"]] * 10 + [["b", "b"]] * 15
RATINGS = [list(row) for row in ("aaa", "aab", "bbb", "bcc", "cca", "aaa", "cbb")] * 2


def quiet(*args: Any, **options: Any) -> Interval:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MasrelWarning)
        return analytic(*args, **options)


def half(interval: Interval) -> float:
    return 0.5 * (interval.high - interval.low)


@pytest.mark.parametrize("name", PUBLISHED)
def test_intervals_are_those_that_packages_print(name: str) -> None:
    dataset = DATA[name]
    for key, printed in PUBLISHED[name].items():
        coefficient, _, rest = key.partition("/")
        weights, _, variant = rest.partition("@")
        ours = quiet(
            coefficient,
            dataset["ratings"],
            target="items",
            categories=dataset.get("categories"),
            weights="identity" if weights == "unweighted" else weights,
            error="over_n" if coefficient == "cohen_kappa" else "irrcac",
            distribution="normal" if variant in ("vcd", "psych") else "t",
        )
        low, high = printed["ci"]
        if low is None:  # one usable item, of which irrCAC has an error and no ends
            continue
        ends = (max(low, -1.0), min(high, 1.0))
        assert (ours.low, ours.high) == pytest.approx(ends, abs=1e-9), key


def test_cohens_own_error_by_hand() -> None:
    # p_o = .7, p_e = .5, n = 50: √(.7 · .3 / 50) / .5 = .129615; z = 1.959964
    interval = analytic(
        "cohen_kappa", PAIRS, target="items", error="cohen", distribution="normal"
    )
    by_hand = 1.959964 * math.sqrt(0.7 * 0.3 / 50) / 0.5
    assert half(interval) == pytest.approx(by_hand, rel=1e-6)
    assert interval.method == "Cohen's error, normal"
    # weights of two categories are identity weights
    for weights in ("linear", "quadratic"):
        same = analytic(
            *("cohen_kappa", PAIRS),
            target="items",
            weights=weights,
            categories=["a", "b"],
            error="cohen",
            distribution="normal",
        )
        assert half(same) == pytest.approx(by_hand, rel=1e-6)


@pytest.mark.parametrize("weights", ["identity", "linear", "quadratic"])
def test_cohens_error_with_weights(weights: Any) -> None:
    rng = np.random.default_rng(11)
    pairs = np.clip(rng.integers(0, 4, (40, 1)) + rng.integers(-1, 2, (40, 2)), 0, 3)
    w = 1.0 - np.abs(np.subtract.outer(range(4), range(4))) / 3.0
    w = {"identity": np.eye(4), "linear": w, "quadratic": 1.0 - (1.0 - w) ** 2}[weights]
    options: dict[str, Any] = {"categories": range(4), "weights": weights}
    kappa = cohen_kappa(pairs, **options)
    p = np.zeros((4, 4))
    np.add.at(p, (pairs[:, 0], pairs[:, 1]), 1 / 40)
    variance = ((w**2 * p).sum() - kappa.observed**2) / 40
    ours = analytic(
        *("cohen_kappa", pairs),
        target="items",
        error="cohen",
        distribution="normal",
        **options,
    )
    expected = 1.959964 * math.sqrt(variance) / (1.0 - kappa.chance)
    assert half(ours) == pytest.approx(expected, rel=1e-6)


def test_over_n_is_the_error_that_vcd_prints() -> None:
    # Fleiss, Cohen and Everitt's of the table: √(.2016/12.5) = .126996 (vcd, psych)
    interval = analytic(
        "cohen_kappa", PAIRS, target="items", error="over_n", distribution="normal"
    )
    assert half(interval) / 1.959964 == pytest.approx(0.126996062931, rel=1e-6)
    ours = cohen_kappa_from_table(TABLE).standard_error
    assert half(interval) / 1.959964 == pytest.approx(ours * math.sqrt(0.98), rel=1e-6)


def test_irrcacs_error_of_complete_ratings_is_ours_but_for_alpha() -> None:
    for name in ("fleiss_kappa", "gwet_ac", "percent_agreement", "conger_kappa"):
        irrcac = analytic(name, RATINGS, target="items", error="irrcac")
        ours = analytic(name, RATINGS, target="items")
        assert half(irrcac) == pytest.approx(half(ours), rel=1e-12)
    # of alpha it is that of Fleiss' kappa, as the factor for small samples is left out
    alpha = analytic("krippendorff_alpha", RATINGS, target="items", error="irrcac")
    kappa = analytic("fleiss_kappa", RATINGS, target="items")
    assert half(alpha) == pytest.approx(half(kappa), rel=1e-12)
    assert half(alpha) > half(analytic("krippendorff_alpha", RATINGS, target="items"))
    gaps = [[*row[:2], None] for row in RATINGS[:3]] + [["a", None, None], *RATINGS]
    single = analytic("gwet_ac", gaps, target="items", error="irrcac")
    assert half(single) > half(analytic("gwet_ac", gaps, target="items"))


@pytest.mark.parametrize("name", ["fleiss_kappa", "gwet_ac", "krippendorff_alpha"])
def test_the_unconditional_error_adds_what_raters_differ_by(name: str) -> None:
    rng = np.random.default_rng(5)
    truth = rng.integers(0, 3, (30, 1))
    ratings = np.where(rng.random((30, 6)) < 0.7, truth, rng.integers(0, 3, (30, 6)))
    function = COEFFICIENTS[name].function
    without = [
        function(np.delete(ratings, rater, axis=1), categories=range(3)).value
        for rater in range(6)
    ]
    of_raters = 5 / 6 * sum((value - np.mean(without)) ** 2 for value in without)
    of_items = function(ratings, categories=range(3)).standard_error
    interval = analytic(
        *(name, ratings),
        target="both",
        categories=range(3),
        error="unconditional",
        distribution="normal",
    )
    expected = 1.959964 * math.sqrt(of_items**2 + of_raters)
    assert half(interval) == pytest.approx(expected, rel=1e-6)
    assert (interval.target, interval.unit) == ("both", "raters")
    # by Student's t it has the degrees of freedom of the fewer, here 6 - 1: 2.570582
    by_t = analytic(
        name, ratings, target="both", categories=range(3), error="unconditional"
    )
    assert half(by_t) == pytest.approx(2.570582 / 1.959964 * expected, rel=1e-6)
    assert by_t.method == "Gwet's unconditional error, t(min(n, r)-1)"


def test_an_error_answers_one_question_of_some_coefficients() -> None:
    def refused(match: str, name: str = "fleiss_kappa", **options: Any) -> None:
        rows = PAIRS if name in ("cohen_kappa", "scott_pi") else RATINGS
        with pytest.raises(ParameterError, match=match):
            analytic(name, rows, **{"target": "items", **options})

    refused("error: needs one of delta, over_n, cohen, irr", error="vcd")
    refused('other items and raters, so "both"; got "items"', error="unconditional")
    refused('for both error="unconditional"; got "both"', target="both")
    refused('to other items only, so "items".*got "raters"', target="raters")
    refused('"cohen" is of Cohen\'s κ alone, got Fleiss', error="cohen")
    refused("irrCAC has none of Cohen's κ", "cohen_kappa", error="irrcac")
    refused("irrCAC has none of Scott's π", "scott_pi", error="irrcac")
    refused(
        "needs at least 3 raters, because one is left out",
        *("cohen_kappa",),
        target="both",
        error="unconditional",
    )


def test_few_raters_are_warned_of() -> None:
    with pytest.warns(SmallSampleWarning, match="3 raters: below 5"):
        analytic("fleiss_kappa", RATINGS, target="both", error="unconditional")
