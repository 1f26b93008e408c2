"""The learning curve of a training: kappa of the last presentations, time and again."""

import warnings
from dataclasses import dataclass, field

from masrel.errors import SmallSampleWarning, UndefinedStatisticWarning
from masrel.estimates import Estimate
from masrel.intervals import estimate
from masrel.lab.training._lessons import TrainingRecord

CURVE_SETS = 4
"""Sets of presentations of which a point is made: fewer say little, more blur."""

STEP_SETS = 2
"""Sets from one point to the next."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CurvePoint:
    """Kappa with the intended grades of the last presentations.

    Attributes
    ----------
    position : int
        Number of the last presentation.
    n_presentations : int
        Presentations of which kappa is.
    n_right : int
        Of these, those with the intended grade.
    kappa : Estimate
        With an interval of other presentations of the same models.
    evidence : float
        Of the training, at this time.
    """

    position: int
    n_presentations: int
    n_right: int
    kappa: Estimate = field(repr=False)
    evidence: float


def learning_curve(
    record: TrainingRecord, *, level: float = 0.95
) -> tuple[CurvePoint, ...]:
    """Return the learning curve of a training.

    Parameters
    ----------
    record : TrainingRecord
        The training.
    level : float, optional
        Nominal level of the intervals.

    Returns
    -------
    tuple of CurvePoint
        One every two sets of as many presentations as there are models, and one where
        the training ended; each of the last four sets, or of those there are.

    Raises
    ------
    ParameterError
        If the level is not between 0 and 1.

    Notes
    -----
    The intervals hold at each point, not at all points together, and not for the point
    at which a training is passed: it stops where kappa happens to be high.
    """
    criterion, evidence = record.criterion, record.evidence()
    n_sets = evidence.size
    ends = {*range(STEP_SETS, n_sets + 1, STEP_SETS), n_sets} - {0}
    points = []
    for end in sorted(ends):
        first, last = max(0, end - CURVE_SETS), end
        n_models = criterion.n_models
        lessons = record.lessons[first * n_models : last * n_models]
        pairs = [(lesson.intended, lesson.grade) for lesson in lessons]
        with warnings.catch_warnings():  # a point says itself on how much it rests
            warnings.simplefilter("ignore", SmallSampleWarning)
            warnings.simplefilter("ignore", UndefinedStatisticWarning)
            kappa = estimate(
                "cohen_kappa",
                pairs,
                target="items",
                categories=criterion.grades,
                weights=criterion.weights,
                level=level,
            )
        points.append(
            CurvePoint(
                position=lessons[-1].position,
                n_presentations=len(lessons),
                n_right=sum(a == b for a, b in pairs),
                kappa=kappa,
                evidence=float(evidence[end - 1]),
            )
        )
    return tuple(points)
