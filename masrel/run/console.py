"""A person at the console gives the grades."""

import sys
from typing import ClassVar, TextIO

from masrel.errors import SessionStoppedError
from masrel.run._grade_sources import GradeRequest
from masrel.scales import Scale


class ConsoleGrades:
    """A person at the console, who is told positions and blinded codes only.

    The words ``again`` and ``stop`` in place of a grade present the model again and
    stop the session.

    Parameters
    ----------
    scale : Scale
        The grades that can be given.
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
        answers: TextIO | None = None,
        questions: TextIO | None = None,
    ) -> None:
        self._scale = scale
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
        answer = self._ask(
            request,
            f"Presentation {presentation.position} of {request.n_presentations}, code "
            f"{presentation.code}{again}. Enter to begin (then any key is an emergency "
            "stop), stop to stop: ",
        )
        if answer == "stop":
            raise _stopped(request, "on request")

    def grade(self, request: GradeRequest) -> str | None:
        """Ask for the grade until it is one of the scale.

        Parameters
        ----------
        request : GradeRequest
            What was presented.

        Returns
        -------
        str or None
            The grade; None when the rater wants to feel it again.

        Raises
        ------
        SessionStoppedError
            If the person stops, or the input ends.
        """
        grades = ", ".join(self._scale.grades)
        while True:
            answer = self._ask(
                request,
                f"Grade of {request.presentation.code} ({grades}; again; stop): ",
            )
            if answer in self._scale.grades:
                return answer
            if answer == "again":
                return None
            if answer == "stop":
                raise _stopped(request, "on request")
            self._say(f"{answer!r} is not a grade: needed one of {grades}.\n")

    def present_again(self, request: GradeRequest, fault: str) -> bool:
        """Ask whether to present the model again after a fault.

        Parameters
        ----------
        request : GradeRequest
            What was presented.
        fault : str
            What went wrong.

        Returns
        -------
        bool
            Whether to present it again.

        Raises
        ------
        SessionStoppedError
            If the input ends.
        """
        self._say(f"The presentation was stopped: {fault}.\n")
        while True:
            answer = self._ask(request, "Present it again? (yes, no): ").casefold()
            if answer in ("yes", "y", "no", "n"):
                return answer.startswith("y")

    def _ask(self, request: GradeRequest, question: str) -> str:
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


def _stopped(request: GradeRequest, why: str) -> SessionStoppedError:
    return SessionStoppedError(
        f"session {request.session} of {request.rater} was stopped {why} at "
        f"presentation {request.presentation.position} of {request.n_presentations}; "
        "the same command goes on there"
    )
