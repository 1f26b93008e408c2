"""Agreement by a few lines of exact arithmetic, to compare with."""

from collections import Counter
from collections.abc import Sequence
from fractions import Fraction


def agreement(items: Sequence[Sequence[str | None]]) -> dict[str, Fraction | None]:
    """Percent agreement, and of a full table Fleiss' kappa; None is undefined.

    The first is the mean, over items with two ratings at least, of the share of pairs
    of ratings that agree.
    """
    counts = [Counter(grade for grade in row if grade is not None) for row in items]
    pairs = [
        Fraction(sum(n * (n - 1) for n in of.values()), of.total() * (of.total() - 1))
        for of in counts
        if of.total() > 1
    ]
    observed = sum(pairs, Fraction()) / len(pairs) if pairs else None
    values = {"percent_agreement": observed}
    if observed is not None and len({of.total() for of in counts}) == 1:
        grades = sum(counts, Counter[str]())
        chance = sum(
            (Fraction(n, grades.total()) ** 2 for n in grades.values()), Fraction()
        )
        values["fleiss_kappa"] = (
            None if chance == 1 else (observed - chance) / (1 - chance)
        )
    return values
