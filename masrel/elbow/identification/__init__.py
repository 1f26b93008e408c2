"""Joints identified from recordings, with the uncertainty of every parameter.

In: recordings of slow and fast stretches (CSV, npz, or masrel's own). Out: a joint
with intervals, a model file that a protocol can name, the friction of a device.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.elbow.identification.between import intermediate_models
    from masrel.elbow.identification.friction import FrictionFit, fit_friction
    from masrel.elbow.identification.identify import fit
    from masrel.elbow.identification.model_file import as_toml, model_document
    from masrel.elbow.identification.movement import Movement
    from masrel.elbow.identification.reading import read_movement
    from masrel.elbow.identification.results import ElbowFit, FittedParameter, Step

__all__ = [
    "ElbowFit",
    "FittedParameter",
    "FrictionFit",
    "Movement",
    "Step",
    "as_toml",
    "fit",
    "fit_friction",
    "intermediate_models",
    "model_document",
    "read_movement",
]

_HOMES = {
    "FrictionFit": "friction",
    "Movement": "movement",
    "as_toml": "model_file",
    "fit": "identify",
    "fit_friction": "friction",
    "intermediate_models": "between",
    "model_document": "model_file",
    "read_movement": "reading",
}


def __getattr__(name: str) -> object:
    # scipy is loaded by the first fit, not by who reads a model
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    home = _HOMES.get(name, "results")
    return getattr(importlib.import_module(f"{__name__}.{home}"), name)
