"""An estimate with the interval that its question and size call for."""

import itertools
import math
import warnings

import numpy as np
import pytest
from scipy.special import expit, logit
from scipy.stats import t as student

from masrel.agreement import fleiss_kappa
from masrel.errors import (
    MasrelWarning,
    SmallSampleWarning,
)
from masrel.estimates import Interval, Target
from masrel.intervals import estimate, posterior
from tests.intervals.data import dirichlet_multinomial

MEDIUM = dirichlet_multinomial(np.random.default_rng(3), 25, 4, 0.6)
LABELS = sorted({grade for row in MEDIUM for grade in row})
# 35 items of which the last of 6 raters puts every other one higher
APART = [
    [*row[:5], min(row[5] + i % 2, 2)]
    for i, row in enumerate(dirichlet_multinomial(np.random.default_rng(4), 35, 6, 0.6))
]
PERFECT = [["a", "a", "a"], ["b", "b", "b"]] * 8
BY_RULE = "chosen by auto-2026.2"


def chosen(ratings: object, target: Target, **options: object) -> Interval:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MasrelWarning)
        found = estimate("fleiss_kappa", ratings, target=target, **options)  # type: ignore[arg-type]
    assert found.interval is not None
    assert found.interval.target == target
    assert found.interval.notes[0].startswith("method chosen for other ")
    return found.interval


def without(ratings: list[list[str]], item: int | None, rater: int | None) -> float:
    rows = [
        [grade for r, grade in enumerate(row) if r != rater]
        for i, row in enumerate(ratings)
        if i != item
    ]
    return fleiss_kappa(rows, categories=LABELS).value


def variances(ratings: list[list[str]]) -> tuple[float, float, float]:
    """V_I, V_R and V_C by leaving out one by one."""
    n, r = len(ratings), len(ratings[0])
    kappa = without(ratings, None, None)
    items = [without(ratings, i, None) for i in range(n)]
    raters = [without(ratings, None, j) for j in range(r)]
    cells = sum(
        (without(ratings, i, j) - items[i] - raters[j] + kappa) ** 2
        for i, j in itertools.product(range(n), range(r))
    )
    return (
        (n - 1) * float(np.var(items)),
        (r - 1) * float(np.var(raters)),
        (n - 1) * (r - 1) / (n * r) * cells,
    )


def on_logit(value: float, half: float, n_raters: int) -> tuple[float, float]:
    """Symmetric on the logit of the position between -1/(r - 1) and 1."""
    low = -1 / (n_raters - 1)
    share = (value - low) / (1 - low)
    half /= (1 - low) * share * (1 - share)
    return tuple(  # type: ignore[return-value]
        low + (1 - low) * float(expit(logit(share) + x)) for x in (-half, half)
    )


def test_other_items_leave_items_out_on_a_scale_without_ends() -> None:
    rows = MEDIUM + MEDIUM[:5]
    of_items, _, _ = variances(rows)
    kappa = fleiss_kappa(rows).value
    half = student.ppf(0.975, 29) * math.sqrt(of_items)
    found = chosen(rows, "items", categories=LABELS)
    assert (found.low, found.high) == pytest.approx(on_logit(kappa, half, 4), rel=1e-9)
    assert found.method == f"item jackknife, t(29) on the logit, {BY_RULE}"


def test_below_thirty_items_the_upper_end_goes_halfway_to_a_higher_posterior() -> None:
    of_items, _, _ = variances(MEDIUM)
    kappa = fleiss_kappa(MEDIUM).value
    low, high = on_logit(kappa, student.ppf(0.975, 24) * math.sqrt(of_items), 4)
    above = posterior("fleiss_kappa", MEDIUM, target="items", categories=LABELS).high
    assert above > high
    found = chosen(MEDIUM, "items", categories=LABELS)
    assert (found.low, found.high) == pytest.approx((low, (high + above) / 2), rel=1e-9)
    assert any("halfway" in note for note in found.notes)


