"""What must be true of every coefficient of the register, one property a test."""

import inspect
import math
import random
import warnings
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

import masrel.agreement
from masrel.agreement import COEFFICIENTS, Coefficient
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Estimate
from tests.strategies import LABELS, Table, tables

ENTRIES = [pytest.param(entry, id=name) for name, entry in COEFFICIENTS.items()]
every = pytest.mark.parametrize("entry", ENTRIES)


def shaped(entry: Coefficient, table: Table) -> object:
    """Lay a table of pairs out as the coefficient takes it."""
    if entry.shape == "ratings":
        return table
    width = len(table[0]) // 2
    return [[row[2 * r : 2 * r + 2] for row in table] for r in range(width)]


def for_entry(entry: Coefficient) -> st.SearchStrategy[Table]:
    if entry.shape == "pairs":
        return st.integers(1, 3).flatmap(lambda r: tables(n_raters=(2 * r, 2 * r)))
    return tables(n_raters=(entry.n_raters[0], entry.n_raters[1] or 6))


def estimate(
    entry: Coefficient, table: Table, categories: tuple[str, ...] = LABELS
) -> Estimate:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)
        return entry(shaped(entry, table), categories=categories)


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
    found = estimate(entry, table)
    if found.reason is not None:
        assert math.isnan(found.value)
        return
    assert found.value <= 1.0
    # Ratings without a partner move chance alone: with them a sample can fall lower.
    if all(grade is not None for row in table for grade in row):
        assert found.value >= entry.lowest


@every
@given(data=st.data())
def test_order_of_items_does_not_matter(
    entry: Coefficient, data: st.DataObject
) -> None:
    table = data.draw(for_entry(entry))
    moved = data.draw(st.permutations(table))
    assert same(estimate(entry, table), estimate(entry, list(moved)))


@every
@given(data=st.data())
def test_order_of_raters_does_not_matter(
    entry: Coefficient, data: st.DataObject
) -> None:
    table = data.draw(for_entry(entry))
    width = 2 if entry.shape == "pairs" else 1
    order = data.draw(st.permutations(range(len(table[0]) // width)))
    moved = [[row[width * r + i] for r in order for i in range(width)] for row in table]
    assert same(estimate(entry, table), estimate(entry, moved))


@every
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


@every
@given(data=st.data())
def test_an_unused_category_changes_nothing_but_their_number(
    entry: Coefficient, data: st.DataObject
) -> None:
    table = data.draw(for_entry(entry))
    found = estimate(entry, table)
    wider = estimate(entry, table, (*LABELS, "9"))
    assert wider.n_categories == found.n_categories + 1
    assert same(found, wider)


@every
@given(data=st.data())
def test_every_item_twice_gives_the_same_value(
    entry: Coefficient, data: st.DataObject
) -> None:
    table = data.draw(for_entry(entry))
    once, twice = estimate(entry, table), estimate(entry, table + table)
    if once.reason is not None:
        assert twice.reason == once.reason
        return
    assert twice.value == once.value
    # The variance per item is that of n items over n - 1; twice as many halve it.
    n = once.n_items
    if n > 1:
        expected = once.standard_error * math.sqrt((n - 1) / (2 * n - 1))
        assert math.isclose(twice.standard_error, expected, rel_tol=1e-9, abs_tol=1e-12)


@every
@given(grades=st.lists(st.sampled_from(LABELS), min_size=2, max_size=12))
def test_perfect_agreement_on_two_categories_is_exactly_1(
    entry: Coefficient, grades: list[str]
) -> None:
    found = estimate(entry, [[grade, grade] for grade in grades])
    if len(set(grades)) > 1 or not entry.chance_corrected:
        assert (found.value, found.standard_error) == (1.0, 0.0)
    else:
        assert "0/0" in (found.reason or "")


@every
def test_1_is_perfect_agreement_only(entry: Coefficient) -> None:
    table: Table = [["0", "0"]] * 30 + [["1", "1"]] * 30 + [["0", "1"]]
    assert estimate(entry, table).value < 1.0


@every
@given(data=st.data())
def test_kernel_and_function_are_the_same_coefficient(
    entry: Coefficient, data: st.DataObject
) -> None:
    table = data.draw(for_entry(entry))
    coded = entry.code(shaped(entry, table), LABELS)
    rated = (coded.codes >= 0).any(axis=1)
    sums = entry.kernel.features(coded)[rated].sum(axis=0)
    value = float(entry.kernel.value(sums, coded.n_categories))
    found = estimate(entry, table).value
    assert (math.isnan(value) and math.isnan(found)) or math.isclose(
        value, found, rel_tol=1e-9, abs_tol=1e-12
    )


@given(table=tables(n_raters=(2, 2), missing=False))
def test_two_raters_fleiss_is_scotts_pi(table: Table) -> None:
    # Scott (1955): chance from the margins of both raters together.
    n = len(table)
    both = [grade for row in table for grade in row]
    observed = sum(a == b for a, b in table) / n
    chance = sum((both.count(k) / (2 * n)) ** 2 for k in LABELS)
    found = estimate(COEFFICIENTS["fleiss_kappa"], table)
    if len(set(both)) == 1:
        assert found.reason
    else:
        assert math.isclose(
            found.value, (observed - chance) / (1 - chance), abs_tol=1e-12
        )


def test_every_public_coefficient_is_registered() -> None:
    public = {
        name
        for name in masrel.agreement.__all__
        if name.endswith(("_kappa", "_agreement"))
        and inspect.isfunction(getattr(masrel.agreement, name))
    }
    assert public == set(COEFFICIENTS)
    assert all(entry.function.__name__ == name for name, entry in COEFFICIENTS.items())


def test_a_function_forgotten_in_the_register_would_be_seen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delitem(COEFFICIENTS, "cohen_kappa")
    with pytest.raises(AssertionError):
        test_every_public_coefficient_is_registered()


def _first_rater_counts_double(ratings: Table, **_: object) -> float:
    return sum(row[0] == row[-1] for row in ratings) / len(ratings)


def _first_item_counts(ratings: Table, **_: object) -> float:
    return float(ratings[0][0] == ratings[0][1])


@pytest.mark.parametrize(
    ("value", "check"),
    [
        (_first_rater_counts_double, test_order_of_raters_does_not_matter),
        (_first_item_counts, test_order_of_items_does_not_matter),
    ],
)
def test_the_checks_can_fail(
    value: Callable[..., float], check: Callable[..., None]
) -> None:
    sound = COEFFICIENTS["percent_agreement"]

    def broken(ratings: Table, *, categories: tuple[str, ...]) -> Estimate:
        found = sound.function(ratings, categories=categories)
        return replace(found, value=value(ratings), standard_error=0.0, reason=None)

    random.seed(0)
    with pytest.raises(AssertionError):
        check(entry=replace(sound, function=broken))
