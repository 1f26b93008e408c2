"""Questions to raters: asked, and each answer logged before the next."""

from collections.abc import Callable, Container

from masrel.errors import ParameterError
from masrel.lab._study_files import Fact
from masrel.lab.protocol import Protocol, Question, Questionnaire
from masrel.lab.protocol._values import When, checked_answer, questions_of
from masrel.lab.run._grade_sources import Correct, GradeSource, QuestionRequest
from masrel.lab.schedule import Presentation


def ask_questions(
    protocol: Protocol,
    when: When,
    source: GradeSource,
    *,
    rater: str,
    session: str,
    presentation: Presentation | None = None,
    answered: Container[tuple[str, str]] = (),
    correct: Correct | None = None,
    log: Callable[[dict[str, Fact]], object],
) -> None:
    """Ask what has no answer yet, and log each answer before the next question."""
    for questionnaire, question in questions_of(protocol, when):
        if (questionnaire.id, question.id) in answered:
            continue
        request = QuestionRequest(
            rater=rater,
            session=session,
            questionnaire=questionnaire,
            question=question,
            presentation=presentation,
            correct=correct,
        )
        answer = checked_answer(question, source.answer(request), where=_place(request))
        log(
            {
                "questionnaire": questionnaire.id,
                "question": question.id,
                "answer": answer,
            }
        )


def _place(request: QuestionRequest) -> str:
    # which answer, in a message
    name = f"{request.questionnaire.id}.{request.question.id}"
    of = "" if request.presentation is None else f" of {request.presentation.code}"
    return f"answer to {name}{of} by {request.rater} in session {request.session}"


def question_named(protocol: Protocol, name: str) -> tuple[Questionnaire, Question]:
    """Return the question that ``questionnaire.question`` names."""
    known = {
        f"{questionnaire.id}.{question.id}": (questionnaire, question)
        for questionnaire in protocol.questionnaires
        for question in questionnaire.questions
    }
    if name not in known:
        raise ParameterError(
            f"question: needed one of {', '.join(known) or 'none'}, got {name!r}"
        )
    return known[name]
