"""What raters answered about the study as a whole."""

from typing import TYPE_CHECKING

from masrel.conduct._study_log import all_events
from masrel.protocol import StudyPaths

if TYPE_CHECKING:
    from masrel.recording import _Facts  # loads numpy


def study_answers(study: StudyPaths) -> "dict[str, dict[tuple[str, str], _Facts]]":
    """Return the last answer of each rater by questionnaire and question."""
    answers: dict[str, dict[tuple[str, str], _Facts]] = {}
    for event in all_events(study):
        if event.kind in ("answered", "answer-correction"):
            fields = event.fields
            key = str(fields["questionnaire"]), str(fields["question"])
            answers.setdefault(str(fields["rater"]), {})[key] = fields["answer"]
    return answers
