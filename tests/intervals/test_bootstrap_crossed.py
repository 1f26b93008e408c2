"""Bootstraps of raters, and of items and raters, against every draw in fractions."""

import itertools
import math
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest

from masrel.agreement import conger_kappa
from masrel.errors import ParameterError, SmallSampleWarning
from masrel.intervals import bootstrap, estimate
from tests.intervals.data import SCALE, TABLE_V, dirichlet_multinomial

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")

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
        chance = sum((sum(of) / n) ** 2 for of in zip(*shares_of_items, strict=True))
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
@pytest.mark.parametrize("name", ["fleiss_kappa", "conger_kappa"])
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


@pytest.mark.parametrize("name", ["conger_kappa", "gwet_ac"])
def test_draws_come_from_that_law(name: str) -> None:
    # 20 000 draws: a quantile of the law is met within five of its own errors, less
    # than once in a million runs of other seeds for each of the four ends.
    table = dirichlet_multinomial(np.random.default_rng(4), 4, 4, 0.4)
    exact, some = (
        bootstrap(
            name, table, target="both", categories=range(3), level=0.8, rng=2, **options
        )  # type: ignore[arg-type]
        for options in ({"exact": True}, {"exact": False, "n_resamples": 20_000})
    )
    assert some.method == "percentile bootstrap of items and raters"
    assert exact.method == "percentile bootstrap of items and raters, exact"
    assert some.monte_carlo_error is not None
    for end, error in zip(("low", "high"), some.monte_carlo_error, strict=True):
        distance = abs(getattr(some, end) - getattr(exact, end))
        assert distance <= 5 * error + 0.02  # the law has steps


def test_of_conger_a_rater_drawn_once_each_gives_the_estimate() -> None:
    table = dirichlet_multinomial(np.random.default_rng(1), 12, 5, 0.4)
    found = bootstrap("conger_kappa", table, target="raters", exact=True)
    value = conger_kappa(table).value
    assert found.distribution is not None
    assert np.abs(found.distribution.values - value).min() < 1e-14


def test_table_v_is_exact() -> None:
    # 35 resamples of items times 6435 of raters
    found = bootstrap("fleiss_kappa", TABLE_V, target="both", categories=SCALE)
    assert found.n_resamples is None
    (note,) = [note for note in found.notes if "undefined" in note]
    # One model four times, or one rater eight times, has none; and so do models that
    # are in one category for those who are drawn.
    assert "of 225225 distinct resamples" in note


@pytest.mark.parametrize("kind", ["basic", "bca"])
def test_other_kinds_have_ends(kind: str) -> None:
    table = dirichlet_multinomial(np.random.default_rng(6), 20, 6, 0.5)
    found = bootstrap("fleiss_kappa", table, target="both", kind=kind, rng=3)  # type: ignore[arg-type]
    plain = estimate("fleiss_kappa", table, target="both", method="bootstrap", rng=3)
    assert plain.interval is not None
    assert found.low < plain.value < found.high
    assert (found.low, found.high) != (plain.interval.low, plain.interval.high)
    assert not math.isnan(found.low)


def test_few_of_either_are_warned_of() -> None:
    with pytest.warns(SmallSampleWarning, match="3 items") as record:
        bootstrap("fleiss_kappa", COMPLETE, target="both")
    assert any("3 raters" in str(warning.message) for warning in record)


@pytest.mark.parametrize(
    ("name", "options", "why"),
    [
        ("krippendorff_alpha", {}, "pairing a rater with a copy of itself"),
        ("light_kappa", {}, "pairing a rater with a copy of itself"),
        (
            "fleiss_kappa",
            {"clusters": [1, 2, 3]},
            "clusters: what is left out, or drawn anew",
        ),
        ("fleiss_kappa", {"kind": "studentized"}, "the standard error of every resam"),
    ],
)
def test_what_cannot_be_drawn_says_why(
    name: str, options: dict[str, object], why: str
) -> None:
    with pytest.raises(ParameterError, match=why):
        bootstrap(name, COMPLETE, target="both", **options)  # type: ignore[arg-type]
