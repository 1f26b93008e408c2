"""matplotlib, loaded whatever backend the environment names.

It cannot be loaded where MPLBACKEND names a backend that is not there, such as
Jupyter's in a process that Jupyter started. Nothing here needs a backend.
"""

import contextlib
import os
import sys

__all__ = ["mpl"]

_backend = None
if "matplotlib" not in sys.modules:
    _backend = os.environ.pop("MPLBACKEND", None)
import matplotlib as mpl  # noqa: E402 - the environment is looked at first

if _backend is not None:
    os.environ["MPLBACKEND"] = _backend
    with contextlib.suppress(ValueError):
        mpl.rcParams["backend"] = _backend
