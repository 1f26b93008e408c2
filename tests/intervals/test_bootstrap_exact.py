"""Exact bootstrap intervals against all n^n resamples in fractions."""

import itertools
import math
import subprocess
import sys
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest

from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Interval
from masrel.intervals import bootstrap
from tests.intervals import textbook
from tests.intervals.data import TABLE_V, dirichlet_multinomial

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")

FIVE = [[0, 0, 1], [1, 1, 1], [2, 1, 2], [0, 0, 0], [2, 2, 0]]
SIX = [*FIVE, [0, 1, 0]]
GAPS = [[0, 0, 1], [1, None, 1], [2, 1, 2], [0, 0, 0], [None, None, 2]]
FORMULAS = {
    "percent_agreement": textbook.percent,
    "fleiss_kappa": textbook.fleiss,
    "gwet_ac": textbook.gwet,
    "krippendorff_alpha": textbook.krippendorff,
    "cohen_kappa": textbook.cohen,
}


def exact(coefficient: str, table: object, **options: object) -> Interval:
    options = {"target": "items", "categories": range(3), "exact": True, **options}
    return bootstrap(coefficient, table, **options)  # type: ignore[arg-type]


def columns(coefficient: str, table: textbook.Table) -> textbook.Table:
    return [row[:2] for row in table] if coefficient == "cohen_kappa" else table


def counted(coefficient: str, table: textbook.Table) -> textbook.Table:
    # the items that are drawn: any with a rating, or with a pair of them
    least = 2 if coefficient in ("cohen_kappa", "krippendorff_alpha") else 1
    return [row for row in table if sum(g is not None for g in row) >= least]


@pytest.mark.parametrize("coefficient", FORMULAS)
@pytest.mark.parametrize("table", [FIVE, GAPS], ids=["complete", "gaps"])
def test_the_law_is_that_of_all_resamples(
    coefficient: str, table: textbook.Table
) -> None:
    ratings = columns(coefficient, table)
    law = textbook.law_of_items(counted(coefficient, ratings), FORMULAS[coefficient])
    found = exact(coefficient, ratings)
    assert found.distribution is not None
    assert found.distribution.values.size == len(law.values)
    np.testing.assert_allclose(
        found.distribution.values, [float(value) for value in law.values], atol=1e-13
    )
    np.testing.assert_allclose(
        found.distribution.weights, [float(w) for w in law.weights], rtol=1e-12
    )
    assert found.low == pytest.approx(float(law.quantile(0.025)), abs=1e-13)
    assert found.high == pytest.approx(float(law.quantile(0.975)), abs=1e-13)
    assert (found.n_undefined > 0) == (law.undefined > 0)
    if law.undefined:
        (note,) = [note for note in found.notes if "undefined" in note]
        assert f"probability {float(law.undefined):.2g}" in note


def test_six_items_of_46_656_resamples() -> None:
    law = textbook.law_of_items(SIX, textbook.fleiss)
    for level in (0.5, 0.9, 0.95):
        found = exact("fleiss_kappa", SIX, level=level)
        tail = (1 - level) / 2
        assert found.low == pytest.approx(float(law.quantile(tail)), abs=1e-13)
        assert found.high == pytest.approx(float(law.quantile(1 - tail)), abs=1e-13)
    mirror = exact("fleiss_kappa", SIX, kind="basic", level=0.9)
    value = textbook.fleiss(SIX)
    assert value is not None
    for end, tail in ((mirror.low, 0.95), (mirror.high, 0.05)):
        assert end == pytest.approx(float(2 * value - law.quantile(tail)), abs=1e-13)


def test_a_position_that_is_met_exactly_gives_the_middle() -> None:
    # Two items, agreeing and not: 0, 1/2, 1 with probability 1/4, 1/2, 1/4.
    table = [[0, 0], [0, 1]]
    found = exact("percent_agreement", table, level=0.5)
    assert (found.low, found.high) == (0.25, 0.75)
    just_inside = exact("percent_agreement", table, level=0.49)
    assert (just_inside.low, just_inside.high) == (0.5, 0.5)
    assert just_inside.notes[-1].startswith("both ends are one value")
    assert not any(note.startswith("both ends") for note in found.notes)
    beyond = exact("percent_agreement", table, level=0.51)
    assert (beyond.low, beyond.high) == (0.0, 1.0)


