"""The spastic elbow: events, torque and traces of a stretch; SI units inside.

In: the parameters of a joint and a motion. Out: exact events, torque at any time,
or the trace a controller would command.
"""

from masrel.elbow.events import Events, PhaseSpan, events
from masrel.elbow.motion import ConstantSpeed, MinimumJerk, Motion
from masrel.elbow.parameters import STANDARD_MODELS, ElbowParameters
from masrel.elbow.sampled import SampledJoint
from masrel.elbow.torque import peak_torque, torque
from masrel.elbow.trace import Trace, trace

__all__ = [
    "STANDARD_MODELS",
    "ConstantSpeed",
    "ElbowParameters",
    "Events",
    "MinimumJerk",
    "Motion",
    "PhaseSpan",
    "SampledJoint",
    "Trace",
    "events",
    "peak_torque",
    "torque",
    "trace",
]
