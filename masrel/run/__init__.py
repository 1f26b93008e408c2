"""One session of one rater: present every model, ask for the grade, log both.

In: a protocol and a drawn schedule. Out: an append-only session log and one
recording a presentation.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.run.correction import record_correction
    from masrel.run.grades import (
        Asked,
        ConsoleGrades,
        GradeSource,
        ScriptGrades,
        SessionStoppedError,
    )
    from masrel.run.log import Event, SessionLog, read_log
    from masrel.run.session import SessionSummary, run_session
    from masrel.run.simulated import SimulatedGrades

__all__ = [
    "Asked",
    "ConsoleGrades",
    "Event",
    "GradeSource",
    "ScriptGrades",
    "SessionLog",
    "SessionStoppedError",
    "SessionSummary",
    "SimulatedGrades",
    "read_log",
    "record_correction",
    "run_session",
]

_HOMES = {
    "correction": ("record_correction",),
    "grades": (
        "Asked",
        "ConsoleGrades",
        "GradeSource",
        "ScriptGrades",
        "SessionStoppedError",
    ),
    "log": ("Event", "SessionLog", "read_log"),
    "session": ("SessionSummary", "run_session"),
    "simulated": ("SimulatedGrades",),
}


def __getattr__(name: str) -> object:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"masrel.run.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
