"""What intervals load, draw, hold in memory, and warn of."""

import json
import subprocess
import sys
import tracemalloc
import warnings
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray

from masrel.errors import SmallSampleWarning
from masrel.estimates import Interval
from masrel.intervals import analytic, bootstrap, difference, jackknife

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
few = [["a", "a", "b"], ["a", "b", "a"], ["b", "b", "b"], ["a", "a", "a"]]
rows, pairs = few * 5, [row[:2] for row in few] * 5
said = []
for call in CALLS:
    drawn.clear()
    result = eval(call)
    interval = getattr(result, "interval", result)
    assert interval.low < interval.high
    said.append([bool(drawn), sorted(HEAVY & set(sys.modules))])
print(json.dumps(said))
"""


def estimated(rows: str, method: str, target: str) -> str:
    return f'estimate("fleiss_kappa", {rows}, method="{method}", target="{target}")'


WHOLE = [estimated("few", "bootstrap", target) for target in ("items", "raters")]
DRAWN = ['bootstrap("fleiss_kappa", few, target="items", exact=False, rng=1)']
CLOSED = [
    estimated("few", "analytic", "items"),
    *(estimated("few", "jackknife", target) for target in ("items", "raters", "both")),
    estimated("few", "posterior", "items"),
    *(
        estimated(rows, "auto", target)
        for rows in ("few", "rows")
        for target in ("items", "raters", "both")
    ),
    'posterior("fleiss_kappa", pairs, target="items", model="table")',
    'difference("fleiss_kappa", rows, pairs, design="independent")',
]


def test_an_interval_draws_and_loads_no_more_than_it_has_to() -> None:
    # one fresh interpreter: what is loaded stays, so that the least comes first
    script = SCRIPT.replace("CALLS", repr([*WHOLE, *DRAWN, *CLOSED]))
    script = script.replace("HEAVY", repr(HEAVY))
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    said = [(drew, set(loaded)) for drew, loaded in json.loads(done.stdout)]
    expected = [(False, set[str]())] * 2 + [(True, set[str]())]
    assert said == expected + [(False, SPECIAL)] * len(CLOSED)


N_ITEMS = 1_000_000
FEW_MB = 50.0  # of some thousand distinct rows; the ratings alone take 5 as bytes


def megabytes(work: Callable[[], object], *, loaded: bool = True) -> float:
    """Return the most that was allocated at once, without what is loaded first."""
    if loaded:
        work()
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()


@pytest.fixture(scope="module")
def ratings() -> NDArray[np.int8]:
    rng = np.random.default_rng(1)
    truth = rng.integers(0, 5, (N_ITEMS, 1), dtype=np.int8)
    other = rng.integers(0, 5, (N_ITEMS, 5), dtype=np.int8)
    return np.where(rng.random((N_ITEMS, 5)) < 0.6, truth, other)


@pytest.mark.parametrize(
    ("target", "kind"),
    [("items", "bca"), ("items", "studentized"), ("raters", "bca")],
)
def test_a_bootstrap_keeps_sums_and_not_resamples(
    ratings: NDArray[np.int8], target: str, kind: str
) -> None:
    # the drawn items of 10 000 resamples would be 10^10 numbers
    work = partial(
        bootstrap,
        "fleiss_kappa",
        ratings,
        target=target,  # type: ignore[arg-type]
        categories=range(5),
        kind=kind,  # type: ignore[arg-type]
        exact=False,
        rng=1,
    )
    assert megabytes(work) < FEW_MB


@pytest.mark.parametrize("target", ["items", "raters", "both"])
def test_a_jackknife_leaves_out_distinct_rows(
    ratings: NDArray[np.int8], target: str
) -> None:
    work = partial(
        jackknife,
        "fleiss_kappa",
        ratings,
        target=target,  # type: ignore[arg-type]
        categories=range(5),
    )
    assert megabytes(work) < FEW_MB


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
    with pytest.warns(
        SmallSampleWarning, match="5 items: with fewer than 1[06]"
    ) as caught:
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
        note = (
            f"{n} {unit}: with fewer than {enough} the true coverage may be below "
            "the level of the interval"
        )
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
