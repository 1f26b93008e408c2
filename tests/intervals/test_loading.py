"""What each method of `estimate` loads, and that an exact one draws nothing."""

import json
import subprocess
import sys

import pytest

HEAVY = {
    "scipy.special",
    "scipy.stats",
    "scipy.optimize",
    "matplotlib",
    "pandas",
    "statsmodels",
    "emcee",
    "arviz_stats",
}
SPECIAL = {"scipy.special"}  # quantiles of t, gamma functions

SCRIPT = """
import json, sys, warnings
import numpy as np
drawn = []
def watched(make):
    def counted(*args, **kwargs):
        drawn.append(make.__name__)
        return make(*args, **kwargs)
    return counted
for name in ("default_rng", "SeedSequence", "random", "normal"):
    setattr(np.random, name, watched(getattr(np.random, name)))
warnings.simplefilter("ignore")
from masrel.intervals import bootstrap, difference, estimate, posterior
rows = [["a", "a", "b"], ["a", "b", "a"], ["b", "b", "b"], ["a", "a", "a"]] * TIMES
pairs = [row[:2] for row in rows]
found = CALL
found = getattr(found, "interval", found)
assert found.low < found.high
print(json.dumps([bool(drawn), sorted(set(HEAVY) & set(sys.modules))]))
"""


def watched(call: str, times: int = 1) -> tuple[bool, set[str]]:
    """Whether a generator was made, and what a fresh interpreter then holds."""
    script = SCRIPT.replace("TIMES", str(times)).replace("CALL", call)
    script = script.replace("set(HEAVY)", f"set({sorted(HEAVY)!r})")
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    drew, loaded = json.loads(done.stdout)
    return drew, set(loaded)


def estimated(method: str, target: str) -> str:
    return f'estimate("fleiss_kappa", rows, method="{method}", target="{target}")'


@pytest.mark.parametrize("target", ["items", "raters", "both"])
@pytest.mark.parametrize("times", [1, 5])
def test_the_chosen_interval_draws_nothing(target: str, times: int) -> None:
    drew, loaded = watched(estimated("auto", target), times)
    assert not drew
    assert loaded <= SPECIAL


@pytest.mark.parametrize(
    ("method", "target"),
    [
        ("analytic", "items"),
        ("jackknife", "items"),
        ("jackknife", "raters"),
        ("jackknife", "both"),
        ("posterior", "items"),
    ],
)
def test_a_closed_form_draws_nothing_and_loads_special_functions(
    method: str, target: str
) -> None:
    assert watched(estimated(method, target)) == (False, SPECIAL)


@pytest.mark.parametrize("target", ["items", "raters"])
def test_a_bootstrap_of_all_resamples_draws_nothing_and_loads_numpy_alone(
    target: str,
) -> None:
    assert watched(estimated("bootstrap", target)) == (False, set())


def test_drawn_resamples_are_counted_as_drawn_and_need_no_scipy() -> None:
    call = 'bootstrap("fleiss_kappa", rows, target="items", exact=False, rng=1)'
    assert watched(call) == (True, set())


@pytest.mark.parametrize(
    "call",
    [
        'posterior("fleiss_kappa", pairs, target="items", model="table")',
        'difference("fleiss_kappa", rows, pairs, design="independent")',
    ],
)
def test_the_other_exact_ones_draw_nothing(call: str) -> None:
    drew, loaded = watched(call, 5)
    assert not drew
    assert loaded <= SPECIAL
