"""Tables of ratings on which floating point loses digits, built to a purpose."""

import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.accuracy.reference import (
    Item,
    items_of_counts,
    items_of_ratings,
    items_of_table,
)

Row = tuple[int | None, ...]  # one item's categories, rater by rater

OF_COUNTS = (
    "percent_agreement",
    "fleiss_kappa",
    "brennan_prediger",
    "gwet_ac",
    "krippendorff_alpha",
)
OF_PAIRS = ("cohen_kappa", "scott_pi")
OF_RATERS = ("conger_kappa", "light_kappa")
WEIGHTS = ("linear", "quadratic", "ordinal", "radical", "ratio", "circular", "bipolar")
METRICS = {
    "nominal": "nominal",
    "ordinal metric": "ordinal",
    "interval": "interval",
    "ratio metric": "ratio",
}


@dataclass(frozen=True)
class Case:
    """Ratings in one of three forms: rows with how often each occurs, counts, a table.

    Values are what the categories weigh, 1 to q unless given.
    """

    group: str
    name: str
    rows: Sequence[tuple[Row, int]] = ()
    counts: Sequence[Sequence[int]] = ()
    table: Sequence[Sequence[int]] = ()
    n_categories: int = 2
    values: Sequence[int | float] = ()
    weights: Sequence[str] = ("identity",)
    long: bool = field(default=False, compare=False)  # minutes in fractions

    @property
    def scale(self) -> tuple[int | float, ...]:
        return tuple(self.values) or tuple(range(1, self.n_categories + 1))

    @cached_property
    def items(self) -> list[Item]:
        if self.table:
            return items_of_table(self.table)
        if self.counts:
            return items_of_counts(self.counts)
        return [
            item for row, times in self.rows for item in items_of_ratings([row], times)
        ]

    @property
    def n_raters(self) -> int | None:
        if self.counts:
            return None
        return 2 if self.table else len(self.rows[0][0])

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Those that the form of the ratings allows."""
        pairs = OF_PAIRS if self.n_raters == 2 else ()
        return OF_COUNTS + pairs + (OF_RATERS if self.rows else ())

    def labels(self) -> NDArray[Any]:
        """Every item's labels, shape (n_items, n_raters); `nan` where missing."""
        gaps = any(code is None for row, _ in self.rows for code in row)
        kind = np.float64 if gaps or self.values else np.int16
        value: dict[int | None, float] = {None: np.nan, **dict(enumerate(self.scale))}
        distinct = [[value[code] for code in row] for row, _ in self.rows]
        times = [times for _, times in self.rows]
        return np.repeat(np.array(distinct, dtype=kind), times, axis=0)


def _rated(
    seed: int, shape: tuple[int, int], q: int, *, alike: float, given: float = 1.0
) -> list[tuple[Row, int]]:
    # items of a true category, which a rater sees with probability `alike`
    draw = random.Random(seed)
    rows = []
    for _ in range(shape[0]):
        true = draw.randrange(q)
        row = tuple(
            None
            if draw.random() >= given
            else true
            if draw.random() < alike
            else draw.randrange(q)
            for _ in range(shape[1])
        )
        rows.append((row, 1))
    return rows


def _chosen(*rows: str) -> list[tuple[Row, int]]:
    # a rater a letter, categories from "a" on, "." where missing
    return [
        (tuple(None if c == "." else ord(c) - ord("a") for c in row), 1) for row in rows
    ]


