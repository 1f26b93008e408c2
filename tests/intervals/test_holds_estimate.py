"""An interval holds its estimate: of every method that promises it, every coefficient.

Whoever adds a method to `masrel.intervals` puts it into one of the two lists here.
"""

import math
import warnings
from collections.abc import Callable

import numpy as np
import pytest

import masrel.intervals
from masrel.agreement import COEFFICIENTS
from masrel.errors import (
    MasrelWarning,
    ParameterError,
    UndefinedStatisticWarning,
)
from masrel.estimates import Interval
from masrel.intervals import analytic, difference, estimate, jackknife

Outcome = tuple[float, Interval]
Method = Callable[..., Outcome]


def of_interval(method: Callable[..., Interval], **fixed: object) -> Method:
    def outcome(coefficient: str, ratings: object, **options: object) -> Outcome:
        options.update(fixed)
        interval = method(coefficient, ratings, **options)
        options = {k: options[k] for k in ("categories", "weights")}
        return COEFFICIENTS[coefficient](ratings, **options).value, interval  # type: ignore[arg-type]

    return outcome


def of_estimate(target: str) -> Method:
    def outcome(coefficient: str, ratings: object, **options: object) -> Outcome:
        result = estimate(coefficient, ratings, target=target, **options)  # type: ignore[arg-type]
        assert result.interval is not None
        return result.value, result.interval

    return outcome


def of_difference(design: str) -> Method:
    def outcome(coefficient: str, ratings: object, **options: object) -> Outcome:
        # the same ratings shifted: two raters or more still rate every item
        other = mirrored(ratings)
        result = difference(coefficient, ratings, other, design=design, **options)  # type: ignore[arg-type]
        assert result.interval is not None
        return result.value, result.interval

    return outcome


def mirrored(ratings: object) -> object:
    """Ratings of as many other items: every second grade of the first rater is 0."""
    if isinstance(ratings, list):
        return [mirrored(rater) for rater in ratings]
    other = np.array(ratings)
    other[::2, 0] = 0
    return other


PROMISE: dict[str, Method] = {
    **{
        f"analytic, {distribution}": of_interval(
            analytic, target="items", distribution=distribution
        )
        for distribution in ("t", "normal", "logit", "fisher")
    },
    **{
        f"jackknife of {target}": of_interval(jackknife, target=target)
        for target in ("items", "raters", "both")
    },
    **{
        f"estimate for other {target}": of_estimate(target)
        for target in ("items", "raters", "both")
    },
    "difference, dependent": of_difference("dependent"),
    "difference, independent": of_difference("independent"),
}
DO_NOT_PROMISE = {
    "bootstrap": "a bootstrap distribution may lie to one side of the estimate",
    "posterior": "so may a posterior, which a prior pulls",
    "retest_model": "the same",
    "latent_trait": "the same",
    "difference_test": "it is a p-value, not an interval",
    "equality_test": "the same",
    "donner_test": "the same",
    "differences": "of many pairs at once; test_several.py holds them to their values",
    "diagnose": "the same; its intervals are those of `estimate` and `difference`",
}
KERNELS = [name for name, entry in COEFFICIENTS.items() if entry.formula is not None]
OF_RATERS = ("raters", "both")


def test_every_method_is_in_a_list() -> None:
    methods = {name for name in masrel.intervals.__all__ if name[0].islower()}
    listed = {name.split(",")[0].split()[0] for name in PROMISE} | set(DO_NOT_PROMISE)
    assert methods <= listed


def made(coefficient: str, seed: int) -> tuple[object, int]:
    """Ratings of some size, every second time with gaps, as codes 0 to q - 1; and q."""
    rng = np.random.default_rng(seed)
    n, r, q = rng.integers(3, 30), rng.integers(3, 6), int(rng.integers(2, 5))
    # every third time most ratings are of one category
    shape = np.full(q, rng.choice([0.1, 1.0, 10.0]))
    shape[0] += 20.0 * (seed % 3 == 2)
    shares = rng.dirichlet(shape, n).cumsum(axis=1)
    codes = (rng.random((n, r, 1)) > shares[:, None, :-1]).sum(axis=2).astype(object)
    codes[:2] = [0, 1, *[1] * (r - 2)], [1] * r  # so that two categories are used
    entry = COEFFICIENTS[coefficient]
    if entry.n_raters[1] == 2:
        codes = codes[:, :2]
    if seed % 2 and not (entry.has_interval and entry.formula):
        codes[1:][rng.random((n - 1, codes.shape[1])) < 0.1] = None
    if entry.shape == "pairs":
        return [codes[:, :2], codes[:, 1:3]], q
    return codes, q


def check(outcome: Outcome, noted: list[warnings.WarningMessage] | None = None) -> None:
    value, interval = outcome
    if math.isnan(interval.low) or math.isnan(value):
        assert math.isnan(interval.low)
        assert math.isnan(interval.high)
        assert interval.reason
        assert noted is None or any(
            issubclass(w.category, UndefinedStatisticWarning) for w in noted
        )
        return
    # the value is of integers and the interval of floats: they may differ in rounding
    near = 1e-12 * max(1.0, abs(value))
    assert interval.low - near <= value <= interval.high + near


@pytest.mark.parametrize("coefficient", KERNELS)
@pytest.mark.parametrize("method", PROMISE)
def test_an_interval_holds_its_estimate(method: str, coefficient: str) -> None:
    entry = COEFFICIENTS[coefficient]
    weights = ("identity", "quadratic", "linear") if entry.weighted else ("identity",)
    for seed, level in enumerate((0.5, 0.95, 0.999)):
        ratings, q = made(coefficient, seed)
        options = {
            "categories": range(q),
            "weights": weights[seed % len(weights)],
            "level": level,
        }
        is_chosen = method.startswith("estimate")
        is_of_items = entry.has_interval and not (
            is_chosen and entry.interval_target == "both"
        )
        if method.endswith(OF_RATERS) and (entry.n_raters[1] == 2 or is_of_items):
            match = "at least 3 raters"
            if is_of_items:
                match = "needs target" if is_chosen else "are left out or drawn"
            with pytest.raises(ParameterError, match=match):
                PROMISE[method](coefficient, ratings, **options)
            continue
        with warnings.catch_warnings(record=True) as noted:
            warnings.simplefilter("always", MasrelWarning)
            outcome = PROMISE[method](coefficient, ratings, **options)
        check(outcome, noted)
        assert outcome[1].level == level


@pytest.mark.parametrize("method", PROMISE)
def test_an_interval_holds_an_estimate_below_minus_one(method: str) -> None:
    # Only the categories 0 and 1 disagree, and always where they are met: of 33 items
    # 4 disagree, 8 of 99 ratings are 0 or 1 and share it. With two raters
    # D_o = 4/33, D_e = 2 (4/66)², and 1 - D_o / D_e = 1 - 2 · 33/4 = -15.5.
    weights = [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]]
    ratings = np.array([[0, 1]] * 4 + [[2, 2]] * 29)
    coefficient = "fleiss_kappa"
    if method.endswith(OF_RATERS):  # a third rater, so that one can be left out
        ratings = np.column_stack([ratings, ratings[:, 0]])
    options = {"categories": range(3), "weights": weights, "level": 0.95}
    value = COEFFICIENTS[coefficient](
        ratings, categories=range(3), weights=weights
    ).value
    if not method.endswith(OF_RATERS):
        assert value == pytest.approx(-15.5, rel=1e-12)
    assert value < -1.0
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("always", MasrelWarning)
        outcome = PROMISE[method](coefficient, ratings, **options)
    check(outcome, noted)
