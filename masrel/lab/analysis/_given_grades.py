"""Which grades models of each intended grade were given."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from masrel.intervals.diagnosis import _share_interval
from masrel.lab.protocol import Protocol
from masrel.lab.ratings import Ratings


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenGrades:
    """Grades of the models of one intended grade."""

    intended: str
    counts: tuple[int, ...]  # of each grade of the scale
    n_raters: int
    # part of the grades that are the intended one, and its interval, raters random
    share: float
    low: float
    high: float

    @property
    def n(self) -> int:
        """How many grades there are."""
        return sum(self.counts)


def given_grades(
    protocol: Protocol, ratings: Ratings, level: float
) -> tuple[str | None, tuple[GivenGrades, ...]]:
    """Return the first session that has ratings, and its grades by intended ones."""
    intended = {model.id: model.intended_grade for model in protocol.models}
    graded = [row for row in ratings.rows if row.grade is not None]
    present = {row.session for row in graded}
    session = next((s.id for s in protocol.sessions if s.id in present), None)
    # how often each rater met each intended grade with each grade
    met: dict[str, Counter[tuple[str, str]]] = {}
    for row in graded:
        aim = intended[row.model]
        if row.session == session and row.grade is not None and aim is not None:
            met.setdefault(aim, Counter())[row.rater, row.grade] += 1
    grades = ratings.scale.grades
    return session, tuple(
        _of_aim(aim, met[aim], grades, level) for aim in grades if aim in met
    )


def _of_aim(
    aim: str, met: Counter[tuple[str, str]], grades: tuple[str, ...], level: float
) -> GivenGrades:
    raters = sorted({rater for rater, _ in met})
    every = np.array([[met[rater, grade] for grade in grades] for rater in raters])
    # of each rater how many grades, and how many of them the intended one
    wholes = every.sum(axis=1).astype(np.float64)
    parts = every[:, grades.index(aim)].astype(np.float64)
    low, high = _share_interval(
        level,
        parts=parts.sum(keepdims=True),
        wholes=wholes.sum(keepdims=True),
        squares=np.array([parts @ parts]),
        products=np.array([parts @ wholes]),
        whole_squares=np.array([wholes @ wholes]),
        n_items=np.array([float(len(raters))]),
    )
    return GivenGrades(
        intended=aim,
        counts=tuple(every.sum(axis=0).tolist()),
        n_raters=len(raters),
        share=float(parts.sum() / wholes.sum()),
        low=float(low[0]),
        high=float(high[0]),
    )
