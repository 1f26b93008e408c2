"""Every number below the count is another admissible order, and none is left out.

An order is drawn by one number that is uniform below the count: that the numbers are
one to one with the orders is then all there is to show.
"""

import itertools
from collections.abc import Sequence

import pytest

from masrel.lab.protocol import Protocol
from masrel.lab.schedule._admissible import (
    FREE,
    LimitedRuns,
    PartedRuns,
    _apart_word,
    _completions,
    arrangement,
    n_arrangements,
    subset,
)
from masrel.lab.schedule._orders import count_orders, order_at
from masrel.lab.schedule._secret import Stream
from tests.lab.schedule.studies import protocol_of

LIMITED = [
    ((2, 2), 0, 1),
    ((2, 2, 2), 0, 1),
    ((3, 2), 1, 1),
    ((3, 3), 2, 2),
    ((4, 2), 0, 2),
    ((4,), 1, 2),
    ((1, 1, 1), 2, 1),
    ((2, 3, 1), 2, 1),
    ((4, 3), 1, 3),
    ((3,), 0, 2),  # none
    ((5, 1), 1, 2),
    ((5, 1), 0, 2),
    ((5, 1), 0, 1),  # none
]


def distinct_orders(letters: Sequence[object]) -> set[tuple[object, ...]]:
    """Every order of letters that may be the same, by leaving out each in turn."""
    if not letters:
        return {()}
    return {
        (letter, *rest)
        for letter in set(letters)
        for rest in distinct_orders(
            [*letters[: letters.index(letter)], *letters[letters.index(letter) + 1 :]]
        )
    }


@pytest.mark.parametrize(("sizes", "n_free", "longest"), LIMITED)
def test_numbers_are_one_to_one_with_words_of_limited_runs(
    sizes: tuple[int, ...], n_free: int, longest: int
) -> None:
    letters = [group for group, size in enumerate(sizes) for _ in range(size)]
    admissible = {
        word
        for word in distinct_orders([*letters, *[FREE] * n_free])
        if all(
            group == FREE or len(list(run)) <= longest
            for group, run in itertools.groupby(word)
        )
    }
    words = LimitedRuns(sizes=sizes, n_free=n_free, longest=longest)
    numbered = [tuple(words.word(number)) for number in range(words.count())]
    assert len(numbered) == len(admissible)
    assert set(numbered) == admissible


def test_the_two_ways_of_counting_agree_on_large_studies() -> None:
    # by inclusion and exclusion, and by putting in group after group
    for sizes, n_free in [((5,) * 16, 0), ((3, 9, 27), 30), ((8,) * 20, 0)]:
        words = LimitedRuns(sizes=sizes, n_free=n_free, longest=1)
        (n_words,) = _completions(sizes, n_free)[0]
        assert words.count() == n_words
        last = _apart_word(n_words - 1, sizes, n_free)
        assert sorted(last) == sorted(
            [*[FREE] * n_free, *(g for g, n in enumerate(sizes) for _ in range(n))]
        )


@pytest.mark.parametrize("sizes", [(2, 2), (3, 1, 2), (1, 1, 1), (4,), ()])
def test_numbers_are_one_to_one_with_arrangements(sizes: tuple[int, ...]) -> None:
    letters = [thing for thing, size in enumerate(sizes) for _ in range(size)]
    numbered = [
        tuple(arrangement(number, sizes)) for number in range(n_arrangements(sizes))
    ]
    assert len(numbered) == len(set(numbered))
    assert set(numbered) == distinct_orders(letters)


def test_numbers_are_one_to_one_with_subsets_in_their_usual_order() -> None:
    numbered = [tuple(subset(number, "abcde", 3)) for number in range(10)]
    assert numbered == list(itertools.combinations("abcde", 3))


STANDARDS, DUMMIES = ("S1", "S2"), ("D1", "D2")
GRADES = {"S1": "1", "S2": "1", "D1": "2"}


def keeps(order: Sequence[str], protocol: Protocol) -> bool:
    """Whether an order keeps the limits of its scheme, from their words."""
    rules = protocol.schedule
    if rules.scheme == "no-immediate-repeat":
        return all(one != then for one, then in itertools.pairwise(order))
    models = {model.id: model for model in protocol.models}
    roles = [models[name].role for name in order]
    if rules.standards_apart and ("standard", "standard") in itertools.pairwise(roles):
        return False
    grades = [models[name].intended_grade for name in order]
    return rules.max_same_grade is None or all(
        grade is None or len(list(run)) <= rules.max_same_grade
        for grade, run in itertools.groupby(grades)
    )


