"""Unitizing alpha and F1 of spans: by hand, published, by all sections, by sets."""

import math
import time
from collections import defaultdict
from collections.abc import Iterable
from fractions import Fraction
from itertools import permutations
from random import Random
from typing import Any, get_args

import numpy as np
import pandas as pd
import pytest
from scipy.special import expit, logit, stdtrit

from masrel.agreement import SpanMatch, span_f1, unitizing_alpha
from masrel.errors import RatingsError, UndefinedStatisticWarning

Row = tuple[Any, ...]  # document, observer, category, begin, length
Section = tuple[int, int, bool]  # begin, length, whether it is a unit

# Krippendorff (1995), printed by DKPro Agreement: .7285, 1, .8587. Exactly, D_o of c
# is 13/900 and D_e 69179/1299825; of k they are 0 and 127621/2605650.
PUBLISHED = [
    *(("first", "c", 225, 70), ("first", "c", 370, 30)),
    *(("second", "c", 220, 80), ("second", "c", 355, 20), ("second", "c", 400, 20)),
    *(
        (who, "k", *unit)
        for who in ("first", "second")
        for unit in [(180, 60), (300, 50)]
    ),
]


def made(
    seed: int, n_documents: int, *, is_full: bool = True
) -> tuple[list[Row], dict[str, int]]:
    """Spans that two or three observers find, or cut short; and documents' lengths."""
    random, rows, lengths = Random(seed), list[Row](), dict[str, int]()
    for number in range(n_documents):
        document = f"d{number}"
        lengths[document] = random.randint(9, 40)
        begins = range(random.randint(0, 4), lengths[document] - 6, 7)
        there = [(random.choice("ab"), begin, random.randint(1, 6)) for begin in begins]
        for who in ("Kim", "Lee", "Ann")[: 2 + seed % 2]:
            if is_full or random.random() < 0.8:
                rows.append((document, who, None, None, None))
                rows += [
                    (document, who, category, begin, random.randint(1, size))
                    for category, begin, size in there
                    if random.random() < 0.8
                ]
    return rows, lengths


def sections(units: Iterable[tuple[int, int]], length: int) -> list[Section]:
    """Units and the gaps between them, one after the other."""
    parts, end = list[Section](), 0
    for begin, size in sorted(units):
        parts += [(end, begin - end, False), (begin, size, True)]
        end = begin + size
    return [part for part in [*parts, (end, length - end, False)] if part[1]]


def distance(one: Section, other: Section) -> int:
    """δ² of two sections, as printed, of an ordered pair."""
    (b, size, is_unit), (b2, size2, is_unit2) = one, other
    if is_unit and is_unit2 and -size < b - b2 < size2:
        return (b - b2) ** 2 + (b + size - b2 - size2) ** 2
    if is_unit and not is_unit2 and b2 <= b and b + size <= b2 + size2:
        return size**2
    return distance(other, one) if is_unit2 and not is_unit else 0


def by_sections(rows: list[Row], lengths: dict[str, int]) -> dict[Any, Row]:
    """D_o and D_e of each category from all pairs of sections, in fractions."""
    units, looked = defaultdict(list), defaultdict(set)
    for document, who, category, begin, size in rows:
        looked[document].add(who)
        if category is not None:
            units[category, document, who].append((begin, size))
    looked = {of: who for of, who in looked.items() if len(who) > 1}
    total = sum(lengths[of] for of in looked)
    places = sum(lengths[of] * len(who) for of, who in looked.items())
    parts = {}
    for category in dict.fromkeys(row[2] for row in rows if row[2]):
        observed, every = Fraction(), list[Section]()
        for document, observers in looked.items():
            of = {
                who: sections(units[category, document, who], lengths[document])
                for who in observers
            }
            for pair in permutations(observers, 2):
                ways = sum(distance(x, y) for x in of[pair[0]] for y in of[pair[1]])
                observed += Fraction(ways, len(observers) - 1)
            every += [section for part in of.values() for section in part]
        sizes = [size for _, size, is_unit in every if is_unit]
        gaps = [size for _, size, is_unit in every if not is_unit]
        expected = sum(
            Fraction((len(sizes) - 1) * (2 * n**3 - 3 * n**2 + n), 3)
            + n**2 * sum(gap - n + 1 for gap in gaps if gap >= n)
            for n in sizes
        )
        ways = places * (places - 1) - sum(n * (n - 1) for n in sizes)
        parts[category] = observed / places / total, 2 * expected / total / ways
    return parts


