"""What a source of grades and answers is, and how a question is put to it."""

from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from masrel.errors import ParameterError
from masrel.lab._study_files import Fact
from masrel.lab.hess import PresentationStatus
from masrel.lab.protocol import PresentationRules, Protocol, Question, Questionnaire
from masrel.lab.protocol._values import Answer, When, checked_answer, questions_of
from masrel.lab.run._state import Felt
from masrel.lab.schedule.presentation import Presentation

MAX_FAULTS = 3  # in a row of one presentation; after that nobody is asked any more

Correct = Callable[..., None]
"""Corrects a grade of the session that goes on: `code`, `grade` (None for a missing
one), `who` corrects it and `why`; ParameterError or SessionLogError where it cannot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeRequest:
    """One request for a grade: the rater, and the presentation.

    Attributes
    ----------
    rater, session : str
        Who grades, and in which session.
    presentation : Presentation
        What is presented. A person is told its position and code, never the model.
    n_presentations : int
        Presentations in the session.
    attempt : int
        From 1; above 1 when it is presented again.
    n_faults : int
        Faults in a row so far.
    rehearsal : bool
        Whether nothing of this enters the study's ratings.
    practice : bool
        Whether it is for practice; its grade is not a rating.
    sealed : bool
        Whether its recording is not to say which model it is of.
    rules : PresentationRules
        How often the arm may be stretched, and with which cues.
    status : PresentationStatus or None
        Of the presentation that is about to begin: whoever lets a program answer calls
        its `done` when the rater is, from any thread. None once it is over.
    n_stretches : int
        Stretches that were made; 0 before.
    felt : {"felt", "below-threshold", "no-catch"} or None
        Whether what the model has could be felt: no stretch was fast enough, or none
        came to the catch that the model has at that speed. None before, and after a
        fault.
    grip_lost : bool or None
        Whether the arm came loose and the model let it go. None before.
    ended : str or None
        What ended the presentation, as in its recording: ``"time-limit"``, say. None
        before.
    may_skip: bool
        Whether the presentation can be left without a grade after a fault.
    correct : callable or None
        Corrects a grade of the session while it goes on: takes `code`, `grade` (None
        for a missing one), `who` and `why`; raises ParameterError or SessionLogError
        where it cannot. None where nothing can be corrected.
    last : tuple of str and str or None, or None
        Code and grade of what the session graded last, as it is corrected: what a
        rater may want to correct. None before there is one.
    samples : Path or None
        File that keeps every sample of the presentation while it goes on. None before
        and after.
    """

    rater: str
    session: str
    presentation: Presentation
    n_presentations: int
    attempt: int
    n_faults: int = 0
    rehearsal: bool = False
    practice: bool = False
    sealed: bool = False
    rules: PresentationRules = field(default_factory=PresentationRules)
    status: PresentationStatus | None = None
    n_stretches: int = 0
    felt: Felt | None = None
    grip_lost: bool | None = None
    ended: str | None = None
    may_skip: bool = False
    correct: Correct | None = None
    last: tuple[str, str | None] | None = None
    samples: Path | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StretchGrade:
    """A grade, and the stretch it rests on.

    Attributes
    ----------
    grade : str
        A grade of the scale.
    stretch : int or None
        Number of the stretch, from 1; None where nobody says.
    """

    grade: str
    stretch: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Skip:
    """That a presentation is left without a grade after a fault.

    Attributes
    ----------
    who, why : str
        Who says so, and for what reason.
    """

    who: str
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class OnSheet:
    """That the grade of a presentation is written on a sheet, to be entered later."""


@dataclass(frozen=True, slots=True, kw_only=True)
class QuestionRequest:
    """One question to a rater.

    Attributes
    ----------
    rater, session : str
        Who is asked, and in which session.
    questionnaire : Questionnaire
        The questionnaire.
    question : Question
        The one of its questions; its `needed` says what an answer is.
    presentation : Presentation or None
        What it is about; None for the session or the study. A person is told its code,
        never the model.
    correct : callable or None
        As that of a `GradeRequest`.
    """

    rater: str
    session: str
    questionnaire: Questionnaire
    question: Question
    presentation: Presentation | None
    correct: Correct | None = None


def remarks_on(request: GradeRequest) -> list[str]:
    """Return by name what a rater has to know of what was presented, to grade it."""
    remarks = {
        "time-limit": request.ended == "time-limit",
        "max-duration": request.ended == "max-duration",
        "too-slow": request.felt not in ("felt", None),
        "grip-lost": request.grip_lost,
    }
    return [name for name, is_so in remarks.items() if is_so]


def checked_grade(
    request: GradeRequest, grades: Sequence[str], grade: object, stretch: Any
) -> StretchGrade:
    """Return a grade of what was presented; ParameterError says what it cannot be."""
    code, n_stretches = request.presentation.code, request.n_stretches
    if not isinstance(grade, str) or grade not in grades:
        raise ParameterError(
            f"grade of {code}: needed one of {', '.join(grades)}, got {grade!r}"
        )
    is_number = type(stretch) is int and 1 <= stretch <= n_stretches  # true is none
    if stretch is not None and not is_number:
        raise ParameterError(
            f"stretch of {code}: needed one of {n_stretches}, from 1, got {stretch!r}"
        )
    return StretchGrade(grade=grade, stretch=stretch)


class GradeSource:
    """A source of grades: a person, a script, or simulated raters.

    The methods here are for those that need no waiting; `grade` is each one's own. One
    that is listened to while a model is presented has a method ``listening``, too: it
    takes the request and the emergency stop, which it may press, and returns what lasts
    as long as the presentation. For any other the terminal is listened to.

    Attributes
    ----------
    name : str
        Name of the source, kept in the log.
    simulated : bool
        Whether its grades are not a person's.
    """

    name: ClassVar[str]
    simulated: ClassVar[bool] = True

    def make_ready(self, request: GradeRequest) -> None:
        """Return when the rater is ready for the presentation."""

    def grade(self, request: GradeRequest) -> str | StretchGrade | OnSheet | None:
        """Return the grade, or None to have it presented again first."""
        raise NotImplementedError

    def present_again(self, request: GradeRequest, fault: str) -> bool | Skip:  # noqa: ARG002 - as all
        """Return whether to present it again after a fault, or that it is skipped."""
        return request.n_faults < MAX_FAULTS

    def instruct(self, request: GradeRequest, text: str) -> None:
        """Return when the rater has read the instructions; `request` comes next."""

    def take_break(self, request: GradeRequest, minutes: float) -> None:
        """Return when a break is over; `request` comes next."""

    def begins_anew(self, request: GradeRequest, days: int) -> bool:  # noqa: ARG002 - as all
        """Return whether a session that was left `days` ago starts again."""
        return False

    def answer(self, request: QuestionRequest) -> Answer:  # noqa: ARG002 - as all
        """Return the answer, or None for none."""
        return None


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
