"""Joints identified from recordings, with the uncertainty of every parameter.

In: recordings of slow and fast stretches (CSV, npz, or masrel's own). Out: a joint
with intervals and whether it fits, a model file that a protocol can name, the friction
of a device.
"""

from masrel.lab.elbow._model_file import as_toml, intermediate_models, model_document
from masrel.lab.elbow.identification._clusters import FittedParameter, Step
from masrel.lab.elbow.identification._friction import FrictionFit, fit_friction
from masrel.lab.elbow.identification._identify import (
    ComparedFit,
    ElbowFit,
    compare_fits,
    fit,
)
from masrel.lab.elbow.identification._lack_of_fit import (
    LackOfFit,
    PhaseResidual,
    StructureTest,
)
from masrel.lab.elbow.identification._laws import (
    LawComparison,
    LawFit,
    compare_laws,
)
from masrel.lab.elbow.identification._reading import Movement, read_movement

__all__ = [
    "ComparedFit",
    "ElbowFit",
    "FittedParameter",
    "FrictionFit",
    "LackOfFit",
    "LawComparison",
    "LawFit",
    "Movement",
    "PhaseResidual",
    "Step",
    "StructureTest",
    "as_toml",
    "compare_fits",
    "compare_laws",
    "fit",
    "fit_friction",
    "intermediate_models",
    "model_document",
    "read_movement",
]
