"""Every table is counted, no other one, and the work that it takes is bounded."""

import itertools
import json
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from masrel.audit import ConsistentTables, consistent_tables

Rows = Sequence[Sequence[int]]


def disagreement(weights: str, k: int, m: int) -> int:
    return {"identity": int(k != m), "linear": abs(k - m), "quadratic": (k - m) ** 2}[
        weights
    ]


def of_two_raters(
    table: Rows, agreement_weights: str, kappa_weights: str
) -> tuple[Fraction, Fraction | None]:
    """Percent agreement and Cohen's kappa, None where it is undefined."""
    q = range(len(table))
    n = sum(map(sum, table))
    rows, columns = (
        [sum(row) for row in table],
        [sum(c) for c in zip(*table, strict=True)],
    )
    worst = disagreement(agreement_weights, 0, len(table) - 1)
    cells = [(k, m, table[k][m]) for k in q for m in q]
    off = sum(disagreement(agreement_weights, k, m) * x for k, m, x in cells)
    observed = sum(disagreement(kappa_weights, k, m) * x for k, m, x in cells)
    chance = sum(
        disagreement(kappa_weights, k, m) * rows[k] * columns[m] for k in q for m in q
    )
    kappa = 1 - Fraction(n * observed, chance) if chance else None
    return 100 * (1 - Fraction(off, n * worst)), kappa


def of_items(
    items: Rows, agreement_weights: str, kappa_weights: str
) -> tuple[Fraction, Fraction | None]:
    """Percent agreement of pairs and Fleiss' kappa from counts by item."""
    q, n, raters = range(len(items[0])), len(items), sum(items[0])

    def pairs(weights: str, counts: Sequence[int]) -> int:
        return sum(
            disagreement(weights, k, m) * counts[k] * counts[m] for k in q for m in q
        )

    n_pairs = n * raters * (raters - 1)
    worst = disagreement(agreement_weights, 0, len(q) - 1)
    off = sum(pairs(agreement_weights, item) for item in items)
    observed = Fraction(sum(pairs(kappa_weights, item) for item in items), n_pairs)
    totals = [sum(column) for column in zip(*items, strict=True)]
    chance = Fraction(pairs(kappa_weights, totals), (n * raters) ** 2)
    kappa = 1 - observed / chance if chance else None
    return 100 * (1 - Fraction(off, n_pairs * worst)), kappa


def rounded(value: Fraction, decimals: int, rule: str) -> int:
    """The value in units of its last decimal."""
    scaled = abs(value) * 10**decimals
    whole = scaled.__floor__()
    rest = scaled - whole
    goes_up = rest > Fraction(1, 2) or (
        rest == Fraction(1, 2) and (rule == "half_up" or whole % 2 == 1)
    )
    return (whole + goes_up) * (1 if value >= 0 else -1)


def shown(units: int, decimals: int) -> str:
    """A number in units of its last decimal, as text."""
    digits = f"{abs(units):0{decimals + 1}d}"
    sign = "-" if units < 0 else ""
    if not decimals:
        return sign + digits
    return f"{sign}{digits[:-decimals]}.{digits[-decimals:]}"


ORACLE = json.loads(
    (Path(__file__).parents[1] / "oracles" / "audit.json").read_text(encoding="utf-8")
)
RULES = ("half_even", "half_up")
WEIGHTS = ("identity", "linear", "quadratic")


@pytest.mark.parametrize("case", ORACLE["cases"], ids=lambda case: case["id"])
def test_published_style_summaries_have_as_many_tables(case: dict[str, object]) -> None:
    keys = ("n_items", "n_categories", "agreement", "kappa", "agreement_weights")
    claim = {key: case[key] for key in keys}
    for weights, numbers in case["n_tables"].items():
        for rounding, n_tables in numbers.items():
            result = consistent_tables(
                **claim, kappa_weights=weights, rounding=rounding
            )
            assert result.n_tables == min(n_tables, 10_000)
            assert result.status == ("exact" if n_tables < 10_000 else "at least")
            assert result.is_possible is (n_tables > 0)


def shares(total: int, cells: int) -> Iterator[tuple[int, ...]]:
    if cells == 1:
        yield (total,)
        return
    for first in range(total + 1):
        for rest in shares(total - first, cells - 1):
            yield (first, *rest)


