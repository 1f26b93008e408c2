"""Agreement of ratings, and studies on a haptic simulator of elbow spasticity.

Statistics, for anybody with ratings::

    ratings     any file of ratings, read and checked
    agreement   coefficients of agreement, from any table of ratings
    intervals   intervals for them: analytic, jackknife, bootstrap, posterior
    planning    how large a study must be
    audit       whether the numbers that a paper prints can be

and `masrel.lab`, the laboratory, which stands on them and which they never import.
"""

import importlib
from types import ModuleType

__version__ = "0.2.0.dev0"

__all__ = ["agreement", "audit", "intervals", "lab", "planning", "ratings"]


def __getattr__(name: str) -> ModuleType:
    # Sub-packages are loaded on first use (PEP 562): importing masrel costs nothing.
    if name in __all__:
        return importlib.import_module(f"masrel.{name}")
    raise AttributeError(f"module 'masrel' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
