"""Coefficients by their textbook formulas, in fractions, of all resamples.

Nothing here is shared with the package: items are drawn one by one, n^n times.
"""

import itertools
from collections import Counter
from collections.abc import Callable, Sequence
from fractions import Fraction
from statistics import NormalDist

from tests.accuracy import reference

Row = Sequence[int | None]
Table = Sequence[Row]
Formula = Callable[[Table], Fraction | None]


ALIKE = reference.agreement("identity", range(3))


def formula(name: str) -> Formula:
    """Return a coefficient of three categories, from its textbook."""

    def value(table: Table) -> Fraction | None:
        return reference.value(name, reference.items_of_ratings(table), ALIKE, 3)

    return value


percent, fleiss, gwet = map(formula, ("percent_agreement", "fleiss_kappa", "gwet_ac"))


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
    """Root of the mean of squared influences of items on Fleiss' kappa."""
    items = reference.items_of_ratings(table)
    error = reference.standard_error("fleiss_kappa", items, ALIKE, 3)
    assert error is not None
    return float(error)
