"""Figures: the only package that draws.

In: what to draw, as plain frozen values. Out: PNG, SVG or PDF, the same bytes for the
same values.
"""

import contextlib
import os
import sys

_is_loaded = "matplotlib" in sys.modules

# matplotlib cannot be loaded where MPLBACKEND names a backend that is not there, such
# as Jupyter's in a process that Jupyter started. Nothing here needs a backend.
_backend = os.environ.pop("MPLBACKEND", None)
try:
    import matplotlib as mpl
finally:
    if _backend is not None:
        os.environ["MPLBACKEND"] = _backend
if _backend is not None and not _is_loaded:
    with contextlib.suppress(ValueError):
        mpl.rcParams["backend"] = _backend

from masrel.report.figures._processes import draw_all  # noqa: E402 - loads matplotlib
from masrel.report.figures._style import draw  # noqa: E402

__all__ = ["draw", "draw_all"]
