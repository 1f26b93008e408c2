"""The Barrett Puck, a motor amplifier on a CAN bus: bring it up, or emulate it.

`open_device("puck", ...)` of `masrel.lab.hess` drives it. In: where the puck is, as
`PuckOptions`. Opening a bus loads python-can.
"""

from masrel.lab.hess.puck._bus import Frame, Link
from masrel.lab.hess.puck._commissioning import (
    Check,
    FrictionEstimate,
    NodeReport,
    SteadyRun,
    check,
    fit_friction,
    probe,
    steady_runs,
    zero,
)
from masrel.lab.hess.puck._emulator import connected
from masrel.lab.hess.puck._puck_options import (
    EmulatorOptions,
    InjectedFault,
    PropertyTable,
    PuckOptions,
    property_table,
    read_property_table,
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