@pytest.mark.parametrize("kind", ["percentile", "basic", "bca", "studentized"])
def test_where_resamples_differ_by_rounding_alone_there_is_no_spread(kind: str) -> None:
    # of the pairs of every item a third agrees
    table = [[2, 3, 2], [2, 0, 2], [1, 0, 1], [2, 1, 2], [3, 1, 3], [1, 3, 1]] * 2
    with pytest.warns(UndefinedStatisticWarning, match="undefined: "):
        found = bootstrap("percent_agreement", table, target="items", kind=kind)  # type: ignore[arg-type]
    assert math.isnan(found.low)
    assert found.reason is not None


@pytest.mark.parametrize("coefficient", ["fleiss_kappa", "gwet_ac"])
def test_bca_counts_half_of_the_ties(coefficient: str) -> None:
    formula = FORMULAS[coefficient]
    law = textbook.law_of_items(FIVE, formula)
    value = formula(FIVE)
    left_out = [formula(FIVE[:i] + FIVE[i + 1 :]) for i in range(5)]
    assert value is not None
    assert law.below(value) != law.below(value - Fraction(1, 10**9))  # there are ties
    for level in (0.8, 0.95):
        found = exact(coefficient, FIVE, kind="bca", level=level)
        low, high = textbook.bca_positions(level, law.below(value), left_out)  # type: ignore[arg-type]
        assert found.low == pytest.approx(float(law.quantile(low)), abs=1e-13)
        assert found.high == pytest.approx(float(law.quantile(high)), abs=1e-13)


def test_studentized_has_the_error_of_every_resample() -> None:
    table = [[0, 0, 1], [1, 1, 1], [2, 1, 2], [0, 1, 2], [2, 2, 0]]
    value = textbook.fleiss(table)
    assert value is not None
    found: Counter[float] = Counter()
    for drawn in itertools.product(range(5), repeat=5):
        resample = [table[i] for i in drawn]
        kappa = textbook.fleiss(resample)
        if kappa is None:
            continue
        error = textbook.fleiss_error(resample)
        off = float(kappa - value)
        found[round(off / error if error else math.copysign(math.inf, off), 9)] += 1
    values = sorted(found)
    upto = np.cumsum([found[v] for v in values]) / sum(found.values())
    own = textbook.fleiss_error(table)
    for level in (0.6, 0.9):
        tail = (1 - level) / 2
        low, high = (
            float(value) - own * values[int(np.searchsorted(upto, at))]
            for at in (1 - tail, tail)
        )
        ours = exact("fleiss_kappa", table, kind="studentized", level=level)
        assert ours.low == pytest.approx(max(low, -1.0), abs=1e-7)
        assert ours.high == pytest.approx(min(high, 1.0), abs=1e-7)


def test_resamples_whose_standard_error_is_0_are_noted_with_their_probability() -> None:
    # Two items agree and one does not. Drawn three times, the first two alone (8 of 27)
    # or the third alone (1 of 27) give an agreement without spread, off by 1/3 or 2/3.
    found = exact("percent_agreement", [[0, 0], [1, 1], [0, 1]], kind="studentized")
    assert (
        "resamples of probability 0.33 have a standard error of 0: their studentized "
        "values are infinite"
    ) in found.notes


@pytest.mark.parametrize("whole", [True, False])
def test_raters_in_all_their_resamples(whole: bool) -> None:
    table: list[list[int | None]] = [
        [0, 0, 1, 0],
        [1, 1, 2, 1],
        [2, 2, 2, 0],
        [0, 0, 0, 0],
    ]
    if not whole:
        table[1][2] = table[2][0] = table[2][1] = None
    law = textbook.Law(rater_resamples(table))
    found = exact("fleiss_kappa", table, target="raters")
    assert found.unit == "raters"
    assert found.distribution is not None
    np.testing.assert_allclose(
        found.distribution.values, [float(value) for value in law.values], atol=1e-13
    )
    np.testing.assert_allclose(
        found.distribution.weights, [float(w) for w in law.weights], rtol=1e-12
    )
    assert found.n_undefined == 4  # one rater four times
    assert found.low == pytest.approx(float(law.quantile(0.025)), abs=1e-13)


