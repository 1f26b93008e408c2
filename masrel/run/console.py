"""A person at the console gives the grades."""

import sys
from typing import ClassVar, TextIO

from masrel.errors import SessionStoppedError
from masrel.run.grades import Asked
from masrel.scales import Scale

__all__ = ["ConsoleGrades"]


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

    def make_ready(self, asked: Asked) -> None:
        """Wait until the rater is ready.

        Parameters
        ----------
        asked : Asked
            What comes next.

        Raises
        ------
        SessionStoppedError
            If the person stops, or the input ends.
        """
        again = "" if asked.attempt == 1 else " again"
        shown = asked.presentation
        answer = self._ask(
            asked,
            f"Presentation {shown.position} of {asked.n_presentations}, code "
            f"{shown.code}{again}. Enter to begin (then any key is an emergency "
            "stop), stop to stop: ",
        )
        if answer == "stop":
            raise _stopped(asked, "on request")

    def grade(self, asked: Asked) -> str | None:
        """Ask for the grade until it is one of the scale.

        Parameters
        ----------
        asked : Asked
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
                asked, f"Grade of {asked.presentation.code} ({grades}; again; stop): "
            )
            if answer in self._scale.grades:
                return answer
            if answer == "again":
                return None
            if answer == "stop":
                raise _stopped(asked, "on request")
            self._say(f"{answer!r} is not a grade: needed one of {grades}.\n")

    def present_again(self, asked: Asked, fault: str) -> bool:
        """Ask whether to present the model again after a fault.

        Parameters
        ----------
        asked : Asked
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
            answer = self._ask(asked, "Present it again? (yes, no): ").casefold()
            if answer in ("yes", "y", "no", "n"):
                return answer.startswith("y")

    def _ask(self, asked: Asked, question: str) -> str:
        self._say(question)
        try:
            answer = self._answers.readline()
        except KeyboardInterrupt as error:
            raise _stopped(asked, "by an interrupt") from error
        if not answer:
            raise _stopped(asked, "by the end of its input")
        return answer.strip()

    def _say(self, text: str) -> None:
        self._questions.write(text)
        self._questions.flush()


def _stopped(asked: Asked, why: str) -> SessionStoppedError:
    return SessionStoppedError(
        f"session {asked.session} of {asked.rater} was stopped {why} at presentation "
        f"{asked.presentation.position} of {asked.n_presentations}; the same command "
        "goes on there"
    )
