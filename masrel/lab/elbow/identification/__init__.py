"""Joints identified from recordings, with the uncertainty of every parameter.

In: recordings of slow and fast stretches (CSV, npz, or masrel's own). Out: a joint
with intervals and whether it fits, a model file that a protocol can name, the friction
of a device.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
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
    from masrel.lab.elbow.identification._model_file import (
        as_toml,
        intermediate_models,
        model_document,
    )
    from masrel.lab.elbow.identification._reading import Movement, read_movement

__all__ = [
    "ComparedFit",
    "ElbowFit",
    "FittedParameter",
    "FrictionFit",
    "LackOfFit",
    "Movement",
    "PhaseResidual",
    "Step",
    "StructureTest",
    "as_toml",
    "compare_fits",
    "fit",
    "fit_friction",
    "intermediate_models",
    "model_document",
    "read_movement",
]

_HOMES = {
    "ComparedFit": "_identify",
    "ElbowFit": "_identify",
    "FittedParameter": "_clusters",
    "FrictionFit": "_friction",
    "LackOfFit": "_lack_of_fit",
    "Movement": "_reading",
    "PhaseResidual": "_lack_of_fit",
    "Step": "_clusters",
    "StructureTest": "_lack_of_fit",
    "as_toml": "_model_file",
    "compare_fits": "_identify",
    "fit": "_identify",
    "fit_friction": "_friction",
    "intermediate_models": "_model_file",
    "model_document": "_model_file",
    "read_movement": "_reading",
}


def __getattr__(name: str) -> object:
    # scipy is loaded by the first fit, not by who reads a model
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
