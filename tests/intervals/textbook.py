"""Coefficients by their textbook formulas, in fractions, and all their resamples.

Nothing here is shared with the package: items are drawn one by one, n^n times.
"""

import itertools
import math
from collections import Counter
from collections.abc import Callable, Sequence
from fractions import Fraction
from statistics import NormalDist

Row = Sequence[int | None]
Table = Sequence[Row]
Formula = Callable[[Table], Fraction | None]


def _agreeing(row: Row) -> Fraction | None:
    given = [grade for grade in row if grade is not None]
    pairs = list(itertools.permutations(given, 2))
    if not pairs:
        return None
    return Fraction(sum(a == b for a, b in pairs), len(pairs))


def percent(table: Table) -> Fraction | None:
    """Mean share of agreeing pairs of raters."""
    shares = [share for row in table if (share := _agreeing(row)) is not None]
    return sum(shares, Fraction(0)) / len(shares) if shares else None


def category_shares(table: Table, n_categories: int) -> list[Fraction]:
    """Mean over items of the share of the item's raters who chose each category."""
    found = [Fraction(0)] * n_categories
    rated = [[grade for grade in row if grade is not None] for row in table]
    rated = [row for row in rated if row]
    for row in rated:
        for k in range(n_categories):
            found[k] += Fraction(row.count(k), len(row) * len(rated))
    return found


def fleiss(table: Table) -> Fraction | None:
    """Fleiss (1971): (P - P_e) / (1 - P_e), P_e the sum of squared shares."""
    observed = percent(table)
    chance = sum(p * p for p in category_shares(table, 3))
    if observed is None or chance == 1:
        return None
    return (observed - chance) / (1 - chance)


def gwet(table: Table) -> Fraction | None:
    """Gwet's AC1, three categories: P_e = Σ p (1 - p) / 2."""
    observed = percent(table)
    if observed is None:
        return None
    chance = sum(p * (1 - p) for p in category_shares(table, 3)) / 2
    return (observed - chance) / (1 - chance)


class Law:
    """The values of all resamples with their probabilities, in fractions."""

    def __init__(self, values: Counter[Fraction | None]) -> None:
        every = sum(values.values())
        self.undefined = Fraction(values.pop(None, 0), every)
        defined = sum(values.values())
        self.values = sorted(value for value in values if value is not None)
        self.weights = [Fraction(values[value], defined) for value in self.values]

    def quantile(self, position: Fraction | float) -> Fraction:
        """The least value at which the probability adds up, middle of two at a tie."""
        upto = Fraction(0)
        for at, weight in enumerate(self.weights):
            upto += weight
            if upto == position:
                return (self.values[at] + self.values[at + 1]) / 2
            if upto > position:
                return self.values[at]
        return self.values[-1]

    def below(self, value: Fraction) -> Fraction:
        """The probability of less than a value, and half that of the value."""
        pairs = list(zip(self.values, self.weights, strict=True))
        less = sum((w for v, w in pairs if v < value), Fraction(0))
        same = sum((w for v, w in pairs if v == value), Fraction(0))
        return less + same / 2


def law_of_items(table: Table, formula: Formula) -> Law:
    """Draw items with replacement in all n^n ways."""
    return law_of_clusters([[row] for row in table], formula)


def law_of_clusters(groups: Sequence[Table], formula: Formula) -> Law:
    """Draw whole groups of items with replacement in all n^n ways."""
    n = len(groups)
    known: dict[tuple[int, ...], Fraction | None] = {}
    values: Counter[Fraction | None] = Counter()
    for drawn in itertools.product(range(n), repeat=n):
        members = tuple(sorted(drawn))  # the formulas do not ask for the order
        if members not in known:
            known[members] = formula([row for i in members for row in groups[i]])
        values[known[members]] += 1
    return Law(values)


def bca_positions(
    level: float, share: Fraction, left_out: Sequence[Fraction]
) -> tuple[float, float]:
    """Efron and Tibshirani (14.10), (14.14) and (14.15), term by term."""
    normal = NormalDist()
    mean = sum(left_out, Fraction(0)) / len(left_out)
    third = sum((mean - value) ** 3 for value in left_out)
    second = sum((mean - value) ** 2 for value in left_out)
    acceleration = float(third) / (6 * float(second) ** 1.5)
    z0 = normal.inv_cdf(float(share))
    tail = (1 - level) / 2
    found = []
    for z in (normal.inv_cdf(tail), normal.inv_cdf(1 - tail)):
        found.append(normal.cdf(z0 + (z0 + z) / (1 - acceleration * (z0 + z))))
    return found[0], found[1]


def fleiss_error(table: Table) -> float:
    """Root of the sum of squared influences of items on Fleiss' kappa, over n."""
    value, observed = fleiss(table), percent(table)
    assert value is not None
    assert observed is not None
    shares = category_shares(table, 3)
    chance = sum(p * p for p in shares)
    n = len(table)
    total = Fraction(0)
    for row in table:
        given = [grade for grade in row if grade is not None]
        agreeing = _agreeing(row)
        assert agreeing is not None
        moved = sum(
            2 * shares[k] * (Fraction(given.count(k), len(given)) - shares[k])
            for k in range(3)
        )
        # d kappa = (dP - (1 - kappa) dP_e) / (1 - P_e)
        total += ((agreeing - observed - (1 - value) * moved) / (1 - chance)) ** 2
    return math.sqrt(total) / n
