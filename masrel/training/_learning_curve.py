"""The learning curve of a training: kappa of the last presentations, block by block."""

import warnings
from dataclasses import dataclass, field

from masrel.errors import SmallSampleWarning, UndefinedStatisticWarning
from masrel.estimates import Estimate
from masrel.intervals import estimate
from masrel.training._lessons import TrainingRecord
from masrel.training._trainees import BLOCK_REPEATS

CURVE_BLOCKS = 2
"""Blocks of which a point is made: fewer say little, more blur what was learnt."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CurvePoint:
    """Kappa with the intended grades at the end of a block.

    Attributes
    ----------
    position : int
        Number of the last presentation of the block.
    n_presentations : int
        Counted presentations of which kappa is.
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
        One a block that came to its end, and one where the training ended; each of the
        last two blocks, or of the one there is.

    Raises
    ------
    ParameterError
        If the level is not between 0 and 1.

    Notes
    -----
    The intervals hold at each point, not at all points together, and not for the point
    at which a training is passed: it stops where kappa happens to be high.
    """
    counted, criterion = record.counted, record.criterion
    block = BLOCK_REPEATS * criterion.n_models
    ends = list(range(block, len(counted) + 1, block))
    whole_sets = len(counted) - len(counted) % criterion.n_models
    if whole_sets and whole_sets not in ends:
        ends.append(whole_sets)
    evidence = record.evidence()
    points = []
    for end in ends:
        lessons = counted[max(0, end - CURVE_BLOCKS * block) : end]
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
                evidence=float(evidence[end // criterion.n_models - 1]),
            )
        )
    return tuple(points)
