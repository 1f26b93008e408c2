"""Items in clusters: against multiagree, a loop over clusters, coverage; refusals."""

import json
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from masrel.agreement import COEFFICIENTS
from masrel.errors import ParameterError
from masrel.intervals import (
    analytic,
    difference,
    difference_test,
    estimate,
    jackknife,
)

FILE = Path(__file__).parents[1] / "oracles" / "several_kappas.json"
SETTINGS = json.loads(FILE.read_text(encoding="utf-8"))["settings"]
KINDS = [
    name
    for name, e in COEFFICIENTS.items()
    if e.formula and e.shape == "ratings" and not e.has_interval
]


def drawn(
    n_clusters: int, seed: int, r: int = 2, strength: float = 1.0
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Ratings of items in clusters of one to four, alike in how well raters agree."""
    rng = np.random.default_rng(seed)
    sizes = rng.integers(1, 5, n_clusters)
    clusters = np.repeat(np.arange(n_clusters), sizes)
    true = rng.integers(0, 3, len(clusters))
    easy = 1.0 / (1.0 + np.exp(-0.8 - strength * rng.normal(size=n_clusters)))
    same = rng.random((len(clusters), r)) < easy[clusters, None]
    ratings = np.where(same, true[:, None], rng.integers(0, 3, (len(clusters), r)))
    return ratings.astype(float), clusters


@pytest.mark.parametrize("place", ["01", "02", "03"])
def test_one_kappa_has_the_interval_of_multiagree(place: str) -> None:
    setting = SETTINGS[f"dependent_kappas_clustered-{place}"]
    data = SETTINGS["dependent_kappas_clustered-01"]["data"]
    ratings = np.array(data["ratings"])[:, :2]
    options: dict[str, Any] = {
        "target": "items",
        "clusters": data["cluster"],
        "weights": setting["weights"],
        "categories": [1, 2, 3],
    }
    normal = analytic("cohen_kappa", ratings, distribution="normal", **options)
    assert (normal.low, normal.high) == pytest.approx(
        setting["one_kappa_interval95"], rel=1e-8
    )
    found = estimate("cohen_kappa", ratings, method="analytic", **options)
    error = setting["reference"]["se"][0]
    assert found.standard_error == pytest.approx(error, rel=1e-8)
    assert found.interval is not None
    half = stats.t.ppf(0.975, setting["reference"]["n_clusters"] - 1) * error
    assert found.interval.high == pytest.approx(found.value + half, rel=1e-8)
    assert found.interval.unit == "clusters"


@pytest.mark.parametrize("name", KINDS)
def test_the_jackknife_leaves_out_every_cluster_once(name: str) -> None:
    ratings, clusters = drawn(15, 3)
    ratings[[2, 9], 0] = np.nan
    found = jackknife(
        name, ratings, target="items", clusters=clusters, categories=[0, 1, 2]
    )
    without = [
        COEFFICIENTS[name](ratings[clusters != c], categories=[0, 1, 2]).value
        for c in range(15)
    ]
    variance = 14 / 15 * float(((without - np.mean(without)) ** 2).sum())
    value = COEFFICIENTS[name](ratings, categories=[0, 1, 2]).value
    half = stats.t.ppf(0.975, 14) * math.sqrt(variance)
    assert found.low == pytest.approx(value - half, rel=1e-9)
    assert found.high == pytest.approx(min(value + half, 1.0), rel=1e-9)
    assert found.method == "cluster jackknife, t(14)"


def test_independent_clusters_add_their_variances() -> None:
    (first, of_first), (second, of_second) = drawn(12, 11), drawn(16, 13)
    labels = [f"a{c}" for c in of_first], [f"b{c}" for c in of_second]
    found = difference(
        "fleiss_kappa",
        first,
        second,
        design="independent",
        categories=[0, 1, 2],
        clusters=labels,
    )
    variance, df = 0.0, 0.0
    for ratings, codes in ((first, of_first), (second, of_second)):
        n = int(codes.max()) + 1
        without = [
            COEFFICIENTS["fleiss_kappa"](
                ratings[codes != c], categories=[0, 1, 2]
            ).value
            for c in range(n)
        ]
        part = (n - 1) / n * float(((without - np.mean(without)) ** 2).sum())
        variance, df = variance + part, df + part**2 / (n - 1)
    assert found.standard_error == pytest.approx(math.sqrt(variance), rel=1e-9)
    test = difference_test(
        "fleiss_kappa",
        first,
        second,
        design="independent",
        categories=[0, 1, 2],
        clusters=labels,
    )
    assert test.df[0] == pytest.approx(variance**2 / df, rel=1e-9)
    with pytest.raises(ParameterError, match="need other clusters, got 'a1' in both"):
        difference(
            "fleiss_kappa",
            first,
            second,
            design="independent",
            clusters=(labels[0], ["a1", *labels[1][1:]]),
        )
    with pytest.raises(ParameterError, match="a pair of sequences"):
        difference(
            "fleiss_kappa", first, second, design="independent", clusters=labels[0]
        )


@pytest.mark.parametrize(("n_outside", "is_rare"), [(4, True), (30, False)])
def test_rare_categories_in_clusters_are_warned_of(
    n_outside: int, is_rare: bool
) -> None:
    # of so few the item jackknife gives way to a posterior
    ratings = np.zeros((90, 3))
    outside = np.arange(n_outside) * 3
    ratings[outside, 0] = ratings[outside[1:], 1] = 1.0
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        interval = estimate(
            "fleiss_kappa", ratings, target="items", clusters=np.arange(90) // 6
        ).interval
    assert interval is not None
    notes = [str(warning.message) for warning in caught]
    assert notes == list(interval.notes[1:])
    expected = "4 items with a rating outside the commonest category: below 30 the"
    assert [note.startswith(expected) for note in notes] == [True] * is_rare