def rater_resamples(table: textbook.Table) -> Counter[Fraction | None]:
    """Fleiss' kappa of all 4^4 resamples, pairs of a rater with itself left out."""
    counted: Counter[Fraction | None] = Counter()
    for taken in itertools.product(range(4), repeat=4):
        shares = []
        for row in table:
            pairs = [
                (row[taken[a]], row[taken[b]])
                for a, b in itertools.permutations(range(4), 2)
                if taken[a] != taken[b]
                and row[taken[a]] is not None
                and row[taken[b]] is not None
            ]
            if pairs:
                shares.append(Fraction(sum(a == b for a, b in pairs), len(pairs)))
        drawn = [[row[rater] for rater in taken] for row in table]
        chance = sum(p * p for p in textbook.category_shares(drawn, 3))
        if not shares or chance == 1:
            counted[None] += 1
        else:
            observed = sum(shares, Fraction(0)) / len(shares)
            counted[(observed - chance) / (1 - chance)] += 1
    return counted


def agreement_of(ratings: textbook.Table, taken: Counter[int]) -> float | None:
    """Fleiss' kappa of raters of whom some are taken twice, copies never paired."""
    agreements, shares = [], []
    for row in ratings:
        rated = [(g, n) for g, n in taken.items() if row[g] is not None]
        total = sum(n for _, n in rated)
        if total == 0:  # whoever rated it was not drawn: it is no item
            continue
        shares.append([sum(n for g, n in rated if row[g] == k) / total for k in (0, 1)])
        pairs = [
            (row[g] == row[h], n * m) for g, n in rated for h, m in rated if g != h
        ]
        if pairs:
            n_pairs = sum(n for _, n in pairs)
            agreements.append(sum(n for same, n in pairs if same) / n_pairs)
    p_e = sum(np.mean(column) ** 2 for column in zip(*shares, strict=True))
    if not agreements or p_e == 1.0:
        return None
    return float((np.mean(agreements) - p_e) / (1.0 - p_e))


def test_an_item_whose_raters_were_not_drawn_is_no_item() -> None:
    # the last item is rated by the third rater alone, and is in resamples with it only
    ratings = [[0, 1, 0], [1, 1, 0], [0, 0, 1], [0, 0, 0], [None, None, 1]]
    values: Counter[float] = Counter()
    for drawn in itertools.product(range(3), repeat=3):
        kappa = agreement_of(ratings, Counter(drawn))
        if kappa is not None:
            values[round(kappa, 12)] += 1
    found = exact("fleiss_kappa", ratings, target="raters", categories=range(2))
    assert found.distribution is not None
    weights: Counter[float] = Counter()
    for value, weight in zip(
        found.distribution.values, found.distribution.weights, strict=True
    ):
        weights[round(float(value), 12)] += weight
    assert list(weights) == pytest.approx(sorted(values), abs=1e-11)
    shares = [values[value] / values.total() for value in sorted(values)]
    assert list(weights.values()) == pytest.approx(shares, rel=1e-12)


def test_clusters_are_drawn_whole() -> None:
    groups = [FIVE[:2], FIVE[2:3], [*FIVE[3:], [0, 1, 0]], [[2, 2, 1], [1, 1, 1]]]
    law = textbook.law_of_clusters(groups, textbook.fleiss)
    rows = [row for group in groups for row in group]
    labels = [name for name, group in zip("abcd", groups, strict=True) for _ in group]
    mixed = [5, 0, 7, 2, 4, 6, 1, 3]
    found = exact(
        "fleiss_kappa", [rows[i] for i in mixed], clusters=[labels[i] for i in mixed]
    )
    assert found.method == "percentile bootstrap of 4 clusters, exact"
    assert found.low == pytest.approx(float(law.quantile(0.025)), abs=1e-13)
    assert found.high == pytest.approx(float(law.quantile(0.975)), abs=1e-13)
    each = exact("fleiss_kappa", SIX, clusters=range(6))
    alone = exact("fleiss_kappa", SIX)
    assert (each.low, each.high) == (alone.low, alone.high)


def test_an_item_without_ratings_is_in_no_cluster() -> None:
    rows = [[0, 0, 1], [None] * 3, [1, 1, 1], [2, 0, 2], [None] * 3]
    found = exact("fleiss_kappa", rows, clusters=["a", "a", "a", "b", "c"])
    assert found.method == "percentile bootstrap of 2 clusters, exact"


