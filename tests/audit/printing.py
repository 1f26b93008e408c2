"""Agreement and kappa of a table as fractions, and as they would be printed."""

from collections.abc import Sequence
from fractions import Fraction

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
