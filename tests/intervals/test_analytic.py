"""Delta-method intervals: printed values, a hand-worked one, coverage, refusals."""

import math
import warnings

import numpy as np
import pytest

from masrel.agreement import fleiss_kappa, percent_agreement
from masrel.errors import (
    ParameterError,
    RatingsError,
    SmallSampleWarning,
    UndefinedStatisticWarning,
)
from masrel.intervals import analytic
from tests.intervals.data import SCALE, TABLE_V, dirichlet_multinomial

few = pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")


@few
@pytest.mark.parametrize(
    ("distribution", "low", "high"),
    [("normal", 0.398, 0.854), ("t", 0.256, 0.996)],
)
def test_table_v_as_other_programs_print_it(
    distribution: str, low: float, high: float
) -> None:
    found = analytic(
        "fleiss_kappa",
        TABLE_V,
        target="items",
        categories=SCALE,
        distribution=distribution,  # type: ignore[arg-type]
    )
    assert found.low == pytest.approx(low, abs=5e-4)
    assert found.high == pytest.approx(high, abs=5e-4)
    assert (found.kind, found.target, found.level) == ("confidence", "items", 0.95)


@few
def test_percent_agreement_has_the_t_interval_of_a_mean() -> None:
    # Shares of agreeing pairs per item 21, 16, 28, 16 of 28: mean 81/112, sd by hand,
    # t(3; .975) = 3.18244630528371 (any table of Student's t).
    shares = np.array([21, 16, 28, 16]) / 28
    error = math.sqrt(((shares - 81 / 112) ** 2).sum() / 3 / 4)
    found = analytic(percent_agreement, TABLE_V, target="items")
    assert found.low == pytest.approx(81 / 112 - 3.18244630528371 * error, rel=1e-12)
    assert found.high == 1.0  # .7232 + 3.18 · .1014 is beyond it
    assert any("cut at the end" in note for note in found.notes)


@few
def test_logit_interval_by_hand() -> None:
    # x = (kappa + 1)/2; logit x ± t · SE / (2 x (1 - x)); back by 2/(1 + e^-y) - 1.
    estimate = fleiss_kappa(TABLE_V)
    x = (estimate.value + 1) / 2
    half = 3.18244630528371 * estimate.standard_error / (2 * x * (1 - x))
    centre = math.log(x / (1 - x))
    found = analytic("fleiss_kappa", TABLE_V, target="items", distribution="logit")
    low, high = (2 / (1 + math.exp(-y)) - 1 for y in (centre - half, centre + half))
    assert (found.low, found.high) == pytest.approx((low, high), rel=1e-12)
    assert -1 < found.low < estimate.value < found.high < 1
    assert found.notes == (
        "4 items: below 10 the interval may cover less than it says",
    )


@few
def test_a_higher_level_is_wider() -> None:
    ends = [
        analytic("fleiss_kappa", TABLE_V, target="items", level=level)
        for level in (0.5, 0.8, 0.9)
    ]
    assert ends[0].low > ends[1].low > ends[2].low
    assert ends[0].high < ends[1].high < ends[2].high


def test_coverage_is_what_it_says() -> None:
    # 800 studies of 30 items × 3 raters, kappa .6. Known coverage 94 %, so 752 with a
    # standard deviation of 6.7; outside 725 to 779 once in 17 000 runs of other seeds.
    rng = np.random.default_rng(20120813)
    covered = 0
    for _ in range(800):
        found = analytic(
            "fleiss_kappa", dirichlet_multinomial(rng, 30, 3, 0.6), target="items"
        )
        covered += found.low <= 0.6 <= found.high
    assert 725 <= covered <= 779


def test_few_items_are_warned_of() -> None:
    with pytest.warns(SmallSampleWarning, match="4 items: below 10"):
        analytic("fleiss_kappa", TABLE_V, target="items")


def test_other_raters_are_not_its_question() -> None:
    for target in ("raters", "both"):
        with pytest.raises(ParameterError, match=f'"{target}"'):
            analytic("fleiss_kappa", TABLE_V, target=target)  # type: ignore[arg-type]


def test_no_spread_gives_no_interval_and_a_reason() -> None:
    perfect = [["a", "a"], ["b", "b"]] * 10
    with pytest.warns(UndefinedStatisticWarning, match="standard error is 0"):
        found = analytic("fleiss_kappa", perfect, target="items")
    assert math.isnan(found.low)
    assert math.isnan(found.high)
    assert "does not mean" in (found.reason or "")


@pytest.mark.parametrize(
    ("ratings", "reason"),
    [
        ([["a", "a"], ["a", "a"]], "0/0"),
        ([["a", None], [None, "a"]], "two raters"),
        ([["a", "b", "b"]], "one item"),
    ],
)
def test_an_undefined_estimate_has_no_interval(
    ratings: list[list[str | None]], reason: str
) -> None:
    with pytest.warns(UndefinedStatisticWarning):
        found = analytic("fleiss_kappa", ratings, target="items")
    assert math.isnan(found.low)
    assert reason in (found.reason or "")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"target": "patients"}, "target: needs one of items, raters, both"),
        ({"target": "items", "level": 95}, r"level: needs \(0, 1\), got 95"),
        ({"target": "items", "level": math.nan}, "level"),
        ({"target": "items", "distribution": "cauchy"}, "distribution: needs one of t"),
    ],
)
def test_a_wrong_option_is_named(options: dict[str, object], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        analytic("fleiss_kappa", TABLE_V, **options)  # type: ignore[arg-type]


def test_a_wrong_coefficient_is_named() -> None:
    with pytest.raises(ParameterError, match="needs one of percent_agreement"):
        analytic("kappa", TABLE_V, target="items")
    with pytest.raises(ParameterError, match="got 'len'"):
        analytic(len, TABLE_V, target="items")  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="needs 2 raters, got 8"):
        analytic("cohen_kappa", TABLE_V, target="items")


def test_target_has_no_default() -> None:
    with pytest.raises(TypeError, match="target"):
        analytic("fleiss_kappa", TABLE_V)  # type: ignore[call-arg]


def test_bad_ratings_are_refused_as_by_the_coefficient() -> None:
    with pytest.raises(RatingsError, match="row 0, column 0"):
        analytic("fleiss_kappa", [["x", "y"]], target="items", categories=SCALE)


def test_no_warning_comes_from_numpy() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        warnings.simplefilter("ignore", SmallSampleWarning)
        analytic("fleiss_kappa", TABLE_V, target="items", categories=SCALE)
