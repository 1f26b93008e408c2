"""An estimate pays only for itself: the work done is counted, not timed."""

import subprocess
import sys
from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest

from masrel.agreement import (
    COEFFICIENTS,
    _counts,
    _labels,
    _pooled,
    count_ratings,
    few_items,
    fleiss_kappa,
    gwet_ac,
    krippendorff_alpha,
    weights,
)

THREE = (fleiss_kappa, gwet_ac, krippendorff_alpha)
RATINGS = np.random.default_rng(1).integers(1, 6, (500, 4))


class Meter:
    """Counts the calls of functions without changing what they do."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._patch = monkeypatch
        self.calls: Counter[str] = Counter()

    def watch(self, owner: object, name: str) -> None:
        """Count the calls of one function from now on."""
        inner: Callable[..., object] = getattr(owner, name)

        def counted(*arguments: object, **options: object) -> object:
            self.calls[name] += 1
            return inner(*arguments, **options)

        self._patch.setattr(owner, name, counted)


@pytest.fixture
def meter(monkeypatch: pytest.MonkeyPatch) -> Meter:
    return Meter(monkeypatch)


def test_identity_weights_make_no_matrix(meter: Meter) -> None:
    meter.watch(weights, "over_one_denominator")
    meter.watch(weights.Weights, "as_floats")
    for function in THREE:
        function(RATINGS)
    assert meter.calls == {}
    fleiss_kappa(RATINGS, weights="linear")
    assert meter.calls["over_one_denominator"] == 1


def test_several_coefficients_of_counted_ratings_look_at_the_ratings_once(
    meter: Meter,
) -> None:
    meter.watch(_labels, "_codes")
    meter.watch(_counts, "_keys")
    counted = count_ratings(RATINGS)
    once = meter.calls.copy()
    assert once["_codes"] == 1
    for function in THREE:
        function(counted)
    assert meter.calls == once


def test_work_after_counting_grows_with_distinct_items_only(meter: Meter) -> None:
    small, large = count_ratings(RATINGS), count_ratings(np.repeat(RATINGS, 40, axis=0))
    meter.watch(few_items, "mul")
    assert fleiss_kappa(small).standard_error > 0
    first = meter.calls["mul"]
    assert fleiss_kappa(large).standard_error > 0
    assert meter.calls["mul"] == 2 * first > 0


def test_a_standard_error_is_computed_once_and_when_it_is_read(meter: Meter) -> None:
    meter.watch(_pooled, "pooled_influence")
    found = fleiss_kappa(RATINGS)
    assert meter.calls == {}
    assert found.standard_error == found.standard_error > 0
    assert meter.calls["pooled_influence"] == 1


def test_an_estimate_has_no_interval_unless_it_is_its_own() -> None:
    for name, entry in COEFFICIENTS.items():
        if entry.shape == "ratings" and entry.n_raters[1] is None:
            found = entry(
                [["1", "2"], ["2", "2"], ["3", "3"]], categories="1 2 3".split()
            )
            assert (found.interval is not None) == name.startswith("icc")


@pytest.mark.parametrize("name", ["fleiss_kappa", "gwet_ac", "cohen_kappa"])
def test_one_estimate_from_an_array_loads_numpy_alone(name: str) -> None:
    code = (
        "import sys, numpy\nbefore = {m.split('.')[0] for m in sys.modules}\n"
        f"from masrel.agreement import {name}\n"
        f"{name}(numpy.array([[1, 1], [1, 2], [2, 2]]), weights='quadratic')\n"
        "after = {m.split('.')[0] for m in sys.modules} - before\n"
        "print(sorted(after & {'pandas', 'scipy', 'statsmodels', 'matplotlib', "
        "'emcee', 'click', 'msgspec'}), 'masrel.intervals' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[] False"
