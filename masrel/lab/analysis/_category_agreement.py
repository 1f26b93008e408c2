"""How well raters agree on each grade, in the ratings of one line of the plan."""

import warnings
from dataclasses import dataclass

import numpy as np

from masrel.agreement import category_kappa, code_ratings
from masrel.errors import MasrelWarning
from masrel.intervals.diagnosis import _category_arrays
from masrel.lab.analysis._results import PlannedEstimate
from masrel.lab.ratings import Ratings, rating_matrix


@dataclass(frozen=True, slots=True, kw_only=True)
class CategoryAgreement:
    """Agreement of raters on one grade."""

    grade: str
    n_ratings: int  # in the grade
    # specific agreement and its interval, models random; ``nan`` where undefined
    agreement: float
    low: float
    high: float
    kappa: float  # Fleiss' of the grade against all others; ``nan`` where undefined


def category_agreement(
    entry: PlannedEstimate, ratings: Ratings, level: float
) -> tuple[CategoryAgreement, ...]:
    """Return how well raters agree on each grade, by the ratings of a planned line."""
    matrix = rating_matrix(ratings, session=entry.line.sessions[0], models=entry.models)
    grades = ratings.scale.grades
    codes = code_ratings(matrix.grades, grades).codes
    freq = np.ones(len(codes), dtype=np.int64)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MasrelWarning)  # a grade that nobody gave
        arrays = _category_arrays(codes, freq, len(grades), level)
        kappas = [
            category_kappa(matrix.grades, grade, categories=grades).value
            for grade in grades
        ]
    keys = ("counts", "values", "low", "high")
    columns = [arrays[f"category_{key}"].tolist() for key in keys]
    return tuple(
        CategoryAgreement(
            grade=grade, n_ratings=n, agreement=value, low=low, high=high, kappa=kappa
        )
        for grade, n, value, low, high, kappa in zip(
            grades, *columns, kappas, strict=True
        )
    )
