"""What is left of ratings without the raters who are excluded from the analysis."""

import dataclasses
from collections.abc import Collection

from masrel.lab.ratings import InPerson, Ratings


def analysed_ratings(ratings: Ratings, excluded: Collection[str]) -> Ratings:
    """Return the ratings of all other raters."""
    rows = tuple(row for row in ratings.rows if row.rater not in excluded)
    return dataclasses.replace(ratings, rows=rows)


def analysed_in_person(
    in_person: InPerson | None, excluded: Collection[str]
) -> InPerson | None:
    """Return the grades given in person by all other raters."""
    if in_person is None:
        return None
    rows = tuple(row for row in in_person.rows if row.rater not in excluded)
    return dataclasses.replace(in_person, rows=rows)
