"""matplotlib, loaded whatever backend the environment names.

It cannot be loaded where MPLBACKEND names a backend that is not there, such as
Jupyter's in a process that Jupyter started. Nothing here needs a backend.
"""

import contextlib
import os
import sys

__all__ = ["mpl"]

_is_loaded = "matplotlib" in sys.modules
_backend = os.environ.pop("MPLBACKEND", None)
try:
    import matplotlib as mpl
finally:
    if _backend is not None:
        os.environ["MPLBACKEND"] = _backend
if _backend is not None and not _is_loaded:
    with contextlib.suppress(ValueError):
        mpl.rcParams["backend"] = _backend
