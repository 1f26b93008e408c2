"""What a coefficient of the register says is true of it, one property a test."""

import inspect
import math
import random
import warnings
from collections.abc import Mapping
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

import masrel.agreement
import masrel.intervals
from masrel.agreement import (
    COEFFICIENTS,
    Coefficient,
    Property,
    WeightName,
)
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Estimate
from tests.strategies import LABELS, Table, tables


def having(name: Property) -> pytest.MarkDecorator:
    """Run a test on every coefficient that claims a property."""
    entries = [
        pytest.param(entry, id=entry.name)
        for entry in COEFFICIENTS.values()
        if name in entry.properties
    ]
    tested.add(name)
    return pytest.mark.parametrize("entry", entries)


tested: set[str] = set()
every = pytest.mark.parametrize(
    "entry", [pytest.param(entry, id=name) for name, entry in COEFFICIENTS.items()]
)


def shaped(entry: Coefficient, table: Table) -> object:
    """Lay a table of pairs out as the coefficient takes it."""
    if entry.shape == "ratings":
        return table
    width = len(table[0]) // 2
    return [[row[2 * r : 2 * r + 2] for row in table] for r in range(width)]


def for_entry(entry: Coefficient) -> st.SearchStrategy[Table]:
    if entry.shape == "pairs":
        return st.integers(1, 3).flatmap(lambda r: tables(n_raters=(2 * r, 2 * r)))
    few = entry.has_interval and entry.name != "kendall_w"
    n_raters = entry.n_raters[0], entry.n_raters[1] or (3 if few else 6)
    is_icc = entry.name.startswith("icc")  # which are fitted where there are gaps
    return tables(n_raters=n_raters, max_items=5 if few else 12, missing=not is_icc)


def weights_for(entry: Coefficient) -> st.SearchStrategy[WeightName]:
    return st.sampled_from(get_args(WeightName) if entry.weighted else ("identity",))


def estimate(
    entry: Coefficient,
    table: Table,
    categories: tuple[str, ...] = LABELS,
    weights: WeightName = "identity",
) -> Estimate:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)
        return entry(shaped(entry, table), categories=categories, weights=weights)


def same(one: Estimate, other: Estimate) -> bool:
    """Whether value and standard error are the same, undefined included."""
    return all(
        (math.isnan(a) and math.isnan(b))
        or math.isclose(a, b, rel_tol=1e-10, abs_tol=1e-12)
        for a, b in (
            (one.value, other.value),
            (one.standard_error, other.standard_error),
        )
    )


@every
@given(data=st.data())
def test_value_is_within_its_parameter_space(
    entry: Coefficient, data: st.DataObject
) -> None:
    table = data.draw(for_entry(entry))
    found = estimate(entry, table, weights=data.draw(weights_for(entry)))
    if found.reason is not None:
        assert math.isnan(found.value)
        return
    assert found.value <= entry.highest
    # Ratings without a partner move chance alone: with them a sample can fall lower;
    # so can a weighted one, or one against a chance of few categories.
    complete = all(grade is not None for row in table for grade in row)
    if (
        complete
        and found.weights == "identity"
        and "unused category" in entry.properties
    ):
        assert found.value >= entry.lowest


@having("items in any order")
@given(data=st.data())
def test_order_of_items_does_not_matter(
    entry: Coefficient, data: st.DataObject
) -> None:
    table, weights = data.draw(for_entry(entry)), data.draw(weights_for(entry))
    moved = list(data.draw(st.permutations(table)))
    assert same(
        estimate(entry, table, weights=weights), estimate(entry, moved, weights=weights)
    )


