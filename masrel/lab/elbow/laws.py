"""Every law of the joint by its name."""

from masrel.lab.elbow.joint_model import JointModel
from masrel.lab.elbow.parameters import ElbowParameters
from masrel.lab.elbow.tone import (
    ClaspKnife,
    Clonus,
    Cogwheel,
    Contracture,
    Dystonia,
    LeadPipe,
    ThresholdReflex,
)

__all__ = ["MODELS"]

_LAWS: tuple[type[JointModel], ...] = (
    ElbowParameters,
    LeadPipe,
    Cogwheel,
    ClaspKnife,
    Contracture,
    Dystonia,
    Clonus,
    ThresholdReflex,
)

MODELS: dict[str, type[JointModel]] = {law.kind: law for law in _LAWS}
"""Every law by the name of its kind; `kind = "..."` of a protocol file."""
