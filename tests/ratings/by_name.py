"""What was read, by the names of items and raters."""

from masrel.ratings import RatingsFile


def grades(file: RatingsFile) -> dict[tuple[str, str], str | None]:
    """Return the grade of each item and rater, None where it is missing."""
    (part,) = file.parts
    names = (*file.scale.grades, None)
    return {
        (item, rater): names[code]
        for item, row in zip(part.items, part.ratings.codes.tolist(), strict=True)
        for rater, code in zip(part.raters, row, strict=True)
    }
