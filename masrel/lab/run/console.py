"""A person at the console gives the grades."""

import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import ClassVar, TextIO

from masrel.errors import ParameterError, SessionLogError, SessionStoppedError
from masrel.lab.hess import EmergencyStop, PresentationStatus
from masrel.lab.hess._stop import enter_on_empty_line, stop_on_key
from masrel.lab.protocol import PresentationRules, Question
from masrel.lab.protocol._values import Answer, checked_answer
from masrel.lab.run._grade_sources import (
    GradeRequest,
    GradeSource,
    OnSheet,
    QuestionRequest,
    Skip,
    StretchGrade,
    remarks_on,
)
from masrel.lab.run._state import FROM_PAPER
from masrel.scales import Scale, published_scale

__all__ = ["ConsoleGrades", "PaperGrades"]

_CUE_EVERY_S = 0.05  # how often it is looked whether a stretch is over

_REMARKS = {
    "time-limit": "The time limit ended the presentation: no stretch begins later than "
    "{limit_s:g} s after the first movement.\n",
    "max-duration": "The presentation was ended because it took too long.\n",
    "too-slow": "That was too slow to feel the catch. To repeat it, type again.\n",
    "grip-lost": "The arm came loose and the model let go. To repeat it, type again.\n",
}
"""A line each of what a rater has to know of a presentation."""


