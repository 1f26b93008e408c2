"""Other tone: laws of the joint besides the paper's spastic elbow; SI units inside."""

from masrel.lab.elbow.tone._clasp_knife import ClaspKnife
from masrel.lab.elbow.tone._clonus import Clonus
from masrel.lab.elbow.tone._cogwheel import Cogwheel
from masrel.lab.elbow.tone._contracture import Contracture
from masrel.lab.elbow.tone._dystonia import Dystonia
from masrel.lab.elbow.tone._lead_pipe import LeadPipe
from masrel.lab.elbow.tone._model import Quantity, ToneEvent, ToneModel
from masrel.lab.elbow.tone._threshold_reflex import ThresholdReflex

__all__ = [
    "ClaspKnife",
    "Clonus",
    "Cogwheel",
    "Contracture",
    "Dystonia",
    "LeadPipe",
    "Quantity",
    "ThresholdReflex",
    "ToneEvent",
    "ToneModel",
]
