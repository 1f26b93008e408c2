"""What raters answered about the study as a whole."""

from masrel.errors import SessionLogError
from masrel.lab.conduct._study_log import all_events
from masrel.lab.protocol import StudyPaths
from masrel.lab.protocol._questions import Answer


def study_answers(study: StudyPaths) -> dict[str, dict[tuple[str, str], Answer]]:
    """Return the last answer of each rater by questionnaire and question."""
    answers: dict[str, dict[tuple[str, str], Answer]] = {}
    for event in all_events(study):
        if event.kind in ("answered", "answer-correction"):
            fields, answer = event.fields, event.fields["answer"]
            if not isinstance(answer, str | int | float | None):
                raise SessionLogError(
                    f"{study.conduct_file}: line {event.line}: {event.kind}: needed "
                    f"one answer, got {answer!r}"
                )
            key = str(fields["questionnaire"]), str(fields["question"])
            answers.setdefault(str(fields["rater"]), {})[key] = answer
    return answers