def _split(seed: int, n_items: int, n_raters: int) -> list[list[int]]:
    # so many distinct items that masrel sums their squares in floats
    draw, half = random.Random(seed), n_raters // 2
    more = [draw.randrange(-half // 10**4, half // 10**4) for _ in range(n_items)]
    return [[half + d, half - d] for d in more]


E15, E14, E12 = 10**15, 10**14, 10**12
MOST = 2**53 - 1  # the largest count that is taken

MANY = 10**7

ORDINARY = [
    # Table V of Park, Kim & Damiano (2012), grades 1, 1+, 2, 3
    Case(
        "Ordinary tables",
        "4 items × 8 raters (HESS, Table V)",
        rows=_chosen("aaabaaaa", "bbbbbaba", "cccccccc", "dcdddcdd"),
        n_categories=4,
    ),
    Case(
        "Ordinary tables",
        "50 items × 2 raters",
        rows=[((0, 0), 20), ((0, 1), 5), ((1, 0), 10), ((1, 1), 15)],
    ),
    Case(
        "Ordinary tables",
        "200 items × 5 raters",
        rows=_rated(1, (200, 5), 4, alike=0.6),
        n_categories=4,
    ),
]

LARGE = [
    Case(
        "Counts up to 10¹⁵",
        "table of two raters, 2·10¹⁵ items",
        table=[[E15, 7], [3, E15 - 11]],
    ),
    Case(
        "Counts up to 10¹⁵",
        "table with cells of 2⁵³ − 1",
        table=[[MOST, 1, 0], [0, MOST, 5], [2, 1, MOST]],
        n_categories=3,
    ),
    Case(
        "Counts up to 10¹⁵",
        "3 items × 10¹⁵ raters",
        counts=[[E15 - 1, 1, 0], [2, E15 - 5, 3], [E15 // 2, E15 // 4, E15 // 4]],
        n_categories=3,
    ),
    Case(
        "Counts up to 10¹⁵",
        "items of 2 to 10¹⁵ raters",
        counts=[[E15, 1], [3, E15 - 7], [1, 1], [E12 + 1, E12]],
    ),
    Case(
        "Counts up to 10¹⁵",
        "2 100 items × 10¹² raters, nearly evenly split",
        counts=_split(9, 2100, E12),
    ),
]

CHANCE = [
    Case(
        "Chance agreement near 1",
        "one disagreement in 10¹⁵, p_e = 1 − 2·10⁻¹⁵",
        table=[[E15, 1], [0, 1]],
    ),
    Case(
        "Chance agreement near 1",
        "no agreement on the rare category",
        table=[[E15, 1], [1, 0]],
    ),
    Case(
        "Chance agreement near 1",
        "perfect agreement, p_e = 1 − 2·10⁻¹⁶",
        table=[[MOST, 0], [0, 1]],
    ),
    Case(
        "Chance agreement near 1",
        "4 items × 10¹⁵ raters, one deviates",
        counts=[[E15, 0], [E15, 0], [E15 - 1, 1], [E15, 0]],
    ),
]

NEAR_ZERO = [
    # (m + 1)(m - 1) - m² = -1: κ = π = -1/(4m²)
    Case(
        "κ near 0",
        "Cohen's κ and Scott's π at −10⁻¹²",
        table=[[500_001, 500_000], [500_000, 499_999]],
    ),
    # p_o - p_e = about 1/(4m) for every coefficient
    Case(
        "κ near 0",
        "every coefficient at about 10⁻¹³",
        table=[[10**12 + 1, 10**12], [10**12, 10**12]],
    ),
    Case("κ near 0", "exactly 0", table=[[E14, E14], [E14, E14]]),
    Case(
        "κ near 0",
        "exactly 0, three raters' ratings",
        rows=[((0, 0, 0), 3), ((0, 0, 1), 9), ((0, 1, 1), 9), ((1, 1, 1), 3)],
    ),
]

NEAR_ONE = [
    Case("κ near 1", "1 − κ = 2·10⁻¹²", table=[[5 * 10**11, 1], [0, 5 * 10**11]]),
    Case("κ near 1", "1 − κ = 10⁻¹⁵", table=[[E15, 0], [1, E15]]),
    Case("κ near 1", "exactly 1", table=[[E15, 0], [0, 3]]),
]

FEW_DISAGREE = [
    Case(
        "Ten million items, few disagreements",
        "2 raters, as a table",
        table=[[MANY // 2, 3], [2, MANY // 2 - 5]],
    ),
    Case(
        "Ten million items, few disagreements",
        "2 raters, as ratings",
        rows=[
            ((0, 0), MANY // 2),
            ((0, 1), 3),
            ((1, 0), 2),
            ((1, 1), MANY // 2 - 5),
        ],
    ),
    # what the two items disagree by is nearly what chance gives: influences cancel
    Case(
        "Ten million items, few disagreements",
        "3 raters, one of them sees the rare category",
        rows=[((0, 0, 0), MANY - 2), ((0, 0, 1), 1), ((1, 0, 0), 1)],
    ),
    Case(
        "Ten million items, few disagreements",
        "3 raters, two of them see the rare category",
        rows=[((0, 0, 0), MANY - 2), ((1, 1, 0), 1), ((0, 1, 1), 1)],
    ),
    Case(
        "Ten million items, few disagreements",
        "3 raters, nearly all in one category",
        rows=[((0, 0, 0), MANY - 5), ((0, 0, 1), 2), ((1, 0, 0), 2), ((0, 1, 1), 1)],
    ),
]

CATEGORIES = [
    Case(
        "Many categories",
        "20 categories, 100 items × 3 raters",
        rows=_rated(2, (100, 3), 20, alike=0.7),
        n_categories=20,
    ),
    Case(
        "Many categories",
        "200 categories, 20 items × 3 raters",
        rows=_rated(3, (20, 3), 200, alike=0.7),
        n_categories=200,
    ),
    Case(
        "Many categories",
        "200 categories, 400 items × 3 raters",
        rows=_rated(3, (400, 3), 200, alike=0.7),
        n_categories=200,
        long=True,
    ),
    Case(
        "Many categories",
        "200 categories, table of two raters",
        table=[
            [(k * m) % 7 + 10**6 * (k == m) for m in range(200)] for k in range(200)
        ],
        n_categories=200,
        long=True,
    ),
]

MISSING = [
    Case(
        "Missing ratings",
        "90 % missing, 60 items × 12 raters",
        rows=_rated(4, (60, 12), 4, alike=0.7, given=0.1),
        n_categories=4,
    ),
    Case(
        "Missing ratings",
        "30 % missing, 40 items × 3 raters",
        rows=_rated(5, (40, 3), 4, alike=0.7, given=0.7),
        n_categories=4,
    ),
    Case(
        "Missing ratings",
        "half missing, 40 items × 2 raters",
        rows=_rated(6, (40, 2), 3, alike=0.7, given=0.7),
        n_categories=3,
    ),
]

WEIGHTED = [
    Case(
        "Weights",
        "5 grades, 30 items × 3 raters",
        rows=_rated(7, (30, 3), 5, alike=0.5),
        n_categories=5,
        weights=(*WEIGHTS, *METRICS),
    ),
    Case(
        "Weights",
        "unequal grades 1, 1.5, 2, 3, 8, table of two raters",
        table=[
            [12, 3, 1, 0, 0],
            [2, 9, 4, 1, 0],
            [0, 5, 11, 2, 1],
            [0, 1, 2, 7, 0],
            [1, 0, 0, 1, 4],
        ],
        n_categories=5,
        values=(1, 1.5, 2, 3, 8),
        weights=(*WEIGHTS, *METRICS),
    ),
    Case(
        "Weights",
        "10¹⁵ items, one off by one grade",
        table=[[E15, 1, 0], [0, 1, 0], [0, 0, 1]],
        n_categories=3,
        weights=(*WEIGHTS, *METRICS),
    ),
    Case(
        "Weights",
        "30 % missing, 25 items × 4 raters",
        rows=_rated(8, (25, 4), 4, alike=0.6, given=0.7),
        n_categories=4,
        weights=(*WEIGHTS, *METRICS),
    ),
]

DEGENERATE = [
    Case(
        "Undefined or nearly",
        "a scale of one category",
        rows=_chosen("aaa", "aaa"),
        n_categories=1,
    ),
    Case(
        "Undefined or nearly",
        "one category used of three",
        rows=_chosen("bbb", "bbb", "bbb"),
        n_categories=3,
    ),
    Case("Undefined or nearly", "one item", rows=_chosen("aab")),
    Case(
        "Undefined or nearly",
        "no item with two ratings",
        rows=_chosen("a.", ".b", "b."),
    ),
    Case(
        "Undefined or nearly",
        "a rater without ratings",
        rows=_chosen("aa.", "ab.", "bb."),
    ),
    Case(
        "Undefined or nearly",
        "an item without ratings",
        rows=_chosen("aa", "..", "ab", "bb"),
    ),
    Case(
        "Undefined or nearly",
        "two raters, each always the same",
        rows=_chosen("ab", "ab", "ab"),
    ),
]

CASES = [
    *ORDINARY,
    *LARGE,
    *CHANCE,
    *NEAR_ZERO,
    *NEAR_ONE,
    *FEW_DISAGREE,
    *CATEGORIES,
    *MISSING,
    *WEIGHTED,
    *DEGENERATE,
]
