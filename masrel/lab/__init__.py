"""The laboratory: studies on a haptic simulator of elbow spasticity.

The flow, each stage handing the next a file that a person can open::

    protocol -> schedule -> run -> ratings -> analysis -> report

and two libraries that know nothing of studies::

    elbow       the spastic joint: events, torque, traces
    hess        the driver of the simulator, on a simulated device by default
"""

import importlib
from types import ModuleType

__all__ = [
    "analysis",
    "elbow",
    "hess",
    "protocol",
    "ratings",
    "report",
    "run",
    "schedule",
]


def __getattr__(name: str) -> ModuleType:
    # Packages are loaded on first use (PEP 562): importing masrel.lab costs nothing.
    if name in __all__:
        return importlib.import_module(f"masrel.lab.{name}")
    raise AttributeError(f"module 'masrel.lab' has no attribute {name!r}")