@pytest.mark.parametrize(
    "ratings", [MEDIUM, APART], ids=["cells hold more", "cells hold less"]
)
def test_both_add_the_distances_less_what_they_hold_in_common(
    ratings: list[list[int]],
) -> None:
    # in common they hold the variance of a rater on an item, or less if either has less
    of_items, of_raters, of_cells = variances(ratings)  # type: ignore[arg-type]
    kappa, n_raters = fleiss_kappa(ratings).value, len(ratings[0])
    t = student.ppf(0.975, n_raters - 1)  # the fewer degrees of freedom
    low, high = on_logit(kappa, t * math.sqrt(of_items), n_raters)
    if len(ratings) < 30:
        model = posterior("fleiss_kappa", ratings, target="items", categories=LABELS)
        high = max(high, (high + model.high) / 2)
    expected = []
    for distance in (kappa - low, high - kappa):
        parts = distance**2, t**2 * of_raters
        expected.append(math.sqrt(sum(parts) - min(*parts, t**2 * of_cells)))
    found = chosen(ratings, "both", categories=LABELS)
    assert found.low == pytest.approx(kappa - expected[0], rel=1e-9)
    assert found.high == pytest.approx(min(kappa + expected[1], 1.0), rel=1e-9)
    assert found.method == (
        f"item jackknife, t({n_raters - 1}) on the logit, "
        f"and rater jackknife, t({n_raters - 1}), {BY_RULE}"
    )


@pytest.mark.parametrize("target", ["items", "raters", "both"])
@pytest.mark.parametrize("level", [0.9, 0.95])
def test_perfect_agreement_is_bounded_from_below_by_the_model(
    target: Target, level: float
) -> None:
    found = chosen(PERFECT, target, level=level)
    central = posterior("fleiss_kappa", PERFECT, target="items", level=2 * level - 1)
    assert found.low == pytest.approx(central.low, rel=1e-9)
    assert found.high == 1.0
    assert found.kind == "credible"
    assert found.method == f"Dirichlet-multinomial posterior, one-sided, {BY_RULE}"
    assert found.is_one_sided
    assert "depends on the prior" in found.notes[1]


RARE = np.zeros((50, 3), dtype=int)
RARE[[0, 1, 2], [0, 1, 2]] = 1  # three items on which one of three sees something


def quietly(name: str, ratings: object, **options: object) -> Interval:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MasrelWarning)
        found = estimate(name, ratings, target="items", **options)  # type: ignore[arg-type]
    assert found.interval is not None
    return found.interval


def test_rare_categories_have_the_posterior_extended_to_the_estimate() -> None:
    with pytest.warns(SmallSampleWarning, match="3 items with a rating outside"):
        found = estimate("fleiss_kappa", RARE, target="items", categories=[0, 1])
    plain = posterior("fleiss_kappa", RARE, target="items", categories=[0, 1])
    interval = found.interval
    assert interval is not None
    # kappa is 1 - (3 · 2/3 / 50) / (2 · 0.02 · 0.98) = -1/49
    assert found.value == pytest.approx(-1.0 / 49.0, rel=1e-12)
    assert interval.low == pytest.approx(found.value, rel=1e-12)
    assert (interval.high, interval.median) == (plain.high, plain.median)
    assert plain.low == pytest.approx(0.008, abs=5e-4)
    assert plain.high == pytest.approx(0.693, abs=5e-4)
    assert "are rare (3 items" in interval.notes[0]
    assert any("posterior, 0.008, is extended" in note for note in interval.notes)


