"""One session of one rater: present every model, ask for the grade, log both.

In: a protocol and a drawn schedule. Out: an append-only session log and one
recording a presentation.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.run.chain import Event, read_log
    from masrel.run.console import ConsoleGrades
    from masrel.run.correction import record_correction
    from masrel.run.grades import Asked, GradeSource, ScriptGrades
    from masrel.run.log import SessionLog
    from masrel.run.session import run_session
    from masrel.run.simulated import SimulatedGrades
    from masrel.run.walk import SessionSummary

__all__ = [
    "Asked",
    "ConsoleGrades",
    "Event",
    "GradeSource",
    "ScriptGrades",
    "SessionLog",
    "SessionSummary",
    "SimulatedGrades",
    "read_log",
    "record_correction",
    "run_session",
]

_HOMES = {
    "chain": ("Event", "read_log"),
    "console": ("ConsoleGrades",),
    "correction": ("record_correction",),
    "grades": ("Asked", "GradeSource", "ScriptGrades"),
    "log": ("SessionLog",),
    "session": ("run_session",),
    "simulated": ("SimulatedGrades",),
    "walk": ("SessionSummary",),
}


def __getattr__(name: str) -> object:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"masrel.run.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