@having("raters in any order")
@given(data=st.data())
def test_order_of_raters_does_not_matter(
    entry: Coefficient, data: st.DataObject
) -> None:
    table, weights = data.draw(for_entry(entry)), data.draw(weights_for(entry))
    width = 2 if entry.shape == "pairs" else 1
    order = data.draw(st.permutations(range(len(table[0]) // width)))
    moved = [[row[width * r + i] for r in order for i in range(width)] for row in table]
    assert same(
        estimate(entry, table, weights=weights), estimate(entry, moved, weights=weights)
    )


@having("categories in any order")
@given(data=st.data())
def test_names_and_order_of_categories_do_not_matter_unweighted(
    entry: Coefficient, data: st.DataObject
) -> None:
    table = data.draw(for_entry(entry))
    to = dict(zip(LABELS, data.draw(st.permutations("abcdef")), strict=True))
    renamed = [[None if g is None else to[g] for g in row] for row in table]
    assert same(
        estimate(entry, table), estimate(entry, renamed, ("a", "b", "c", "d", "e", "f"))
    )


@having("unused category")
@given(data=st.data())
def test_an_unused_category_changes_nothing_but_their_number(
    entry: Coefficient, data: st.DataObject
) -> None:
    table = data.draw(for_entry(entry))
    found = estimate(entry, table)
    wider = estimate(entry, table, (*LABELS, "9"))
    assert wider.n_categories == found.n_categories + 1
    assert same(found, wider)


@having("items twice")
@given(data=st.data())
def test_every_item_twice_gives_the_same_value(
    entry: Coefficient, data: st.DataObject
) -> None:
    table, weights = data.draw(for_entry(entry)), data.draw(weights_for(entry))
    once = estimate(entry, table, weights=weights)
    twice = estimate(entry, table + table, weights=weights)
    if once.reason is not None:
        # one item or none is too few for some; two of it are not
        assert twice.reason == once.reason or once.n_items < 2
        return
    assert math.isclose(twice.value, once.value, rel_tol=1e-12, abs_tol=1e-14)
    # The variance per item is that of n items over n - 1; twice as many halve it.
    n = once.n_items_paired if entry.shape == "pairs" else once.n_items
    if n > 1 and not math.isnan(once.standard_error):
        expected = once.standard_error * math.sqrt((n - 1) / (2 * n - 1))
        assert math.isclose(twice.standard_error, expected, rel_tol=1e-9, abs_tol=1e-12)


@having("two categories")
@given(data=st.data())
def test_weights_of_two_categories_are_identity_weights(
    entry: Coefficient, data: st.DataObject
) -> None:
    table = data.draw(for_entry(entry))
    two = [[None if g is None else str(LABELS.index(g) % 2) for g in r] for r in table]
    plain = estimate(entry, two, ("0", "1"))
    for weights in get_args(WeightName):
        assert same(plain, estimate(entry, two, ("0", "1"), weights))


@having("perfect agreement")
@given(grades=st.lists(st.sampled_from(LABELS), min_size=2, max_size=12))
def test_perfect_agreement_on_two_categories_is_exactly_1(
    entry: Coefficient, grades: list[str]
) -> None:
    found = estimate(entry, [[grade, grade] for grade in grades])
    if len(set(grades)) > 1:
        assert found.value == 1.0
        assert found.standard_error == 0.0 or entry.has_interval or not entry.formula
    elif found.chance < 1.0:
        assert found.value == 1.0
    else:
        assert "0/0" in (found.reason or "")


@pytest.mark.parametrize(
    "entry",
    [pytest.param(e, id=e.name) for e in COEFFICIENTS.values() if e.has_interval],
)
def test_an_interval_that_comes_with_an_estimate_holds_it(entry: Coefficient) -> None:
    # Small tables of few levels, where Satterthwaite's degrees of freedom are few. At
    # levels far below 0.5 an interval from F need not hold its estimate.
    rng = random.Random(3)
    n_intervals = 0
    for _ in range(200):
        n_items, n_raters = rng.randint(2, 6), rng.randint(2, 5)
        levels = rng.choice([2, 3, 9])
        table = [
            [rng.randrange(levels) for _ in range(n_raters)] for _ in range(n_items)
        ]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UndefinedStatisticWarning)
            result = entry(table, level=rng.choice([0.5, 0.8, 0.95]))
        interval = result.interval
        if interval is None:
            assert result.reason
        elif interval.reason is not None:
            assert math.isnan(interval.low)
            assert math.isnan(interval.high)
        else:
            n_intervals += 1
            slack = 1e-12 * max(1.0, abs(result.value))
            assert interval.low - slack <= result.value <= interval.high + slack
    assert n_intervals > 100


def _public(names: Mapping[str, object]) -> set[str]:
    # what returns an Estimate from ratings alone, by its annotations
    return {
        name
        for name, value in names.items()
        if inspect.isfunction(value)
        and inspect.signature(value).return_annotation is Estimate
        and name != "category_kappa"  # one of Fleiss' kappa, for a category
    }


def test_every_public_coefficient_is_registered() -> None:
    exported = {n: getattr(masrel.agreement, n) for n in masrel.agreement.__all__}
    registered = {
        getattr(entry.function, "func", entry.function).__name__
        for entry in COEFFICIENTS.values()
    }
    assert _public(exported) == registered
    assert all(name == entry.name for name, entry in COEFFICIENTS.items())


def test_every_property_has_a_test() -> None:
    assert tested == set(get_args(Property))
