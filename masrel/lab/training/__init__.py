"""Training of raters: models of known grade, feedback, a test of what is learnt.

In: a protocol. Out: a log of its own for every rater. Nothing of a training enters the
ratings of the study.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.lab.training._criterion import (
        Calibration,
        Criterion,
        TraineeErrors,
        calibrate,
        training_criterion,
    )
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
    "Calibration",
    "Criterion",
    "CurvePoint",
    "Lesson",
    "SimulatedTrainee",
    "TraineeErrors",
    "TrainingRecord",
    "calibrate",
    "confusion",
    "learning_curve",
    "read_training",
    "train_rater",
    "training_criterion",
]

_HOMES = {
    "_criterion": (
        "Calibration",
        "Criterion",
        "TraineeErrors",
        "calibrate",
        "training_criterion",
    ),
    "_lessons": (
        "CurvePoint",
        "Lesson",
        "TrainingRecord",
        "learning_curve",
        "read_training",
    ),
    "_trainees": ("confusion",),
    "_trainer": ("SimulatedTrainee", "train_rater"),
}


def __getattr__(name: str) -> object:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(
                importlib.import_module(f"masrel.lab.training.{module}"), name
            )
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