def test_published_units() -> None:
    result = unitizing_alpha(PUBLISHED, begin=150, length=300)
    assert result.value == pytest.approx(0.8586654051841702, rel=1e-12)
    assert result.by_category == {"c": pytest.approx(0.7285989968053889), "k": 1.0}
    for of, d_o, d_e in (
        ("c", Fraction(13, 900), Fraction(69179, 1299825)),
        ("k", Fraction(0), Fraction(127621, 2605650)),
    ):
        assert result.estimates[of].observed == pytest.approx(1 - d_o, rel=1e-14)
        assert result.estimates[of].chance == pytest.approx(1 - d_e, rel=1e-14)


def test_two_units_by_hand() -> None:
    # Units of 2 and 3 places that begin together, in 10: D_o = 2/(2 · 10²). Each fits
    # into the gaps of 8 and 7 in 13 and 11 places, so that D_e is 2/10 (2 + 10 + 4 · 13
    # + 9 · 11)/(20 · 19 - 2 - 6).
    frame = pd.DataFrame(
        {"observer": ["Kim", "Lee"], "category": "x", "begin": 0, "length": [2, 3]}
    )
    expected = Fraction(2, 10) * Fraction(163, 372)
    value = unitizing_alpha(frame, length=10).value
    assert value == float(1 - Fraction(1, 100) / expected)


