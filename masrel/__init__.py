"""Agreement of ratings, and studies on a haptic simulator of elbow spasticity.

The flow, each stage handing the next a file that a person can open::

    protocol -> schedule -> run -> ratings -> analysis -> report

and the libraries beside it, which know nothing of studies::

    agreement   coefficients of agreement, from any table of ratings
    intervals   intervals for them: analytic, jackknife, bootstrap, posterior
    elbow       the spastic joint: events, torque, traces
    hess        the driver of the simulator, on a simulated device by default
"""

import importlib
from types import ModuleType

__version__ = "0.1.0"

__all__ = [
    "agreement",
    "analysis",
    "elbow",
    "hess",
    "intervals",
    "protocol",
    "ratings",
    "report",
    "run",
    "schedule",
]


def __getattr__(name: str) -> ModuleType:
    # Sub-packages are loaded on first use (PEP 562): importing masrel costs nothing.
    if name in __all__:
        return importlib.import_module(f"masrel.{name}")
    raise AttributeError(f"module 'masrel' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