def every_table(n_items: int, q: int, n_raters: int) -> list[Rows]:
    if n_raters > 2:
        return list(itertools.product(shares(n_raters, q), repeat=n_items))
    return [
        tuple(cells[k : k + q] for k in range(0, q * q, q))
        for cells in shares(n_items, q * q)
    ]


@pytest.mark.parametrize(
    ("n_items", "q", "n_raters"),
    [(1, 2, 2), (5, 2, 2), (8, 2, 2), (3, 3, 2), (2, 4, 2), (3, 2, 3), (2, 3, 3)],
)
def test_the_count_is_that_of_all_tables_one_by_one(
    n_items: int, q: int, n_raters: int
) -> None:
    rng = np.random.default_rng(n_items + 10 * q + 100 * n_raters)
    tables = every_table(n_items, q, n_raters)
    of_table = of_two_raters if n_raters == 2 else of_items
    for weights in itertools.product(WEIGHTS, WEIGHTS):
        values = [of_table(table, *weights) for table in tables]
        for _ in range(3):
            check_count(rng, tables, values, of_table, weights, n_raters)


def check_count(
    rng: np.random.Generator,
    tables: list[Rows],
    values: list[tuple[Fraction, Fraction | None]],
    of_table: Callable[..., tuple[Fraction, Fraction | None]],
    weights: tuple[str, str],
    n_raters: int,
) -> None:
    rule, decimals = str(rng.choice(RULES)), int(rng.integers(0, 3))
    # agreement and kappa of two tables: about half of these claims are impossible
    percent = rounded(values[rng.integers(len(values))][0], decimals, rule)
    kappa = rounded(
        values[rng.integers(len(values))][1] or Fraction(1, 3), decimals, rule
    )
    if abs(kappa) > 10**decimals:  # Fleiss' kappa can be below -1 for few ratings
        return

    def fits(value: tuple[Fraction, Fraction | None], by: str) -> bool:
        return (
            value[1] is not None
            and rounded(value[0], decimals, by) == percent
            and rounded(value[1], decimals, by) == kappa
        )

    result = consistent_tables(
        n_items=len(tables[0]) if n_raters > 2 else sum(map(sum, tables[0])),
        n_categories=len(tables[0][0]),
        n_raters=n_raters,
        agreement=shown(percent, decimals),
        kappa=shown(kappa, decimals),
        agreement_weights=weights[0],
        kappa_weights=weights[1],
    )
    assert result.n_tables == sum(any(fits(v, by) for by in RULES) for v in values)
    for reading in result.readings:
        assert reading.n_tables == sum(fits(v, reading.rounding) for v in values)
    for example in result.examples:
        assert any(fits(of_table(example, *weights), by) for by in RULES)


@pytest.mark.parametrize(
    ("claim", "n_visited"),
    [
        ({"n_items": 100, "n_categories": 2, "kappa": "0.755"}, 400_000),
        ({"n_items": 40, "n_categories": 3, "kappa": "0.755"}, 400_000),
        ({"n_items": 40, "n_categories": 3, "kappa": "0.200"}, 5_000_000),
        (
            {
                "n_items": 60,
                "n_categories": 3,
                "agreement": "73.3",
                "kappa": "0.588",
            },
            1_000_000,
        ),
    ],
)
def test_little_is_visited(claim: dict[str, object], n_visited: int) -> None:
    result = consistent_tables(**claim)
    assert result.status in ("exact", "at least")
    assert result.n_visited <= n_visited


def test_it_says_where_the_bound_on_work_was_met() -> None:
    result = consistent_tables(
        n_items=10_000, n_categories=3, n_raters=1000, kappa="0.3"
    )
    assert (result.n_tables, result.status, str(result)) == (
        None,
        "cannot tell",
        "cannot tell",
    )
    assert result.is_possible is None


def test_forms_in_which_numbers_are_printed() -> None:
    plain = {"n_items": 20, "n_categories": 2, "agreement": "85.0"}
    assert consistent_tables(**plain, kappa=".58") == consistent_tables(
        **plain, kappa="0.58"
    )
    assert consistent_tables(
        n_items=20, n_categories=2, kappa="−0.11"
    ) == consistent_tables(n_items=20, n_categories=2, kappa="-0.11")
    two: ConsistentTables = consistent_tables(**plain, kappa="1.0")
    assert str(two) == "no table"