@pytest.mark.parametrize(
    "protocol",
    [
        protocol_of(models=("A", "B", "C"), repeats=2, scheme="no-immediate-repeat"),
        protocol_of(models=("A", "B"), repeats=4, scheme="no-immediate-repeat"),
        protocol_of(
            models=STANDARDS + DUMMIES,
            dummies=DUMMIES,
            grades={"S1": "1", "S2": "2"},
            repeats=2,
            scheme="restricted",
            standards_apart=True,
            max_same_grade=1,
        ),
        protocol_of(
            models=STANDARDS + DUMMIES,
            dummies=DUMMIES,
            grades=GRADES,
            repeats=2,
            scheme="restricted",
            max_same_grade=1,
        ),
        protocol_of(
            models=STANDARDS + DUMMIES,
            dummies=DUMMIES,
            grades=GRADES,
            repeats=2,
            scheme="restricted",
            max_same_grade=2,
        ),
        protocol_of(
            models=(*STANDARDS, "D1", "D2", "D3"),
            dummies=("D1", "D2", "D3"),
            grades={"S1": "1", "S2": "2", "D1": "1", "D2": "1"},
            scheme="restricted",
            standards_apart=True,
            max_same_grade=2,
        ),
        protocol_of(
            models=("S1", "D1", "D2"),
            dummies=DUMMIES,
            grades={"S1": "1", "D1": "2", "D2": "1"},
            repeats=2,
            scheme="restricted",
            standards_apart=True,
            max_same_grade=1,
        ),
    ],
)
def test_numbers_are_one_to_one_with_the_orders_of_a_protocol(
    protocol: Protocol,
) -> None:
    names = [model.id for model in protocol.models] * protocol.schedule.repeats
    admissible = {order for order in distinct_orders(names) if keeps(order, protocol)}
    numbered = [
        tuple(order_at(protocol, number)) for number in range(count_orders(protocol))
    ]
    assert len(numbered) == len(admissible)
    assert set(numbered) == admissible


def test_orders_of_pairs_without_two_in_a_row_are_as_many_as_in_the_literature() -> (
    None
):
    # n models twice each, none twice in a row: https://oeis.org/A114938
    counts = [LimitedRuns((2,) * n, 0, 1).count() for n in range(1, 7)]
    assert counts == [0, 2, 30, 864, 39480, 2631600]


PARTED = [
    (((2, 1), (1, 1)), (1, 0), 1),
    (((2, 1), (2, 1)), (0, 1), 2),
    (((1, 1), (1, 1), (1, 1)), (0, 0), 1),
    (((3, 0), (0, 2)), (1, 0), 2),
    (((0, 3),), (1, 0), 1),  # none
]


@pytest.mark.parametrize(("grades", "free", "longest"), PARTED)
def test_numbers_are_one_to_one_with_words_under_both_limits(
    grades: tuple[tuple[int, int], ...], free: tuple[int, int], longest: int
) -> None:
    cells = [*enumerate(grades), (None, free)]
    letters = [
        (grade, is_standard)
        for grade, sizes in cells
        for is_standard in (False, True)
        for _ in range(sizes[is_standard])
    ]
    admissible = {
        word
        for word in distinct_orders(letters)
        if not any(a[1] and b[1] for a, b in itertools.pairwise(word))
        and all(
            grade is None or len(list(run)) <= longest
            for grade, run in itertools.groupby(cell[0] for cell in word)
        )
    }
    words = PartedRuns(grades, free, longest)
    numbered = [tuple(words.word(number)) for number in range(words.count())]
    assert len(numbered) == len(admissible)
    assert set(numbered) == admissible
    assert len(words._counts) <= words.n_remainders


class Given(Stream):
    """A stream of words that are given."""

    def __init__(self, *words: int) -> None:
        self._words = iter(words)

    def word(self) -> int:
        return next(self._words)


def test_words_beyond_the_last_multiple_are_rejected() -> None:
    # 2**64 = 3 * 6148914691236517205 + 1: the word 2**64 - 1 would favour 0
    assert Given(2**64 - 1, 2**64 - 2).below(3) == 2
    # a power of two divides 2**64: no word is rejected
    assert Given(2**64 - 1).below(8) == 7
    assert Given(5).below(1) == 0