class ConsoleGrades(GradeSource):
    """A person at the console, who is told positions and blinded codes only.

    The words ``again`` and ``stop`` in place of a grade present the model again and
    stop the session; ``correct CODE GRADE WHY`` corrects a grade given before, ``NA``
    for a missing one; a ``?`` says what grades mean, where the study or masrel has
    words for it. After more than one stretch, ``1+ 2`` is the grade 1+ that rests on
    stretch 2.

    Parameters
    ----------
    scale : Scale
        The grades that can be given.
    anchors : mapping of str to str, optional
        What grades mean in the words of the study; none unless given.
    answers : TextIO, optional
        Where answers come from, a line each; standard input unless given.
    questions : TextIO, optional
        Where questions go; standard output unless given.
    """

    name: ClassVar[str] = "console"
    simulated: ClassVar[bool] = False

    def __init__(
        self,
        scale: Scale,
        *,
        anchors: Mapping[str, str] | None = None,
        answers: TextIO | None = None,
        questions: TextIO | None = None,
    ) -> None:
        self._scale = scale
        self._meanings = _meanings_in_words(scale, anchors)
        self._answers = sys.stdin if answers is None else answers
        self._questions = sys.stdout if questions is None else questions

    def make_ready(self, request: GradeRequest) -> None:
        """Wait until the rater is ready.

        Parameters
        ----------
        request : GradeRequest
            What comes next.

        Raises
        ------
        SessionStoppedError
            If the person stops, or the input ends.
        """
        again = "" if request.attempt == 1 else " again"
        presentation = request.presentation
        labels = ["REHEARSAL"] * request.rehearsal + ["PRACTICE"] * request.practice
        label = f"{', '.join(labels)}, not a rating of the study. " if labels else ""
        self._ask_or_correct(
            request,
            f"{label}Presentation {presentation.position} of "
            f"{request.n_presentations}, code {presentation.code}{again}. "
            f"{_instruction(request.rules)}Press Enter to begin (then any other key is "
            "an emergency stop), or type stop: ",
        )

    def _ask_or_correct(self, request: GradeRequest, question: str) -> str:
        # the answer; before it any grade of the session can be corrected
        while True:
            answer = self._ask(request, question)
            word, _, words = answer.partition(" ")
            if word != "correct" or request.correct is None:
                return answer
            correction = self._correction(request.rater, words.strip())
            if correction is None:
                self._say("To correct a grade: correct CODE GRADE WHY.\n")
                continue
            try:
                request.correct(**correction)
                self._say(f"{correction['code']} is corrected in the log.\n")
            except (ParameterError, SessionLogError) as error:
                self._say(f"{error}.\n")

    def _correction(self, rater: str, words: str) -> dict[str, str | None] | None:
        code, _, rest = words.partition(" ")
        grades = (*self._scale.grades, "NA")  # no scale has such a grade
        begins = [grade for grade in grades if rest.startswith(f"{grade} ")]
        grade = max(begins, key=len, default="")
        why = rest.removeprefix(grade).strip()
        if not grade or not why:
            return None
        grade_now = None if grade == "NA" else grade
        return {"code": code, "grade": grade_now, "who": rater, "why": why}

    def grade(self, request: GradeRequest) -> str | StretchGrade | OnSheet | None:
        """Ask for the grade until it is one of the scale.

        Before, the rater is told if a limit of time ended the presentation, and if the
        stretches were too slow to feel the catch.

        Parameters
        ----------
        request : GradeRequest
            What was presented.

        Returns
        -------
        str, StretchGrade or None
            The grade, with the stretch it rests on if the rater says so; None when the
            rater wants to feel it again.

        Raises
        ------
        SessionStoppedError
            If the person stops, or the input ends.
        """
        grades, n_stretches = ", ".join(self._scale.grades), request.n_stretches
        self._say_remarks(request)
        meanings = "; ? for their meanings" if self._meanings else ""
        rests = ""
        if n_stretches > 1:
            rests = f", and the stretch it rests on, 1 to {n_stretches}, if any"
        while True:
            answer = self._ask_or_correct(
                request,
                f"Grade of {request.presentation.code} ({grades}{rests}; again; "
                f"stop{meanings}): ",
            )
            if answer in self._scale.grades:
                return answer
            if answer == "again":
                return None
            if answer == "?" and self._meanings:
                self._say(self._meanings)
                continue
            words, _, stretch = answer.rpartition(" ")
            is_one = stretch in map(str, range(1, n_stretches + 1))
            if (grade := words.strip()) in self._scale.grades and is_one:
                return StretchGrade(grade=grade, stretch=int(stretch))
            if answer:  # else it was an Enter too many
                self._say(
                    f"{answer!r} is not a grade: needed one of {grades}{rests}.\n"
                )

    def present_again(self, request: GradeRequest, fault: str) -> bool | Skip:
        """Ask whether to present the model again after a fault.

        Parameters
        ----------
        request : GradeRequest
            What was presented.
        fault : str
            What went wrong.

        Returns
        -------
        bool or Skip
            Whether to present it again; `Skip` when it is to have no grade.

        Raises
        ------
        SessionStoppedError
            If the input ends.
        """
        self._say(f"The presentation was stopped: {fault}.\n")
        choices = "yes, no, or skip and why" if request.may_skip else "yes, no"
        while True:
            answer = self._read(request, f"Present it again? ({choices}): ")
            if answer.casefold() in ("yes", "y", "no", "n"):
                return answer[0] in "yY"
            word, _, why = answer.partition(" ")
            if request.may_skip and word.casefold() == "skip":
                if why.strip():
                    return Skip(who=request.rater, why=why.strip())
                self._say("Skipping needs a reason, such as: skip the motor is hot.\n")

    def instruct(self, request: GradeRequest, text: str) -> None:
        """Show the instructions, and wait until the rater has read them.

        Parameters
        ----------
        request : GradeRequest
            What comes next.
        text : str
            The instructions.

        Raises
        ------
        SessionStoppedError
            If the person stops, or the input ends.
        """
        self._wait(request, f"{text.strip()}\nPress Enter to continue, or type stop: ")

    def take_break(self, request: GradeRequest, minutes: float) -> None:
        """Say that there is a break, and wait until the rater goes on.

        Parameters
        ----------
        request : GradeRequest
            What comes next.
        minutes : float
            How long the break is meant to be, min.

        Raises
        ------
        SessionStoppedError
            If the person stops, or the input ends.
        """
        unit = "minute" if minutes == 1 else "minutes"
        self._wait(
            request,
            f"A break of {minutes:g} {unit}. Then press Enter to continue, or type "
            "stop: ",
        )

    def _say_remarks(self, request: GradeRequest) -> None:
        remarks = "".join(_REMARKS[name] for name in remarks_on(request))
        self._say(remarks.format(limit_s=request.rules.time_limit_s))

    def _wait(self, request: GradeRequest, text: str) -> None:
        while self._ask(request, text):
            pass

    def begins_anew(self, request: GradeRequest, days: int) -> bool:
        """Ask whether a session is resumed or begins again.

        Parameters
        ----------
        request : GradeRequest
            What comes next if it is resumed.
        days : int
            How many days ago it was left.

        Returns
        -------
        bool
            Whether it starts again.

        Raises
        ------
        SessionStoppedError
            If the person stops, or the input ends.
        """
        when = {0: "today", 1: "yesterday"}.get(days, f"{days} days ago")
        while True:
            answer = self._ask(
                request,
                f"This session was left {when}, before presentation "
                f"{request.presentation.position} of {request.n_presentations}. Resume "
                "it, or start again? After a new start the earlier grades no longer "
                "count. (resume; restart; stop): ",
            )
            if answer in ("resume", "restart"):
                return answer == "restart"

    def answer(self, request: QuestionRequest) -> Answer:
        """Ask a question until it is answered.

        Parameters
        ----------
        request : QuestionRequest
            The question.

        Returns
        -------
        str, int, float or None
            The answer; None where the rater gives none and none is required.

        Raises
        ------
        SessionStoppedError
            If the person stops, or the input ends.
        """
        question, shown = request.question, request.presentation
        if question == request.questionnaire.questions[0]:
            of = "" if shown is None else f" ({shown.code})"
            self._say(f"{request.questionnaire.title}{of}\n")
        text = f"{question.text} ({_possible(question)}; stop): "
        while True:
            answer = self._ask(request, text)
            try:
                return checked_answer(question, answer, where="answer")
            except ParameterError as error:
                if answer:  # else it was an Enter too many
                    self._say(f"{error}.\n")

    def _ask(self, request: GradeRequest | QuestionRequest, question: str) -> str:
        # the answer, unless it stops the session
        if (answer := self._read(request, question)) == "stop":
            raise _stopped(request, "on request")
        return answer

    def _read(self, request: GradeRequest | QuestionRequest, question: str) -> str:
        self._say(question)
        try:
            answer = self._answers.readline()
        except KeyboardInterrupt as error:
            raise _stopped(request, "by an interrupt") from error
        if not answer:
            raise _stopped(request, "by the end of its input")
        return answer.strip()

    def _say(self, text: str) -> None:
        self._questions.write(text)
        self._questions.flush()


