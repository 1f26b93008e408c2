"""One session of one rater: present every model, ask for the grade, log both.

In: a protocol and a drawn schedule. Out: an append-only session log and one
recording a presentation.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.lab._event_log import Event, SessionLog, read_log
    from masrel.lab.run._corrections import (
        record_answer,
        record_correction,
        record_skip,
    )
    from masrel.lab.run._grade_sources import (
        GradeRequest,
        GradeSource,
        QuestionRequest,
        ScriptGrades,
        Skip,
        StretchGrade,
    )
    from masrel.lab.run._settings import model_controller
    from masrel.lab.run._simulated_raters import SimulatedGrades
    from masrel.lab.run.console import ConsoleGrades
    from masrel.lab.run.session import SessionSummary, run_session

__all__ = [
    "ConsoleGrades",
    "Event",
    "GradeRequest",
    "GradeSource",
    "QuestionRequest",
    "ScriptGrades",
    "SessionLog",
    "SessionSummary",
    "SimulatedGrades",
    "Skip",
    "StretchGrade",
    "model_controller",
    "read_log",
    "record_answer",
    "record_correction",
    "record_skip",
    "run_session",
]

_HOMES = {
    "masrel.lab.run._corrections": (
        "record_answer",
        "record_correction",
        "record_skip",
    ),
    "masrel.lab.run._grade_sources": (
        "GradeRequest",
        "GradeSource",
        "QuestionRequest",
        "ScriptGrades",
        "Skip",
        "StretchGrade",
    ),
    "masrel.lab._event_log": ("Event", "SessionLog", "read_log"),
    "masrel.lab.run._settings": ("model_controller",),
    "masrel.lab.run._simulated_raters": ("SimulatedGrades",),
    "masrel.lab.run.console": ("ConsoleGrades",),
    "masrel.lab.run.session": ("SessionSummary", "run_session"),
}


def __getattr__(name: str) -> object:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(module), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
