"""The Barrett Puck, a motor amplifier on a CAN bus: bring it up, or emulate it.

`open_device("puck", ...)` of `masrel.lab.hess` drives it. In: where the puck is, as
`PuckOptions`. Opening a bus loads python-can.
"""

from masrel.lab.hess._can import Frame, Link
from masrel.lab.hess._emulated import InjectedFault
from masrel.lab.hess._free_arm import (
    Check,
    FrictionEstimate,
    SteadyRun,
    fit_friction,
    steady_runs,
)
from masrel.lab.hess.puck._commissioning import NodeReport, check, probe, zero
from masrel.lab.hess.puck._emulator import connected
from masrel.lab.hess.puck._puck_options import (
    EmulatorOptions,
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