class PaperGrades(ConsoleGrades):
    """A person at the console who presents models by code; grades are on a sheet.

    Parameters
    ----------
    scale, answers, questions
        As those of `ConsoleGrades`.
    """

    name: ClassVar[str] = FROM_PAPER

    def grade(self, request: GradeRequest) -> OnSheet | None:
        """Wait until the grade is on the sheet.

        Parameters
        ----------
        request : GradeRequest
            What was presented.

        Returns
        -------
        OnSheet or None
            None when the rater wants to feel it again.

        Raises
        ------
        SessionStoppedError
            If the person stops, or the input ends.
        """
        self._say_remarks(request)
        while True:
            answer = self._ask(
                request,
                f"Grade {request.presentation.code} on the sheet. Enter to "
                "continue (again; stop): ",
            )
            if answer in ("", "again"):
                return None if answer else OnSheet()


def _meanings_in_words(scale: Scale, anchors: Mapping[str, str] | None) -> str:
    # where the words of a scale are, and what each grade means
    source, published = "", published_scale(scale)
    if published is not None:
        source = f"{published.title}. Its own words: {published.source}.\n"
    texts = anchors or (published.meanings if published else {})
    whose = "In the words of this study" if anchors else "In short, in masrel's words"
    lines = [
        f"  {grade:3} {texts[grade]}\n" for grade in scale.grades if grade in texts
    ]
    return source + (f"{whose}:\n" if lines else "") + "".join(lines)


