"""Bootstraps against all draws in fractions, scipy, and themselves."""

import itertools
import math
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest

from masrel.estimates import Interval
from masrel.intervals import bootstrap
from tests.intervals import textbook
from tests.intervals.data import dirichlet_multinomial

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")

FIVE = [[0, 0, 1], [1, 1, 1], [2, 1, 2], [0, 0, 0], [2, 2, 0]]
GAPS = [[0, 0, 1], [1, None, 1], [2, 1, 2], [0, 0, 0], [None, None, 2]]
FORMULAS = {
    "percent_agreement": textbook.percent,
    "fleiss_kappa": textbook.fleiss,
    "gwet_ac": textbook.gwet,
}


def exact(coefficient: str, table: object, **options: object) -> Interval:
    options = {"target": "items", "categories": range(3), "exact": True, **options}
    return bootstrap(coefficient, table, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("coefficient", FORMULAS)
@pytest.mark.parametrize("table", [FIVE, GAPS], ids=["complete", "gaps"])
def test_the_law_is_that_of_all_resamples(
    coefficient: str, table: textbook.Table
) -> None:
    law = textbook.law_of_items(table, FORMULAS[coefficient])
    found = exact(coefficient, table)
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


def test_a_position_that_is_met_exactly_gives_the_middle() -> None:
    # Two items, agreeing and not: 0, 1/2, 1 with probability 1/4, 1/2, 1/4.
    table = [[0, 0], [0, 1]]
    found = exact("percent_agreement", table, level=0.5)
    assert (found.low, found.high) == (0.25, 0.75)
    just_inside = exact("percent_agreement", table, level=0.49)
    assert (just_inside.low, just_inside.high) == (0.5, 0.5)
    assert just_inside.notes[-1].startswith("both limits are the same value")
    assert not any(note.startswith("both limits") for note in found.notes)
    beyond = exact("percent_agreement", table, level=0.51)
    assert (beyond.low, beyond.high) == (0.0, 1.0)


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
    for drawn in itertools.combinations_with_replacement(range(5), 5):
        resample = [table[i] for i in drawn]
        kappa = textbook.fleiss(resample)
        if kappa is None:
            continue
        error = textbook.fleiss_error(resample)
        off = float(kappa - value)
        n_orders = 120 // math.prod(map(math.factorial, Counter(drawn).values()))
        place = round(off / error if error else math.copysign(math.inf, off), 9)
        found[place] += n_orders
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
    each = exact("fleiss_kappa", FIVE, clusters=range(5))
    alone = exact("fleiss_kappa", FIVE)
    assert (each.low, each.high) == (alone.low, alone.high)


Row = tuple[int | None, ...]
COMPLETE: list[Row] = [(0, 0, 1), (1, 1, 1), (0, 1, 0)]
HOLED: list[Row] = [(0, 0, 1), (1, None, 1), (0, 1, 0)]


def drawn(
    name: str, items: tuple[Row, ...], raters: tuple[int, ...]
) -> Fraction | None:
    """The coefficient of a draw; a rater is no pair with a copy of the same one."""
    # A pair of two copies of different raters counts as often as it is there.
    observed, n_items, shares_of_items = Fraction(0), 0, []
    for row in items:
        rated = [(g, row[g]) for g in raters if row[g] is not None]
        pairs = [
            k == m for (g, k), (h, m) in itertools.permutations(rated, 2) if g != h
        ]
        if pairs:
            observed += Fraction(sum(pairs), len(pairs))
            n_items += 1
        if rated:
            count = Counter(k for _, k in rated)
            shares_of_items.append([Fraction(count[k], len(rated)) for k in (0, 1)])
    if not n_items:
        return None
    if name == "conger_kappa":
        shares = {}
        for g in set(raters):
            count = Counter(row[g] for row in items if row[g] is not None)
            if count.total():
                shares[g] = [Fraction(count[k], count.total()) for k in (0, 1)]
        both = [
            sum(p * q for p, q in zip(shares[g], shares[h], strict=True))
            for g, h in itertools.permutations([g for g in raters if g in shares], 2)
            if g != h
        ]
        chance = sum(both, Fraction(0)) / len(both) if both else Fraction(1)
    else:
        n = len(shares_of_items)
        p = [sum(of, Fraction(0)) / n for of in zip(*shares_of_items, strict=True)]
        chance = {
            "percent_agreement": Fraction(0),
            "fleiss_kappa": p[0] ** 2 + p[1] ** 2,
            "brennan_prediger": Fraction(1, 2),
            "gwet_ac": 2 * p[0] * p[1],
        }[name]
    if chance == 1:
        return None
    return (observed / n_items - chance) / (1 - chance)


def law(name: str, table: list[Row], *, items: bool) -> dict[Fraction, Fraction]:
    """Every value of all draws, with its probability among those that have one."""
    tables = itertools.product(table, repeat=3) if items else [tuple(table)]
    values = Counter(
        drawn(name, rows, raters)
        for rows, raters in itertools.product(
            tables, itertools.product(range(3), repeat=3)
        )
    )
    del values[None]
    return {k: Fraction(n, values.total()) for k, n in sorted(values.items())}  # type: ignore[type-var]


@pytest.mark.parametrize("table", [COMPLETE, HOLED], ids=["complete", "holed"])
@pytest.mark.parametrize("name", [*FORMULAS, "brennan_prediger", "conger_kappa"])
@pytest.mark.parametrize("target", ["raters", "both"])
def test_the_law_is_that_of_every_draw(
    name: str, table: list[Row], target: str
) -> None:
    expected = law(name, table, items=target == "both")
    found = bootstrap(name, table, target=target, categories=[0, 1])  # type: ignore[arg-type]
    assert found.seed is None
    assert found.unit == target
    distribution = found.distribution
    assert distribution is not None
    np.testing.assert_allclose(
        distribution.values, [float(value) for value in expected], atol=1e-13
    )
    np.testing.assert_allclose(
        distribution.weights, [float(weight) for weight in expected.values()], rtol=1e-9
    )


few = pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")


def made(n: int, r: int, categories: int = 3) -> list[list[int]]:
    rows = dirichlet_multinomial(np.random.default_rng(n + r), n, r, 0.5)
    return [[min(grade, categories - 1) for grade in row] for row in rows]


@few
@pytest.mark.parametrize("kind", ["percentile", "basic", "bca", "studentized"])
@pytest.mark.parametrize(("n", "r", "categories"), [(10, 6, 3), (60, 3, 2)])
def test_errors_are_as_large_as_they_say(
    kind: str, n: int, r: int, categories: int
) -> None:
    options = {"target": "items", "kind": kind, "categories": range(3)}
    table = made(n, r, categories)
    exact = bootstrap("fleiss_kappa", table, **options)  # type: ignore[arg-type]
    assert exact.monte_carlo_error is None
    off = []
    for seed in range(30):
        found = bootstrap(
            "fleiss_kappa",
            table,
            exact=False,
            rng=seed,
            n_resamples=4000,
            **options,  # type: ignore[arg-type]
        )
        assert found.monte_carlo_error is not None
        for end in ("low", "high"):
            error = found.monte_carlo_error[end == "high"]
            if getattr(exact, end) not in (-1.0, 1.0):  # not cut
                off.append((getattr(found, end) - getattr(exact, end)) / error)
    # Root mean square of 30 or 60 standard normal numbers: outside once in 100 000 for
    # 30; the errors themselves are known to a quarter.
    assert 0.5 < math.sqrt(np.mean(np.square(off))) < 1.6


def test_seeds_repeat_and_are_recorded() -> None:
    table = dirichlet_multinomial(np.random.default_rng(4), 40, 4, 0.5)
    one = bootstrap("fleiss_kappa", table, target="items", rng=5)
    assert bootstrap("fleiss_kappa", table, target="items", rng=5) == one
    assert bootstrap("fleiss_kappa", table, target="items", rng=6) != one
    fresh = bootstrap("fleiss_kappa", table, target="items")
    assert fresh.seed is not None
    assert bootstrap("fleiss_kappa", table, target="items", rng=fresh.seed) == fresh
    given = bootstrap(
        "fleiss_kappa", table, target="items", rng=np.random.default_rng(5)
    )
    assert (given.low, given.high, given.seed) == (one.low, one.high, None)
