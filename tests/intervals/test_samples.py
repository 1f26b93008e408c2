"""Whoever asks for an interval of a small sample is told, where he or she asks."""

from collections.abc import Callable

import pytest

from masrel.errors import SmallSampleWarning
from masrel.intervals import analytic, bootstrap, difference, jackknife
from masrel.intervals._problem import warn_small

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


def test_enough_of_them_are_passed_over() -> None:
    assert warn_small(10, 10, "items") == ()