def _instruction(rules: PresentationRules, *, on_paper: bool = False) -> str:
    # what the rater is asked to do, a sentence for each cue; on paper nothing says done
    stretches = rules.stretches
    if stretches == 1:
        return ""
    done = "press Enter" if rules.done_with == "enter" else "press the button"
    if stretches == "free":
        then = "" if on_paper else f", then {done}"
        return f"Stretch the arm as often as you want{then}. "
    if isinstance(stretches, int):
        before = "" if on_paper else f"; {done} to end earlier"
        return (
            f"Stretch the arm {stretches} times and bring it back each time{before}. "
        )
    cues = [f"{cue}. " for cue in _cues_in_words(rules)]
    return "".join([*cues, *(["Bring the arm back each time. "] if cues[1:] else [])])


@contextmanager
def _at_terminal(request: GradeRequest, stop: EmergencyStop) -> Iterator[None]:
    """Listen to the keys of the terminal: any but Enter is an emergency stop."""
    rules, status = request.rules, request.status
    with ExitStack() as stack:
        enter: Callable[[], object] = lambda: None  # noqa: E731 - nothing at all
        if status and rules.stretches != 1 and rules.done_with == "enter":
            enter = status.done
            stack.enter_context(enter_on_empty_line(sys.stdin, enter))
        stack.enter_context(stop_on_key(stop, sys.stdin, enter))
        if status:
            stack.enter_context(_cues_shown(rules, status, sys.stdin))
        yield


@contextmanager
def _cues_shown(
    rules: PresentationRules, status: PresentationStatus, keys: TextIO | None
) -> Iterator[None]:
    """Show a person at a terminal the next cue when a stretch is over."""
    cues = _cues_in_words(rules)
    if not cues or keys is None or not keys.isatty():
        yield
        return
    is_over = threading.Event()

    def show() -> None:
        n_shown = 1  # before it began
        while not is_over.wait(_CUE_EVERY_S):
            if status.n_stretches >= n_shown and n_shown < len(cues):
                sys.stdout.write(f"{cues[n_shown]}\n")
                sys.stdout.flush()
                n_shown += 1

    thread = threading.Thread(target=show, daemon=True)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        thread.join()


def _cues_in_words(rules: PresentationRules) -> list[str]:
    """Return what each stretch is to be like, for a rater; nothing without cues."""
    if not isinstance(rules.stretches, tuple):
        return []
    words = {
        "slow": f"slow, at most {rules.slow_speed_deg_s:g} deg/s (V1)",
        "fast": f"fast, at least {rules.fast_speed_deg_s:g} deg/s (V3)",
    }
    return [
        f"Stretch {number}: {words[cue]}"
        for number, cue in enumerate(rules.stretches, start=1)
    ]


def _possible(question: Question) -> str:
    # what can be answered, with what the ends of a range mean
    if question.range is None:
        words = question.needed
    else:
        labels = zip(
            question.range, (question.low_label, question.high_label), strict=True
        )
        ends = [f"{end}: {label}" for end, label in labels if label]
        words = "; ".join([question.needed, *ends])
    return words if question.required else f"{words}; Enter for none"


def _stopped(request: GradeRequest | QuestionRequest, why: str) -> SessionStoppedError:
    where = "a question"
    if isinstance(request, GradeRequest):
        place, n_presentations = request.presentation.position, request.n_presentations
        where = f"presentation {place} of {n_presentations}"
    return SessionStoppedError(
        f"session {request.session} of {request.rater} was stopped {why} at {where}; "
        "the same command resumes it there"
    )
