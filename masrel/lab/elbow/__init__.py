"""The spastic elbow: events, torque and traces of a motion; SI units inside.

In: the parameters of a joint and a motion. Out: exact events, torque at any time,
what moving the arm takes, or the trace a controller would command.
"""

from typing import TYPE_CHECKING

from masrel._interpreter import loaded_from
from masrel.lab.elbow._events import Events, PhaseSpan, StretchEvents, events
from masrel.lab.elbow._model_file import intermediate_models
from masrel.lab.elbow._scenes import Columns, SceneTable, evaluate
from masrel.lab.elbow._torque import (
    Outline,
    Trace,
    impulse,
    outline,
    peak_torque,
    residual_torque,
    times_at,
    torque,
    torque_at,
    trace,
    work,
)
from masrel.lab.elbow.joint_model import Stepper
from masrel.lab.elbow.motions import (
    ConstantSpeed,
    Hold,
    Joined,
    MinimumJerk,
    Motion,
    Part,
    Recorded,
    Reversed,
    Trapezoid,
    interrupted,
)
from masrel.lab.elbow.parameters import STANDARD_MODELS, ElbowParameters, SampledJoint
from masrel.lab.elbow.tone import MODELS, JointModel, Tardieu, tardieu

if TYPE_CHECKING:
    from masrel.lab.elbow.identification import fit, fit_friction, read_movement

__all__ = [
    "MODELS",
    "STANDARD_MODELS",
    "Columns",
    "ConstantSpeed",
    "ElbowParameters",
    "Events",
    "Hold",
    "Joined",
    "JointModel",
    "MinimumJerk",
    "Motion",
    "Outline",
    "Part",
    "PhaseSpan",
    "Recorded",
    "Reversed",
    "SampledJoint",
    "SceneTable",
    "Stepper",
    "StretchEvents",
    "Tardieu",
    "Trace",
    "Trapezoid",
    "evaluate",
    "events",
    "fit",
    "fit_friction",
    "impulse",
    "intermediate_models",
    "interrupted",
    "outline",
    "peak_torque",
    "read_movement",
    "residual_torque",
    "tardieu",
    "times_at",
    "torque",
    "torque_at",
    "trace",
    "work",
]

# identification needs scipy, which nothing else here does
_IDENTIFIED = dict.fromkeys(("fit", "fit_friction", "read_movement"), "identification")
__getattr__ = loaded_from(__name__, _IDENTIFIED)
