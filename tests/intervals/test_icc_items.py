"""Intraclass correlations as functions of sums over items: item by item, with `icc`."""

from typing import Any, get_args

import numpy as np
import pytest
from scipy import stats

from masrel.agreement import COEFFICIENTS, IccForm, icc
from masrel.errors import (
    ParameterError,
)
from masrel.intervals import analytic, difference, estimate, jackknife

FORMS: dict[str, IccForm] = {
    name: form
    for form in get_args(IccForm)
    for name, entry in COEFFICIENTS.items()
    if entry.title == form
}
RNG = np.random.default_rng(4)
RATINGS = RNG.normal(size=(24, 1)) + [0.4, 0.0, -0.2] + 0.6 * RNG.normal(size=(24, 3))
GAP: Any = RATINGS.tolist()
GAP[3][1] = None
PATIENTS = [f"p{i // 2}" for i in range(24)]


@pytest.mark.parametrize(("name", "form"), FORMS.items())
def test_the_interval_of_clusters_is_symmetric_on_fishers_z(
    name: str, form: IccForm
) -> None:
    units = np.array(PATIENTS)
    without = np.array([
        icc(RATINGS[units != unit], form=form).value for unit in np.unique(units)
    ])  # fmt: skip
    error = np.sqrt(11 / 12 * ((without - without.mean()) ** 2).sum())
    chosen = estimate(name, RATINGS, target="items", clusters=PATIENTS)
    assert chosen.interval is not None
    low, high = np.arctanh([chosen.interval.low, chosen.interval.high])
    value, t = chosen.value, stats.t.ppf(0.975, 11)
    assert np.tanh((low + high) / 2.0) == pytest.approx(value, rel=1e-9)
    assert (high - low) / 2.0 == pytest.approx(t * error / (1 - value**2), rel=1e-9)


def test_clustered_intervals_cover() -> None:
    # 30 patients with two sites, whose ratings go together by half: of 150 studies at
    # 94 % fewer than 132 cover with probability .003. Without clusters 84 % do.
    rng, covered, as_items = np.random.default_rng(8), 0, 0
    levels = np.array([0.3, 0.0, -0.3])
    truth = 1.0 / (1.0 + levels.var(ddof=1) + 0.5)
    for _ in range(150):
        patients = np.sqrt(0.9) * rng.normal(size=(30, 1, 1))
        sites = patients + np.sqrt(0.1) * rng.normal(size=(30, 2, 1))
        noise = np.sqrt(0.45) * rng.normal(size=(30, 1, 3))
        ratings = sites + levels + noise + np.sqrt(0.05) * rng.normal(size=(30, 2, 3))
        rows, clusters = ratings.reshape(60, 3), np.repeat(np.arange(30), 2)
        found = estimate("icc_a1", rows, target="items", clusters=clusters).interval
        alone = jackknife("icc_a1", rows, target="items")
        assert found is not None
        covered += found.low <= truth <= found.high
        as_items += alone.low <= truth <= alone.high
    assert covered >= 132 > as_items


def test_the_interval_that_comes_with_it_answers_with_a_note() -> None:
    own = icc(RATINGS).interval
    assert own is not None
    for target in ("items", "raters"):
        found = estimate("icc_a1", RATINGS, target=target).interval  # type: ignore[arg-type]
        assert found is not None
        assert (found.low, found.high, found.target) == (own.low, own.high, "both")
        assert found.notes[-1].startswith("the only interval available is for other ")
    # the rule says its name, and the one before had the ends from F where all are there
    of: Any
    for of, rule, kind in (
        (RATINGS, "auto", "auto"),
        (RATINGS, "auto-2026.1", "F"),
        (GAP, "auto-2026.1", "auto"),
    ):
        found = estimate("icc_a1", of, target="both", method=rule).interval  # type: ignore[arg-type]
        by = icc(of, interval=kind).interval  # type: ignore[arg-type]
        assert found is not None
        assert by is not None
        assert (found.low, found.high, found.target) == (by.low, by.high, "both")
        assert found.method.startswith(f"{by.method}, chosen by auto-2026.")
    assert estimate("kendall_w", RATINGS, target="items").interval is not None
    with pytest.raises(
        ParameterError, match='generalises to other items: needs target "it'
    ):
        estimate("icc_c1", RATINGS, target="both")
    # by formula: from F for its own target, by the error for other items alone
    by_f = estimate("icc_a1", RATINGS, target="both", method="analytic").interval
    assert by_f == icc(RATINGS, interval="F").interval
    by_error = estimate("icc_a1", RATINGS, target="items", method="analytic").interval
    assert by_error == analytic("icc_a1", RATINGS, target="items")


def test_two_sets_of_raters_are_compared() -> None:
    noisy = RATINGS + np.random.default_rng(1).normal(size=RATINGS.shape)
    found = difference("icc_a1", RATINGS, noisy, design="dependent")
    assert found.value == icc(RATINGS).value - icc(noisy).value
    moved = [
        icc(np.delete(RATINGS, i, 0)).value - icc(np.delete(noisy, i, 0)).value
        for i in range(24)
    ]
    assert found.standard_error == pytest.approx(23**0.5 * np.std(moved), rel=1e-9)
