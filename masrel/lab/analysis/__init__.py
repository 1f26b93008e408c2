"""The estimates a study's plan asks for, and nothing else.

In: a protocol, its ratings and grades given in person. Out: an `Analysis`, written
as JSON in full precision; or a regression of the grades, or estimates as a frame.
"""

from masrel.analysis._gates import GateResult
from masrel.lab.analysis._comparison import check_gates
from masrel.lab.analysis._grading import Effect, GradeRegression, grade_regression
from masrel.lab.analysis._plan import analyze
from masrel.lab.analysis._results import (
    Analysis,
    AnswerCount,
    InPersonAgreement,
    InPersonPair,
    IntendedAgreement,
    ModelAgreement,
    PlannedEstimate,
    PlannedJudge,
    Presentations,
    QuestionSummary,
    RaterEstimate,
    Speed,
    Speeds,
    SpeedSummary,
    as_analysis_document,
    to_frame,
    write_analysis,
)

__all__ = [
    "Analysis",
    "AnswerCount",
    "Effect",
    "GateResult",
    "GradeRegression",
    "InPersonAgreement",
    "InPersonPair",
    "IntendedAgreement",
    "ModelAgreement",
    "PlannedEstimate",
    "PlannedJudge",
    "Presentations",
    "QuestionSummary",
    "RaterEstimate",
    "Speed",
    "SpeedSummary",
    "Speeds",
    "analyze",
    "as_analysis_document",
    "check_gates",
    "grade_regression",
    "to_frame",
    "write_analysis",
]
