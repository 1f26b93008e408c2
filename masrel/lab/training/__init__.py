"""Training of raters: models of known grade, feedback, a test of what is learnt.

In: a protocol. Out: a log of its own for every rater. Nothing of a training enters the
ratings of the study.
"""

from masrel.lab.training._criterion import Criterion, calibrate
from masrel.lab.training._lessons import (
    CurvePoint,
    Lesson,
    TrainingRecord,
    learning_curve,
    read_training,
)
from masrel.lab.training._trainees import confusion
from masrel.lab.training._trainer import SimulatedTrainee, train_rater

__all__ = [
    "Criterion",
    "CurvePoint",
    "Lesson",
    "SimulatedTrainee",
    "TrainingRecord",
    "calibrate",
    "confusion",
    "learning_curve",
    "read_training",
    "train_rater",
]
