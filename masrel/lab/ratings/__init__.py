"""Ratings of a study: where they come from, and how statistics take them.

In: session logs, or a study's table. Out: a checked table, the item by rater matrix
of one session, and the pairs of two.
"""

from masrel.lab.ratings.answers import (
    RECONSTRUCTED,
    GivenAnswer,
    answers_csv,
    answers_from_logs,
    answers_of,
    read_answers,
    write_answers,
)
from masrel.lab.ratings.completeness import Correction, corrections_of, study_remarks
from masrel.lab.ratings.study_data import (
    StudyData,
    in_person_of,
    ratings_from_logs,
    read_study_data,
)
from masrel.lab.ratings.study_file import (
    InPerson,
    InPersonRow,
    read_in_person,
    read_study_ratings,
)
from masrel.lab.ratings.table import (
    DEFAULT_SESSION,
    RATING_COLUMNS,
    SOURCES,
    Rating,
    RatingMatrix,
    Ratings,
    RetestPairs,
    rating_matrix,
    ratings_csv,
    ratings_from_rows,
    retest_pairs,
    write_ratings,
)

__all__ = [
    "DEFAULT_SESSION",
    "RATING_COLUMNS",
    "RECONSTRUCTED",
    "SOURCES",
    "Correction",
    "GivenAnswer",
    "InPerson",
    "InPersonRow",
    "Rating",
    "RatingMatrix",
    "Ratings",
    "RetestPairs",
    "StudyData",
    "answers_csv",
    "answers_from_logs",
    "answers_of",
    "corrections_of",
    "in_person_of",
    "rating_matrix",
    "ratings_csv",
    "ratings_from_logs",
    "ratings_from_rows",
    "read_answers",
    "read_in_person",
    "read_study_data",
    "read_study_ratings",
    "retest_pairs",
    "study_remarks",
    "write_answers",
    "write_ratings",
]