def test_the_rule_counts_items_outside_the_commonest_category() -> None:
    def method(n_outside: int, n_items: int) -> str:
        rows = np.zeros((n_items, 3), dtype=int)
        rows[:n_outside] = 1
        rows[: n_outside // 2, 0] = 0
        single = np.full((10, 3), -1.0)  # items of one rating do not count
        table = np.where(single < 0, np.nan, single)
        table[:, 0] = 1.0
        return quietly("fleiss_kappa", np.vstack([rows, table])).method

    assert "posterior" in method(29, 200)
    assert "jackknife" in method(30, 200)
    assert "jackknife" in method(20, 40)
    assert "posterior" in method(19, 40)


@pytest.mark.parametrize("name", ["fleiss_kappa", "gwet_ac"])
@pytest.mark.parametrize(
    ("n_items", "n_raters", "models"),
    [
        (30, 4, {"patterns"}),
        (29, 4, {"dirichlet-multinomial", "patterns"}),
        (30, 3, {"dirichlet-multinomial"}),
        (9, 9, {"dirichlet-multinomial"}),
        (9, 10, {"dirichlet-multinomial", "patterns"}),
    ],
)
def test_four_raters_of_rare_categories_have_the_posterior_of_patterns(
    name: str, n_items: int, n_raters: int, models: set[str]
) -> None:
    rows = np.zeros((n_items, n_raters), dtype=int)
    rows[:2], rows[2, 0] = 1, 1
    parts = [
        posterior(name, rows, target="items", model=model, n_draws=2_000, rng=1)  # type: ignore[arg-type]
        for model in models
    ]
    found = quietly(name, rows)
    low, high = min(of.low for of in parts), max(of.high for of in parts)
    assert (found.low, found.high) == pytest.approx((low, high), rel=1e-12)
    # as it was before: raters are taken for alike
    former = quietly(name, rows, method="auto-2026.1")
    alike = posterior(
        name,
        rows,
        target="items",
        model="dirichlet-multinomial",
        n_draws=2_000,
        rng=1,
    )
    assert (former.low, former.high) == pytest.approx((alike.low, alike.high))


@pytest.mark.parametrize("target", ["items", "raters", "both"])
def test_the_newest_rule_is_auto_and_says_its_name(target: Target) -> None:
    newest = chosen(MEDIUM, target, categories=LABELS)
    by_name = chosen(MEDIUM, target, categories=LABELS, method="auto-2026.2")
    assert newest == by_name
    assert newest.method.endswith(BY_RULE)
    former = chosen(MEDIUM, target, categories=LABELS, method="auto-2026.1")
    assert former.method.endswith("chosen by auto-2026.1")
    assert (former.low, former.high) == (newest.low, newest.high)


def by_turns(n_items: int, n_raters: int, changes: dict[int, str]) -> list[list[str]]:
    """Return items of a and b by turns, but for some."""
    rows = [letter * n_raters for letter in "ab"] * n_items
    return [list(changes.get(i, row)) for i, row in enumerate(rows[:n_items])]


def one_differs(n_items: int, n_raters: int) -> list[list[str]]:
    """Every third item is disputed by one rater, another each time."""
    changes = {}
    for k in range(n_items // 3):
        row, place = "ab"[k % 2] * n_raters, k % n_raters
        changes[3 * k] = row[:place] + "ba"[k % 2] + row[place + 1 :]
    return by_turns(n_items, n_raters, changes)


def half_differ(n_items: int, n_raters: int, n_disputed: int) -> list[list[str]]:
    """Some items are disputed by half of the raters, always the same."""
    row = "a" * (n_raters // 2) + "b" * (n_raters // 2)
    return by_turns(n_items, n_raters, {2 * k: row for k in range(n_disputed)})


MODEL, JACKKNIFE = "Dirichlet-multinomial posterior", "item jackknife"
TABLE, PATTERNS = "Dirichlet posterior of the table", "Dirichlet posterior of the pat"
# Either side of every limit of the rule: coefficient, weights, ratings, which others
# the interval is of, and its method.
RULE = {
    "9 items": ("fleiss_kappa", None, one_differs(9, 3), "items", MODEL),
    "10 items": ("fleiss_kappa", None, one_differs(10, 3), "items", JACKKNIFE),
    "9 raters": ("fleiss_kappa", None, one_differs(9, 9), "items", MODEL),
    "10 raters": ("fleiss_kappa", None, one_differs(9, 10), "items", JACKKNIFE),
    "few, 2 raters": ("gwet_ac", None, one_differs(9, 2), "items", TABLE),
    "few, 3 raters": ("gwet_ac", None, one_differs(9, 3), "items", MODEL),
    "few, told apart": ("conger_kappa", None, one_differs(9, 3), "items", MODEL),
    "few, weighted": ("fleiss_kappa", "linear", one_differs(9, 3), "items", PATTERNS),
    "few, 2, weighted": ("cohen_kappa", "linear", one_differs(9, 2), "items", TABLE),
    "few, raters": ("conger_kappa", None, MEDIUM[:9], "raters", "rater jackknife"),
    "2000 items": ("fleiss_kappa", None, by_turns(2000, 3, {}), "items", MODEL),
    "2001 items": ("fleiss_kappa", None, by_turns(2001, 3, {}), "items", PATTERNS),
    "spread of .0029": ("fleiss_kappa", None, half_differ(40, 4, 4), "raters", MODEL),
    "spread of .0036": (
        *("fleiss_kappa", None, half_differ(60, 6, 6)),
        *("raters", "rater jackknife"),
    ),
    "spread, told apart": (
        *("conger_kappa", None, half_differ(40, 4, 4)),
        *("raters", "rater jackknife"),
    ),
}


@pytest.mark.parametrize("case", RULE)
def test_the_rule_chooses_on_either_side_of_its_limits(case: str) -> None:
    name, weights, ratings, target, method = RULE[case]
    scale = None if weights is None else ["a", "b"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MasrelWarning)
        found = estimate(
            name,
            ratings,
            target=target,  # type: ignore[arg-type]
            weights=weights,
            categories=scale,
        )
    assert found.interval is not None
    assert found.interval.method.startswith(method)
    assert found.interval.kind == ("confidence" if "jack" in method else "credible")


@pytest.mark.parametrize(
    ("n_outside", "weights", "is_small"),
    [(4, None, True), (5, None, False), (5, "linear", True), (29, "linear", True)],
)
def test_few_outside_the_commonest_category_are_warned_of(
    n_outside: int, weights: str | None, is_small: bool
) -> None:
    ratings = np.zeros((60, 3), dtype=int)
    ratings[:n_outside, :2] = 1
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        estimate("fleiss_kappa", ratings, target="items", weights=weights)
    said = [w for w in caught if issubclass(w.category, SmallSampleWarning)]
    assert (len(said) > 0) == is_small


@pytest.mark.parametrize("weights", ["linear", "quadratic"])
def test_no_end_of_a_weighted_coefficient_is_lifted(weights: str) -> None:
    found = chosen(MEDIUM, "items", categories=LABELS, weights=weights)
    value = fleiss_kappa(MEDIUM, categories=LABELS, weights=weights).value
    # both ends are as far away on the logit between -1 and 1
    low, middle, high = (logit((1 + x) / 2) for x in (found.low, value, found.high))
    assert high - middle == pytest.approx(middle - low, rel=1e-9)


def test_a_lower_posterior_lowers_no_end() -> None:
    # 29 items of which one is disputed: the jackknife reaches further up
    rows = [[0] * 4, [1] * 4] * 14 + [[0, 0, 1, 1]]
    of_items, _, _ = variances(rows)
    kappa = fleiss_kappa(rows).value
    ends = on_logit(kappa, student.ppf(0.975, 28) * math.sqrt(of_items), 4)
    above = posterior("fleiss_kappa", rows, target="items", categories=LABELS).high
    assert above < ends[1]
    found = chosen(rows, "items", categories=LABELS)
    assert (found.low, found.high) == pytest.approx(ends, rel=1e-9)
    assert not any("halfway" in note for note in found.notes)
