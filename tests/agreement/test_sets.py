"""Ratings that are sets of labels: Jaccard's and Passonneau's distance in alpha."""

from fractions import Fraction

import pytest

from masrel.agreement import Metric, krippendorff_alpha
from masrel.errors import ParameterError

A, B, C = {"a"}, {"b"}, {"c"}
AB, BC = {"a", "b"}, {"b", "c"}


@pytest.mark.parametrize(
    ("metric", "of_half", "of_third"),
    [
        # {a} and {a, b} share 1 of 2 labels; {a, b} and {b, c} share 1 of 3. MASI: the
        # first is a subset, 1 - (1/2)(2/3); the second overlaps, 1 - (1/3)(1/3).
        ("jaccard", Fraction(1, 2), Fraction(2, 3)),
        ("masi", Fraction(2, 3), Fraction(8, 9)),
    ],
)
def test_alpha_of_sets_by_hand(
    metric: Metric, of_half: Fraction, of_third: Fraction
) -> None:
    # Three items: (a, ab), (ab, bc), (bc, bc): N = 6; D_o = (2 half + 2 third)/6. Each
    # of a (1), ab (2), bc (3) with another: pairs a-ab 2, ab-bc 6, and a-bc 3, which
    # share nothing: D_e = 2 (2 half + 6 third + 3) / 30.
    ratings = [[A, AB], [AB, BC], [BC, BC]]
    observed = (2 * of_half + 2 * of_third) / 6
    expected = 2 * (2 * of_half + 6 * of_third + 3) / 30
    result = krippendorff_alpha(ratings, metric=metric)
    assert result.value == pytest.approx(float(1 - observed / expected), abs=1e-14)
    assert (result.weights, result.n_categories) == (metric, 3)
    # the same as text, in any order of the labels, and frozen
    text = [["a", "b;a"], ["a; b", "c;b"], ["b;c", "b; c"]]
    assert krippendorff_alpha(text, metric=metric).value == pytest.approx(
        result.value, abs=1e-14
    )
    frozen = [[frozenset(x) for x in row] for row in ratings]
    assert krippendorff_alpha(frozen, metric=metric) == result


@pytest.mark.parametrize("metric", ["jaccard", "masi"])
def test_an_empty_set_is_far_from_all_but_itself(metric: Metric) -> None:
    same = krippendorff_alpha([[set(), set()], [A, A], [AB, AB]], metric=metric)
    assert same.value == 1.0
    # of two items, one (∅, a): N = 4, D_o = 2/4; ∅ 1, a 3: D_e = 6/12: α = 0
    assert krippendorff_alpha([[set(), A], [A, A]], metric=metric).value == 0.0


# {a}, {a, b}, {b, c}, each as text
WAYS = {
    "semicolons": ("a", "a;b", "b; c"),
    "bars": ("a", "b|a", "b | c"),
    "Python lists": ("['a']", "['b', 'a']", "['b', \"c\"]"),
    "JSON lists": ('["a"]', '["\\u0061","b"]', '["c", "b"]'),
    "Python sets": ("{'a'}", "{'a', 'b'}", "{'b', 'c'}"),
    "frozen sets": tuple(
        f"frozenset({x})" for x in ("{'a'}", "{'a', 'b'}", "{'c', 'b'}")
    ),
    "lists of numbers": ("[1]", "[1, 2]", "[2, 3.5]"),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("metric", ["jaccard", "masi"])
def test_text_holds_several_labels_in_any_of_these_ways(
    metric: Metric, way: str
) -> None:
    a, ab, bc = WAYS[way]
    sets = krippendorff_alpha([[A, AB], [AB, BC], [BC, BC]], metric=metric)
    text = krippendorff_alpha([[a, ab], [ab, bc], [bc, bc]], metric=metric)
    assert text == sets


@pytest.mark.parametrize(
    ("one", "two"),
    [
        *(("a", "b"), ("a", "a,b"), ("a", "a b"), ("[a]", "[a, b]")),  # no way
        *(("a;b", "a|b"), ("a", "a;b|c"), ("['a']", "a;b"), ("['a']", "a")),  # two
        ("['a']", "['a' 'b']"),  # an array of numpy
    ],
)
def test_text_that_may_be_one_label_is_not_nominal_in_silence(
    one: str, two: str
) -> None:
    with pytest.raises(ParameterError, match=r"masi needs sets of labels, .* nominal"):
        krippendorff_alpha([[one, two], [two, two]], metric="masi")


@pytest.mark.parametrize(
    ("ratings", "value"),
    [
        # (a, ab), (b, b): D_o = (2/2)/4, D_e = 2 (1/2 + 2 + 2/2)/12
        ([["a", AB], ["b", "b"]], Fraction(4, 7)),  # text beside sets is one label
        ([[{"a|b"}, {"a|b", "c"}], [{"c"}, {"c"}]], Fraction(4, 7)),
        ([["[]", "['a']"], ["['a']", "['a']"]], 0),  # as with the empty set above
        ([["set()", "{'a'}"], ["{'a'}", "{'a'}"]], 0),
    ],
)
def test_sets_beside_text_and_empty_lists(
    ratings: list[list[object]], value: Fraction
) -> None:
    result = krippendorff_alpha(ratings, metric="jaccard")
    assert result.value == pytest.approx(float(value), abs=1e-15)