@pytest.mark.parametrize(
    ("clusters", "said"),
    [
        ("abcde", "one label an item, got str"),
        (["a", "b", "c"], "one label an item, 5, got 3"),
        ({1, 2, 3, 4, 5}, "one label an item, got set"),
        ([1, 2, 3, 4, None], "item 4 needs the label of its cluster, got None"),
        ([1, 2, 3, 4, math.nan], "item 4 needs the label of its cluster, got nan"),
        ([[1], [2], [3], [4], [5]], r"item 0 needs the label of its cluster, got \[1"),
    ],
)
def test_wrong_clusters_are_named(clusters: object, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        exact("fleiss_kappa", FIVE, clusters=clusters)


def test_clusters_are_of_items() -> None:
    with pytest.raises(ParameterError, match='so target "items"; got "raters"'):
        exact("fleiss_kappa", FIVE, target="raters", clusters=range(5))


def test_an_exact_interval_draws_nothing_and_loads_neither_scipy_nor_matplotlib() -> (
    None
):
    code = f"""
import sys
import numpy as np
def forbidden(*_, **__):
    raise AssertionError("a random number")
np.random.default_rng = np.random.SeedSequence = forbidden
from masrel.intervals import bootstrap
import warnings
warnings.simplefilter("ignore")
for kind in ("percentile", "basic", "bca", "studentized"):
    for target in ("items", "raters")[: 1 if kind == "studentized" else 2]:
        found = bootstrap("fleiss_kappa", {TABLE_V!r}, target=target, kind=kind)
        assert found.low < found.high and found.seed is None
        assert found.n_resamples is None and found.monte_carlo_error is None
print(sorted({{"scipy", "matplotlib", "pandas", "emcee"}} & set(sys.modules)))
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_the_generator_stays_where_it_was() -> None:
    generator = np.random.default_rng(3)
    before = generator.bit_generator.state
    exact("fleiss_kappa", SIX, rng=generator)
    assert generator.bit_generator.state == before
    bootstrap("fleiss_kappa", SIX, target="items", exact=False, rng=generator)
    assert generator.bit_generator.state != before


def test_the_words_say_what_it_is() -> None:
    found = bootstrap("fleiss_kappa", TABLE_V, target="items")
    assert found.method == "percentile bootstrap, exact"
    assert found.distribution is not None
    assert found.distribution.words == "exact bootstrap distribution, 35 resamples"
    assert not found.distribution.continuous
    assert found.distribution.weights.sum() == pytest.approx(1.0, abs=1e-14)
    assert found.n_undefined == 1
    assert any("1 of 35 distinct resamples, of probability" in n for n in found.notes)
    with pytest.raises(ValueError, match="read-only"):
        found.distribution.values[0] = 0.0


@pytest.mark.parametrize("options", [{"exact": True}, {"exact": False, "rng": 1}])
@pytest.mark.parametrize("target", ["items", "raters"])
def test_the_distribution_is_of_the_coefficient_or_not_there(
    target: str, options: dict[str, object]
) -> None:
    found = {
        kind: bootstrap("fleiss_kappa", TABLE_V, target=target, kind=kind, **options)  # type: ignore[arg-type]
        for kind in ("percentile", "basic", "bca")
    }
    plain = found["percentile"].distribution
    assert plain is not None
    assert plain.values.min() > -1.0
    assert plain.values.max() <= 1.0
    for kind in ("basic", "bca"):
        other = found[kind].distribution
        assert other is not None
        np.testing.assert_array_equal(other.values, plain.values)
        np.testing.assert_array_equal(other.weights, plain.weights)


def test_too_many_resamples_are_drawn_or_refused() -> None:
    table = dirichlet_multinomial(np.random.default_rng(1), 40, 6, 0.5)
    drawn = bootstrap("fleiss_kappa", table, target="items", rng=1)
    assert drawn.n_resamples == 10_000
    with pytest.raises(ParameterError, match="more than 300000 distinct"):
        exact("fleiss_kappa", table)
    many = dirichlet_multinomial(np.random.default_rng(1), 5, 12, 0.5)
    assert math.comb(23, 11) == 1_352_078
    with pytest.raises(ParameterError, match="more than 300000 distinct"):
        exact("fleiss_kappa", many, target="raters")
