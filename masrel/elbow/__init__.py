"""The spastic elbow: events, torque and traces of a motion; SI units inside.

In: the parameters of a joint and a motion. Out: exact events, torque at any time,
what moving the arm takes, or the trace a controller would command.
"""

from masrel.elbow.effort import impulse, peak_torque, residual_torque, work
from masrel.elbow.events import Events, PhaseSpan, StretchEvents, events
from masrel.elbow.motion import Motion
from masrel.elbow.motions import (
    ConstantSpeed,
    Hold,
    Joined,
    MinimumJerk,
    Part,
    Recorded,
    Reversed,
    Trapezoid,
    interrupted,
)
from masrel.elbow.parameters import STANDARD_MODELS, ElbowParameters
from masrel.elbow.sampled import SampledJoint
from masrel.elbow.scenes import SceneTable, evaluate, torque_traces
from masrel.elbow.torque import times_at, torque, torque_at
from masrel.elbow.trace import Trace, trace

__all__ = [
    "STANDARD_MODELS",
    "ConstantSpeed",
    "ElbowParameters",
    "Events",
    "Hold",
    "Joined",
    "MinimumJerk",
    "Motion",
    "Part",
    "PhaseSpan",
    "Recorded",
    "Reversed",
    "SampledJoint",
    "SceneTable",
    "StretchEvents",
    "Trace",
    "Trapezoid",
    "evaluate",
    "events",
    "impulse",
    "interrupted",
    "peak_torque",
    "residual_torque",
    "times_at",
    "torque",
    "torque_at",
    "torque_traces",
    "trace",
    "work",
]
