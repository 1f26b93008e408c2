"""The Barrett Puck, a motor amplifier on a CAN bus: bring it up, or emulate it.

`open_device("puck", ...)` of `masrel.lab.hess` drives it. In: where the puck is, as
`PuckOptions`. The names that speak on a bus load python-can on first use (PEP 562).
"""

import importlib
from typing import TYPE_CHECKING

from masrel.lab.hess.puck._properties import (
    PropertyTable,
    property_table,
    read_property_table,
)
from masrel.lab.hess.puck._puck_options import (
    EmulatorOptions,
    InjectedFault,
    PuckOptions,
)

if TYPE_CHECKING:
    from masrel.lab.hess.puck._bus import Frame, Link
    from masrel.lab.hess.puck._commissioning import (
        Check,
        NodeReport,
        check,
        connected,
        probe,
        zero,
    )
    from masrel.lab.hess.puck._steady_rotation import (
        FrictionEstimate,
        SteadyRun,
        fit_friction,
        steady_runs,
    )

__all__ = [
    "Check",
    "EmulatorOptions",
    "Frame",
    "FrictionEstimate",
    "InjectedFault",
    "Link",
    "NodeReport",
    "PropertyTable",
    "PuckOptions",
    "SteadyRun",
    "check",
    "connected",
    "fit_friction",
    "probe",
    "property_table",
    "read_property_table",
    "steady_runs",
    "zero",
]

_LOADED_ON_USE = {
    "_bus": ("Frame", "Link"),
    "_commissioning": ("Check", "NodeReport", "check", "connected", "probe", "zero"),
    "_steady_rotation": (
        "FrictionEstimate",
        "SteadyRun",
        "fit_friction",
        "steady_runs",
    ),
}


def __getattr__(name: str) -> object:
    for module, names in _LOADED_ON_USE.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
