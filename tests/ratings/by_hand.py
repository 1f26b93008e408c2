"""Texts read as files, what was read by names, and agreement by exact arithmetic."""

from collections import Counter
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from masrel.ratings import RatingsFile, Reading, read_ratings


def read(folder: Path, text: str, ending: str = ".csv", **options: Any) -> RatingsFile:
    """Read a text as a file of this ending."""
    path = folder / f"r{ending}"
    path.write_text(text, encoding="utf-8")
    return read_ratings(path, Reading(**options))


def grades(file: RatingsFile) -> dict[tuple[str, str], str | None]:
    """Return the grade of each item and rater, None where it is missing."""
    (part,) = file.parts
    names = (*file.scale.grades, None)
    return {
        (item, rater): names[code]
        for item, row in zip(part.items, part.ratings.codes.tolist(), strict=True)
        for rater, code in zip(part.raters, row, strict=True)
    }


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