# With three observers for odd numbers, and with gaps in who looked from 6 on
@pytest.mark.parametrize("seed", range(12))
def test_all_sections_give_the_same(seed: int) -> None:
    rows, lengths = made(seed, 1 + seed // 2, is_full=seed < 6)
    result, parts = unitizing_alpha(rows, length=lengths), by_sections(rows, lengths)
    d_o, d_e = (sum(part[k] for part in parts.values()) for k in (0, 1))
    assert result.value == float(1 - d_o / d_e)
    for of, (observed, expected) in parts.items():
        assert result.by_category[of] == float(1 - observed / expected)


@pytest.mark.parametrize("of", ["alpha", *get_args(SpanMatch)])
def test_intervals_leave_out_documents(of: Any) -> None:
    rows, lengths = made(8, 7)

    def value(left_out: str = "") -> Any:
        rest = [row for row in rows if row[0] != left_out]
        if of == "alpha":
            return unitizing_alpha(rest, length=lengths).estimates[None]
        return span_f1(rest, match=of)["Kim", "Lee"]

    estimate, lowest = value(), -1.0 if of == "alpha" else 0.0
    without = np.array([value(document).value for document in lengths])
    error = math.sqrt(6 / 7 * ((without - without.mean()) ** 2).sum())
    share = (estimate.value - lowest) / (1.0 - lowest)
    half = stdtrit(6, 0.975) * error / (1.0 - lowest) / share / (1.0 - share)
    low, high = lowest + (1.0 - lowest) * expit(logit(share) + np.array([-half, half]))
    assert estimate.standard_error == pytest.approx(error, rel=1e-9)
    assert estimate.interval.low == pytest.approx(low, rel=1e-9)
    assert estimate.interval.high == pytest.approx(high, rel=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_f1_by_sets(seed: int) -> None:
    rows, _ = made(seed, 4, is_full=False)
    looked = {row[:2] for row in rows}
    spans = [row for row in rows if row[2]]
    for match in get_args(SpanMatch):
        for pair, estimate in span_f1(rows, match=match).items():
            one, other = (
                [
                    (document, category, begin, begin + size)
                    for document, of, category, begin, size in spans
                    if of == who and {(document, both) for both in pair} <= looked
                ]
                for who in pair
            )
            of_one, of_other = (
                {(*of[:2], at) for of in part for at in range(*of[2:])}
                for part in (one, other)
            )
            top, bottom = 2 * len({*one} & {*other}), len(one) + len(other)
            if match == "token":
                top, bottom = 2 * len(of_one & of_other), len(of_one) + len(of_other)
            elif match == "overlap":
                places = [
                    (part, {(*of[:2], at) for at in range(*of[2:])})
                    for part, every in ((of_other, one), (of_one, other))
                    for of in every
                ]
                top = sum(bool(part & place) for part, place in places)
            assert estimate.value == pytest.approx(top / bottom, rel=1e-14)


def test_what_changes_nothing() -> None:
    rows, lengths = made(9, 6)
    alone = [("z", "Kim", "a", 0, 3)]  # of one observer
    called = [(x, {"Kim": 7, "Lee": "q", "Ann": "r"}[who], *of) for x, who, *of in rows]
    for other in (rows[::-1], rows + alone, called):
        result = unitizing_alpha(other, length=lengths | {"z": 9})
        assert result.value == unitizing_alpha(rows, length=lengths).value
        assert {of.value for of in span_f1(other).values()} == {
            of.value for of in span_f1(rows).values()
        }


def test_same_spans_agree_perfectly() -> None:
    rows, lengths = made(4, 5)
    same = [row for row in rows if row[1] == "Kim"]
    same += [(document, "Lee", *of) for document, _, *of in same]
    result = unitizing_alpha(same, length=lengths)
    assert result.value == 1.0
    assert result.estimates[None].interval.reason
    for match in get_args(SpanMatch):
        assert span_f1(same, match=match)["Kim", "Lee"].value == 1.0


def test_nothing_to_compare_is_undefined() -> None:
    looked = [("d", who, None, None, None) for who in ("Kim", "Lee")]
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        result = unitizing_alpha(looked, length={"d": 9})
    assert math.isnan(result.value)
    assert result.estimates[None].reason
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        assert math.isnan(span_f1(looked)["Kim", "Lee"].value)


@pytest.mark.parametrize(
    ("spans", "places"),
    [
        # a document of nine units, in which one ends where the other begins, or later
        ([("a", 0, 3), ("a", 3, 6)], None),
        ([("a", 0, 4), ("b", 3, 6)], None),
        ([("a", 3, 6), ("a", 0, 4)], ("0 to 4", "3 to 9")),
        ([("a", 0, 9), ("a", 2, 1)], ("0 to 9", "2 to 3")),
        ([("a", 3, 7)], ("3 to 10",)),
        ([("a", -1, 2)], ("-1 to 1",)),
        ([("a", 4, 0)], ("4 to 4",)),
    ],
)
def test_which_spans_are_refused(
    spans: list[tuple[str, int, int]], places: tuple[str, ...] | None
) -> None:
    rows: list[Row] = [("d", "Kim", "a", 0, 9)]
    rows += [("d", "Lee", *of) for of in spans]
    if places is None:
        assert math.isfinite(unitizing_alpha(rows, length={"d": 9}).value)
        return
    with pytest.raises(RatingsError, match=".*".join(places)):
        unitizing_alpha(rows, length={"d": 9})


@pytest.mark.slow
def test_a_hundred_thousand_spans_take_two_seconds() -> None:
    rng, rows = np.random.default_rng(1), list[Row]()
    for document in range(200):
        for who in range(5):
            begins = np.sort(rng.choice(2000, 100, replace=False)) * 100
            sizes, labels = rng.integers(1, 100, 100), rng.integers(0, 8, 100)
            columns = zip(labels.tolist(), begins.tolist(), sizes.tolist(), strict=True)
            rows += [(document, who, *of) for of in columns]
    start = time.process_time()
    unitizing_alpha(rows, length=dict.fromkeys(range(200), 200_000))
    assert time.process_time() - start < 2.0
