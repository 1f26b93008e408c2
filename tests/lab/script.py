"""Grades and answers that are fixed beforehand."""

from collections.abc import Mapping, Sequence

from masrel.errors import ParameterError
from masrel.lab.run._grade_sources import GradeRequest, GradeSource, QuestionRequest

Answer = str | int | float | None


class ScriptGrades(GradeSource):
    """A source of grades by code or by position, and of answers by question."""

    name = "script"

    def __init__(
        self,
        grades: Mapping[str, str] | Sequence[str],
        *,
        practice: Mapping[str, str] | Sequence[str] = (),
        answers: Mapping[str, Answer] | None = None,
    ) -> None:
        self._grades, self._practice, self._answers = grades, practice, answers or {}

    def grade(self, request: GradeRequest) -> str:
        """Return the grade of a presentation."""
        presentation = request.presentation
        grades = self._practice if request.practice else self._grades
        code, place = presentation.code, presentation.position
        if isinstance(grades, Mapping):
            grade = grades.get(code)
        else:
            grade = dict(enumerate(grades, 1)).get(place)
        if grade is None:
            raise ParameterError(f"script: needed a grade of position {place}, {code}")
        return grade

    def answer(self, request: QuestionRequest) -> Answer:
        """Return the answer to a question; None where the script has none."""
        return self._answers.get(f"{request.questionnaire.id}.{request.question.id}")
