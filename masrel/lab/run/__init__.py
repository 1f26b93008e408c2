"""One session of one rater: present every model, ask for the grade, log both.

In: a protocol and a drawn schedule. Out: an append-only session log and one
recording a presentation.
"""

from typing import TYPE_CHECKING

from masrel._interpreter import loaded_from
from masrel.lab._event_log import Event, SessionLog, read_log

if TYPE_CHECKING:
    from masrel.lab.run._corrections import (
        record_answer,
        record_correction,
        record_day,
        record_skip,
    )
    from masrel.lab.run._grade_sources import (
        GradeRequest,
        GradeSource,
        QuestionRequest,
        Skip,
        StretchGrade,
    )
    from masrel.lab.run._settings import model_controller
    from masrel.lab.run._simulated_raters import SimulatedGrades
    from masrel.lab.run.console import ConsoleGrades, PaperGrades
    from masrel.lab.run.session import SessionSummary, run_session

__all__ = [
    "ConsoleGrades",
    "Event",
    "GradeRequest",
    "GradeSource",
    "PaperGrades",
    "QuestionRequest",
    "SessionLog",
    "SessionSummary",
    "SimulatedGrades",
    "Skip",
    "StretchGrade",
    "model_controller",
    "read_log",
    "record_answer",
    "record_correction",
    "record_day",
    "record_skip",
    "run_session",
]

_HOMES = {
    "ConsoleGrades": "console",
    "GradeRequest": "_grade_sources",
    "GradeSource": "_grade_sources",
    "PaperGrades": "console",
    "QuestionRequest": "_grade_sources",
    "SessionSummary": "session",
    "SimulatedGrades": "_simulated_raters",
    "Skip": "_grade_sources",
    "StretchGrade": "_grade_sources",
    "model_controller": "_settings",
    "record_answer": "_corrections",
    "record_correction": "_corrections",
    "record_day": "_corrections",
    "record_skip": "_corrections",
    "run_session": "session",
}

__getattr__ = loaded_from(__name__, _HOMES)
