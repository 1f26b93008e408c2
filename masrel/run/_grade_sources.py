"""What a source of grades is, and the one that reads them off a script."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Protocol

from masrel.errors import ParameterError
from masrel.protocol import PresentationRules
from masrel.run._state import Felt
from masrel.schedule import Presentation

if TYPE_CHECKING:
    from masrel.hess import PresentationStatus  # loads numpy

MAX_FAULTS = 3  # in a row of one presentation; after that nobody is asked any more


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeRequest:
    """One request for a grade: to whom, and of which presentation.

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
    may_skip: bool
        Whether the presentation can be left without a grade after a fault.
    """

    rater: str
    session: str
    presentation: Presentation
    n_presentations: int
    attempt: int
    n_faults: int = 0
    rehearsal: bool = False
    rules: PresentationRules = field(default_factory=PresentationRules)
    status: "PresentationStatus | None" = None
    n_stretches: int = 0
    felt: Felt | None = None
    may_skip: bool = False


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


class GradeSource(Protocol):
    """A source of grades: a person, a script, or simulated raters."""

    @property
    def name(self) -> str:
        """Name of the source, kept in the log."""
        ...

    @property
    def simulated(self) -> bool:
        """Whether its grades are no person's."""
        ...

    def make_ready(self, request: GradeRequest) -> None:
        """Return when the rater is ready for the presentation."""
        ...

    def grade(self, request: GradeRequest) -> str | StretchGrade | None:
        """Return the grade, or None to have it presented again first."""
        ...

    def present_again(self, request: GradeRequest, fault: str) -> bool | Skip:
        """Return whether to present it again after a fault, or that it is skipped."""
        ...


class ScriptGrades:
    """Grades fixed beforehand.

    Parameters
    ----------
    grades : mapping of str to str, or sequence of str
        Grade by code, or one grade a position.
    """

    name: ClassVar[str] = "script"
    simulated: ClassVar[bool] = True

    def __init__(self, grades: Mapping[str, str] | Sequence[str]) -> None:
        self._grades = grades

    def make_ready(self, request: GradeRequest) -> None:
        """Return at once."""

    def grade(self, request: GradeRequest) -> str | None:
        """Return the grade of the script.

        Parameters
        ----------
        request : GradeRequest
            What was presented.

        Returns
        -------
        str
            The grade.

        Raises
        ------
        ParameterError
            If the script has none for it.
        """
        presentation, grades = request.presentation, self._grades
        if isinstance(grades, Mapping):
            if presentation.code in grades:
                return grades[presentation.code]
        elif presentation.position <= len(grades):
            return grades[presentation.position - 1]
        raise ParameterError(
            f"script: needed a grade of position {presentation.position}, "
            f"code {presentation.code}"
        )

    def present_again(self, request: GradeRequest, fault: str) -> bool:  # noqa: ARG002 - the interface's
        """Return whether there were fewer faults in a row than `MAX_FAULTS`."""
        return request.n_faults < MAX_FAULTS
