"""Whoever asks for an interval of a small sample is told, where he or she asks."""

import warnings
from collections.abc import Callable

import numpy as np
import pytest

from masrel.errors import SmallSampleWarning
from masrel.estimates import Interval
from masrel.intervals import analytic, bootstrap, difference, jackknife

TABLE = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"], ["a", "a"]]
OTHER = [["a", "b"], ["a", "b"], ["b", "b"], ["b", "a"], ["a", "a"], ["b", "b"]]

METHODS: dict[str, Callable[[], object]] = {
    "analytic": lambda: analytic("cohen_kappa", TABLE, target="items"),
    "jackknife": lambda: jackknife("cohen_kappa", TABLE, target="items"),
    "bootstrap": lambda: bootstrap("cohen_kappa", TABLE, target="items", rng=1),
    "difference": lambda: difference("cohen_kappa", TABLE, OTHER, design="independent"),
}


@pytest.mark.parametrize("method", METHODS)
def test_the_warning_points_to_who_asked(method: str) -> None:
    with pytest.warns(SmallSampleWarning, match="5 items: below 1[06]") as caught:
        METHODS[method]()
    assert [warning.filename for warning in caught] == [__file__]
    # the line within this file, not that of the test which calls it
    first = METHODS[method].__code__.co_firstlineno
    assert first <= caught[0].lineno <= first + 2


@pytest.mark.parametrize(
    ("unit", "enough"), [("items", 16), ("clusters", 16), ("raters", 5)]
)
def test_a_bootstrap_warns_below_enough_units(unit: str, enough: int) -> None:
    rows = np.random.default_rng(1).integers(0, 3, (40, 40))
    for n in (enough - 1, enough):
        table = rows[:, :n] if unit == "raters" else rows[:n, :3]
        options = {"target": "raters" if unit == "raters" else "items"}
        if unit == "clusters":
            options["clusters"] = range(n)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            interval = bootstrap(
                "fleiss_kappa", table, categories=range(3), rng=1, **options
            )
        note = f"{n} {unit}: below {enough} the interval may cover less than it says"
        assert [str(w.message) for w in caught] == [note] * (n < enough)
        assert (note in interval.notes) == (n < enough)


@pytest.mark.parametrize(
    ("method", "target", "enough"),
    [
        (analytic, "items", 10),
        (jackknife, "items", 10),
        (jackknife, "raters", 5),
    ],
)
def test_a_closed_form_warns_below_enough_units(
    method: Callable[..., Interval], target: str, enough: int
) -> None:
    rows = np.random.default_rng(1).integers(0, 3, (40, 40))
    for n in (enough - 1, enough):
        table = rows[:n, :4] if target == "items" else rows[:, :n]
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            method("fleiss_kappa", table, target=target, categories=range(3))
        assert [w.category for w in caught] == [SmallSampleWarning] * (n < enough)
